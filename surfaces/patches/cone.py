"""Patches of cones about the z axis of their own frame."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array
from coverable.errors import Fault
from surfaces.arguments import LARGEST_RATIO, ORIGIN, Checks
from surfaces.patches.smooth_patch import LocalClosestPoints, SmoothPatch, azimuth
from surfaces.surface import Side


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Cone(SmoothPatch):
    """r(z) = radius + slope z: u is the angle about z, v = z; outward is away from the axis."""

    kind: ClassVar[str] = "cone"
    units: ClassVar[tuple[str, str]] = ("rad", "m")
    u_angle: ClassVar[bool] = True
    radius: float
    """m, at z = 0."""
    slope: float
    """dr/dz, of either sign."""

    def local_point(self, u: Array, v: Array) -> Array:
        """(r cos u, r sin u, z)."""
        r = self.radius + self.slope * v
        return np.stack([r * np.cos(u), r * np.sin(u), v], axis=-1)

    def local_normal(self, u: Array, v: Array) -> Array:
        """(cos u, sin u, -slope) over its length."""
        length = math.hypot(1.0, self.slope)
        flat = np.full_like(u, -self.slope / length)
        return np.stack([np.cos(u) / length, np.sin(u) / length, flat], axis=-1)

    def area(self, u0: ArrayLike, u1: ArrayLike, v0: ArrayLike, v1: ArrayLike) -> Array:
        """(u1 - u0) times the slant length times the radius at mid height."""
        u0, u1, v0, v1 = (np.asarray(value, float) for value in (u0, u1, v0, v1))
        middle = self.radius + self.slope * (v0 + v1) / 2.0
        return np.asarray((u1 - u0) * (v1 - v0) * math.hypot(1.0, self.slope) * middle)

    def local_closest_points(self, points: Array) -> LocalClosestPoints:
        """Perpendicular to the straight meridian at the point's azimuth.

        Past the apex the closest point is the apex, which no patch holds; `height` is then the
        distance from the meridian's line.
        """
        x, y, z = points.T
        rho = np.hypot(x, y)
        length = math.hypot(1.0, self.slope)
        v = (z + self.slope * (rho - self.radius)) / length**2
        past = self.radius + self.slope * v <= 0.0
        if past.any():
            v = np.where(past, -self.radius / self.slope, v)
        u = azimuth(x, y, *self.u_range, size=self.radius)
        height = (rho - self.radius - self.slope * z) / length
        return LocalClosestPoints(u, v, height, self.local_normal(u, v), ~past)


def cone(
    radius: float,
    slope: float,
    angle_deg: Sequence[float],
    height: Sequence[float],
    side: Side = "inside",
    position: Sequence[float] = ORIGIN,
    rpy_deg: Sequence[float] = ORIGIN,
) -> Cone:
    """A patch of a cone, r(z) = radius + slope z, with its apex left out.

    Args:
        radius: m, at z = 0 of the surface's frame.
        slope: how fast the radius grows with z: the tangent of half the angle at the apex.
        angle_deg: (low, high) angle about z, at most a full turn apart.
        height: (low, high) along z, m; the radius stays above 0 there.
        side: 'inside' or 'outside', where the tool works; see `plane` for position and rpy_deg.

    Raises:
        SurfaceError: one or more of the numbers do not describe a patch; all are named.

    Example:
        >>> funnel = cone(0.2, slope=1.0, angle_deg=(0, 360), height=(0.0, 0.3))
        >>> funnel.closest([0.4, 0.0, 0.2]).height.item()
        0.0
    """
    check = Checks("cone")
    radius = check.positive("radius", radius)
    low, high = check.interval("height", height, "metres")
    steep = check.number(
        "slope",
        slope,
        f"must be a number in {-LARGEST_RATIO:g} .. {LARGEST_RATIO:g} (metres of radius for a "
        "metre of height)",
        -LARGEST_RATIO,
        LARGEST_RATIO,
    )
    ends = (radius + steep * low, radius + steep * high)
    if not check.faults and not min(ends) * LARGEST_RATIO > max(ends):
        got = f"got {height!r}, where the radius runs from {ends[0]:g} to {ends[1]:g}"
        apex = f"must end before the apex at z = {-radius / steep:g} (metres), where no normal is"
        check.keep(Fault("height", got, expected=apex))
    made = Cone(
        u_range=check.angles("angle_deg", angle_deg),
        v_range=(low, high),
        radius=radius,
        slope=steep,
        **check.pose(side, position, rpy_deg),
    )
    check.done()
    return made
