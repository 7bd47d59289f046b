"""sphere."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfaces.arguments import Checks
from surfaces.patches.closed_form import ClosedFormPatch
from surfaces.patches.normal_bounds import CurvatureSlices
from surfaces.surface import Side

Array = NDArray[np.float64]
Pair = Sequence[float]

_ORIGIN = (0.0, 0.0, 0.0)
_SLICES = 512  # over which the hyperboloid's curvatures are bounded


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Sphere(ClosedFormPatch):
    """u is the polar angle from +z, v the azimuth about z."""

    kind: ClassVar[str] = "sphere"
    units: ClassVar[tuple[str, str]] = ("rad", "rad")
    code: ClassVar[int] = 1
    u_angle: ClassVar[bool] = False
    v_angle: ClassVar[bool] = True
    radius: float
    """m."""

    @property
    def lengths(self) -> tuple[float, ...]:
        """The radius."""
        return (self.radius,)

    @property
    def poles(self) -> tuple[bool, bool]:
        """A row closes around a pole where the patch reaches it and the azimuth is a full turn."""
        if not self.v_closed:
            return (False, False)
        return (self.u_range[0] <= 1e-9, self.u_range[1] >= math.pi - 1e-9)

    def local_point(self, u: Array, v: Array) -> Array:
        """Radius times normal."""
        return self.radius * self.local_normal(u, v)

    def local_normal(self, u: Array, v: Array) -> Array:
        """Away from the centre."""
        s = np.sin(u)
        return np.stack([s * np.cos(v), s * np.sin(v), np.cos(u)], axis=-1)

    def area(self, u0: ArrayLike, u1: ArrayLike, v0: ArrayLike, v1: ArrayLike) -> Array:
        """R^2 (cos u0 - cos u1) (v1 - v0), the difference written without cancellation."""
        u0, u1, v0, v1 = (np.asarray(value, float) for value in (u0, u1, v0, v1))
        drop = 2.0 * np.sin((u0 + u1) / 2.0) * np.sin((u1 - u0) / 2.0)
        return np.asarray(self.radius**2 * drop * (v1 - v0))

    def curvature_slices(self, margin: float) -> CurvatureSlices:
        """1/R both ways."""
        return CurvatureSlices.constant(1.0 / self.radius, 1.0 / self.radius)


def sphere(
    radius: float,
    polar_deg: Pair,
    azimuth_deg: Pair,
    side: Side = "inside",
    position: Pair = _ORIGIN,
    rpy_deg: Pair = _ORIGIN,
) -> Sphere:
    """A patch of a sphere.

    Args:
        radius: m.
        polar_deg: (low, high) angle from +z, within 0..180.
        azimuth_deg: (low, high) angle about z, at most a full turn apart.
        side: 'inside' or 'outside', where the tool works.
        position: (3,) m, the centre in the root frame.
        rpy_deg: (3,) fixed-axis roll, pitch, yaw of the surface's frame.

    Raises:
        SurfaceError: one or more of the numbers do not describe a patch; all are named.

    Example:
        >>> dome = sphere(1.0, polar_deg=(10, 90), azimuth_deg=(10, 180))
        >>> dome.closest([0.0, 0.5, 0.0]).height.item()
        -0.5
    """
    check = Checks("sphere")
    made = Sphere(
        u_range=check.polar("polar_deg", polar_deg),
        v_range=check.angles("azimuth_deg", azimuth_deg),
        radius=check.positive("radius", radius),
        side=check.side(side),
        position=check.vector("position", position, "metres"),
        rotation=check.rotation("rpy_deg", rpy_deg),
    )
    check.done()
    return made
