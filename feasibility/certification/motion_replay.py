"""The independent replay: what must accept a motion before the word "feasible" is said.

It shares no code with the search but the curves between cell centres, and compares these with the
surface's own closest points and normals (`feasibility.certification.curve_matching`). Besides, it
uses Pinocchio's frame placements and joint Jacobians, and the bound between samples
(`lever_bounds`); it sees only the walk, not how it was found. Whether bodies collide is judged
by `feasibility.certification.collisions`.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from coverable_arrays import Array, Mask
from feasibility.certification.cells_reached import at_targets
from feasibility.certification.collisions import collision_replay
from feasibility.certification.curve_matching import CurveMatch, match_to_curves
from feasibility.certification.jacobians import placements
from feasibility.certification.lever_bounds import peaks, second_derivatives
from feasibility.certification.order import order_of_marks
from feasibility.certification.rolls import (
    reference_axes,
    tool_frames,
)
from feasibility.certification.rolls_along import rolls_along
from feasibility.certification.surface_replay import replay_over_surface
from feasibility.collisions import gather
from feasibility.cone import angle_of
from feasibility.task import Task
from feasibility.verdict import Certificate, Replay, Walk
from robots import Robot
from surfaces import Cells

HALVINGS = 3  # of every segment, while the roll alone is not known well enough between waypoints
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
    needed: Mask,
    deviations: Array | None = None,
) -> Replay:
    """Check a walk: limits, tool point, cone and roll at and between waypoints, and its cells.

    A walk that the curves between cell centres do not show to be right, because it leaves them or
    because of how far they may be from the surface, is judged over the surface itself
    (`surface_replay`). Its marked waypoints have to be where they say they are.

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
    found = _replay_of_tool(robot, cells, task, walk, needed)
    bodies = gather(robot, cells.surface, task.collision, task.standoff)
    if bodies is None or not found.accepted:
        return found
    clear = collision_replay(robot, bodies, walk.q, deviations)
    certificate = replace(
        found.certificate, min_clearance=clear.min_clearance, nearest_pair=clear.nearest_pair
    )
    return Replay(certificate, clear.refusal, collides=not clear.accepted)


def _replay_of_tool(robot: Robot, cells: Cells, task: Task, walk: Walk, needed: Mask) -> Replay:
    """`replay` of limits, tool and cells alone."""
    disorder = order_of_marks(cells, walk)
    if disorder:
        return Replay(Certificate(len(walk.q), np.nan, np.nan, np.nan), disorder)
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


def _marks_are_right(robot: Robot, cells: Cells, task: Task, walk: Walk, needed: Mask) -> bool:
    """Are the marked waypoints at the targets of their cells, and every needed cell marked?"""
    at = np.flatnonzero(walk.cell >= 0)
    visited = np.zeros(len(cells), dtype=bool)
    visited[walk.cell[at]] = True
    q, cell = walk.q[at], walk.cell[at]
    poses = placements(robot, q)
    x = poses.axes if task.roll is None else reference_axes(robot, q)
    right = at_targets(task, task.targets(cells), cell, poses.points, poses.axes, x)
    return bool(visited[needed].all() and right.all())


def _largest_tilt(
    matched: CurveMatch,
    derivative_bound: Array,
    axis_bound: Array,
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


def replay_along_curves(robot: Robot, cells: Cells, task: Task, walk: Walk, needed: Mask) -> Replay:
    """`replay` by the curves alone, of a walk that goes from centre to centre along them.

    Where the roll alone is not shown to stay in its range, segments are halved, a few times.
    """
    fault = _malformed(robot, cells, walk)
    if fault:
        return Replay(Certificate(len(walk.q), np.nan, np.nan, np.nan), fault)
    halved = walk
    for _ in range(HALVINGS + 1):
        found = _along_curves(robot, cells, task, halved, needed)
        if not found.roll_is_open:
            break
        halved = _with_middles(halved)
    whole = replace(found.certificate, waypoints=len(walk.q))
    return Replay(whole, "; ".join(found.refusals))


class _Along(NamedTuple):
    """What was found along the curves."""

    certificate: Certificate
    refusals: list[str]
    roll_is_open: bool = False
    """Is nothing wrong but that the roll between waypoints is not known well enough?"""


def _with_middles(walk: Walk) -> Walk:
    """The same motion with a waypoint in the middle of each segment."""
    q = np.empty((2 * len(walk.q) - 1, walk.q.shape[1]))
    q[::2], q[1::2] = walk.q, 0.5 * (walk.q[:-1] + walk.q[1:])
    cell = np.full(len(q), -1, dtype=np.int64)
    cell[::2] = walk.cell
    return Walk(q, cell)


def _along_curves(robot: Robot, cells: Cells, task: Task, walk: Walk, needed: Mask) -> _Along:
    """`replay_along_curves` of these segments as they are."""
    poses = placements(robot, walk.q)
    matched = match_to_curves(cells, task, walk, poses.points, poses.axes)
    if matched.fault:
        return _Along(Certificate(len(walk.q), np.nan, np.nan, np.nan), [matched.fault])
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
    if not worst <= task.cone_chord + CLOSE_TO_ZERO:
        worst = _largest_tilt(matched, derivative_bound, axis_bound, beside=False)
    margin = float(np.min(np.minimum(walk.q - robot.lower, robot.upper - walk.q), initial=np.inf))
    certificate = Certificate(
        waypoints=len(walk.q),
        max_position_error=float(position),
        max_angle=angle_of(worst),
        min_limit_margin=margin,
    )
    refusals = _refusals(cells, task, walk, needed, matched, certificate, worst)
    if task.roll is None or matched.frames is None:
        return _Along(certificate, refusals)
    frames = tool_frames(robot, walk.q, poses.axes, reference_axes(robot, walk.q))
    found = rolls_along(robot, task.roll, walk.q, poses.axes, frames, matched)
    certificate = replace(certificate, max_roll=found.most)
    if found.inside:
        return _Along(certificate, refusals)
    return _Along(certificate, [*refusals, found.refusal(task)], found.open and not refusals)


def _refusals(
    cells: Cells,
    task: Task,
    walk: Walk,
    needed: Mask,
    matched: CurveMatch,
    certificate: Certificate,
    worst: float,
) -> list[str]:
    """What is wrong with limits, tool point and axis (`worst` the chord of its tilt), and cells."""
    tolerance, cone_chord = task.effective_tolerance, task.cone_chord
    position, margin = certificate.max_position_error, certificate.min_limit_margin
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
    return refusals
