"""A patch of an ellipsoid with its axes along those of its own frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array
from surfaces.arguments import ORIGIN, Checks
from surfaces.patches.quadrature import rectangle_areas
from surfaces.patches.smooth_patch import LocalClosestPoints, SmoothPatch, azimuth
from surfaces.patches.sphere import unit_sphere
from surfaces.surface import Side

_MOST_STEPS = 200


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Ellipsoid(SmoothPatch):
    """(a sin u cos v, b sin u sin v, c cos u); outward is away from the centre.

    u and v are those of the unit sphere that is stretched into the ellipsoid: u the polar angle
    from +z, v the azimuth about z. On the stretched surface they are no longer the angles seen
    from the centre, but the poles and the equator stay what they are.
    """

    kind: ClassVar[str] = "ellipsoid"
    units: ClassVar[tuple[str, str]] = ("rad", "rad")
    u_polar: ClassVar[bool] = True
    v_angle: ClassVar[bool] = True
    semi_axes: tuple[float, float, float]
    """m, along x, y and z."""

    @property
    def lengths(self) -> tuple[float, ...]:
        """The semi-axes."""
        return self.semi_axes

    def local_point(self, u: Array, v: Array) -> Array:
        """The unit sphere's point, stretched."""
        return unit_sphere(u, v) * np.array(self.semi_axes)

    def local_normal(self, u: Array, v: Array) -> Array:
        """The gradient of (x/a)^2 + (y/b)^2 + (z/c)^2 over its length."""
        gradient = unit_sphere(u, v) / np.array(self.semi_axes)
        return gradient / np.linalg.norm(gradient, axis=-1, keepdims=True)

    def area(self, u0: ArrayLike, u1: ArrayLike, v0: ArrayLike, v1: ArrayLike) -> Array:
        """By quadrature of sin u |(b c x, c a y, a b z)|, (x, y, z) on the unit sphere."""
        a, b, c = self.semi_axes
        stretch = np.array([b * c, c * a, a * b])

        def element(u: Array, v: Array) -> Array:
            return np.asarray(np.sin(u) * np.linalg.norm(unit_sphere(u, v) * stretch, axis=-1))

        return rectangle_areas(element, u0, u1, v0, v1)

    def local_closest_points(self, points: Array) -> LocalClosestPoints:
        """From the one root that the normal equations leave; see `nearest_on_ellipsoid`.

        Where several points are equally close (on the planes inside that the normals of opposite
        sides meet in), the one on the patch's own side is taken, or else the one across.
        """
        axes = np.array(self.semi_axes)
        middle = unit_sphere(*(np.array(sum(ends) / 2.0) for ends in (self.u_range, self.v_range)))
        closest_point = nearest_on_ellipsoid(axes, points, middle)
        u, v = self._parameters(closest_point)
        off = np.flatnonzero(~self._on_patch(u, v))
        if len(off):
            across = nearest_on_ellipsoid(axes, points[off], -middle)
            u_across, v_across = self._parameters(across)
            better = self._on_patch(u_across, v_across)
            gap = np.linalg.norm(across - points[off], axis=1)
            before = np.linalg.norm(closest_point[off] - points[off], axis=1)
            better &= gap <= before * (1.0 + 1e-12)
            u[off[better]], v[off[better]] = u_across[better], v_across[better]
        normal = self.local_normal(u, v)
        height = np.einsum("ni,ni->n", points - self.local_point(u, v), normal)
        return LocalClosestPoints(u, v, height, normal, np.ones(len(u), dtype=bool))

    def _parameters(self, closest_point: Array) -> tuple[Array, Array]:
        x, y, z = (closest_point / np.array(self.semi_axes)).T
        return np.arctan2(np.hypot(x, y), z), azimuth(x, y, *self.v_range, size=1.0)


def nearest_on_ellipsoid(axes: Array, points: Array, toward: Array) -> Array:
    """The points (n, 3) of the ellipsoid closest to `points` (n, 3), both in its own frame.

    The closest point to p is x_i = e_i^2 p_i / (s + d_i) with d_i = e_i^2 - e^2, e the least
    semi-axis, and s the root of g(s) = |e_i p_i / (s + d_i)| - 1 on s > 0, where g falls.
    1 / |...| is concave and rises, so that Newton's method on it comes up to the root from the left
    without passing it (the secular equation of trust regions). Where g < 0 down to s = 0, p lies on
    the plane across the shortest axis, near the centre: then s = 0, and what is missing on x along
    that axis may have either sign.

    Args:
        axes: (3,) m, semi-axes.
        points: (n, 3) m.
        toward: (3,) which side to take where both are equally near.
    """
    shortest = float(axes.min())
    excess = (axes - shortest) * (axes + shortest)
    pull = axes * points
    s = np.maximum((np.abs(pull) - excess).max(axis=1), 0.0)
    for _ in range(_MOST_STEPS):
        norm, fall = _norm_and_fall(pull, s[:, None] + excess)
        # 1 / norm - 1 = 0; its slope is fall / norm^3, where fall = sum pull^2 / (s + d)^3.
        gain = np.divide(norm**2 * (norm - 1.0), fall, out=np.zeros_like(s), where=fall > 0.0)
        following = np.where(norm > 1.0, s + gain, s)
        if (following <= s).all():
            break
        s = np.maximum(following, s)
    below = s[:, None] + excess
    scaled = np.divide(pull, below, out=np.zeros_like(pull), where=below > 0.0)  # x_i / e_i
    free = np.where((below <= 0.0) & (pull == 0.0), np.where(toward < 0.0, -1.0, 1.0), 0.0)
    free *= np.abs(toward) + 1e-3
    missing = np.sqrt(np.maximum(1.0 - np.einsum("ni,ni->n", scaled, scaled), 0.0))
    length = np.linalg.norm(free, axis=1)
    share = np.divide(missing, length, out=np.zeros_like(missing), where=length > 0.0)
    return np.asarray(axes * (scaled + share[:, None] * free))


def _norm_and_fall(pull: Array, below: Array) -> tuple[Array, Array]:
    """|pull / below| and the sum of pull^2 / below^3; a zero over zero counts nothing."""
    ratio = np.divide(pull, below, out=np.zeros_like(pull), where=below > 0.0)
    third = np.divide(ratio**2, below, out=np.zeros_like(pull), where=below > 0.0)
    return np.linalg.norm(ratio, axis=1), third.sum(axis=1)


def ellipsoid(
    semi_axes: Sequence[float],
    polar_deg: Sequence[float],
    azimuth_deg: Sequence[float],
    side: Side = "inside",
    position: Sequence[float] = ORIGIN,
    rpy_deg: Sequence[float] = ORIGIN,
) -> Ellipsoid:
    """A patch of an ellipsoid with semi-axes along x, y and z of its own frame.

    Args:
        semi_axes: (3,) m.
        polar_deg: (low, high) angle from +z, within 0..180, on the unit sphere that is stretched.
        azimuth_deg: (low, high) angle about z on that sphere, at most a full turn apart.
        side: 'inside' or 'outside', where the tool works; see `plane` for position and rpy_deg.

    Raises:
        SurfaceError: one or more of the numbers do not describe a patch; all are named.

    Example:
        >>> tank = ellipsoid((1.0, 1.0, 0.5), polar_deg=(0, 90), azimuth_deg=(0, 360))
        >>> tank.closest([0.0, 0.0, 0.75]).height.item()
        0.25
    """
    check = Checks("ellipsoid")
    axes = check.vector("semi_axes", semi_axes, "metres")
    given = [1.0] * 3 if check.faults else axes.tolist()  # one fault of them is enough
    a, b, c = (check.positive(f"semi_axes[{k}]", e) for k, e in enumerate(given))
    longest = max(a, b, c)
    check.ratio("semi_axes", "each other", longest / min(a, b, c), "use a plane")
    made = Ellipsoid(
        u_range=check.polar("polar_deg", polar_deg),
        v_range=check.angles("azimuth_deg", azimuth_deg),
        semi_axes=(a, b, c),
        **check.pose(side, position, rpy_deg),
    )
    check.done()
    return made
