"""What the kernels of the search say, in words that stay: one place for their work arrays."""

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from coverable import Cells, Robot, Task, plane
from coverable.kernels import entry
from feasibility.collisions.kernels.clearance import blamed, segment_clear
from feasibility.collisions.kernels.memory import collision_buffer, configuration_bounds
from feasibility.collisions.problem_bodies import Bodies
from feasibility.roadmap.motions import aiming, segment_bound
from feasibility.roadmap.motions.aiming import aim, stand_still
from feasibility.roadmap.motions.off_target import project_near_cell
from feasibility.roadmap.motions.projection import project_onto_cell
from feasibility.roadmap.motions.roll_kernels import level, roll_off_middle
from feasibility.roadmap.motions.search_arrays import arrays_of
from feasibility.roadmap.motions.working_memory import place, work_for
from feasibility.roadmap.proofs import box_bounds, box_contraction
from feasibility.roadmap.proofs.boxes import box_work
from feasibility.roadmap.proofs.branching import DIRECTIONS, root_box, rule
from feasibility.roadmap.proofs.ruling import Ruling

Floats = NDArray[np.float64]

# Only other kernels call these in the search. They run as Python here, which takes less time than
# compiling them; but for the one that has to refuse NaN as compiled code does.
bounds_between, contract_roll = aiming.bounds_between, box_bounds.contract_roll
second_derivatives = segment_bound.second_derivatives
roll_derivatives = segment_bound.roll_derivatives
reach, shrink = box_bounds.reach, box_contraction.shrink
segment_holds = entry(segment_bound.segment_holds)


class Clearance:
    """How far the bodies of an arm are apart, as the search sees them."""

    def __init__(self, robot: Robot, bodies: Bodies) -> None:
        self.n, self.buffer = robot.n, collision_buffer(bodies, robot)

    def margin(self, q0: Any, q1: Any) -> float:
        """m, that a segment has to spare at least; not more than 0 where it may collide."""
        ends = (np.array(q, dtype=float).reshape(self.n) for q in (q0, q1))
        return segment_clear(self.buffer, *ends)

    def clear(self, q0: Any, q1: Any) -> bool:
        return self.margin(q0, q1) > 0.0

    def bounds(self, q: Any) -> Floats:
        """(P,) m, lower bounds of the distances of all pairs."""
        return configuration_bounds(self.buffer, np.array(q, dtype=float).reshape(self.n))

    def blamed(self) -> int:
        """The pair for which the last segment was refused."""
        return blamed(self.buffer)


class Held(NamedTuple):
    """What is certain of a segment, beside its moving target."""

    holds: bool
    off: float  # m, the tool point is never further from its target
    chord: float  # |a - b| is never larger
    roll: float  # rad, the roll is never further from the middle of its range
    on_target: bool  # is the tool point as near to its targets at the ends as in a search?
    roll_off: float  # rad, the roll over the target's frame differs by no more from the curve's


class Motions:
    def __init__(self, robot: Robot, cells: Cells | None = None, task: Task | None = None) -> None:
        cells = plane((-1, 1), (-1, 1)).cells(1, 1) if cells is None else cells
        self.task = Task(0.0, 30) if task is None else task
        self.arrays, self.work = arrays_of(robot, cells, self.task), work_for(robot.n)

    def sag(self, q0: Floats, q1: Floats) -> tuple[float, float]:
        """Bounds on |p''| (m) and |a''| of tool point and tool axis along a segment, s in 0..1."""
        place(self.arrays, self.work, 0, q0)
        place(self.arrays, self.work, 1, q1)
        return second_derivatives(self.arrays, self.work, q0, q1)

    def reach(self, q: Floats, half: Floats, which: int) -> tuple[float, float, Floats]:
        """How far tool point (0) or axis (1) get in a box about q, to both orders; and J."""
        rows = np.zeros((3, len(q)))
        place(self.arrays, self.work, 1, q)
        return *reach(self.arrays, self.work, which, half, rows, np.zeros(len(q))), rows

    def cut_by_roll(self, q: Floats, half: Floats, d: Floats, b: Floats) -> list[Floats]:
        """Ends left of a box about q where the roll over a target along b is as at q + d."""
        low, high, work, sines = -half, half.copy(), self.work, np.zeros(len(q))
        work.target[1:] = b, b[[1, 2, 0]]
        level(work.target)
        place(self.arrays, work, 1, q + d)
        wanted = roll_off_middle(work.target, work.axis[1], work.reference[1], 0.0)
        place(self.arrays, work, 1, q)
        off = roll_off_middle(work.target, work.axis[1], work.reference[1], wanted)
        work.error[1, 1:] = np.linalg.norm(work.axis[1] - b), off
        reach(self.arrays, work, 1, half, np.zeros((3, len(q))), sines)
        contract_roll(self.arrays, work, half, sines, np.zeros(len(q)), low, high)
        return [low, high]

    def roll_off(self, q: Floats, t: float = 0.0) -> float:
        """Roll at a configuration over a curve's target at t, off the middle of its range, rad."""
        aim(self.arrays, self.work, 0, t)
        place(self.arrays, self.work, 0, q)
        return float(self.work.error[0, 2])

    def roll_rates(self, q0: Floats, q1: Floats, frame: Any, chord: float) -> tuple[float, float]:
        """Bounds on |psi'| and |psi''| of roll (rad) along a segment, s in 0..1."""
        self.sag(q0, q1)
        self.work.derivative_bound[5:8] = frame
        return roll_derivatives(self.work, chord, 1.0)

    def turn_range(self, middle: float, half: float) -> None:
        """Let the roll have another range (rad)."""
        self.arrays = self.arrays._replace(roll=np.array([middle, half]))

    def onto(self, q: Floats) -> Floats | None:
        """Newton from q onto the target at the end of the first curve; None where it fails."""
        found = q.copy()
        there = project_onto_cell(self.arrays, self.work, np.int64(1), found, np.int64(60))
        return found if there else None

    def along_curve(self, q0: Floats, q1: Floats) -> Held:
        """A segment whose target runs along the whole of the first curve."""
        bounds_between(self.arrays, self.work, 0, 0.0, 1.0)
        for slot, q in enumerate((q0, q1)):
            aim(self.arrays, self.work, 0, float(slot))
            place(self.arrays, self.work, slot, q)
        return self._held(q0, q1)

    def at_rest(
        self, q0: Floats, q1: Floats, point: Any, approach: Any, reference: Any = (1.0, 0.0, 0.0)
    ) -> Held:
        self.work.target[:3] = point, approach, reference
        stand_still(self.arrays, self.work)
        for slot, q in enumerate((q0, q1)):
            place(self.arrays, self.work, slot, q)
        return self._held(q0, q1)

    def _held(self, q0: Floats, q1: Floats) -> Held:
        position, turned = segment_holds(self.arrays, self.work, q0, q1)
        length, chord, roll = self.work.allowance
        good = bool(position <= 1.0 and turned <= 1.0)
        ends = max(self.work.error[0, 0], self.work.error[1, 0])
        beside = self.arrays.frame_deviations[:1, 1:]
        off = beside.max(initial=0.0) if self.task.roll is not None else 0.0
        with np.errstate(invalid="ignore"):
            bounds = position * length, turned * chord, turned * roll
        return Held(good, *bounds, bool(ends <= self.arrays.near), float(off))

    def near(self, cell: int, q: Floats, steps: int = 60) -> Floats | None:
        """A configuration within tolerance and cone of a cell's target, from q; or None."""
        found = q.copy()
        there = project_near_cell(self.arrays, self.work, cell, found, np.int64(steps))
        return found if there else None


class Ruled(NamedTuple):
    """What branch and bound says of one target."""

    ruling: Ruling
    found: Floats  # a configuration, where it was reached
    boxes: int


def ruled(robot: Robot, cells: Cells, task: Task, boxes: int = 2000, cell: int = 0) -> Ruled:
    """Can a cell be covered at all? With so many boxes at most."""
    arrays = arrays_of(robot, cells, task)
    stack = root_box(arrays)
    outcome, found = rule(arrays, work_for(robot.n), cell, stack, boxes)
    return Ruled(outcome, found, int(stack.counts[1]))


def contracted(
    arrays: Any, places: Any, part: int, low: Floats, high: Floats
) -> tuple[bool, Floats, Floats]:
    """Is something left of a box of joints and x in a part of the surface, and what?"""
    n = len(arrays.lower)
    low, high, space = low.copy(), high.copy(), box_work(len(low))
    code, _ = shrink(arrays, work_for(n), places, part, DIRECTIONS, space, low, high)
    return code != 1, low, high


def assert_walked(roadmap: Any, walk: Any) -> list[int]:
    """Only steps of stored motions, and marks where nodes are; returns the cells in order."""
    steps = set()
    for edge in range(len(roadmap.edges)):
        motion = [tuple(q) for q in roadmap.motion(edge)]
        steps |= set(pairwise(motion)) | set(pairwise(motion[::-1]))
    nodes = {tuple(q): cell for q, cell in zip(roadmap.q, roadmap.cell, strict=True)}
    rows = [tuple(q) for q in walk.q]
    assert set(pairwise(rows)) <= steps
    assert [nodes.get(row, -1) for row in rows] == walk.cell.tolist()
    return walk.cell[walk.cell >= 0].tolist()
