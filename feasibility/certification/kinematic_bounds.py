"""Bounds between samples of a joint motion, from Pinocchio's placements and Jacobians.

The bound D is derived in `feasibility.roadmap.motions.segment_bound`; here it is evaluated again
from Pinocchio's Jacobian: the linear part of column j, moved to the tool point, has the length r_j
(the lever arm), and |z_j x a| = s_j for its angular part z_j.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robots import Kinematics, Robot

BLOCK = 4096  # configurations at once, to bound the memory


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
    m, kinematics = len(q), Kinematics(robot)
    found = Placements(
        np.empty((m, 3)), np.empty((m, 3)), np.empty((m, robot.n)), np.empty((m, robot.n))
    )
    for first in range(0, m, BLOCK):
        some = slice(first, first + BLOCK)
        points, axes, twists = kinematics.tools_and_twists(q[some])
        moving = np.ascontiguousarray(twists.transpose(1, 0, 2))  # by coordinate, (6, k, n)
        linear, angular = moving[:3], moving[3:]
        found.points[some], found.axes[some] = points, axes
        found.levers[some] = _length(linear + _cross(angular, points))
        found.sines[some] = _length(_cross(angular, axes))
    return found


def _cross(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3, m, n) the cross products of vectors (3, m, n) with one (m, 3) for each row."""
    x, y, z = b.T[:, :, None]
    return np.stack([a[1] * z - a[2] * y, a[2] * x - a[0] * z, a[0] * y - a[1] * x])


def _length(a: NDArray[np.float64]) -> NDArray[np.float64]:
    """(m, n) lengths of vectors (3, m, n); numpy's own sums are slow over three numbers."""
    return np.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


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


def peaks(
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
