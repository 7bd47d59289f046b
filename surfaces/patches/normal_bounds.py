"""How fast the field of unit normals can turn: the bounds that make certificates sound.

Let m(x) be the outward unit normal at the point of a surface closest to x, h(x) its signed height.
Then m = grad h, and on the parallel surface at height h, with e1, e2 its principal directions:

- Dm has the eigenvalues k_i = kappa_i / (1 + kappa_i h) along e_i, and 0 along m, where kappa_i
  are the principal curvatures of the surface itself, positive where the normals spread.
- D^2 m is the symmetric tensor T of third derivatives of h. Differentiating |grad h|^2 = 1 twice
  gives T(m, a, b) = -(Dm a).(Dm b). On tangents T is the covariant derivative of the second
  fundamental form, symmetric by Codazzi's equations; on a surface of revolution (e1 along the
  meridian, s its arc length) only T(1,1,1) = p = dk_1/ds and T(1,2,2) = q = dk_2/ds remain.

The norm of a symmetric form is attained on the diagonal (Banach), so for a unit vector
x = a e1 + b e2 + c m the largest |D^2 m[x, x]| is the largest value of the cubic
p a^3 + 3 q a b^2 - 3 c (k_1^2 a^2 + k_2^2 b^2). For a sphere of radius rho it is 2/sqrt(3)/rho^2.

Arc length on the parallel surface is (1 + kappa_1 h) ds, hence p = kappa_1' / (1 + kappa_1 h)^3
and q = kappa_2' / ((1 + kappa_2 h)^2 (1 + kappa_1 h)), the primes taken on the surface itself.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array
from surfaces.patches.cylinder import Cylinder
from surfaces.patches.hyperboloid import Hyperboloid
from surfaces.patches.patch import ClosedFormPatch
from surfaces.patches.sphere import Sphere

SLICES = 512  # over which the curvatures of a hyperboloid are bounded
ROUNDING = 1.0 + 1e-12  # covers the rounding of the few operations below


@dataclass(frozen=True, slots=True)
class NormalBounds:
    """Bounds on the derivatives of the field of unit normals; inf where the field is not smooth."""

    curvature: float
    """1/m, at least the operator norm of Dm: the largest curvature of the parallel surfaces."""
    second_derivative: float
    """1/m^2, at least |D^2 m[x, x]| for every unit vector x."""


class CurvatureSlices(NamedTuple):
    """Intervals that hold the curvatures of a surface of revolution; one entry for each slice.

    Slices cut the patch across its meridians. Curvatures are signed, positive where the outward
    normals spread; slopes are bounds on the absolute derivative by the meridian's arc length.
    """

    meridian_low: Array
    """(s,) 1/m, least kappa_1 on each slice."""
    meridian_high: Array
    """(s,) 1/m, largest kappa_1."""
    parallel_low: Array
    """(s,) 1/m, least kappa_2."""
    parallel_high: Array
    """(s,) 1/m, largest kappa_2."""
    meridian_slope: Array
    """(s,) 1/m^2, at least |d kappa_1 / ds|."""
    parallel_slope: Array
    """(s,) 1/m^2, at least |d kappa_2 / ds|."""
    reach: Array
    """(s,) m, the signed height up to which points above the slice are closest to it."""

    @staticmethod
    def constant(meridian: float, parallel: float) -> CurvatureSlices:
        """One slice of constant curvatures (1/m)."""
        k1, k2, zero = np.array([meridian]), np.array([parallel]), np.zeros(1)
        return CurvatureSlices(k1, k1, k2, k2, zero, zero, np.full(1, np.inf))


def bounds_of(patch: ClosedFormPatch, height: float, slack: float = 0.0) -> NormalBounds:
    """Bounds on how fast the normal turns near the parallel surface at a signed height (m).

    They hold at every point whose closest point lies on the patch and whose height differs from
    `height` by at most `slack` (m); see `normal_bounds`.
    """
    return normal_bounds(_slices_of(patch, abs(slack)), height, abs(slack))


def _slices_of(patch: ClosedFormPatch, margin: float) -> CurvatureSlices:
    """Bounds on the curvatures of a patch, widened by `margin` where it has open ends."""
    if isinstance(patch, Hyperboloid):
        return _of_hyperboloid(patch, margin)
    if isinstance(patch, Sphere):
        return CurvatureSlices.constant(1.0 / patch.radius, 1.0 / patch.radius)
    return CurvatureSlices.constant(0.0, 1.0 / patch.radius if isinstance(patch, Cylinder) else 0.0)


def _of_hyperboloid(patch: Hyperboloid, margin: float) -> CurvatureSlices:
    """Interval bounds on each of many slices of z: rigorous, not sampled.

    d kappa_2 / ds = -b^2 z r / g^4 and d kappa_1 / ds = 3 s^2 waist^2 b^2 z r / g^6, where
    b^2 = s^2 (1 + s^2); r and g grow with |z|. Outward normals from z and -z meet in the plane
    z = 0 at height g / s^2, which is never beyond the meridian's centre of curvature; inward
    normals meet on the axis, at the centre of curvature 1 / kappa_2.
    """
    square = (patch.waist / patch.flare) ** 2
    growth = square * (1.0 + square)
    # Equal steps of asinh(b z / waist): fine at the waist, where the curvatures change fastest.
    scale = patch.waist / math.sqrt(growth)
    low, high = patch.v_range[0] - margin, patch.v_range[1] + margin
    steps = np.linspace(math.asinh(low / scale), math.asinh(high / scale), SLICES + 1)
    edges = scale * np.sinh(steps)
    edges[0], edges[-1] = low, high
    a, b = np.abs(edges[:-1]), np.abs(edges[1:])
    far = np.maximum(a, b)
    near = np.where(edges[:-1] * edges[1:] <= 0.0, 0.0, np.minimum(a, b))
    g_near = np.hypot(patch.waist, math.sqrt(growth) * near)
    g_far = np.hypot(patch.waist, math.sqrt(growth) * far)
    dent = square * patch.waist**2
    lever = growth * far * np.hypot(patch.waist, far * (patch.waist / patch.flare))
    return CurvatureSlices(
        meridian_low=-dent / g_near**3,
        meridian_high=-dent / g_far**3,
        parallel_low=1.0 / g_far,
        parallel_high=1.0 / g_near,
        meridian_slope=3.0 * dent * lever / g_near**6,
        parallel_slope=lever / g_near**4,
        reach=g_near / square,
    )


def normal_bounds(slices: CurvatureSlices, height: float, slack: float) -> NormalBounds:
    """Bounds over all slices and all signed heights within `slack` (m) of `height` (m).

    Both k = kappa / (1 + kappa h) and its stretch 1 / (1 + kappa h) are monotone in kappa and in h
    as long as the parallel surface does not fold, so the corners of each interval decide. Where it
    folds or meets itself the closest point jumps, and no bound holds.
    """
    if (height + slack >= slices.reach).any():
        return NormalBounds(math.inf, math.inf)
    k1, stretch1 = _corners(slices.meridian_low, slices.meridian_high, height, slack)
    k2, stretch2 = _corners(slices.parallel_low, slices.parallel_high, height, slack)
    curvature = float(np.maximum(k1, k2).max())
    if not math.isfinite(curvature):
        return NormalBounds(math.inf, math.inf)
    p = slices.meridian_slope * stretch1**3
    q = slices.parallel_slope * stretch2**2 * stretch1
    second = float(_cubic_maximum(p, q, np.maximum(k1, k2) ** 2).max())
    return NormalBounds(curvature * ROUNDING, second * ROUNDING)


def _corners(low: Array, high: Array, height: float, slack: float) -> tuple[Array, Array]:
    """Largest |kappa / (1 + kappa h)| and largest 1 / (1 + kappa h); inf where a corner folds."""
    kappa = np.stack([low, high, low, high])
    h = np.array([height - slack, height - slack, height + slack, height + slack])[:, None]
    scale = 1.0 + kappa * h
    stretch = np.full_like(scale, np.inf)
    np.divide(1.0, scale, out=stretch, where=scale > 0.0)
    bent = np.where(scale > 0.0, np.abs(kappa) * np.where(scale > 0.0, stretch, 0.0), np.inf)
    return bent.max(axis=0), stretch.max(axis=0)


def _cubic_maximum(p: Array, q: Array, k: Array) -> Array:
    """Upper bound on |p a^3 + 3 q a b^2 - 3 c k (a^2 + b^2)| over unit (a, b, c); p, q, k >= 0.

    With a = t x, t^2 = a^2 + b^2: first the largest C = p x^3 + 3 q x (1 - x^2) over x in 0..1,
    then the largest C t^3 + 3 k t^2 c over t^2 + c^2 = 1, both in closed form.
    """
    interior = 2.0 * q > p  # then the largest C lies at x^2 = q / (3 q - p), and is 2 q x
    ratio = np.divide(q, 3.0 * q - p, out=np.zeros_like(q), where=interior)
    tangential = np.where(interior, 2.0 * q * np.sqrt(ratio), p)
    angle = np.arctan2(tangential + np.sqrt(tangential**2 + 8.0 * k**2), 2.0 * k)
    t, c = np.sin(angle), np.cos(angle)
    return t**2 * (tangential * t + 3.0 * k * c)
