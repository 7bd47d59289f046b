"""Cells that collisions keep the arm from, proved by the judge: by the tool alone, or by boxes."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from feasibility.certification.collisions.every_pose import Collides, never_clear
from feasibility.certification.cut_proofs.empty_region import ArmCollisions
from feasibility.collisions.asked_bodies import gather
from feasibility.collisions.problem_bodies import Bodies
from feasibility.roadmap.motions.off_target import project_near_cell
from feasibility.roadmap.motions.projection import PROJECTION_STEPS
from feasibility.roadmap.motions.search_arrays import SearchArrays
from feasibility.roadmap.motions.working_memory import Work
from feasibility.roadmap.proofs.branching import root_box
from feasibility.task import Task
from robots.robot import Robot
from surfaces.cells import Cells

POSE_BOXES, ALL_POSE_BOXES = 4_000, 20_000  # of tilt and roll, of one cell and of all
ARM_BOXES, ALL_ARM_BOXES = 30_000, 40_000  # of joint values
GUESSES = 30  # at a configuration over the cell, of which none may be seen to be clear

Tried = tuple[int, tuple[tuple[str, str], ...]]
"""A cell, and the pairs of bodies that count."""


@dataclass(eq=False)
class Blockers:
    """Proofs that collisions keep an arm from cells of one problem."""

    robot: Robot
    task: Task
    bodies: Bodies
    collisions: ArmCollisions
    tried: dict[Tried, tuple[int, Collides]]
    """What boxes of joint values said, and how many were allowed. The shapes are those of the
    judge, so it holds for the same arm with its links cut into pieces, too."""
    left: int = ALL_ARM_BOXES
    """Boxes of joint values that may still be looked at."""
    poses_left: int = ALL_POSE_BOXES
    """Boxes of tilt and roll that may still be looked at."""
    tool: dict[int, Collides] = field(default_factory=dict)
    """By cell: whether the tool collides over it in every pose."""
    arm: dict[int, Collides] = field(default_factory=dict)
    """By cell: whether something collides wherever the tool is over it."""

    def tool_collides(self, arrays: SearchArrays, cell: int, tick: Callable[[], object]) -> bool:
        """Is it proved that the tool collides in every pose over a cell, whatever the arm does?

        `tick` is called now and then; it may raise.
        """
        if cell not in self.tool:
            self.tool[cell] = never_clear(
                self.robot, self.bodies, self.task.cone, self.task.effective_tolerance,
                arrays.points[cell], arrays.approaches[cell], tick,
                most=min(POSE_BOXES, max(self.poses_left, 0)),
            )  # fmt: skip
            self.poses_left -= self.tool[cell].boxes
        return self.tool[cell].confirmed

    def arm_collides(
        self, arrays: SearchArrays, work: Work, cell: int, tick: Callable[[], object]
    ) -> bool:
        """Is it proved that something of the arm collides wherever the tool is over a cell?

        `tick` is called now and then; it may raise.
        """
        if cell not in self.arm:
            self.arm[cell] = self._examined(arrays, work, cell, tick)
            self.left -= self.arm[cell].boxes
        return self.arm[cell].confirmed

    def _examined(
        self, arrays: SearchArrays, work: Work, cell: int, tick: Callable[[], object]
    ) -> Collides:
        if not self.collisions.possible or self.left <= 0:
            return Collides(False, 0)
        box = root_box(arrays)
        low, high = box.low[0], box.high[0]
        # Random numbers of its own: whether it is tried does not change the search.
        guesses = np.random.default_rng(cell).uniform(low, high, (GUESSES, len(low)))
        found = [q for q in guesses if project_near_cell(arrays, work, cell, q, PROJECTION_STEPS)]
        if not found or self.collisions.any_clear(np.array(found), cell):
            return Collides(False, 0)
        which = cell, tuple((pair.first, pair.second) for pair in self.bodies.pairs)
        most = min(ARM_BOXES, self.left)
        if which not in self.tried or self.tried[which][0] < most:
            self.tried[which] = most, self.collisions.check(cell, tick, most)
        return self.tried[which][1]


def blockers_of(
    robot: Robot, cells: Cells, task: Task, tried: dict[Tried, tuple[int, Collides]] | None = None
) -> Blockers | None:
    """What may keep an arm from cells of a surface; None where collisions are not checked.

    Args:
        robot, cells, task: the problem.
        tried: what another attempt at this problem has tried; filled here.
    """
    bodies = gather(robot, cells.surface, task.collision, task.standoff)
    if bodies is None:
        return None
    known = {} if tried is None else tried
    return Blockers(robot, task, bodies, ArmCollisions(robot, cells, task, bodies), known)
