"""The formulas of sphere, cylinder, hyperboloid and plane, each in its own frame."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfaces.bounds import CurvatureSlices
from surfaces.charted import ChartedPatch

Array = NDArray[np.float64]

_SLICES = 512  # over which the hyperboloid's curvatures are bounded


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Sphere(ChartedPatch):
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


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Cylinder(ChartedPatch):
    """u is the angle about z, v the height along z."""

    kind: ClassVar[str] = "cylinder"
    units: ClassVar[tuple[str, str]] = ("rad", "m")
    code: ClassVar[int] = 2
    u_angle: ClassVar[bool] = True
    v_angle: ClassVar[bool] = False
    radius: float
    """m."""

    @property
    def lengths(self) -> tuple[float, ...]:
        """The radius."""
        return (self.radius,)

    def local_point(self, u: Array, v: Array) -> Array:
        """(R cos u, R sin u, v)."""
        return np.stack([self.radius * np.cos(u), self.radius * np.sin(u), v], axis=-1)

    def local_normal(self, u: Array, v: Array) -> Array:
        """Away from the axis."""
        return np.stack([np.cos(u), np.sin(u), np.zeros_like(u)], axis=-1)

    def area(self, u0: ArrayLike, u1: ArrayLike, v0: ArrayLike, v1: ArrayLike) -> Array:
        """R (u1 - u0) (v1 - v0)."""
        u0, u1, v0, v1 = (np.asarray(value, float) for value in (u0, u1, v0, v1))
        return np.asarray(self.radius * (u1 - u0) * (v1 - v0))

    def curvature_slices(self, margin: float) -> CurvatureSlices:
        """Straight along z, 1/R around it."""
        return CurvatureSlices.constant(0.0, 1.0 / self.radius)


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Hyperboloid(ChartedPatch):
    """One sheet, r(z) = waist sqrt(1 + (z / flare)^2): u is the angle about z, v = z.

    With s = waist/flare, r^2 = waist^2 + s^2 z^2, r r' = s^2 z and
    g = r sqrt(1 + r'^2) = sqrt(waist^2 + s^2 (1 + s^2) z^2): the area element is g du dz, the
    curvatures are 1/g around the axis and -s^2 waist^2 / g^3 along the meridian.
    """

    kind: ClassVar[str] = "hyperboloid"
    units: ClassVar[tuple[str, str]] = ("rad", "m")
    code: ClassVar[int] = 3
    u_angle: ClassVar[bool] = True
    v_angle: ClassVar[bool] = False
    waist: float
    """m, radius at z = 0."""
    flare: float
    """m, height at which the radius is sqrt(2) waist."""

    @property
    def lengths(self) -> tuple[float, ...]:
        """Waist and flare."""
        return (self.waist, self.flare)

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

    def curvature_slices(self, margin: float) -> CurvatureSlices:
        """Interval bounds on each of many slices of z: rigorous, not sampled.

        d kappa_2 / ds = -b^2 z r / g^4 and d kappa_1 / ds = 3 s^2 waist^2 b^2 z r / g^6, where
        b^2 = s^2 (1 + s^2); r and g grow with |z|. Outward normals from z and -z meet in the plane
        z = 0 at height g / s^2, which is never beyond the meridian's centre of curvature; inward
        normals meet on the axis, at the centre of curvature 1 / kappa_2.
        """
        square = (self.waist / self.flare) ** 2
        growth = square * (1.0 + square)
        # Equal steps of asinh(b z / waist): fine at the waist, where the curvatures change fastest.
        scale = self.waist / math.sqrt(growth)
        low, high = self.v_range[0] - margin, self.v_range[1] + margin
        steps = np.linspace(math.asinh(low / scale), math.asinh(high / scale), _SLICES + 1)
        edges = scale * np.sinh(steps)
        edges[0], edges[-1] = low, high
        a, b = np.abs(edges[:-1]), np.abs(edges[1:])
        far = np.maximum(a, b)
        near = np.where(edges[:-1] * edges[1:] <= 0.0, 0.0, np.minimum(a, b))
        g_near = np.hypot(self.waist, math.sqrt(growth) * near)
        g_far = np.hypot(self.waist, math.sqrt(growth) * far)
        dent = square * self.waist**2
        lever = growth * far * self._radius(far)
        return CurvatureSlices(
            meridian_low=-dent / g_near**3,
            meridian_high=-dent / g_far**3,
            parallel_low=1.0 / g_far,
            parallel_high=1.0 / g_near,
            meridian_slope=3.0 * dent * lever / g_near**6,
            parallel_slope=lever / g_near**4,
            reach=g_near / square,
        )


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Plane(ChartedPatch):
    """u and v are x and y of its own frame, the normal is +z."""

    kind: ClassVar[str] = "plane"
    units: ClassVar[tuple[str, str]] = ("m", "m")
    code: ClassVar[int] = 0
    u_angle: ClassVar[bool] = False
    v_angle: ClassVar[bool] = False

    @property
    def lengths(self) -> tuple[float, ...]:
        """Nothing."""
        return ()

    def local_point(self, u: Array, v: Array) -> Array:
        """(u, v, 0)."""
        return np.stack([u, v, np.zeros_like(u)], axis=-1)

    def local_normal(self, u: Array, v: Array) -> Array:
        """+z."""
        zero = np.zeros_like(u)
        return np.stack([zero, zero, np.ones_like(u)], axis=-1)

    def area(self, u0: ArrayLike, u1: ArrayLike, v0: ArrayLike, v1: ArrayLike) -> Array:
        """(u1 - u0) (v1 - v0)."""
        u0, u1, v0, v1 = (np.asarray(value, float) for value in (u0, u1, v0, v1))
        return np.asarray((u1 - u0) * (v1 - v0))

    def curvature_slices(self, margin: float) -> CurvatureSlices:
        """None."""
        return CurvatureSlices.constant(0.0, 0.0)
