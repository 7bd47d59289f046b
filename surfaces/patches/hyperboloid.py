"""A patch of a hyperboloid of one sheet about z of its own frame: Table III of the paper.

Its eqs. (14) to (16), but for the standoff d: as on every surface here it is a distance, along the
normal, where eq. (14) takes it off the radius.
"""

from __future__ import annotations

import math
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
class Hyperboloid(ClosedFormPatch):
    """One sheet, r(z) = waist sqrt(1 + (z / flare)^2): u is the angle about z, v = z.

    With s = waist/flare, r^2 = waist^2 + s^2 z^2, r r' = s^2 z and
    g = r sqrt(1 + r'^2) = sqrt(waist^2 + s^2 (1 + s^2) z^2): the area element is g du dz, the
    curvatures are 1/g around the axis and -s^2 waist^2 / g^3 along the meridian.
    """

    kind: ClassVar[str] = "hyperboloid"
    units: ClassVar[tuple[str, str]] = ("rad", "m")
    code: ClassVar[int] = 3
    u_angle: ClassVar[bool] = True
    waist: float
    """m, radius at z = 0."""
    flare: float
    """m, height at which the radius is sqrt(2) waist."""

    def _radius(self, z: Array) -> Array:
        return np.hypot(self.waist, z * (self.waist / self.flare))

    def local_point(self, u: Array, v: Array) -> Array:
        """(r cos u, r sin u, z)."""
        r = self._radius(v)
        return np.stack([r * np.cos(u), r * np.sin(u), v], axis=-1)

    def local_normal(self, u: Array, v: Array) -> Array:
        """(cos u, sin u, -r') over its length: away from the axis."""
        rise = (self.waist / self.flare) ** 2 * v / self._radius(v)
        length = np.hypot(1.0, rise)
        return np.stack([np.cos(u) / length, np.sin(u) / length, -rise / length], axis=-1)

    def local_enclosures(self, u: Enclosure, v: Enclosure) -> tuple[Enclosure, Enclosure]:
        """Of normals as (r cos u, r sin u, -r r') over its length: r' alone is known less well."""
        slope = self.waist / self.flare

        def normal(u: Array, v: Array) -> Array:
            length = np.hypot(self.waist, v * (slope * math.hypot(1.0, slope)))
            point = self.local_point(u, v)
            return point * np.array([1.0, 1.0, -(slope**2)]) / length[..., None]

        return self._enclosed(self.local_point, u, v), self._enclosed(normal, u, v)

    def area(self, u0: ArrayLike, u1: ArrayLike, v0: ArrayLike, v1: ArrayLike) -> Array:
        """(u1 - u0) times the integral of g, z (g + waist asinh(x) / x) / 2, x = b z / waist."""
        u0, u1, v0, v1 = (np.asarray(value, float) for value in (u0, u1, v0, v1))
        slope = self.waist / self.flare
        b = slope * math.sqrt(1.0 + slope**2)

        def integral(z: Array) -> Array:
            x = b * z / self.waist
            ratio = np.divide(np.arcsinh(x), x, out=np.ones_like(x), where=x != 0.0)
            return z * self.waist * (np.hypot(1.0, x) + ratio) / 2.0

        return np.asarray((u1 - u0) * (integral(v1) - integral(v0)))


def hyperboloid(
    waist: float,
    flare: float,
    angle_deg: Sequence[float],
    height: Sequence[float],
    side: Side = "inside",
    position: Sequence[float] = ORIGIN,
    rpy_deg: Sequence[float] = ORIGIN,
) -> Hyperboloid:
    """A patch of a hyperboloid of one sheet, r(z) = waist sqrt(1 + (z / flare)^2).

    Args:
        waist: m, radius at z = 0.
        flare: m, height at which the radius is sqrt(2) waist.
        angle_deg: (low, high) angle about z, at most a full turn apart.
        height: (low, high) along z, m.
        side: 'inside' or 'outside', where the tool works; see `plane` for position and rpy_deg.

    Raises:
        SurfaceError: one or more of the numbers do not describe a patch; all are named.
    """
    check = Checks("hyperboloid")
    waist, flare = check.positive("waist", waist), check.positive("flare", flare)
    check.ratio(
        "flare", "the radius of the waist", waist / flare, "beyond that use a cylinder or a plane"
    )
    made = Hyperboloid(
        u_range=check.angles("angle_deg", angle_deg),
        v_range=check.interval("height", height, "metres"),
        waist=waist,
        flare=flare,
        **check.pose(side, position, rpy_deg),
    )
    check.done()
    return made
