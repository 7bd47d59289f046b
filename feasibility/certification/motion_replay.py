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

from dataclasses import replace
from functools import cache, partial
from typing import TYPE_CHECKING, TypeGuard

import numpy as np

from coverable.arrays import Array, Ints, Mask
from feasibility.certification.cells_reached import at_targets, cells_reached, missed_text
from feasibility.certification.faults import (
    MotionFault,
    Replay,
    and_others,
    less_deviations,
    too_vague,
    unmeasured,
)
from feasibility.certification.placement_margin import margin_fault, placement_margin
from feasibility.certification.stretches import Judge
from feasibility.certification.tool_along import tool_along
from feasibility.collisions.asked_bodies import gather
from feasibility.cone import angle_of
from feasibility.task import Task
from feasibility.verdict import Certificate, Walk
from robots.kinematics import Kinematics
from robots.robot import Robot
from surfaces.cells import Cells
from surfaces.surface import Surface

if TYPE_CHECKING:
    from feasibility.collisions.problem_bodies import Bodies
    from surfaces.toolpaths.pose_surface import PoseSurface


def replay_over_surface(
    robot: Robot,
    cells: Cells,
    task: Task,
    q: Array,
    needed: Mask | None = None,
    bodies: Bodies | None = None,
    marks: Ints | None = None,
    working: Mask | None = None,
) -> Replay:
    """Judge a motion by the module's rules.

    Args:
        robot, cells, task: the case; tolerance, cone and roll are used exactly.
        q: (m, n) rows, rad or m, unwrapped.
        needed: (N,) cells that have to be reached; all by default.
        bodies: what has to stay clear of what; None where collisions are not checked.
        marks: (m,) the cell whose target a row is said to be at, -1 at none: places to try first.
        working: (m,) at which rows the tool works: between two of them it has to be right over the
            surface, or over that under poses, whose curves then do not count; elsewhere it may be
            anywhere but through that. Everywhere by default.
    """
    found = _of_the_tool(robot, cells, task, np.asarray(q, dtype=float), needed, marks, working)
    return _with_bodies(found, robot, task, q, bodies)


def _of_the_tool(
    robot: Robot,
    cells: Cells,
    task: Task,
    rows: Array,
    needed: Mask | None,
    marks: Ints | None,
    working: Mask | None = None,
) -> Replay:
    """Limits, tool point, axis, roll, and the cells that are reached."""
    surface = _surface_of(cells, task, working)
    refused = _malformed(robot, rows) or too_vague(task, surface)
    if refused:
        return unmeasured(cells, rows, *refused)
    poses, curves = _is_of_poses(surface), None
    if poses or working is not None:
        from feasibility.certification import pose_replay
    if poses and marks is not None and working is None:
        curves = pose_replay.curves_of_marks(cells, marks)
    less = less_deviations(task, surface)
    judge = Judge(robot, less, surface, cells, rows, None if working is not None else marks, curves)
    margin, faults = limits(robot, rows)
    if working is None:
        found = tool_along(judge)
    else:
        found = pose_replay.tool_at_work(judge, surface.wall, working)
        if needed is None and _is_of_poses(cells.surface):
            needed = cells.surface.working
    faults += found.faults
    exact = task if working is None else less
    at = cells_reached(judge, exact, found.samples, found.room)
    missed = np.flatnonzero(~at if needed is None else needed & ~at)
    if len(missed):
        faults.append(MotionFault(missed_text(cells, task, missed, found.samples)))
    if _is_of_poses(surface):
        found = pose_replay.along_poses(found, judge, surface, not faults)
        faults += found.faults
    error, chord, roll = found.most.tolist()
    certificate = Certificate(
        len(rows), error, angle_of(chord), margin, max_roll=None if task.roll is None else roll
    )
    if len(cells) and not faults:
        margin_of = partial(placement_margin, judge.kinematics, cells, task, rows, found.room)
        certificate = replace(certificate, margin=cache(margin_of))  # found when it is asked for
    return Replay(certificate, tuple(faults), at)


def _with_bodies(
    found: Replay,
    robot: Robot,
    task: Task,
    q: Array,
    bodies: Bodies | None,
    deviations: Array | None = None,
) -> Replay:
    """A replay with what is between bodies, where some are given; and the margin, judged last."""
    certificate, faults = found.certificate, found.faults
    if bodies is not None and not np.isnan(certificate.min_limit_margin):  # these are a motion
        from feasibility.certification.collisions.collision_replay import collision_replay

        clear = collision_replay(robot, bodies, q, deviations)
        certificate, faults = clear.added_to(certificate), faults + clear.faults
    if deviations is not None:  # the margin is of motions that are straight
        certificate = replace(certificate, margin=None)
    collides = len(faults) > len(found.faults)
    short = "" if faults else margin_fault(task, certificate)
    faults += (MotionFault(short),) if short else ()
    return Replay(certificate, faults, found.reached, collides)


def limits(robot: Robot, rows: Array) -> tuple[float, list[MotionFault]]:
    """The smallest distance from a limit, and the worst row that passes one; limits are convex."""
    margins = np.minimum(rows - robot.lower, robot.upper - rows)
    least = float(margins.min(initial=np.inf))
    if least >= 0.0:
        return least, []
    row, joint = np.unravel_index(np.argmin(margins), margins.shape)
    by = f"{-1e3 * least:.4g} mm" if robot.prismatic[joint] else f"{-np.degrees(least):.4g} deg"
    text = f"{robot.joint_names[joint]} passes its limit by {by}"
    others = int((margins < 0.0).any(axis=1).sum()) - 1
    return least, [MotionFault(text + and_others(others, "row"), int(row))]


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


def _malformed(robot: Robot, rows: Array) -> list[MotionFault]:
    """Why rows are no motion of this arm; nothing when they are one."""
    if rows.ndim != 2 or rows.shape[1] != robot.n:
        text = f"rows of shape {rows.shape} are no motion of {robot.n} joints"
        return [MotionFault(text)]
    finite = np.isfinite(rows)
    if not finite.all():
        row, joint = np.argwhere(~finite)[0]
        return [MotionFault(f"{robot.joint_names[joint]} is not a finite number", int(row))]
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
        robot, cells, task: the case; tolerance, cone and roll are used exactly. Whether bodies stay
            clear is asked only of walks that are right in everything else.
        walk: the motion.
        needed: (N,) cells that must be visited.
        deviations: (m - 1, n) how far each joint may be from the straight lines between waypoints,
            for collisions; 0 by default.

    Returns:
        What was measured, and the reason if the walk is refused. NaN anywhere refuses.
    """
    disorder = _mismarked(cells, walk)
    if disorder:
        return unmeasured(cells, walk.q, MotionFault(disorder))
    found = _of_the_tool(robot, cells, task, walk.q, needed, walk.cell)
    misplaced = "" if found.faults else _misplaced(robot, cells, task, walk)
    if misplaced:
        certificate = replace(found.certificate, margin=None)
        return Replay(certificate, (MotionFault(misplaced),), found.reached)
    if found.faults:
        return found
    bodies = gather(robot, cells.surface, task.collision, task.standoff)
    return _with_bodies(found, robot, task, walk.q, bodies, deviations)


def _mismarked(cells: Cells, walk: Walk) -> str:
    """Why the marks of a walk are none over these cells, or in their order; empty if they are."""
    if walk.cell.shape != walk.q.shape[:1]:
        return f"waypoints of shape {walk.q.shape} have cells of shape {walk.cell.shape}"
    if ((walk.cell < -1) | (walk.cell >= len(cells))).any():
        return f"a waypoint is marked with a cell that is not one of the {len(cells)}"
    if not cells.in_order:
        return ""
    from feasibility.certification.pose_replay import order_of_marks

    return order_of_marks(cells, walk)


def _misplaced(robot: Robot, cells: Cells, task: Task, walk: Walk) -> str:
    """Why a marked waypoint is not where it says it is; empty where all are."""
    at = np.flatnonzero(walk.cell >= 0)
    held = Kinematics(robot).held(walk.q[at])
    right = at_targets(task, task.targets(cells), walk.cell[at], *held)[0] < np.inf
    if right.all():
        return ""
    row = int(at[np.argmin(right)])
    return f"row {row + 1} is marked with cell {walk.cell[row]}, but is not at its centre's target"
