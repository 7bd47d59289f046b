"""The independent replay: what must accept a motion before the word "feasible" is said.

It shares no code with the search, and judges any motion, whoever made it.

A motion is straight in joint space between its rows. It is accepted where, at every instant, the
joints are inside their limits, and some place x of the surface that moves continuously has the tool
point within the tolerance of its target T(x), the tool axis within the cone of its approach
direction b(x), and the roll about it, where that is limited, in its range; and where every needed
cell is reached at some instant. Curves between cells play no part, nor does what the motion says of
where it is.

Rows and what is between them are judged in `tool_along`, along poses in `pose_replay`, and whether
bodies stay clear in `collisions`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import TYPE_CHECKING, TypeGuard

import numpy as np

from coverable.arrays import Array, Ints, Mask
from feasibility.certification.cells_reached import at_targets, cells_reached, missed_text
from feasibility.certification.faults import Judged, MotionFault, less_deviations, too_vague
from feasibility.certification.placement_margin import margin_fault, placement_margin
from feasibility.certification.stretches import Judge
from feasibility.certification.tool_along import less_room, past_limit, tool_along
from feasibility.collisions.asked_bodies import gather
from feasibility.cone import angle_of
from feasibility.task import Task
from feasibility.verdict import Certificate, Replay, Walk
from robots.kinematics import Kinematics, reference_axes
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
    rows, surface = np.asarray(q, dtype=float), _surface_of(cells, task, working)
    refused = _malformed(robot, rows) or too_vague(task, surface)
    if refused:
        unknown = Certificate(len(rows) if rows.ndim else 0, np.nan, np.nan, np.nan)
        return MotionReplay(unknown, tuple(refused), np.zeros(len(cells), dtype=bool))
    curves = None
    if marks is not None and working is None and _is_of_poses(surface):
        from feasibility.certification.pose_replay import curves_of_marks

        curves = curves_of_marks(cells, marks)
    offset = offset_surface(surface, surface.side_sign * task.standoff)
    judge = Judge(robot, less_deviations(task, surface), offset, cells, curves)
    margin, faults = limits(robot, rows)
    if working is None:
        found = tool_along(judge, rows, cells, marks)
        reached = cells_reached(robot, cells, task, rows, found.samples, marks)
    else:
        from feasibility.certification.pose_replay import tool_at_work

        found, reached = tool_at_work(judge, rows, cells, surface, working)
        if needed is None and _is_of_poses(cells.surface):
            needed = cells.surface.working
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
    return least, [past_limit(robot, rows)]


def _surface_of(cells: Cells, task: Task, working: Mask | None) -> Surface:
    """What a motion is judged over."""
    surface = cells.surface
    if not _is_of_poses(surface):
        return surface
    if working is not None and surface.under is not None:
        return surface.under
    # Those of the poses' own do not count along normals.
    return replace(surface, axes=None) if task.approach == "normal" else surface


def _is_of_poses(surface: Surface) -> TypeGuard[PoseSurface]:
    """Are there poses alone, or poses over a surface?"""
    return surface.kind == "poses"


def _among(
    bodies: Bodies, robot: Robot, rows: Array, found: Certificate, deviations: Array | None = None
) -> tuple[Certificate, Sequence[MotionFault]]:
    """The certificate with what was measured between bodies, and where these are too near."""
    from feasibility.certification.collisions.collision_replay import collision_replay

    clear = collision_replay(robot, bodies, rows, deviations)
    return clear.added_to(found), clear.faults


def _malformed(robot: Robot, rows: Array) -> list[MotionFault]:
    """Why rows are no motion of this arm; nothing when they are one."""
    if rows.ndim != 2 or rows.shape[1] != robot.n:
        text = f"rows of shape {rows.shape} are no motion of {robot.n} joints"
        return [MotionFault(-1, 0.0, text)]
    finite = np.isfinite(rows)
    if not finite.all():
        row, joint = np.argwhere(~finite)[0]
        return [MotionFault(int(row), 0.0, f"{robot.joint_names[joint]} is not a finite number")]
    return []


def replay(
    robot: Robot,
    cells: Cells,
    task: Task,
    walk: Walk,
    needed: Mask,
    deviations: Array | None = None,
) -> Replay:
    """Check a walk: limits, tool point, cone and roll at and between waypoints, and its cells.

    Args:
        robot: the arm.
        cells: the cells.
        task: the task; its tolerance, cone and roll are used exactly. Whether bodies stay clear is
            asked only of walks that are right in everything else.
        walk: the motion.
        needed: (N,) cells that must be visited.
        deviations: (m - 1, n) how far each joint may be from the straight lines between waypoints,
            for collisions; 0 by default.

    Returns:
        What was measured, and the reason if the walk is refused. NaN anywhere refuses.
    """
    disorder = _mismarked(cells, walk)
    if cells.in_order and not disorder:
        from feasibility.certification.pose_replay import order_of_marks

        disorder = order_of_marks(cells, walk)
    if disorder:
        return Replay(Certificate(len(walk.q), np.nan, np.nan, np.nan), disorder)
    here = replace(task, placement_error=None)  # its margin is judged last
    found = replay_over_surface(robot, cells, here, walk.q, needed, marks=walk.cell)
    refusal = found.refusal or _misplaced(robot, cells, task, walk)
    bodies = gather(robot, cells.surface, task.collision, task.standoff)
    certificate, hit = found.certificate, ""
    if bodies is not None and not refusal:
        certificate, faults = _among(bodies, robot, walk.q, certificate, deviations)
        refusal = hit = "; ".join(map(str, faults))
    if refusal or deviations is not None:  # the margin is of motions that are straight
        certificate = replace(certificate, margin=None)
    refusal = refusal or margin_fault(task, certificate)
    return Replay(certificate, refusal, bool(hit))


def _mismarked(cells: Cells, walk: Walk) -> str:
    """Why the marks of a walk are none over these cells; empty where they are."""
    if walk.cell.shape != walk.q.shape[:1]:
        return f"waypoints of shape {walk.q.shape} have cells of shape {walk.cell.shape}"
    if ((walk.cell < -1) | (walk.cell >= len(cells))).any():
        return f"a waypoint is marked with a cell that is not one of the {len(cells)}"
    return ""


def _misplaced(robot: Robot, cells: Cells, task: Task, walk: Walk) -> str:
    """Why a marked waypoint is not where it says it is; empty where all are."""
    at = np.flatnonzero(walk.cell >= 0)
    q, cell = walk.q[at], walk.cell[at]
    points, axes = Kinematics(robot).tools(q)
    x = axes if task.roll is None else reference_axes(robot, q)
    right = at_targets(task, task.targets(cells), cell, points, axes, x)[0] < np.inf
    if right.all():
        return ""
    row = int(at[np.argmin(right)])
    return f"row {row + 1} is marked with cell {walk.cell[row]}, but is not at its centre's target"
