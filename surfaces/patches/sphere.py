"""Patches of spheres about the origin of their frame: Table III, eqs. (9) to (11) of the paper."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array
from surfaces.arguments import ORIGIN, Checks
from surfaces.enclosures import Enclosure
from surfaces.patches.patch import ClosedFormPatch
from surfaces.surface import Side


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Sphere(ClosedFormPatch):
    """u is the polar angle from +z, v the azimuth about z."""

    kind: ClassVar[str] = "sphere"
    units: ClassVar[tuple[str, str]] = ("rad", "rad")
    code: ClassVar[int] = 1
    u_polar: ClassVar[bool] = True
    v_angle: ClassVar[bool] = True
    radius: float
    """m."""

    def local_point(self, u: Array, v: Array) -> Array:
        """Radius times normal."""
        return self.radius * self.local_normal(u, v)

    def local_normal(self, u: Array, v: Array) -> Array:
        """Away from the centre."""
        return unit_sphere(u, v)

    def local_point_and_normal(self, u: Array, v: Array) -> tuple[Array, Array]:
        """The sines and cosines once."""
        normal = unit_sphere(u, v)
        return self.radius * normal, normal

    def local_enclosures(self, u: Enclosure, v: Enclosure) -> tuple[Enclosure, Enclosure]:
        """Likewise."""
        normal = self._enclosed(self.local_normal, u, v)
        return self.radius * normal, normal

    def area(self, u0: ArrayLike, u1: ArrayLike, v0: ArrayLike, v1: ArrayLike) -> Array:
        """R^2 (cos u0 - cos u1) (v1 - v0), the difference written without cancellation."""
        u0, u1, v0, v1 = (np.asarray(value, float) for value in (u0, u1, v0, v1))
        drop = 2.0 * np.sin((u0 + u1) / 2.0) * np.sin((u1 - u0) / 2.0)
        return np.asarray(self.radius**2 * drop * (v1 - v0))


def unit_sphere(u: Array, v: Array) -> Array:
    """Points (..., 3) at polar angles u from +z and azimuths v about z, rad."""
    s = np.sin(u)
    return np.stack([s * np.cos(v), s * np.sin(v), np.cos(u)], axis=-1)


def sphere(
    radius: float,
    polar_deg: Sequence[float],
    azimuth_deg: Sequence[float],
    side: Side = "inside",
    position: Sequence[float] = ORIGIN,
    rpy_deg: Sequence[float] = ORIGIN,
) -> Sphere:
    """A patch of a sphere.

    Args:
        radius: m.
        polar_deg: (low, high) angle from +z, within 0..180.
        azimuth_deg: (low, high) angle about z, at most a full turn apart.
        side: 'inside' or 'outside', where the tool works; see `plane` for position and rpy_deg.

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
        **check.pose(side, position, rpy_deg),
    )
    check.done()
    return made
