"""Patches whose closest points and curvatures have closed formulas, for compiled loops.

The paper's greedy search needs the closest point of every J-cell, so it works on these only.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from surfaces.patches.normal_bounds import CurvatureSlices, NormalBounds, normal_bounds
from surfaces.patches.patch import Patch
from surfaces.surface import ClosestPoint, points_of

if TYPE_CHECKING:
    from surfaces.patches.closed_form_kernels import PatchKernel


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class ClosedFormPatch(Patch):
    """A patch that `closed_form_kernels` knows."""

    code: ClassVar[int]
    """The number that `closed_form_kernels` dispatches on."""

    @abstractmethod
    def curvature_slices(self, margin: float) -> CurvatureSlices:
        """Bounds on the curvatures of the patch, widened by `margin` where it has open ends."""

    def closest(self, points: ArrayLike) -> ClosestPoint:
        """The points of the surface closest to `points` (..., 3) m; see `ClosestPoint`.

        Where several points are equally close (centre of a sphere, axis of a cylinder), one of
        them is taken, on the patch if there is one.

        Raises:
            ValueError: `points` does not end in an axis of length 3.
        """
        from surfaces.patches.closed_form_kernels import closest_points

        points = points_of(points)
        shape = points.shape[:-1]
        values, inside = closest_points(self.patch_kernel(), np.array(points.reshape(-1, 3)))
        return ClosestPoint(
            u=values[:, 0].reshape(shape),
            v=values[:, 1].reshape(shape),
            height=values[:, 2].reshape(shape),
            normal=values[:, 3:].reshape(*shape, 3),
            inside=inside.reshape(shape),
        )

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

    def bounds(self, height: float, slack: float = 0.0) -> NormalBounds:
        """Bounds on how fast the normal turns near the parallel surface at a signed height.

        They hold at every point whose closest point lies on the patch and whose height differs from
        `height` by at most `slack` (m); see `normal_bounds`.
        """
        return normal_bounds(self.curvature_slices(abs(slack)), height, abs(slack))
