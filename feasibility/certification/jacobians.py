"""Tool points, tool axes and their Jacobians at many configurations, from Pinocchio's twists.

Column j of the tool point's Jacobian, z_j x (p - o_j), is as long as the lever arm r_j; that of the
axis, z_j x a, has the length s_j, a sine. A joint that slides has z_j in place of the first, and 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coverable.arrays import Array
from feasibility.certification.bisection import Rows
from robots.kinematics import Kinematics


@dataclass(frozen=True, eq=False, slots=True)
class Jacobians(Rows):
    """Of m configurations."""

    points: Array
    """(m, 3) m, tool points."""
    axes: Array
    """(m, 3) approach axes."""
    point: Array
    """(m, 3, n) derivatives of the tool point."""
    axis: Array
    """(m, 3, n) derivatives of the approach axis."""

    @property
    def levers(self) -> Array:
        """(m, n) m, r_j; 1 for a joint that slides."""
        return lengths(self.point)

    @property
    def sines(self) -> Array:
        """(m, n) s_j; 0 for a joint that slides."""
        return lengths(self.axis)


def jacobians(kinematics: Kinematics, q: Array) -> Jacobians:
    """Of configurations q (m, n), rad or m."""
    points, axes, twists = kinematics.tools_and_twists(q)
    moving = np.ascontiguousarray(twists.transpose(1, 0, 2)).transpose(1, 0, 2)  # by coordinate
    linear, angular = moving[:, :3], moving[:, 3:]
    return Jacobians(points, axes, linear + cross(angular, points), cross(angular, axes))


def cross(a: Array, b: Array) -> Array:
    """(m, 3, n) products of n vectors (m, 3, n) with one (m, 3); `np.cross` is slower."""
    x, y, z = b.T[:, :, None]
    u, v, w = a[:, 0], a[:, 1], a[:, 2]
    return np.stack([v * z - w * y, w * x - u * z, u * y - v * x]).transpose(1, 0, 2)


def lengths(a: Array) -> Array:
    """(m, n) lengths of vectors (m, 3, n); numpy's own sums are slow over three numbers."""
    x, y, z = a[:, 0], a[:, 1], a[:, 2]
    return np.sqrt(x * x + y * y + z * z)


def smallest_singular(at: Jacobians, scale: float) -> Array:
    """(k,) the smallest singular value that counts: of two directions of the axis, not three."""
    both = np.concatenate([at.point / scale, at.axis], axis=1)
    values = np.linalg.svd(both, compute_uv=False)
    return np.asarray(values[:, min(both.shape[2], 5) - 1])
