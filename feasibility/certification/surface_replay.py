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

Along poses that follow a surface the same has to hold over that surface (`followed`).

Where bodies are given, they have to stay clear of each other too (`collisions`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple, TypeGuard

import numpy as np

from coverable.arrays import Array, Ints, Mask
from feasibility.certification.bisection import bisected
from feasibility.certification.cells_reached import (
    Reached,
    cells_reached,
    in_order,
    missed_text,
)
from feasibility.certification.faults import Judged, MotionFault
from feasibility.certification.jacobians import jacobians
from feasibility.certification.placement_margin import margin_fault, margin_of
from feasibility.certification.refusals import exact_faults, limits, open_fault
from feasibility.certification.stretches import Bounds, Judge, SampledStretches, Samples
from feasibility.cone import angle_of
from feasibility.task import Task
from feasibility.verdict import Certificate
from robots.kinematics import Kinematics
from robots.robot import Robot
from surfaces.cells import Cells
from surfaces.places.offset_surfaces import offset_surface
from surfaces.surface import Surface

if TYPE_CHECKING:
    from feasibility.collisions.problem_bodies import Bodies
    from surfaces.toolpaths.pose_surface import PoseSurface

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
    working: Mask | None = None,
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
        working: (m,) at which rows the tool works: between two of them it has to be right over the
            surface, or over that under poses, whose curves then do not count; elsewhere it may be
            anywhere but through that. Everywhere by default.
    """
    rows = np.asarray(q, dtype=float)
    nowhere = np.zeros(len(cells), dtype=bool)
    fault = _malformed(robot, rows)
    if fault is not None:
        unknown = Certificate(len(rows) if rows.ndim else 0, np.nan, np.nan, np.nan)
        return MotionReplay(unknown, (fault,), nowhere)
    surface = _surface_of(cells, task, working)
    vague = _too_vague(task, surface)
    if vague:
        return MotionReplay(Certificate(len(rows), np.nan, np.nan, np.nan), tuple(vague), nowhere)
    curves = None if working is not None or marks is None else _marked_curves(cells, marks)
    offset = offset_surface(surface, surface.side_sign * task.standoff)
    judge = Judge(robot, less_deviations(task, surface), offset, cells, curves)
    margin, faults = limits(robot, rows)
    if working is None:
        found = _tool_along(judge, rows, cells, marks)
        reached = cells_reached(robot, cells, task, rows, found.samples, marks)
    else:
        found, reached = _tool_at_work(judge, rows, cells, surface, working)
        needed = _at_work(cells) if needed is None else needed
    faults += found.faults
    at = reached.cells
    missed = np.flatnonzero(~at if needed is None else needed & ~at)
    if len(missed):
        faults.append(MotionFault(-1, 0.0, missed_text(cells, task, missed, found.samples)))
    if _is_of_poses(surface):
        from feasibility.certification.toolpath_order import order_of_places

        faults += order_of_places(offset, found.samples, task.effective_tolerance)
        if not faults:
            found = _with_what_follows(found, judge, rows, cells, surface)
            faults += found.faults
    _less_room(found.room, task, reached.row[at], reached.chord[at], reached.roll[at])
    error, chord, roll = found.most.tolist()
    certificate = Certificate(
        len(rows), error, angle_of(chord), margin, max_roll=None if task.roll is None else roll
    )
    if len(cells) and not faults:
        certificate = replace(certificate, margin=margin_of(robot, cells, task, rows, found.room))
    if bodies is not None:
        certificate, hit = _among(bodies, robot, rows, certificate)
        faults += hit
    short = "" if faults else margin_fault(task, certificate)
    faults += [MotionFault(-1, 0.0, short)] if short else []
    return MotionReplay(certificate, tuple(faults), at)


def _marked_curves(cells: Cells, marks: Ints) -> Ints | None:
    """The curve between poses that each row is said to be on; None where cells are no poses."""
    if not _is_of_poses(cells.surface):
        return None
    from feasibility.certification.toolpath_order import curves_of_marks

    return curves_of_marks(cells, marks)


def _among(
    bodies: Bodies, robot: Robot, rows: Array, certificate: Certificate
) -> tuple[Certificate, tuple[MotionFault, ...]]:
    """The certificate with what was measured between bodies, and where these are too near."""
    from feasibility.certification.collisions.collision_replay import collision_replay

    clear = collision_replay(robot, bodies, rows)
    return clear.added_to(certificate), clear.faults


def _less_room(room: Array, task: Task, row: Ints, chord: Array, roll: Array) -> None:
    """Take what is left of cone and roll behind rows (k,), where it is less, into `room` (m, 2)."""
    if task.cone < np.pi:
        angle = 2.0 * np.arcsin(np.minimum(0.5 * chord, 1.0))
        np.minimum.at(room[:, 0], row, np.maximum(task.cone - angle, 0.0))
    if task.roll is not None:
        np.minimum.at(room[:, 1], row, np.maximum(task.roll.half - roll, 0.0))


def _is_of_poses(surface: Surface) -> TypeGuard[PoseSurface]:
    """Are there poses alone, or poses over a surface?"""
    return surface.kind == "poses"


def _surface_of(cells: Cells, task: Task, working: Mask | None) -> Surface:
    """What a motion is judged over."""
    surface = cells.surface
    if not _is_of_poses(surface):
        return surface
    if working is not None and surface.under is not None:
        return surface.under
    # Those of the poses' own do not count along normals.
    return replace(surface, axes=None) if task.approach == "normal" else surface


def _at_work(cells: Cells) -> Mask | None:
    """(N,) the poses at which the tool works, where cells are poses; None for all cells."""
    return cells.surface.working if _is_of_poses(cells.surface) else None


def _tool_at_work(
    judge: Judge, rows: Array, cells: Cells, surface: Surface, working: Mask
) -> tuple[_Along, Reached]:
    """What is found where the tool works, and the cells that are reached there.

    Where it does not, it must not go through the surface.
    """
    from feasibility.certification.followed import lifted_faults

    most, faults, samples = np.zeros(3), list[MotionFault](), list[Samples]()
    reached, room = Reached.none(len(cells)), np.full((len(rows), 2), np.inf)
    turns = np.flatnonzero(np.diff(working)) + 1
    for part in np.split(np.arange(len(rows)), turns):
        if len(part) and working[part[0]]:
            found = _tool_along(judge, rows[part])
            most = np.maximum(most, found.most)
            faults += [replace(each, row=each.row + part[0]) for each in found.faults]
            samples.append(replace(found.samples, row=found.samples.row + part[0]))
            room[part] = found.room
            some = cells_reached(judge.robot, cells, judge.task, rows[part], found.samples)
            new = some.cells & (some.chord < reached.chord)
            reached.row[new] = some.row[new] + part[0]
            reached.chord[new], reached.roll[new] = some.chord[new], some.roll[new]
    lifted = np.flatnonzero(~(working[:-1] & working[1:])).astype(float)
    kinematics, tolerance = Kinematics(judge.robot), judge.task.effective_tolerance
    faults += lifted_faults(surface.wall, rows, (lifted, lifted + 1.0), kinematics, tolerance)
    none = judge.sampled(np.zeros(0, dtype=np.int64), np.zeros(0), rows[:0])
    return _Along(most, faults, Samples.join(none, *samples), room), reached


class _Along(NamedTuple):
    """What is found of tool point, axis and roll along a motion."""

    most: Array
    """(3,) bounds: m, how far the tool point is off; of |a - b|; rad of the roll."""
    faults: list[MotionFault]
    samples: Samples
    """In the order of the motion, all rows among them."""
    room: Array
    """(m, 2) rad, how much of cone and roll is left at least from each row to the next; inf where
    they are free, or the tool does not work."""


def _tool_along(
    judge: Judge, rows: Array, cells: Cells | None = None, marks: Ints | None = None
) -> _Along:
    """Judge tool point, axis and roll at all rows and between them."""
    poses, x = jacobians(Kinematics(judge.robot), rows), judge.reference_axes(rows)
    count = np.arange(len(rows))
    at_rows = judge.compared(count, np.zeros(len(rows)), poses.points, poses.axes, x)
    if marks is not None and cells is not None:
        at_rows = _at_marks(judge, cells, marks, at_rows)
    good = judge.within(at_rows)
    faults = exact_faults(judge, at_rows.of(~good), "row")
    stretches = judge.between_rows(rows, poses, at_rows).of(good[:-1] & good[1:])
    most, room = np.zeros(3), np.full((len(rows), 2), np.inf)
    more, between = _between(judge, rows, stretches, most, room)
    samples = in_order(Samples.join(at_rows, *between))
    np.maximum(most, _most(judge, samples), out=most)
    _less_room(room, judge.task, samples.row, samples.chord, samples.roll)
    return _Along(most, faults + more, samples, room)


def _with_what_follows(
    found: _Along, judge: Judge, rows: Array, cells: Cells, surface: PoseSurface
) -> _Along:
    """What is found along poses, and of what follows the surface under them over that, too.

    What is lifted, or beyond the border, must not go through the surface.
    """
    if surface.under is None or surface.working is None:
        return found
    from feasibility.certification.followed import followed_parts, lifted_faults, off_surface

    task = less_deviations(judge.task, surface.under)
    over = Judge(judge.robot, task, offset_surface(surface.under, judge.offset.height), cells)
    followed, most, room = surface.followed, found.most, found.room
    at = off_surface(followed, found.samples)
    kinematics, tolerance = Kinematics(judge.robot), judge.task.effective_tolerance
    faults = lifted_faults(surface.under.wall, rows, at, kinematics, tolerance)
    faults += _too_vague(judge.task, surface.under)
    for part in followed_parts(judge, followed, rows, found.samples):
        one = _tool_along(over, part.q)
        most = np.maximum(most, one.most)
        faults += [part.placed(fault) for fault in one.faults]
        np.minimum.at(room, part.row, one.room)
    return _Along(most, faults, found.samples, room)


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
    cone_deg = task.cone_deg - _turn_deg(leans)
    return replace(task, tolerance=max(tolerance, 1e-12), cone_deg=max(cone_deg, 0.0))


def _turn_deg(leans: float) -> float:
    """Angle between unit vectors that are so far apart."""
    return float(np.degrees(2.0 * np.arcsin(min(leans / 2.0, 1.0))))


def _too_vague(task: Task, surface: Surface) -> list[MotionFault]:
    """Faults of all motions: nothing is left of tolerance or cone, so the best would be wrong."""
    off, leans = surface.deviations
    faults = []
    if off + task.standoff * leans >= task.effective_tolerance:
        known = f"targets on the surface are known to {1e3 * (off + task.standoff * leans):.4g} mm"
        allowed = f"{1e3 * task.effective_tolerance:g} mm are allowed"
        faults.append(MotionFault(-1, 0.0, f"{known} only, {allowed}"))
    if _turn_deg(leans) > task.cone_deg:
        known = f"its normals are known to {_turn_deg(leans):.4g} deg only"
        text = f"{known}, {task.cone_deg:g} deg are allowed"
        faults.append(MotionFault(-1, 0.0, text))
    return faults


def _most(judge: Judge, one: Samples | Bounds) -> Array:
    """(3,) the most of how far tool points are off (m), of |a - b| and of the roll (rad).

    Nearer to a mesh's triangles than the standoff they are off, too; further from them they are off
    by no more than from their targets.
    """
    off = np.maximum(one.error, judge.task.standoff - one.facets)
    return np.array([np.max(each, initial=0.0) for each in (off, one.chord, one.roll)])


def _between(
    judge: Judge, rows: Array, stretches: SampledStretches, most: Array, room: Array
) -> tuple[list[MotionFault], list[Samples]]:
    """Judge stretches whose ends are good, halved as needed: what is wrong, and what was looked at.

    What is known where they are right goes into `most` and `room`, see `_Along`.
    """
    samples, wrong = list[Samples](), list[Samples]()

    def decided(left: SampledStretches) -> Mask:
        bounds = judge.bounds(left)
        good = judge.within(bounds)
        right = bounds.of(good)
        np.maximum(most, _most(judge, right), out=most)
        _less_room(room, judge.task, left.row[good], right.chord, right.roll)
        return good

    def halves(left: SampledStretches) -> SampledStretches:
        middle = judge.middles(rows, left)
        good = judge.within(middle)
        samples.append(middle)
        if not good.all():
            wrong.append(middle.of(~good))
        good &= sum(len(part.row) for part in wrong) <= ENOUGH
        return left.of(good).halves(middle.of(good))

    left = bisected(stretches, decided, halves, LEVELS, MOST_SAMPLES)
    if wrong:
        return exact_faults(judge, Samples.join(*wrong), "place"), samples
    return [open_fault(judge, left, judge.bounds(left))] if len(left.row) else [], samples


def _malformed(robot: Robot, rows: Array) -> MotionFault | None:
    """Why rows are no motion of this arm; None when they are one."""
    if rows.ndim != 2 or rows.shape[1] != robot.n:
        return MotionFault(-1, 0.0, f"rows of shape {rows.shape} are no motion of {robot.n} joints")
    finite = np.isfinite(rows)
    if not finite.all():
        row, joint = np.argwhere(~finite)[0]
        return MotionFault(int(row), 0.0, f"{robot.joint_names[joint]} is not a finite number")
    return None
