"""Linear models of the roll over boxes of joints and surface parameters, with proved remainders.

A range of half width h <= 90 deg about its middle m says F >= 0 of both (see `roll_held`)

    F = x . p + y . (b x p)    p = t turned about b by m +- h, and on by -+90 deg

and F <= 2 always. So |F - 1| <= 1, one coordinate each beside those of `cut_proofs`. In joints,
x and y follow their linear models within D_x / 2 and D_y / 2 and move by at most M_x and M_y. Over
a part of the surface let b = b0 + sum_i g_i s_i and t = t0 + sum_i k_i s_i, |s_i| <= 1, within r_b
and r_t; then u = b x t has the slopes g_i x t0 + b0 x k_i, within

    r_u = |b| r_t + |t| r_b + r_b r_t + (sum_i |g_i|)(sum_i |k_i|)

and p and b x p, which are t and u turned by an angle, follow theirs within r_p = |cos| r_t +
|sin| r_u, and so on, and move by at most M_p. The products leave M_x M_p + M_y M_q, and the radii.

**t over a part.** Let b and the reference e both be followed on straight lines, of lengths V and E,
and b be at least m long there. Then b / |b| has |b'| <= beta = V / m and |b''| <= (2 / sqrt 3)
beta^2, so g = e - (e . b) b has |g'| <= |e| beta + E and |g''| <= |e| (2 |b''| + 2 beta^2) +
4 E beta. That bounds |t''| of t = g / |g|, by `second_derivative_of_unit`, and half of it how far t
is from its tangent. Off the models of b by r_b and of e by r_e, t is by (|e| r_b / m + r_e) / h
more, h the least |g|. Where e is square to b everywhere, as the u direction is to normals, t is e.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Rows
from feasibility.roll import Roll, projected
from surfaces.places.places import second_derivative_of_unit

ROUNDING = 1e-9  # [1], and of u directions, which are differences
NEVER = 4.0  # [1] of |F - 1|, which says nothing
LEAST = 0.02  # [1] of h: nearer to a reference along b nothing is said


@dataclass(frozen=True, eq=False, slots=True)
class Directions(Rows):
    """Unit vectors over K parts: within a radius of affine models, or on them at their ends."""

    centre: Array
    """(K, 3)"""
    slopes: Array
    """(K, 2, 3)"""
    radius: Array
    """(K,) inf where nothing is known."""

    @staticmethod
    def between(start: Array, end: Array, radius: Array) -> Directions:
        """From one (K, 3) to the other, by the first parameter."""
        slopes = np.stack([0.5 * (end - start), np.zeros_like(start)], axis=1)
        return Directions(0.5 * (start + end), slopes, radius)

    @staticmethod
    def fixed(one: Array, count: int) -> Directions:
        """The same (3,) everywhere; of zeros `reference_parts` says that nothing is known."""
        return Directions(np.tile(one, (count, 1)), np.zeros((count, 2, 3)), np.zeros(count))

    def at(self, x: Array) -> Directions:
        """The same, about other parameters (K, 2) of the parts."""
        return replace(self, centre=self.centre + (x[..., None] * self.slopes).sum(axis=1))


@np.errstate(invalid="ignore", divide="ignore", over="ignore")  # what is not known is inf or NaN
def reference_parts(b: Directions, e: Directions, square: bool = False) -> Directions:
    """t from models of b and of the reference e; `square` says that e is square to b everywhere.

    Example:
        >>> flat = Directions.fixed(np.array([0.0, 0.0, -1.0]), 1)
        >>> found = reference_parts(flat, Directions.fixed(np.array([0.6, 0.0, 0.8]), 1))
        >>> found.centre.round(6).tolist(), found.radius.tolist()
        ([[1.0, 0.0, 0.0]], [0.0])
    """
    if square:
        return _where_known(e.centre, e.slopes, e.radius)
    length = np.linalg.norm(b.centre, axis=1)
    ahead = b.centre / length[:, None]
    t, sine = projected(e.centre, ahead)
    moved, own = (np.linalg.norm(x.slopes, axis=2).sum(axis=1) for x in (b, e))
    most = np.maximum(np.linalg.norm(e.centre, axis=1), 1.0) + own + e.radius
    shortest = length - moved - b.radius
    shortest = np.where(shortest > 0.0, shortest, np.nan)
    beta, deviation = moved / shortest, b.radius / shortest
    h = sine - most * (beta + deviation) - own - e.radius
    second = most * (2.0 * (2.0 / np.sqrt(3.0)) * beta**2 + 2.0 * beta**2) + 4.0 * own * beta
    reached = 0.5 * second_derivative_of_unit(h, most * beta + own, second)
    reached += (most * deviation + e.radius) / np.where(h > LEAST, h, np.nan)
    # dt along db and de: what they do to g = e - (e . b) b, square to t, over its length.
    db, de = (x.slopes for x in (b, e))
    db = db / length[:, None, None]
    db = db - (db * ahead[:, None]).sum(axis=2, keepdims=True) * ahead[:, None]
    of_b = ((db * e.centre[:, None]) + (de * ahead[:, None])).sum(axis=2, keepdims=True)
    dg = de - of_b * ahead[:, None] - (e.centre * ahead).sum(axis=1)[:, None, None] * db
    dt = dg - (dg * t[:, None]).sum(axis=2, keepdims=True) * t[:, None]
    return _where_known(t, dt / sine[:, None, None], reached)


def _where_known(centre: Array, slopes: Array, radius: Array) -> Directions:
    known = np.isfinite(radius) & np.isfinite(centre).all(axis=1)
    known &= np.isfinite(slopes).all(axis=(1, 2))
    return Directions(
        np.where(known[:, None], centre, 0.0),
        np.where(known[:, None, None], slopes, 0.0),
        np.where(known, radius, np.inf),
    )


class ToolModel(NamedTuple):
    """x and y of the tool over m boxes of joints."""

    values: Array
    """(m, 2, 3) x and y at the centres."""
    columns: Array
    """(m, n, 2, 3) their derivatives."""
    second: Array
    """(m, 2) D_x and D_y."""
    moves: Array
    """(m, 2) M_x and M_y."""


class RollModels(NamedTuple):
    """Coordinates F - 1 of both ends, as `linear_models.Models` has them."""

    residual: Array
    """(m, 2)"""
    columns: Array
    """(m, n + 2, 2) by joints and parameters."""
    radius: Array
    """(m, 2)"""


@np.errstate(invalid="ignore")  # inf * 0, where nothing is known, is NaN on the way
def roll_models(
    tool: ToolModel, approach: Directions, reference: Directions, half: Array, roll: Roll
) -> RollModels:
    """F - 1 for both ends of a range of at most 180 degrees, over m boxes.

    Args:
        tool: x and y over them.
        approach, reference: b and t over their parameters, at the centres.
        half: (m, 2) half the widths of the boxes in the parameters.
        roll: the range.
    """
    (b, db, r_b), (t, dt, r_t) = (
        (one.centre, one.slopes, one.radius) for one in (approach, reference)
    )
    u, du = np.cross(b, t), np.cross(db, t[:, None]) + np.cross(b[:, None], dt)
    size_b, size_t = np.linalg.norm(b, axis=1), np.linalg.norm(t, axis=1)
    spans = [(np.linalg.norm(d, axis=2) * half).sum(axis=1) for d in (db, dt)]
    r_u = size_b * r_t + size_t * r_b + r_b * r_t + spans[0] * spans[1]
    r_u += spans[0] * r_t + spans[1] * r_b
    n, values = tool.columns.shape[1], tool.values
    residual, radius = np.empty((2, len(b), 2))
    columns = np.empty((len(b), n + 2, 2))
    for end, sign in enumerate((1.0, -1.0)):
        # x . p + y . q = sin(h - off), or sin(h + off), times 1 + c.
        angle = roll.middle + sign * roll.half
        c, s = sign * np.cos(angle), sign * np.sin(angle)
        both = np.stack([s * t - c * u, c * t + s * u], axis=1)  # p and q
        slopes = np.stack([s * dt - c * du, c * dt + s * du], axis=2)
        residual[:, end] = (values * both).sum(axis=(1, 2)) - 1.0
        columns[:, :n, end] = (tool.columns * both[:, None]).sum(axis=(2, 3))
        columns[:, n:, end] = (slopes * values[:, None]).sum(axis=(2, 3))
        moved = (np.linalg.norm(slopes, axis=3) * half[..., None]).sum(axis=1)
        bends = 0.5 * tool.second * np.linalg.norm(both, axis=2)
        radius[:, end] = 1.0 + ROUNDING + (bends + tool.moves * moved).sum(axis=1)
        radius[:, end] += (abs(s) + abs(c)) * (r_t + r_u)
    silent = ~(radius < NEVER)
    residual[silent], radius[silent] = 0.0, NEVER
    columns[np.broadcast_to(silent[:, None], columns.shape)] = 0.0
    return RollModels(residual, columns, radius)
