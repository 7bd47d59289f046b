"""Jacobians of tool point and axis at many configurations, from Pinocchio's twists.

With the column z_j x (p - o_j) for joint j, its length is the lever arm r_j; the column z_j x a of
the axis has the length s_j, a sine. A joint that slides has z_j in place of the first, and zero.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from robots import Kinematics, Robot

Array = NDArray[np.float64]


class Jacobians(NamedTuple):
    """Of k configurations."""

    points: Array
    """(k, 3) m, tool points."""
    point: Array
    """(k, 3, n) derivatives of the tool point."""
    axis: Array
    """(k, 3, n) derivatives of the approach axis."""

    def of(self, rows: NDArray[np.int64] | NDArray[np.bool_]) -> Jacobians:
        """Some of them."""
        return Jacobians(self.points[rows], self.point[rows], self.axis[rows])

    @property
    def levers(self) -> Array:
        """(k, n) m; 1 of a joint that slides."""
        return np.asarray(np.linalg.norm(self.point, axis=1))

    @property
    def sines(self) -> Array:
        """(k, n); 0 of a joint that slides."""
        return np.asarray(np.linalg.norm(self.axis, axis=1))


def jacobians(robot: Robot, q: Array) -> Jacobians:
    """Of configurations q (k, n)."""
    points, axes, twists = Kinematics(robot).tools_and_twists(q)
    linear, angular = np.split(twists, 2, axis=1)
    moved = linear + np.cross(angular, points[:, :, None], axis=1)
    return Jacobians(points, moved, np.cross(angular, axes[:, :, None], axis=1))


def largest_between(
    steps: Array, prismatic: NDArray[np.bool_], first: Array, last: Array, cap: float
) -> Array:
    """(m, n) bounds of r_j (or s_j) along m straight segments, from those at their ends.

    The lever of joint j changes by no more than the tool point moves when the joints behind j do,
    and no place is further than half a segment from one of its ends.

    Args:
        steps: (m, n) absolute joint changes.
        prismatic: (n,) which joints slide.
        first, last: (m, n) levers at the ends.
        cap: what none exceeds: inf for lengths, 1 for sines.
    """
    found = np.maximum(first, last)
    behind = np.zeros(len(steps))
    for j in range(steps.shape[1] - 1, -1, -1):
        if prismatic[j]:
            behind = behind + (steps[:, j] if cap > 1.0 else 0.0)
            continue
        found[:, j] = np.minimum(found[:, j] + 0.5 * behind, cap)
        behind = behind + found[:, j] * steps[:, j]
    return found
