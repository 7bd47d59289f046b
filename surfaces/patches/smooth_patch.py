"""SmoothPatch: a patch with formulas in NumPy, or a search for closest points."""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array, Mask
from surfaces.patches.parametric import EDGE
from surfaces.patches.patch import Patch
from surfaces.surface import ClosestPoint, points_of


class LocalClosestPoints(NamedTuple):
    """Closest points to n points in the own frame of a patch, before the ranges are checked."""

    u: Array
    """(n,) rad, m or as the knots count."""
    v: Array
    """(n,) likewise."""
    height: Array
    """(n,) m, along the outward normal."""
    normal: Array
    """(n, 3) outward unit normals."""
    upright: Mask
    """(n,) True where the point lies on the normal there, to 1e-9 m."""


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class SmoothPatch(Patch):
    """A patch that gives points, normals and closest points in its own frame."""

    @abstractmethod
    def local_closest_points(self, points: Array) -> LocalClosestPoints:
        """Closest points to finite points (n, 3) m, given in the own frame."""

    def closest(self, points: ArrayLike) -> ClosestPoint:
        """The points of the surface closest to `points` (..., 3) m; see `ClosestPoint`.

        Where the normal at the closest point does not lead through the point, because it is on a
        border, `height` is the part of the distance along the normal there and `inside` is
        False. For a point that is not finite it is NaN and not inside.
        """
        points = points_of(points)
        flat = points.reshape(-1, 3)
        finite = np.isfinite(flat).all(axis=1)
        values = np.full((len(flat), 6), np.nan)
        inside = np.zeros(len(flat), dtype=bool)
        if finite.any():
            found = self.local_closest_points((flat[finite] - self.position) @ self.rotation)
            normal = found.normal @ self.rotation.T
            values[finite] = np.column_stack([found.u, found.v, found.height, normal])
            inside[finite] = found.upright & self._on_patch(found.u, found.v)
        return ClosestPoint.of_rows(points.shape[:-1], values, inside)

    def _on_patch(self, u: Array, v: Array) -> Mask:
        """True where the parameters lie in the patch's ranges."""
        (u0, u1), (v0, v1) = self.u_range, self.v_range
        within = (u >= u0 - EDGE) & (u <= u1 + EDGE) & (v >= v0 - EDGE) & (v <= v1 + EDGE)
        return np.asarray(within)


def wrapped(angle: Array, low: float, high: float) -> Array:
    """The values angle + 2 pi k (rad) that lie in low..high, or failing that, nearest to it."""
    turned = low + np.mod(angle - low, math.tau)
    back = (turned > high) & (turned - high > low - (turned - math.tau))
    return np.where(back, turned - math.tau, turned)


def azimuth(x: Array, y: Array, lowest: float, highest: float, size: float) -> Array:
    """Angle about z (rad) within a range; on the axis, where every angle is one, one inside it.

    `size` (m) is the length beside which a distance from the axis of 1e-9 is none.
    """
    angle = wrapped(np.arctan2(y, x), lowest, highest)
    on_axis = np.hypot(x, y) <= EDGE * size
    return np.where(on_axis, np.clip(angle, lowest, highest), angle)
