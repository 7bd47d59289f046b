"""Affine models of curves and of what they sweep: the bounds behind the parts of smooth patches.

Each bound holds for every place of a part, by one of these arguments; none is sampled.

**Arc.** For |t| <= h <= pi let C = (1 + cos h) / 2. cos t lies in cos h .. 1, so |cos t - C| <=
(1 - cos h) / 2. And sin t - (t / h) sin h is 0 at 0 and h, concave between them, hence >= 0 and
largest where cos t = sin(h) / h.

**Bounded curve.** f of one parameter with |f''| <= M on a segment of half length h (for which f'
Lipschitz is enough). Let s be its chord, D = f(0) - s(0) in the middle; |D| <= M h^2 / 2.
E = f - s - D / 2 is D / 2 in the middle and -D / 2 at the ends. On either half, with 0 <= k <= 1
along it, E differs from the straight line between these by at most M h^2 k (1 - k) / 2, so
|E| <= M h^2 / 4 (|1 - 2 k| + 2 k (1 - k)) <= M h^2 / 4. It holds for each coordinate apart.

**Turned.** (r cos t, r sin t, z) for r = r_0 + r_1 x + e, |e| <= e_r, z likewise, and the arc
cos t = C + c, sin t = S y + s. With the model (C (r_0 + r_1 x), r_0 S y, z_0 + z_1 x), what is left
is (C e + r c, (r - r_0) S y + r s, e_z). Of the second, r_1 S x y is a twist beside the axis;
without it e S y + r s is left.

**Unit vectors.** N = A + E, A affine, |E| <= e. See `unit_model`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from coverable_arrays import Array
from surfaces.parts import PartModels


class Arc(NamedTuple):
    """cos t and sin t over |t| <= h, k times: C + c and S t / h + s."""

    mean: Array
    """(k,) C."""
    slope: Array
    """(k,) S."""
    bow: Array
    """(k,) the largest |c|."""
    sway: Array
    """(k,) the largest |s|."""


def arc(half: Array) -> Arc:
    """The arc of half angles (k,) rad. Half a turn and more is the whole circle."""
    h = np.minimum(half, np.pi)
    bow = np.sin(h / 2.0) ** 2
    cosine = np.clip(np.sinc(h / np.pi), -1.0, 1.0)
    peak = np.arccos(cosine)
    return Arc(1.0 - bow, np.sin(h), bow, np.maximum(np.sin(peak) - peak * cosine, 0.0))


class CurveModel(NamedTuple):
    """k pieces of curves in the half plane of r (away from the axis) and z, or their normals."""

    centre: Array
    """(k, 2)"""
    slope: Array
    """(k, 2)"""
    error: Array
    """(k, 2) the largest |r| and |z| of what is left."""


def circle(middle: Array, half: Array, radius: float, inward: bool = False) -> CurveModel:
    """An arc of a circle about the origin, (cos t, sin t) times the radius.

    Args:
        middle: (k,) rad, t in the middle.
        half: (k,) rad, half its angle.
        radius: m.
        inward: whether t runs the other way round.
    """
    along = arc(half)
    out = np.stack([np.cos(middle), np.sin(middle)], axis=1)
    ahead = np.stack([-out[:, 1], out[:, 0]], axis=1)
    error = np.abs(out) * along.bow[:, None] + np.abs(ahead) * along.sway[:, None]
    sense = -radius if inward else radius
    return CurveModel(
        radius * along.mean[:, None] * out, sense * along.slope[:, None] * ahead, radius * error
    )


def bounded_curve(places: Array, most: Array, half: Array) -> CurveModel:
    """A curve from its places at both ends and in the middle.

    Args:
        places: (3, k, 2) at the lower end, in the middle and at the upper end.
        most: (k, 2) bounds on the second derivatives.
        half: (k,) half the range of the parameter.
    """
    low, middle, high = places
    error = most * (half**2 / 4.0)[:, None]
    return CurveModel((low + 2.0 * middle + high) / 4.0, (high - low) / 2.0, error)


def straight(low: Array, high: Array) -> CurveModel:
    """A straight line between two ends (k, 2); or a place, where they are one."""
    return CurveModel((low + high) / 2.0, (high - low) / 2.0, np.zeros_like(low))


class Twisted(NamedTuple):
    """A closer model: |f - (centre + x_1 e_1 + x_2 e_2 + x_1 x_2 t)| <= error.

    t lies along one of the slopes and is no longer, so the model fills a flat convex quadrilateral.
    """

    twist: Array
    """(k, 3) t; zero where it would be longer than the slope."""
    error: Array
    """(k,)"""
    along: Array
    """(k, 2) what of the error comes from each axis."""


class SpaceModel(NamedTuple):
    """k pieces of a surface, or its normals: |f - (centre + x_1 e_1 + x_2 e_2)| <= error."""

    centre: Array
    """(k, 3)"""
    slopes: Array
    """(k, 2, 3)"""
    error: Array
    """(k,)"""
    along: Array
    """(k, 2) what of the error comes from each axis; see `PartModels`."""
    twisted: Callable[[], Twisted] | None = None
    """Makes a closer model, where one is known."""

    @staticmethod
    def exact(centre: Array, slopes: Array) -> SpaceModel:
        """(k, 3) and (k, 2, 3), nothing left."""
        return SpaceModel(centre, slopes, np.zeros(len(centre)), np.zeros((len(centre), 2)))


class Turned(NamedTuple):
    """A curve turned about z, and stretched: what is left lies in a skew box."""

    centre: Array
    """(k, 3)"""
    slopes: Array
    """(k, 2, 3)"""
    frame: Array
    """(k, 3, 3) rows: what becomes of the unit vectors away from the axis, beside and along it."""
    left: Array
    """(k, 3) the largest coordinates along these of what is left."""
    by_axis: Array
    """(k, 2, 3) what of that comes from each parameter."""
    twist: Array
    """(k,) the coefficient of x_1 x_2 beside the axis, which is among what is left; 0 where the
    curve meets the axis inside the piece."""

    def model(self, factor: float = 1.0) -> SpaceModel:
        """As a model, times a positive factor."""
        along = np.stack([_length(self.frame, self.by_axis[:, side]) for side in (0, 1)], axis=1)
        error = _length(self.frame, self.left)
        return SpaceModel(
            factor * self.centre,
            factor * self.slopes,
            factor * error,
            factor * along,
            partial(self._twisted, factor),
        )

    def _twisted(self, factor: float) -> Twisted:
        """The model with its twist."""
        beside = np.array([0.0, 1.0, 0.0])
        size = np.abs(self.twist)
        left = self.left - size[:, None] * beside
        by_axis = self.by_axis - size[:, None, None] / 2.0 * beside
        along = np.stack([_length(self.frame, by_axis[:, side]) for side in (0, 1)], axis=1)
        twist = self.twist[:, None] * self.frame[:, 1]
        return Twisted(*(factor * each for each in (twist, _length(self.frame, left), along)))

    def unit(self) -> SpaceModel:
        """The unit vectors along the vectors."""
        axis = _direction(self.centre)
        shares = np.einsum("kid,kd->ki", self.frame, axis)
        ahead = (np.abs(shares) * self.left).sum(axis=1)
        beside = self.frame - shares[..., None] * axis[:, None]
        across = _length(beside, self.left)
        centre, slopes, radius = unit_model(self.centre, self.slopes, ahead, across)
        size = np.maximum(np.linalg.norm(self.centre, axis=1), 1e-300)
        by_axis = [_length(beside, self.by_axis[:, side]) / size for side in (0, 1)]
        along = np.stack(by_axis, axis=1) + (slopes**2).sum(axis=2) / 4.0
        return SpaceModel(centre, slopes, radius, along)


NO_STRETCH = np.ones(3)


def turned(
    curve: CurveModel, low: Array, high: Array, angle: int, stretch: Array = NO_STRETCH
) -> Turned:
    """The curve turned about z from low to high.

    Args:
        curve: k pieces.
        low: (k,) rad.
        high: (k,) rad.
        angle: 0 or 1, which parameter the angle is; the other runs along the curve.
        stretch: (3,) factors of x, y and z afterwards.
    """
    about = arc((high - low) / 2.0)
    middle = (low + high) / 2.0
    (r, z), (dr, dz), (er, ez) = curve.centre.T, curve.slope.T, curve.error.T
    flat, one = np.zeros_like(r), np.ones_like(r)
    away = np.stack([np.cos(middle), np.sin(middle), flat], axis=1)
    beside = np.stack([-away[:, 1], away[:, 0], flat], axis=1)
    frame = np.stack([away, beside, np.stack([flat, flat, one], axis=1)], axis=1) * stretch
    change = np.abs(dr) + er
    largest = np.abs(r) + change
    by_curve = np.stack([about.mean * er, flat, ez], axis=1)
    by_angle = np.stack([largest * about.bow, largest * about.sway, flat], axis=1)
    mixed = np.stack([flat, change * about.slope, flat], axis=1)
    slopes = np.stack(
        [
            np.stack([about.mean * dr, flat, dz], axis=1),
            np.stack([flat, r * about.slope, flat], axis=1),
        ],
        axis=1,
    )
    by_axis = np.stack([by_curve + mixed / 2.0, by_angle + mixed / 2.0], axis=1)
    if angle == 0:
        slopes, by_axis = slopes[:, ::-1], by_axis[:, ::-1]
    centre = np.stack([about.mean * r, flat, z], axis=1)[:, None]
    left = by_curve + by_angle + mixed
    twist = np.where(np.abs(dr) <= r, dr * about.slope, 0.0)
    return Turned((centre @ frame)[:, 0], slopes @ frame, frame, left, by_axis, twist)


def _direction(vectors: Array) -> Array:
    """(k, d) unit vectors; zero where there is none."""
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-300))


def _length(frame: Array, parts: Array) -> Array:
    """(k,) the largest length of a vector whose coordinates are no larger than (k, 3)."""
    products = np.abs(frame @ frame.transpose(0, 2, 1))
    square = (products @ parts[:, :, None])[..., 0] * parts
    return np.asarray(np.sqrt(square.sum(axis=1)))


def unit_model(
    centre: Array, slopes: Array, ahead: Array, across: Array
) -> tuple[Array, Array, Array]:
    """A model of N / |N|, from one of N = A + E with A = centre + sum x_i slopes_i.

    With the unit vector c along A's centre, A = |A(0)| ((1 + a) c + t): the share along c changes
    by |a| <= a_0, and t, square to c, is affine in x, |t| <= t_0. The model is
    (1 - k / 2) c + t, where k = 1 - cos b and tan b = t_0 / (1 - a_0): b is the largest angle
    between A and c, so A / |A| has along c a share from 1 - k to 1. Square to c it is t / L, with L
    from 1 - a_0 to hypot(1 + a_0, t_0).

    Last, N and A are at an angle of at most d: square to A, E is no longer than its share square to
    c and sin(b) times that along c, so sin d is at most that over the least |N|.

    Where that says nothing, or less than "within 1 of zero", the model is zero with radius 1.

    Args:
        centre: (k, d)
        slopes: (k, m, d)
        ahead: (k,) the largest |E . c|.
        across: (k,) how long E is square to c, at most.

    Returns:
        centre (k, d), slopes (k, m, d) and radius (k,) of the unit vectors.
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        size = np.linalg.norm(centre, axis=1)
        axis = centre / size[:, None]
        by_axis = np.einsum("kmd,kd->km", slopes, axis) / size[:, None]
        turn = slopes / size[:, None, None] - by_axis[..., None] * axis[:, None]
        a, t = np.abs(by_axis).sum(axis=1), np.linalg.norm(turn, axis=2).sum(axis=1)
        tangent = t / (1.0 - a)
        drop = 1.0 - 1.0 / np.hypot(1.0, tangent)
        beside = t * np.maximum(1.0 / (1.0 - a) - 1.0, 1.0 - 1.0 / np.hypot(1.0 + a, t))
        least = size * (1.0 - a) - np.hypot(ahead, across)
        sine = (across + ahead * tangent / np.hypot(1.0, tangent)) / least
        off = 2.0 * np.sin(np.arcsin(np.minimum(sine, 1.0)) / 2.0)
        radius = np.hypot(drop / 2.0, beside) + off
        known = (a < 1.0) & (least > 0.0) & (radius < 1.0)
    shown = known[:, None]
    return (
        np.where(shown, axis * (1.0 - drop / 2.0)[:, None], 0.0),
        np.where(shown[..., None], turn, 0.0),
        np.where(known, radius, 1.0),
    )


def unit_curve(model: CurveModel) -> CurveModel:
    """The unit vectors along the vectors of a curve's model."""
    axis = _direction(model.centre)
    ahead = (model.error * np.abs(axis)).sum(axis=1)
    across = (model.error * np.abs(axis[:, ::-1])).sum(axis=1)
    centre, slopes, radius = unit_model(model.centre, model.slope[:, None], ahead, across)
    return CurveModel(centre, slopes[:, 0], np.repeat(radius[:, None], 2, axis=1))


def part_models(points: SpaceModel, normals: SpaceModel) -> PartModels:
    """Both in one."""
    return PartModels(
        np.concatenate([points.centre, normals.centre], axis=-1),
        np.concatenate([points.slopes, normals.slopes], axis=-1),
        np.stack([points.error, normals.error], axis=-1),
        np.stack([points.along, normals.along], axis=-1),
    )
