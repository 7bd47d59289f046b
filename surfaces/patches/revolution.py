"""A surface of revolution: a smooth profile turned about the z axis of its own frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array
from coverable.errors import Fault
from surfaces.arguments import ORIGIN, Checks, metres
from surfaces.patches.parametric import EDGE
from surfaces.patches.profile import Profile
from surfaces.patches.quadrature import rectangle_areas
from surfaces.patches.smooth_patch import LocalClosestPoints, SmoothPatch, azimuth
from surfaces.surface import Side

MOST_POINTS = 1000


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Revolution(SmoothPatch):
    """u is the chord length along the profile, v the angle about z; outward is along S_u x S_v.

    So outward is to the left of the profile as u walks it, with r to the right and z up: away from
    the axis where u runs down, as a sphere's polar angle does.
    """

    kind: ClassVar[str] = "revolution"
    units: ClassVar[tuple[str, str]] = ("m", "rad")
    v_angle: ClassVar[bool] = True
    profile: Profile

    @property
    def lengths(self) -> tuple[float, ...]:
        """Radius and height at the profile's ends, as they were listed: r, z, r, z."""
        return (*self.profile.points[-1].tolist(), *self.profile.points[0].tolist())

    @property
    def poles(self) -> tuple[bool, bool]:
        """A row closes around an end of the profile on the axis where the angle is a full turn."""
        if not self.v_closed:
            return (False, False)
        first, last = self.profile.poles
        low, high = self.u_range
        return (first and low <= EDGE, last and high >= self.profile.length - EDGE)

    def local_point(self, u: Array, v: Array) -> Array:
        """(r cos v, r sin v, z)."""
        r, z = self.profile.curve(u)
        return np.stack([r * np.cos(v), r * np.sin(v), z], axis=-1)

    def local_normal(self, u: Array, v: Array) -> Array:
        """(-z' cos v, -z' sin v, r') over its length."""
        out, up = _normal(self.profile, u)
        return np.stack([out * np.cos(v), out * np.sin(v), up], axis=-1)

    def area(self, u0: ArrayLike, u1: ArrayLike, v0: ArrayLike, v1: ArrayLike) -> Array:
        """(v1 - v0) times the integral of r times the profile's arc length."""

        def element(u: Array, v: Array) -> Array:
            return self.profile.at(u)[..., 0] * np.linalg.norm(self.profile.at(u, 1), axis=-1)

        around = rectangle_areas(element, u0, u1, 0.0, 1.0, u_breaks=self.profile.knots)
        return np.asarray((np.asarray(v1, float) - np.asarray(v0, float)) * around)

    @property
    def breaks(self) -> tuple[Array, Array]:
        """The knots of the profile."""
        return self.profile.knots[1:-1], np.empty(0)

    @property
    def part_roots(self) -> tuple[Array, Array]:
        """Closest points never lie beyond the profile's ends."""
        low, high = super(Revolution, self).part_roots
        low[:, 0], high[:, 0] = self.u_range
        return low, high

    def local_closest_points(self, points: Array) -> LocalClosestPoints:
        """The nearest point of the profile, turned to the point's azimuth."""
        x, y, z = points.T
        flat = np.column_stack([np.hypot(x, y), z])
        u = self.profile.search.nearest(flat)[:, 0]
        v = azimuth(x, y, *self.v_range, size=1.0)
        out, up = _normal(self.profile, u)
        away = flat - self.profile.at(u)
        height = away[:, 0] * out + away[:, 1] * up
        upright = np.abs(away[:, 1] * out - away[:, 0] * up) <= EDGE
        return LocalClosestPoints(u, v, height, self.local_normal(u, v), upright)


def _normal(profile: Profile, u: Array) -> tuple[Array, Array]:
    """The part of the unit normal away from the axis, and along it."""
    dr, dz = profile.curve(u, 1)
    speed = np.hypot(dr, dz)
    return -dz / speed, dr / speed


def revolution(
    profile: Any,
    angle_deg: Sequence[float],
    side: Side = "inside",
    position: Sequence[float] = ORIGIN,
    rpy_deg: Sequence[float] = ORIGIN,
) -> Revolution:
    """The surface that a smooth curve through given points sweeps when turned about z.

    The curve is a cubic spline over the chord length. Its ends may lie on the axis (r = 0), where
    it leaves the axis at a right angle. Whether it crosses itself is looked for on 16 chords
    between neighbouring points.

    Args:
        profile: (n, 2) m, points (r, z), 2 to 1000 of them, r > 0 but at the ends. The outward side
            is to the right as the list is walked, with r to the right and z up: away from the axis
            if the points are listed upwards. The parameter u runs from the last point to the first.
        angle_deg: (low, high) angle about z, at most a full turn apart.
        side: 'inside' or 'outside', where the tool works; see `plane` for position and rpy_deg.

    Raises:
        SurfaceError: one or more of the arguments do not describe a patch; all are named.

    Example:
        >>> vase = revolution([(0.2, 0.0), (0.3, 0.2), (0.1, 0.5)], angle_deg=(0, 360))
        >>> vase.closest([0.3, 0.0, 0.2]).inside.item()
        True
    """
    check = Checks("revolution")
    expected = f"points (r, z) in metres, 2 to {MOST_POINTS} of them"
    points = metres("profile", profile, (None, 2), expected, 2 * MOST_POINTS, check.faults)
    curve = Profile(np.array([[1.0, 0.0], [1.0, 1.0]]) if points is None else points)
    if len(curve.points) < 2:
        check.keep(Fault("profile", f"got {len(curve.points)}", expected=f"must hold {expected}"))
    elif not check.faults:
        check.faults += curve.faults()
    made = Revolution(
        u_range=(0.0, curve.length),
        v_range=check.angles("angle_deg", angle_deg),
        profile=Profile(curve.points[::-1]),
        **check.pose(side, position, rpy_deg),
    )
    check.done()
    return made
