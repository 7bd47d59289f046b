"""The independent replay: what must accept a motion before the word "feasible" is said.

It shares no code with the search but the curves between cell centres, and compares these with the
surface's own closest points and normals (`feasibility.certification.curve_matching`). Besides, it
uses Pinocchio's frame placements and joint Jacobians, and the bound between samples; it sees only
the walk, not how it was found. The bound D is derived in `feasibility.roadmap.segment_bound`; here
it is evaluated again from Pinocchio's Jacobian: the linear part of column j, moved to the tool
point, has the length r_j (the lever arm), and |z_j x a| = s_j for its angular part z_j.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from feasibility.certification.curve_matching import match_to_curves
from feasibility.cone import angle_of
from feasibility.task import Task
from feasibility.verdict import Certificate, Replay, Walk
from robots import Kinematics, Robot
from surfaces import Cells

CLOSE_TO_ZERO = 1e-12  # [m], [1]: rounding of double arithmetic on metres and unit vectors


@dataclass(frozen=True, eq=False, slots=True)
class Placements:
    """What Pinocchio computes for m configurations."""

    points: NDArray[np.float64]
    """(m, 3) tool points, m."""
    axes: NDArray[np.float64]
    """(m, 3) approach axes."""
    levers: NDArray[np.float64]
    """(m, n) distance of the tool point from each revolute axis, m; 1 for a prismatic joint."""
    sines: NDArray[np.float64]
    """(m, n) sine of the angle between each revolute axis and the approach axis; 0 if prismatic."""


def placements(robot: Robot, q: NDArray[np.float64]) -> Placements:
    """Tool points, axes and lever arms at q (m, n) by Pinocchio."""
    kinematics = Kinematics(robot)
    points, axes = kinematics.tools(q)
    linear, angular = np.split(kinematics.twists(q).transpose(0, 2, 1), 2, axis=2)
    levers = np.linalg.norm(linear + np.cross(angular, points[:, None]), axis=2)
    sines = np.linalg.norm(np.cross(angular, axes[:, None]), axis=2)
    return Placements(points, axes, levers, sines)


def second_derivatives(
    steps: NDArray[np.float64],
    prismatic: NDArray[np.bool_],
    levers: NDArray[np.float64],
    cap: float,
    bent: NDArray[np.float64] | None = None,
) -> NDArray[np.float64]:
    """Bound D of |p''| (or Da of |a''|) along segments, straight ones in joint space by default.

    Args:
        steps: (m, n) absolute joint changes; of bent segments, bounds on |dq/ds|, s from 0 to 1.
        prismatic: (n,) which joints slide.
        levers: (m + 1, n) r_j (or s_j) at the ends of the segments.
        cap: upper bound of every lever (1 for sines, inf for lengths).
        bent: (m, n) bounds on the joints' own |d^2q/ds^2|; each adds that times its lever.

    Returns:
        (m,) bounds.
    """
    m, n = steps.shape
    own = np.zeros((m, n)) if bent is None else bent
    is_length = cap > 1.0
    turns = np.where(prismatic, 0.0, steps)
    before = np.cumsum(turns, axis=1) - turns  # turn of the revolute joints before j
    total, behind = np.zeros(m), np.zeros(m)
    ends = np.maximum(levers[:-1], levers[1:])
    for j in range(n - 1, -1, -1):
        d = steps[:, j]
        if prismatic[j]:
            if is_length:
                total += 2.0 * d * before[:, j] + own[:, j]
                behind += d
            continue
        lever = np.minimum(ends[:, j] + 0.5 * behind, cap)
        total += lever * d * (d + 2.0 * before[:, j]) + lever * own[:, j]
        behind += lever * d
    return total


def _peaks(
    a: NDArray[np.float64], b: NDArray[np.float64], most: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(m,) largest values along m segments of a norm with the values a and b (m,) at their ends.

    `most` (m,) bounds the second derivative, so the norm is at most
    (1 - s) a + s b + s (1 - s) most / 2, whose largest value this is. NaN comes out as NaN.
    """
    slope = np.abs(b - a)
    with np.errstate(divide="ignore", invalid="ignore"):
        inner = 0.5 * (a + b) + most / 8.0 + slope**2 / (2.0 * most)
    return np.where(2.0 * slope >= most, np.maximum(a, b), inner)


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


def replay(robot: Robot, cells: Cells, task: Task, walk: Walk, needed: NDArray[np.bool_]) -> Replay:
    """Check a walk: limits, tool point and cone at and between waypoints, and the cells it visits.

    Args:
        robot: the arm.
        cells: the cells.
        task: the task; its tolerance and cone are used exactly.
        walk: the motion.
        needed: (N,) cells that must be visited.

    Returns:
        What was measured, and the reason if the walk is refused. NaN anywhere refuses.
    """
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
    error, chord, curvature = matched.error, matched.chord, matched.derivative_bounds[:, 2]
    with np.errstate(invalid="ignore", over="ignore"):  # a fold: inf * 0 is NaN, and refused
        axis_bound = axis_bound + curvature * derivative_bound
        # The cone is to hold at the tool point's closest point on the surface, where the normal
        # differs from the one at its target.
        before = chord[:-1] + curvature * error[:-1]
        after = chord[1:] + curvature * error[1:]
    deviated = _peaks(error[:-1], error[1:], derivative_bound) + matched.deviations[:, 0]
    tilted = _peaks(before, after, axis_bound) + matched.deviations[:, 1]
    position = np.max(deviated, initial=np.max(error, initial=0.0))
    at_waypoints = chord + matched.centre_curvature * error if len(chord) == 1 else chord
    worst = np.max(tilted, initial=np.max(at_waypoints, initial=0.0))
    margin = float(np.min(np.minimum(walk.q - robot.lower, robot.upper - walk.q), initial=np.inf))
    certificate = Certificate(
        waypoints=len(walk.q),
        max_position_error=float(position),
        max_angle=angle_of(float(worst)),
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
