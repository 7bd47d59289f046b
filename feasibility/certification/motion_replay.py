"""The independent replay: what must accept a motion before the word "feasible" is said.

It shares no code with the search but the curves between cell centres, and compares these with the
surface's own closest points and normals (`feasibility.certification.curve_matching`). Besides, it
uses Pinocchio's frame placements and joint Jacobians, and the bound between samples
(`kinematic_bounds`); it sees only the walk, not how it was found. Whether bodies collide is judged
by `feasibility.certification.collisions`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from feasibility.certification.collisions import collision_replay
from feasibility.certification.curve_matching import CurveMatch, match_to_curves
from feasibility.certification.kinematic_bounds import peaks, placements, second_derivatives
from feasibility.certification.surface_replay import replay_over_surface
from feasibility.collisions import gather
from feasibility.cone import angle_of
from feasibility.task import Task
from feasibility.verdict import Certificate, Replay, Walk
from robots import Robot
from surfaces import Cells

CLOSE_TO_ZERO = 1e-12  # [m], [1]: rounding of double arithmetic on metres and unit vectors


def _malformed(robot: Robot, cells: Cells, walk: Walk) -> str:
    """Why a walk is no motion of this arm over these cells; empty when it is one."""
    if walk.q.ndim != 2 or walk.q.shape[1] != robot.n or walk.cell.shape != walk.q.shape[:1]:
        return (
            f"waypoints of shape {walk.q.shape} and cells of shape {walk.cell.shape} are no "
            f"motion of {robot.n} joints"
        )
    if not np.isfinite(walk.q).all():
        return "a joint value is not finite"
    if ((walk.cell < -1) | (walk.cell >= len(cells))).any():
        return f"a waypoint is marked with a cell that is not one of the {len(cells)}"
    return ""


def replay(
    robot: Robot,
    cells: Cells,
    task: Task,
    walk: Walk,
    needed: NDArray[np.bool_],
    strays: NDArray[np.float64] | None = None,
) -> Replay:
    """Check a walk: limits, tool point and cone at and between waypoints, and the cells it visits.

    A walk that the curves between cell centres do not show to be right, because it leaves them or
    because of how far they may be from the surface, is judged over the surface itself
    (`surface_replay`). Its marked waypoints have to be where they say they are.

    Args:
        robot: the arm.
        cells: the cells.
        task: the task; its tolerance and cone are used exactly. Whether bodies stay clear is asked
            only of walks that are right in everything else.
        walk: the motion.
        needed: (N,) cells that must be visited.
        strays: (m - 1, n) how far each joint may be from the straight lines between waypoints,
            for collisions; 0 by default.

    Returns:
        What was measured, and the reason if the walk is refused. NaN anywhere refuses.
    """
    found = _replay_of_tool(robot, cells, task, walk, needed)
    bodies = gather(robot, cells.surface, task.collision, task.standoff)
    if bodies is None or not found.accepted:
        return found
    clear = collision_replay(robot, bodies, walk.q, strays)
    certificate = replace(
        found.certificate, min_clearance=clear.min_clearance, nearest_pair=clear.nearest_pair
    )
    return Replay(certificate, clear.refusal, collides=not clear.accepted)


def _replay_of_tool(
    robot: Robot, cells: Cells, task: Task, walk: Walk, needed: NDArray[np.bool_]
) -> Replay:
    """`replay` of limits, tool and cells alone."""
    along_curves = replay_along_curves(robot, cells, task, walk, needed)
    if along_curves.accepted or _malformed(robot, cells, walk):
        return along_curves
    if not _marks_are_right(robot, cells, task, walk, needed):
        return along_curves
    over_surface = replay_over_surface(robot, cells, task, walk.q, needed)
    if over_surface.accepted:
        return Replay(over_surface.certificate, "")
    if along_curves.narrowly_refused:
        return along_curves
    return Replay(over_surface.certificate, f"{along_curves.refusal}; {over_surface.refusal}")


def _marks_are_right(
    robot: Robot, cells: Cells, task: Task, walk: Walk, needed: NDArray[np.bool_]
) -> bool:
    """Are the marked waypoints at the targets of their cells, and every needed cell marked?"""
    at = np.flatnonzero(walk.cell >= 0)
    visited = np.zeros(len(cells), dtype=bool)
    visited[walk.cell[at]] = True
    aims, poses = task.targets(cells), placements(robot, walk.q[at])
    off = np.linalg.norm(poses.points - aims.points[walk.cell[at]], axis=1)
    chord = np.linalg.norm(poses.axes - aims.approaches[walk.cell[at]], axis=1)
    right = (off <= task.effective_tolerance) & (chord <= task.cone_chord + CLOSE_TO_ZERO)
    return bool(visited[needed].all() and right.all())


def _largest_tilt(
    matched: CurveMatch,
    derivative_bound: NDArray[np.float64],
    axis_bound: NDArray[np.float64],
    beside: bool,
) -> float:
    """The largest |a - b| along a walk.

    The task asks for the cone at the tool point's target. With `beside` it is to hold at the tool
    point's closest point on the surface too, where the normal may be another: the more cautious
    figure, which is taken where it is inside the cone.
    """
    share = 1.0 if beside else 0.0
    error, chord = matched.error, matched.chord
    with np.errstate(invalid="ignore", over="ignore"):  # a fold: inf * 0 is NaN, and refused
        curvature = share * matched.derivative_bounds[:, 2]
        bound = axis_bound + curvature * derivative_bound
        before = chord[:-1] + curvature * error[:-1]
        after = chord[1:] + curvature * error[1:]
    tilted = peaks(before, after, bound) + matched.deviations[:, 1]
    alone = chord + share * matched.centre_curvature * error if len(chord) == 1 else chord
    return float(np.max(tilted, initial=np.max(alone, initial=0.0)))


def replay_along_curves(
    robot: Robot, cells: Cells, task: Task, walk: Walk, needed: NDArray[np.bool_]
) -> Replay:
    """`replay` by the curves alone, of a walk that goes from centre to centre along them."""
    fault = _malformed(robot, cells, walk)
    if fault:
        return Replay(Certificate(len(walk.q), np.nan, np.nan, np.nan), fault)
    tolerance, cone_chord = task.effective_tolerance, task.cone_chord
    poses = placements(robot, walk.q)
    matched = match_to_curves(cells, task, walk, poses.points, poses.axes)
    if matched.fault:
        return Replay(Certificate(len(walk.q), np.nan, np.nan, np.nan), matched.fault)
    steps = np.abs(np.diff(walk.q, axis=0))
    derivative_bound = (
        second_derivatives(steps, robot.prismatic, poses.levers, np.inf)
        + matched.derivative_bounds[:, 0]
    )
    axis_bound = (
        second_derivatives(steps, robot.prismatic, poses.sines, 1.0)
        + matched.derivative_bounds[:, 1]
    )
    deviated = peaks(matched.error[:-1], matched.error[1:], derivative_bound)
    position = np.max(
        deviated + matched.deviations[:, 0], initial=np.max(matched.error, initial=0.0)
    )
    worst = _largest_tilt(matched, derivative_bound, axis_bound, beside=True)
    if not worst <= cone_chord + CLOSE_TO_ZERO:
        worst = _largest_tilt(matched, derivative_bound, axis_bound, beside=False)
    margin = float(np.min(np.minimum(walk.q - robot.lower, robot.upper - walk.q), initial=np.inf))
    certificate = Certificate(
        waypoints=len(walk.q),
        max_position_error=float(position),
        max_angle=angle_of(worst),
        min_limit_margin=margin,
    )

    visited = np.zeros(len(cells), dtype=bool)
    visited[walk.cell[walk.cell >= 0]] = True
    refusals = []
    if not margin >= 0.0:
        refusals.append(f"a joint passes its limit by {-margin:.3g}")
    if not position <= tolerance:
        refusals.append(f"the tool point deviates by {position:.3g} m, more than {tolerance:.3g} m")
    if not worst <= cone_chord + CLOSE_TO_ZERO:
        refusals.append(
            f"the tool axis tilts {np.degrees(certificate.max_angle):.4f} deg, "
            f"more than {task.cone_deg:g} deg"
        )
    at = walk.cell >= 0
    if not (position <= tolerance and worst <= cone_chord + CLOSE_TO_ZERO) and (
        (matched.error[at] > tolerance).any() or (matched.chord[at] > cone_chord).any()
    ):
        refusals.append("a marked waypoint is not at its cell's centre target")
    if not visited[needed].all():
        refusals.append(f"{int((needed & ~visited).sum())} cells are never visited")
    return Replay(certificate, "; ".join(refusals))
