"""Patch: a part of a smooth surface that can be cut into cells; and the two families of its kinds.

A `ClosedFormPatch` has formulas in compiled loops, which make the paper's greedy search quick; any
other is a `SmoothPatch`, with formulas in NumPy or a search for closest points.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array, Mask
from surfaces.patches.grid_cells import GridCells
from surfaces.patches.parametric import EDGE, ParametricSurface
from surfaces.surface import ClosestPoint, points_of

if TYPE_CHECKING:
    from surfaces.patches.closed_form_kernels import PatchKernel


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Patch(ParametricSurface):
    """A patch (u, v) -> point of a smooth surface."""

    def cells(self, nu: int, nv: int) -> GridCells:
        """Cut the patch into nu x nv E-cells of equal parameter steps.

        Raises:
            SurfaceError: nu or nv is not a whole number >= 0.

        Example:
            >>> from coverable import sphere
            >>> cells = sphere(1.0, polar_deg=(10, 90), azimuth_deg=(10, 180)).cells(9, 10)
            >>> len(cells), len(cells.pairs)
            (90, 305)
        """
        return GridCells.cut(self, nu, nv)


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class ClosedFormPatch(Patch):
    """A patch that `closed_form_kernels` knows."""

    code: ClassVar[int]
    """The number that `closed_form_kernels` dispatches on."""

    def closest(self, points: ArrayLike) -> ClosestPoint:
        """The points of the surface closest to `points` (..., 3) m; see `ClosestPoint`.

        Where several points are equally close (centre of a sphere, axis of a cylinder), one of
        them is taken, on the patch if there is one. For a point that is not finite it is NaN and
        not inside.
        """
        from surfaces.patches.closed_form_kernels import closest_points

        points = points_of(points)
        flat = np.array(points.reshape(-1, 3))
        values, inside = closest_points(self.patch_kernel(), flat)
        finite = np.isfinite(flat).all(axis=1)
        values[~finite], inside[~finite] = np.nan, False
        return ClosestPoint.of_rows(points.shape[:-1], values, inside)

    def patch_kernel(self, nu: int = 1, nv: int = 1) -> PatchKernel:
        """What compiled loops need of the surface, cut into nu x nv cells."""
        from surfaces.patches.closed_form_kernels import PatchKernel

        return PatchKernel(
            code=self.code,
            shape=(*map(float, self.lengths), 0.0, 0.0)[:2],
            rotation=tuple(self.rotation.ravel().tolist()),
            position=tuple(self.position.tolist()),
            side_sign=self.side_sign,
            low=(float(self.u_range[0]), float(self.v_range[0])),
            high=(float(self.u_range[1]), float(self.v_range[1])),
            closed=(bool(self.u_closed), bool(self.v_closed)),
            cells=(int(nu), int(nv)),
        )


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
