"""Patches of ring tori about the z axis of their own frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array
from surfaces.arguments import ORIGIN, Checks
from surfaces.patches.smooth_patch import LocalClosestPoints, SmoothPatch, azimuth
from surfaces.surface import Side


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Torus(SmoothPatch):
    """u is the angle about z, v the angle about the tube; outward is out of the tube.

    v is 0 at the outermost circle and 90 degrees at the top.
    """

    kind: ClassVar[str] = "torus"
    units: ClassVar[tuple[str, str]] = ("rad", "rad")
    u_angle: ClassVar[bool] = True
    v_angle: ClassVar[bool] = True
    ring: float
    """m, radius of the circle in the middle of the tube."""
    tube: float
    """m, radius of the tube, less than `ring`."""

    def local_point(self, u: Array, v: Array) -> Array:
        """(r cos u, r sin u, tube sin v), r = ring + tube cos v."""
        r = self.ring + self.tube * np.cos(v)
        return np.stack([r * np.cos(u), r * np.sin(u), self.tube * np.sin(v)], axis=-1)

    def local_normal(self, u: Array, v: Array) -> Array:
        """Away from the circle in the middle of the tube."""
        c = np.cos(v)
        return np.stack([c * np.cos(u), c * np.sin(u), np.sin(v)], axis=-1)

    def area(self, u0: ArrayLike, u1: ArrayLike, v0: ArrayLike, v1: ArrayLike) -> Array:
        """(u1 - u0) tube (ring (v1 - v0) + tube (sin v1 - sin v0))."""
        u0, u1, v0, v1 = (np.asarray(value, float) for value in (u0, u1, v0, v1))
        rise = 2.0 * np.cos((v0 + v1) / 2.0) * np.sin((v1 - v0) / 2.0)
        return np.asarray((u1 - u0) * self.tube * (self.ring * (v1 - v0) + self.tube * rise))

    def local_closest_points(self, points: Array) -> LocalClosestPoints:
        """Along the line from the middle of the tube at the point's azimuth."""
        x, y, z = points.T
        u = azimuth(x, y, *self.u_range, size=self.ring)
        beyond = np.hypot(x, y) - self.ring
        v = azimuth(beyond, z, *self.v_range, size=self.tube)
        height = np.hypot(beyond, z) - self.tube
        return LocalClosestPoints(
            u, v, height, self.local_normal(u, v), np.ones(len(u), dtype=bool)
        )


def torus(
    ring: float,
    tube: float,
    u_deg: Sequence[float],
    v_deg: Sequence[float],
    side: Side = "inside",
    position: Sequence[float] = ORIGIN,
    rpy_deg: Sequence[float] = ORIGIN,
) -> Torus:
    """A patch of a torus about the z axis of its own frame.

    Args:
        ring: m, radius of the circle in the middle of the tube.
        tube: m, radius of the tube, less than `ring`.
        u_deg: (low, high) angle about z, at most a full turn apart.
        v_deg: (low, high) angle about the tube, at most a full turn apart: 0 is the outermost
            circle, 90 the top, 180 the innermost.
        side: 'inside' for a tool in the tube, 'outside' for one around it.
        position: see `plane`, as for rpy_deg.

    Raises:
        SurfaceError: one or more of the numbers do not describe a patch; all are named.

    Example:
        >>> bend = torus(0.5, 0.125, u_deg=(0, 90), v_deg=(-180, 180), side="outside")
        >>> bend.closest([0.75, 0.0, 0.0]).height.item()
        0.125
    """
    check = Checks("torus")
    ring, tube = check.positive("ring", ring), check.positive("tube", tube)
    if not check.faults:
        check.ratio("tube", "the radius of the ring", ring / tube, "beyond that use a cylinder")
        if not tube < ring:
            expected = f"must be less than ring ({ring:g} metres), or the torus cuts through itself"
            check.wrong("tube", tube, expected)
    made = Torus(
        u_range=check.angles("u_deg", u_deg),
        v_range=check.angles("v_deg", v_deg),
        ring=ring,
        tube=tube,
        **check.pose(side, position, rpy_deg),
    )
    check.done()
    return made
