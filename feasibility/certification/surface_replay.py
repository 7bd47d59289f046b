"""The replay of any joint motion over a surface, whoever made it.

A motion is straight in joint space between its rows. It is accepted where, at every instant, the
joints are inside their limits, and some place x of the surface that moves continuously has the tool
point within the tolerance of its target T(x), the tool axis within the cone of its approach
direction b(x), and the roll about it, where that is limited, in its range; and where every needed
cell is reached at some instant. Curves between cells play no part, nor does what the motion says of
where it is.

Rows and what is between them are judged in `tool_along`, along poses in `pose_replay`.

Where bodies are given, they have to stay clear of each other too (`collisions`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache, partial
from typing import TYPE_CHECKING, TypeGuard

import numpy as np

from coverable.arrays import Array, Ints, Mask
from feasibility.certification.cells_reached import cells_reached, missed_text
from feasibility.certification.faults import Judged, MotionFault, less_deviations, too_vague
from feasibility.certification.placement_margin import margin_fault, placement_margin
from feasibility.certification.stretches import Judge
from feasibility.certification.tool_along import less_room, tool_along
from feasibility.cone import angle_of
from feasibility.task import Task
from feasibility.verdict import Certificate
from robots.robot import Robot
from surfaces.cells import Cells
from surfaces.places.offset_surfaces import offset_surface
from surfaces.surface import Surface

if TYPE_CHECKING:
    from feasibility.collisions.problem_bodies import Bodies
    from surfaces.toolpaths.pose_surface import PoseSurface


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
        marks: (m,) the cell whose target a row is said to be at, -1 at none: places to try first.
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
    vague = too_vague(task, surface)
    if vague:
        return MotionReplay(Certificate(len(rows), np.nan, np.nan, np.nan), tuple(vague), nowhere)
    curves = None if working is not None or marks is None else _marked_curves(cells, marks)
    offset = offset_surface(surface, surface.side_sign * task.standoff)
    judge = Judge(robot, less_deviations(task, surface), offset, cells, curves)
    margin, faults = limits(robot, rows)
    if working is None:
        found = tool_along(judge, rows, cells, marks)
        reached = cells_reached(robot, cells, task, rows, found.samples, marks)
    else:
        from feasibility.certification.pose_replay import tool_at_work

        found, reached = tool_at_work(judge, rows, cells, surface, working)
        needed = _at_work(cells) if needed is None else needed
    faults += found.faults
    at = reached.cells
    missed = np.flatnonzero(~at if needed is None else needed & ~at)
    if len(missed):
        faults.append(MotionFault(-1, 0.0, missed_text(cells, task, missed, found.samples)))
    if _is_of_poses(surface):
        from feasibility.certification.pose_replay import along_poses

        found, more = along_poses(found, judge, rows, cells, surface, task, not faults)
        faults += more
    less_room(found.room, task, reached.row[at], reached.chord[at], reached.roll[at])
    error, chord, roll = found.most.tolist()
    certificate = Certificate(
        len(rows), error, angle_of(chord), margin, max_roll=None if task.roll is None else roll
    )
    if len(cells) and not faults:
        margin_of = partial(placement_margin, judge.kinematics, cells, task, rows, found.room)
        certificate = replace(certificate, margin=cache(margin_of))  # found when it is asked for
    if bodies is not None:
        certificate, hit = _among(bodies, robot, rows, certificate)
        faults += hit
    short = "" if faults else margin_fault(task, certificate)
    faults += [MotionFault(-1, 0.0, short)] if short else []
    return MotionReplay(certificate, tuple(faults), at)


def limits(robot: Robot, rows: Array) -> tuple[float, list[MotionFault]]:
    """The smallest distance from a limit, and the worst row that passes one; limits are convex."""
    least = float(np.minimum(rows - robot.lower, robot.upper - rows).min(initial=np.inf))
    if least >= 0.0:
        return least, []
    from feasibility.certification.refusals import past_limit

    return least, [past_limit(robot, rows)]


def _marked_curves(cells: Cells, marks: Ints) -> Ints | None:
    """The curve between poses that each row is said to be on; None where cells are no poses."""
    if not _is_of_poses(cells.surface):
        return None
    from feasibility.certification.pose_replay import curves_of_marks

    return curves_of_marks(cells, marks)


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


def _is_of_poses(surface: Surface) -> TypeGuard[PoseSurface]:
    """Are there poses alone, or poses over a surface?"""
    return surface.kind == "poses"


def _among(
    bodies: Bodies, robot: Robot, rows: Array, certificate: Certificate
) -> tuple[Certificate, tuple[MotionFault, ...]]:
    """The certificate with what was measured between bodies, and where these are too near."""
    from feasibility.certification.collisions.collision_replay import collision_replay

    clear = collision_replay(robot, bodies, rows)
    return clear.added_to(certificate), clear.faults


def _malformed(robot: Robot, rows: Array) -> MotionFault | None:
    """Why rows are no motion of this arm; None when they are one."""
    if rows.ndim != 2 or rows.shape[1] != robot.n:
        return MotionFault(-1, 0.0, f"rows of shape {rows.shape} are no motion of {robot.n} joints")
    finite = np.isfinite(rows)
    if not finite.all():
        row, joint = np.argwhere(~finite)[0]
        return MotionFault(int(row), 0.0, f"{robot.joint_names[joint]} is not a finite number")
    return None
