"""The replay of any joint motion over a surface, whoever made it.

A motion is straight in joint space between its rows. It is accepted where, at every instant, the
joints are inside their limits, and some place x of the surface that moves continuously has the tool
point within the tolerance of its target T(x), the tool axis within the cone of its approach
direction b(x), and the roll about it, where that is limited, in its range; and where every needed
cell is reached at some instant. Curves between cells play no part, nor does what the motion says of
where it is.

Between rows, bounds are used (`stretches`). A stretch that they do not accept is halved: they fall
to a quarter, and one exact configuration is added. What is wrong at an exact configuration is
refused, and so is what is still open after many halvings.

Where bodies are given, they have to stay clear of each other too (`collisions`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from coverable_arrays import Array, Ints, Mask
from coverable_errors import counted
from feasibility.certification.cells_reached import cells_reached, in_order, missed_text
from feasibility.certification.collisions import collision_replay
from feasibility.certification.faults import Judged, MotionFault
from feasibility.certification.jacobians import placements
from feasibility.certification.order import curves_of_marks, order_of_places
from feasibility.certification.rolls import CLOSE_TO_ZERO as ROLL_CLOSE
from feasibility.certification.stretches import CLOSE_TO_ZERO, Bounds, Judge, Samples, Stretches
from feasibility.collisions import Bodies
from feasibility.cone import angle_of
from feasibility.task import Task
from feasibility.verdict import Certificate
from robots import Robot
from surfaces import Cells, Surface
from surfaces.places import offset_surface
from surfaces.toolpaths import PoseSurface

LEVELS = 26  # halvings of a segment between two rows
MOST_SAMPLES = 1_000_000  # configurations looked at between rows
ENOUGH = 1000  # wrong configurations, after which no more are looked for


@dataclass(frozen=True, eq=False, slots=True)
class MotionReplay(Judged):
    """What the replay of a motion over a surface found."""

    certificate: Certificate
    """Bounds over all of an accepted motion; of a refused one what was measured."""
    faults: tuple[MotionFault, ...]
    """Why the motion is refused, the worst of each kind; none when it is accepted."""
    reached: Mask
    """(N,) cells that are reached."""


def replay_over_surface(
    robot: Robot,
    cells: Cells,
    task: Task,
    q: Array,
    needed: Mask | None = None,
    bodies: Bodies | None = None,
    marks: Ints | None = None,
) -> MotionReplay:
    """Judge a motion by the module's rules.

    Args:
        robot: the arm.
        cells: the surface and its cells.
        task: its tolerance and cone are used exactly.
        q: (m, n) rows, rad or m, unwrapped.
        needed: (N,) cells that have to be reached; all by default.
        bodies: what has to stay clear of what; None where collisions are not checked.
        marks: (m,) the cell whose target a row is said to be at, -1 at none: over which places the
            motion may be, to be tried first.
    """
    rows = np.asarray(q, dtype=float)
    nowhere = np.zeros(len(cells), dtype=bool)
    fault = _malformed(robot, rows)
    if fault is not None:
        unknown = Certificate(len(rows) if rows.ndim else 0, np.nan, np.nan, np.nan)
        return MotionReplay(unknown, (fault,), nowhere)
    height = cells.surface.side_sign * task.standoff
    surface = cells.surface
    if isinstance(surface, PoseSurface) and task.approach == "normal":
        surface = replace(surface, axes=None)  # those of the poses' own do not count
    curves = None if marks is None else curves_of_marks(cells, marks)
    offset = offset_surface(surface, height)
    judge = Judge(robot, less_deviations(task, surface), offset, cells, curves)
    margin, faults = _limits(robot, rows)
    poses = placements(robot, rows)
    count = np.arange(len(rows))
    x = judge.reference_axes(rows)
    at_rows = judge.compared(count, np.zeros(len(rows)), poses.points, poses.axes, x)
    if marks is not None:
        at_rows = _at_marks(judge, cells, marks, at_rows)
    good = judge.within(at_rows)
    faults += _exact_faults(judge, at_rows.of(~good), "row")
    stretches = judge.between_rows(rows, poses, at_rows).of(good[:-1] & good[1:])
    looked = _between(judge, rows, stretches)
    faults += looked.faults
    samples = in_order(Samples.join(at_rows, *looked.samples))
    reached = cells_reached(robot, cells, task, rows, samples)
    missed = np.flatnonzero(~reached if needed is None else needed & ~reached)
    if len(missed):
        faults.append(MotionFault(-1, 0.0, missed_text(cells, task, missed, samples)))
    faults += order_of_places(judge.offset, samples, task.effective_tolerance)
    error = max(looked.error, float(np.max(samples.error, initial=0.0)))
    chord = max(looked.chord, float(np.max(samples.chord, initial=0.0)))
    roll = max(looked.roll, float(np.max(samples.roll, initial=0.0)))
    certificate = Certificate(
        len(rows), error, angle_of(chord), margin, max_roll=None if task.roll is None else roll
    )
    if bodies is not None:
        clear = collision_replay(robot, bodies, rows)
        faults += clear.faults
        certificate = clear.added_to(certificate)
    return MotionReplay(certificate, tuple(faults), reached)


def _at_marks(judge: Judge, cells: Cells, marks: Ints, at: Samples) -> Samples:
    """The samples at all rows, over their marked cells where the places found will not do."""
    bad = np.flatnonzero(~judge.within(at) & (marks >= 0))
    if not len(bad):
        return at
    aims = judge.task.targets(cells).points[marks[bad]]
    places = judge.offset.nearest(aims, aims, 0.0)
    some = at.of(bad)
    tried = judge.over(places, some.row, some.share, some.points, some.axes, some.x)
    row = np.arange(len(marks))
    better = judge.within(tried)
    row[bad[better]] = len(marks) + np.flatnonzero(better)
    return Samples.join(at, tried).of(row)


def less_deviations(task: Task, surface: Surface) -> Task:
    """The task less what the surface may deviate from the one meant."""
    off, leans = surface.deviations
    if not (off or leans):
        return task
    tolerance = task.effective_tolerance - off - task.standoff * leans
    cone_deg = task.cone_deg - float(np.degrees(2.0 * np.arcsin(min(leans / 2.0, 1.0))))
    return replace(task, tolerance=max(tolerance, 1e-12), cone_deg=max(cone_deg, 0.0))


class _Between(NamedTuple):
    """What is found between rows."""

    error: float
    """m, bound of |p - T|; and of |a - b|, and rad of the roll, where stretches are right."""
    chord: float
    roll: float
    faults: list[MotionFault]
    samples: list[Samples]


def _between(judge: Judge, rows: Array, stretches: Stretches) -> _Between:
    """Judge stretches whose ends are good, halved as needed."""
    most, samples, wrong = np.zeros(3), list[Samples](), list[Samples]()
    left, seen = stretches, 0
    for level in range(LEVELS + 1):
        bounds = judge.bounds(left)
        good = judge.within(bounds)
        each = (bounds.error, bounds.chord, bounds.roll)
        most = np.maximum(most, [np.max(one[good], initial=0.0) for one in each])
        left, bounds = left.of(~good), bounds.of(~good)
        seen += len(left.length)
        enough = sum(len(part.row) for part in wrong) > ENOUGH
        if not len(left.length) or enough or level == LEVELS or seen > MOST_SAMPLES:
            break
        middle = judge.middles(rows, left)
        good = judge.within(middle)
        samples.append(middle)
        if not good.all():
            wrong.append(middle.of(~good))
        left = left.of(good).halves(middle.of(good))
    faults = list[MotionFault]()
    if wrong:
        faults = _exact_faults(judge, Samples.join(*wrong), "place")
    elif len(left.length):
        faults = [_open_fault(judge, left, bounds)]
    error, chord, roll = most.tolist()
    return _Between(error, chord, roll, faults, samples)


def _malformed(robot: Robot, rows: Array) -> MotionFault | None:
    """Why rows are no motion of this arm; None when they are one."""
    if rows.ndim != 2 or rows.shape[1] != robot.n:
        return MotionFault(-1, 0.0, f"rows of shape {rows.shape} are no motion of {robot.n} joints")
    finite = np.isfinite(rows)
    if not finite.all():
        row, joint = np.argwhere(~finite)[0]
        return MotionFault(int(row), 0.0, f"{robot.joint_names[joint]} is not a finite number")
    return None


def _limits(robot: Robot, rows: Array) -> tuple[float, list[MotionFault]]:
    """The smallest distance from a limit, and the worst row that passes one; limits are convex."""
    margins = np.minimum(rows - robot.lower, robot.upper - rows)
    least = float(margins.min(initial=np.inf))
    if least >= 0.0:
        return least, []
    row, joint = np.unravel_index(np.argmin(margins), margins.shape)
    slides = robot.prismatic[joint]
    by = f"{-1e3 * least:.4g} mm" if slides else f"{-np.degrees(least):.4g} deg"
    text = f"{robot.joint_names[joint]} passes its limit by {by}"
    others = int((margins < 0.0).any(axis=1).sum()) - 1
    return least, [MotionFault(int(row), 0.0, text + _others(others, "row"))]


def _exact_faults(judge: Judge, wrong: Samples, noun: str) -> list[MotionFault]:
    """The worst of configurations that are wrong: the furthest off, and the most tilted."""
    task, faults = judge.task, []
    tolerance = task.effective_tolerance
    off = np.flatnonzero(~(wrong.error <= tolerance))
    if len(off):
        worst = off[np.argmax(np.nan_to_num(wrong.error[off], nan=np.inf))]
        text = (
            f"the tool point is {1e3 * wrong.error[worst]:.4g} mm off its surface, "
            f"{1e3 * tolerance:g} mm are allowed" + _others(len(off) - 1, noun)
        )
        faults.append(MotionFault(int(wrong.row[worst]), float(wrong.share[worst]), text))
    tilted = np.flatnonzero(~(wrong.chord <= task.cone_chord + CLOSE_TO_ZERO))
    if len(tilted):
        worst = tilted[np.argmax(np.nan_to_num(wrong.chord[tilted], nan=np.inf))]
        text = (
            f"the tool axis tilts {np.degrees(angle_of(float(wrong.chord[worst]))):.6g} deg, "
            f"{task.cone_deg:g} deg are allowed" + _others(len(tilted) - 1, noun)
        )
        faults.append(MotionFault(int(wrong.row[worst]), float(wrong.share[worst]), text))
    faults += _roll_faults(task, wrong, noun)
    near = np.flatnonzero(~(wrong.facets >= judge.least_distance - CLOSE_TO_ZERO))
    if len(near) and not len(off):
        worst = near[np.argmin(wrong.facets[near])]
        text = (
            f"the tool point comes within {1e3 * wrong.facets[worst]:.4g} mm of the mesh's "
            f"triangles, nearer than the standoff of {1e3 * task.standoff:g} mm: something "
            "protrudes there, or its facets are too coarse for this standoff"
        )
        faults.append(MotionFault(int(wrong.row[worst]), float(wrong.share[worst]), text))
    return faults


def _roll_faults(task: Task, wrong: Samples, noun: str) -> list[MotionFault]:
    """The one whose roll is furthest outside its range."""
    if task.roll is None or task.roll_deg is None:
        return []
    rolled = np.flatnonzero(~(wrong.roll <= task.roll.half + ROLL_CLOSE))
    if not len(rolled):
        return []
    worst = rolled[np.argmax(np.nan_to_num(wrong.roll[rolled], nan=np.inf))]
    beyond = np.degrees(wrong.roll[worst] - task.roll.half)
    low, high = task.roll_deg
    text = f"the roll is {beyond:.6g} deg outside its range, {low:g} to {high:g} deg" + _others(
        len(rolled) - 1, noun
    )
    return [MotionFault(int(wrong.row[worst]), float(wrong.share[worst]), text)]


def _others(number: int, noun: str) -> str:
    """' (the worst; wrong at 3 other rows, too)', or nothing."""
    others = counted(number, f"other {noun}")
    return f" (the worst; wrong at {others}, too)" if number > 0 else ""


def _open_fault(judge: Judge, left: Stretches, bounds: Bounds) -> MotionFault:
    """What to say of a stretch that neither bounds nor exact configurations decide."""
    # One with a jump first, then the shortest: what is wrong there is nearest to a place.
    one = int(np.lexsort((left.length, bounds.joined))[0])
    row, share = int(left.start.row[one]), float(left.start.share[one] + 0.5 * left.length[one])
    if not bounds.joined[one]:
        target = [
            judge.offset.at(s.places.of(np.array([one])))[0][0] for s in (left.start, left.end)
        ]
        jump = 1e3 * float(np.linalg.norm(target[1] - target[0]))
        text = f"the place on the surface that the tool is over jumps, by {jump:.3g} mm"
    elif not bounds.error[one] <= judge.task.effective_tolerance:
        text = (
            "not certified: the tool point is at the edge of the tolerance, or its place on the "
            f"surface jumps (within {1e3 * bounds.error[one]:.6g} mm, "
            f"{1e3 * judge.task.effective_tolerance:g} mm are allowed)"
        )
    elif not bounds.chord[one] <= judge.task.cone_chord + CLOSE_TO_ZERO:
        text = (
            "not certified: the tool axis is at the edge of the cone (within "
            f"{np.degrees(angle_of(float(bounds.chord[one]))):.6f} deg, {judge.task.cone_deg:g} "
            "deg are allowed)"
        )
    elif not bounds.facets[one] >= judge.least_distance - CLOSE_TO_ZERO:
        text = "not certified: the tool point may come too near to the mesh's triangles"
    else:
        text = "not certified: the roll is at the edge of its range, or the reference turns there"
    return MotionFault(row, share, text)
