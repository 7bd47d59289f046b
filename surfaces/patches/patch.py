"""Patch: a part of a smooth surface that can be cut into cells.

A `ClosedFormPatch` has formulas in compiled loops, which make the paper's greedy search quick; any
other is a `SmoothPatch` (`smooth_patch.py`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from surfaces.patches.grid_cells import GridCells
from surfaces.patches.parametric import ParametricSurface
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
