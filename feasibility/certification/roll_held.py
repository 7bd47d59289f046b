"""The roll of the tool along stretches, where it is limited: bounds without angles' whole turns.

*Reference.* Along a straight piece of a path of places b differs from a straight line by at most
d_b (`PlacePaths`). The reference e is fixed, or the u direction, which differs from a straight line
by a known amount, too (`PlacePaths`). What that says of t, `reference_parts`
knows, as over boxes: t is within a radius r_t of a straight line, and within d_t = 2 r_t of that
between its ends. The product u = b x t has D_u = 2 |db| |dt|, and d_u = d_b + d_t on top.

*Roll.* With the tool's x and y, the target's t and u = b x t, and the middle m of the roll's range,
let

    z = (C cos m + N sin m, N cos m - C sin m)    C = t . x + u . y    N = u . x - t . y

so that z = (1 + c) (cos off, sin off) with off = psi - m, see `feasibility.roll`. |off| <= h <= 90
deg means F = z . (sin h, -+cos h) >= 0 for both signs. z is linear in each of x, y, t, u. Let them
differ from straight lines by at most s (1 - s) / 2 times D_x, D_y, D_t, D_u. The product of two
straight lines differs from the straight line between its ends by s (1 - s) times that of their
changes, so F differs from a straight line by at most s (1 - s) / 2 times

    D = 2 |(dt . dx + du . dy, du . dx - dt . dy)| + D_x + D_y + sqrt(2) (D_t + D_u)

where the root is that of |sin| + |cos|. F is bounded at every instant, and no angle is followed, so
no whole turn can hide between the ends. Of a range of more than 180 deg only what is outside both
of its half turns is left out: there it is enough that F >= 0 for one sign, or that h = 90 deg does.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Mask
from feasibility.certification.faults import ROLL_CLOSE
from feasibility.certification.lever_bounds import Jacobians, peaks, second_derivatives
from feasibility.certification.roll_box_models import Directions, reference_parts
from feasibility.roll import Roll, projected
from surfaces.places.places import PlacePaths

ROUNDS = 24  # halvings of the angle that is looked for
ROOT = float(np.sqrt(2.0))


def frame_second_derivatives(steps: Array, slides: Mask, poses: Jacobians, x: Array) -> Array:
    """(m - 1,) D_x + D_y between m poses with these reference axes (m, 3), as `second_derivatives`.

    With the sines of the angles between revolute axes and x, or y, in place of levers.
    """
    both = x, np.cross(poses.axes, x)
    turned = [np.cross(poses.angular, axis[..., None], axis=1) for axis in both]
    sines = [np.linalg.norm(one, axis=1) for one in turned]
    return np.sum([second_derivatives(steps, slides, one, 1.0) for one in sines], axis=0)


def roll_vectors(x: Array, axes: Array, references: Array, approaches: Array, roll: Roll) -> Array:
    """(..., 2) z, from x, a, t and b (..., 3)."""
    return vectors_of(x, np.cross(axes, x), references, np.cross(approaches, references), roll)


def vectors_of(x: Array, y: Array, t: Array, u: Array, roll: Roll) -> Array:
    """(..., 2) z, from vectors (..., 3) that need not be unit or square."""
    cosine = (t * x).sum(axis=-1) + (u * y).sum(axis=-1)
    sine = (u * x).sum(axis=-1) - (t * y).sum(axis=-1)
    c, s = np.cos(roll.middle), np.sin(roll.middle)
    return np.stack([c * cosine + s * sine, c * sine - s * cosine], axis=-1)


def products_of_changes(dx: Array, dy: Array, dt: Array, du: Array) -> Array:
    """(...) 2 |(dt . dx + du . dy, du . dx - dt . dy)|, from changes (..., 3)."""
    along = (dt * dx + du * dy).sum(axis=-1)
    across = (du * dx - dt * dy).sum(axis=-1)
    return np.asarray(2.0 * np.hypot(along, across))


def off_middle(z: Array) -> Array:
    """(...) rad, |off| of z (..., 2)."""
    return np.abs(np.arctan2(z[..., 1], z[..., 0]))


def largest_off(z0: Array, z1: Array, second: Array, unknown: Array, half: float) -> Array:
    """(k,) rad, bounds on |off| along k stretches, where that is shown to be at most `half`.

    Of z0 and z1 (k, 2) at both ends, the second derivative D (k,), how much less F may be at both
    ends than z shows (k, 2), and half the range of the roll, rad. They are inf where the roll may
    leave the range, NaN where something is.
    """

    def holds(angle: Array, sign: float) -> Mask:
        ends = [np.sin(angle) * z[:, 0] - sign * np.cos(angle) * z[:, 1] for z in (z0, z1)]
        low = peaks(unknown[:, 0] - ends[0], unknown[:, 1] - ends[1], second)
        return np.asarray(low <= ROLL_CLOSE)

    most = np.full(len(z0), min(half, 0.5 * np.pi))
    within = holds(most, 1.0) & holds(most, -1.0)
    low, high = np.minimum(np.maximum(off_middle(z0), off_middle(z1)), most), most.copy()
    for _ in range(ROUNDS):
        tried = 0.5 * (low + high)
        good = holds(tried, 1.0) & holds(tried, -1.0)
        high, low = np.where(good, tried, high), np.where(good, low, tried)
    if half <= 0.5 * np.pi:
        return np.where(within, high, np.inf)
    whole = np.full(len(z0), half)
    one_side = holds(whole, 1.0) | holds(whole, -1.0)
    return np.where(within, high, np.where(one_side, half, np.inf))


FIRST, LAST = 0, 2  # pieces of a path; in the middle one the place changes sides, on the spot


class ReferencesAlong(NamedTuple):
    """Reference directions along k paths of places."""

    t: Array
    """(k, 4, 3) at the four places."""
    second_u: Array
    """(k, 3) D_u of the pieces."""
    beside: Array
    """(k, 3) d_t + d_u."""


class HeldRoll(NamedTuple):
    """The range of the roll, and what is known of its references."""

    roll: Roll
    square: bool
    """Are they square to the approach everywhere, as u directions are to normals?"""

    def rolls(self, x: Array, axes: Array, approaches: Array, references: Array) -> Array:
        """(k,) rad, how far rolls of tools are off the middle of their range."""
        t, _ = projected(references, approaches)
        return off_middle(roll_vectors(x, axes, t, approaches, self.roll))

    def rolls_between(
        self, x: tuple[Array, Array], axes: tuple[Array, Array], second: Array, path: PlacePaths
    ) -> Array:
        """(k,) rad, bounds on that along stretches; inf where the roll may leave its range.

        x and axes (k, 3) are of the tool at both ends, `second` (k,) is D_x + D_y along the
        stretch; the path of places has approach and reference directions for normals and u.
        """
        references, second_u, beside = self.references_along(path)
        share = path.share[..., None]
        ends = x, tuple(map(np.cross, axes, x))
        xs, ys = ((1.0 - share) * one[:, None] + share * other[:, None] for one, other in ends)
        us = np.cross(path.normals, references)
        z = vectors_of(xs, ys, references, us, self.roll)
        unknown = 0.5 * path.share * (1.0 - path.share) * second[:, None]
        dt, du = np.diff(references, axis=1), np.diff(us, axis=1)
        width = np.diff(path.share, axis=1)
        with np.errstate(invalid="ignore"):  # inf * 0 is NaN, and refused
            most = width**2 * second[:, None] + ROOT * second_u
            most += products_of_changes(np.diff(xs, axis=1), np.diff(ys, axis=1), dt, du)
        most[:, 1] = 0.0  # on the spot: right on both sides is enough
        found = []
        for k in range(3):
            less = unknown[:, k : k + 2] + ROOT * beside[:, k, None]
            found.append(largest_off(z[:, k], z[:, k + 1], most[:, k], less, self.roll.half))
        return np.asarray(np.max(found, axis=0))

    def references_along(self, path: PlacePaths) -> ReferencesAlong:
        """t at the places of paths, and how much t and u bend along their pieces."""
        b, e, off = path.normals, path.tangents, path.deviations
        references, _ = projected(e, b)
        db, dt = (np.linalg.norm(np.diff(a, axis=1), axis=2) for a in (b, references))
        beside = np.zeros_like(off[..., 1])
        for k in (FIRST, LAST):
            of_b = Directions.between(b[:, k], b[:, k + 1], off[:, k, 1])
            of_e = Directions.between(e[:, k], e[:, k + 1], 0.5 * off[:, k, 2])
            d_t = 2.0 * reference_parts(of_b, of_e, self.square).radius
            beside[:, k] = 2.0 * d_t + off[:, k, 1]
        with np.errstate(invalid="ignore"):  # inf * 0 is NaN, and refused
            return ReferencesAlong(references, 2.0 * db * dt, beside)
