"""The independent replay: what must accept a motion before the word "feasible" is said.

It shares no code with the search. It sees only the motion, not how it was found: `surface_replay`
judges it over the surface itself, `collisions` whether bodies stay clear.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from coverable.arrays import Array, Mask
from feasibility.certification.cells_reached import at_targets
from feasibility.certification.placement_margin import margin_fault
from feasibility.certification.surface_replay import replay_over_surface
from feasibility.collisions.asked_bodies import gather
from feasibility.task import Task
from feasibility.verdict import Certificate, Replay, Walk
from robots.kinematics import Kinematics, reference_axes
from robots.robot import Robot
from surfaces.cells import Cells


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
    disorder = _malformed(cells, walk)
    if cells.in_order and not disorder:
        from feasibility.certification.pose_replay import order_of_marks

        disorder = order_of_marks(cells, walk)
    if disorder:
        return Replay(Certificate(len(walk.q), np.nan, np.nan, np.nan), disorder)
    here = replace(task, placement_error=None)  # its margin is judged last
    found = replay_over_surface(robot, cells, here, walk.q, needed, marks=walk.cell)
    refusal = found.refusal or _misplaced(robot, cells, task, walk)
    bodies = gather(robot, cells.surface, task.collision, task.standoff)
    certificate, collides = found.certificate, False
    if bodies is not None and not refusal:
        from feasibility.certification.collisions.collision_replay import collision_replay

        clear = collision_replay(robot, bodies, walk.q, deviations)
        certificate, refusal = clear.added_to(certificate), clear.refusal
        collides = not clear.accepted
    if refusal or deviations is not None:  # the margin is of motions that are straight
        certificate = replace(certificate, margin=None)
    refusal = refusal or margin_fault(task, certificate)
    return Replay(certificate, refusal, collides)


def _malformed(cells: Cells, walk: Walk) -> str:
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
