"""How far an arm follows a displaced path near a motion: Newton and Kantorovich along stretches.

**Lemma**, on a straight stretch q(s), s from 0 to 1, with the joint changes h_j. J is the tool
point's Jacobian, A that of the axis, P a right inverse of J at both ends and straight between, with
|JP - I| <= eps there; d_j bounds the norms of its rows, N those of P, T those of AP, at both ends.
J and A change by at most C and C_a along the stretch (`changes` below). As P is a mean of both,

    |J(s) P(s) - I| <= kappa = eps + N C / 2,    |A(s) P(s)| <= T' = T + N C_a / 2.

Over all configurations q(s) + P(s) v, |v| <= y, the second derivatives of tool point and axis by v
are at most M and M_a: `lever_bounds` with the steps d_j over a box of the half widths h_j / 2 +
y d_j about both ends. Let f(y) = (1 - kappa) y - M y^2 / 2 and |g p - p| <= rho. **If** rho <= f(y)
and M y < 1 - kappa, exactly one v with |v| <= y has p(q(s) + P(s) v) = g p(q(s)): with B the
derivative JP at v = 0, v -> v - B^-1 (p(q + P v) - g p) maps the ball into itself, as it takes v to
at most (rho + M y^2 / 2) / (1 - kappa), and is a contraction there. All of it is continuous in t,
so v is; stretches that meet share P, and the smaller of their balls holds both of their v. QED

So joint j moves by e_j = d_j y at most, the axis by |a' - a| <= T' y + M_a y^2 / 2. The part turns
the approach direction by at most Theta. The roll is the twist about it: turning the tool, then the
part, by w in all changes it by at most w / cos(swing / 2), the swing inside the cone all the while,
and w is at most Theta + sum of e_j of the joints that turn. The singular value falls by at most the
change of the Jacobian.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints
from feasibility.certification.jacobians import jacobians, smallest_singular
from feasibility.certification.lever_bounds import (
    column_changes,
    largest_levers,
    second_derivative_bound,
)
from feasibility.certification.rows import Rows
from feasibility.task import Task
from feasibility.verdict import Bound
from robots.kinematics import Kinematics
from robots.robot import Robot

CLOSE = 0.95  # [1] of the least room at a configuration: stretches with so much are not halved
LEVELS = 12  # halvings of a segment
BALLS = 2  # that are tried, each of the size that the one before allows: a third is the second
MOST = 10.0  # [m] no larger ball is tried
LEAST = 1e-9  # [m], [rad] so that nothing is divided by 0
FREE = 1e9  # [rad] room for what is free
BELOW = 1.0 - 1e-9  # [1] of what is found is claimed: rounding
SINGULAR = 1e-10  # [1] ratio of squared singular values, up to which there is no right inverse
BOUNDS = (Bound.LIMIT, Bound.CONE, Bound.ROLL, Bound.SINGULAR)


class Given(NamedTuple):
    """What all stretches of a motion share."""

    robot: Robot
    task: Task
    pivot: Array


@dataclass(frozen=True, eq=False, slots=True)
class Ends(Rows):
    """k configurations at which stretches begin or end."""

    q: Array
    points: Array
    levers: Array
    sines: Array
    rows: Array
    """(k, n) norms of the rows of P."""
    norms: Array
    """(k, 3) N, eps and T."""
    sigma: Array
    """(k,) the smallest singular value; inf where it does not matter."""


def ends_of(case: Given, q: Array) -> Ends:
    """What has to be known of configurations q (k, n)."""
    at = jacobians(Kinematics(case.robot), q)
    back = at.point.transpose(0, 2, 1)
    squares, vectors = np.linalg.eigh(at.point @ back)
    some = squares[:, 0] > SINGULAR * squares[:, 2]
    inverse = np.where(some[:, None], 1.0 / np.where(some[:, None], squares, 1.0), 0.0)
    right = back @ (vectors * inverse[:, None]) @ vectors.transpose(0, 2, 1)
    off = np.linalg.norm(at.point @ right - np.eye(3), axis=(1, 2))  # 1 and more where singular
    turned = np.linalg.norm(at.axis @ right, 2, axis=(1, 2))
    norms = np.stack([np.sqrt(inverse[:, 0]) / BELOW, off, turned], axis=1)
    sigma = np.full(len(q), np.inf)
    if case.task.min_manipulability is not None:
        sigma = smallest_singular(at, case.robot.length_unit)
    rows = np.linalg.norm(right, axis=2)
    return Ends(q, at.points, at.levers, at.sines, rows, norms, sigma)


@dataclass(frozen=True, eq=False, slots=True)
class Parts(Rows):
    """k parts of segments between rows."""

    row: Ints
    share: Array
    """(k, 2) from where to where on the way to the next row, 0..1."""
    first: Ends
    last: Ends
    room: Array
    """(k, 2) rad, of cone and roll."""


@dataclass(frozen=True, eq=False, slots=True)
class Balls(Rows):
    """What holds along k stretches for |v| <= y."""

    row: Ints
    share: Array
    """(k, 2) see `Parts`."""
    slope: Array
    """(k,) 1 - kappa."""
    second: Array
    """(k,) M."""
    tilts: Array
    """(k, 2) T' and M_a."""
    moves: Array
    """(k, n) d_j."""
    turns: Array
    """(k,) sum of d_j of the joints that turn."""
    caps: Array
    """(k, 2) m, what y may be for limits, and for singularities and the lemma itself."""
    room: Array
    """(k, 2) rad, of the cone; of the roll, times cos(swing / 2)."""
    far: Array
    """(k,) m, r."""

    def allowed(self, turn: Array | float) -> Array:
        """(k, 4) m, y by `BOUNDS`, with the part turned by so many rad for each metre of f(y)."""
        cone, roll = self.room.T
        chord = np.where(cone < np.pi, 2.0 * np.sin(0.5 * cone), FREE)
        less, (first, bend) = turn * chord / np.maximum(cone, LEAST), self.tilts.T
        tilt = solved(first + less * self.slope, bend - less * self.second, chord)
        twist = solved(self.turns + turn * self.slope, -turn * self.second, roll)
        return np.column_stack([self.caps[:, 0], tilt, twist, self.caps[:, 1]])

    def reached(self, turn: Array | float) -> Array:
        """(k,) m, f of the least of these."""
        y = self.allowed(turn).min(axis=1)
        return np.asarray(self.slope * y - 0.5 * self.second * y**2)

    @property
    def positions(self) -> Array:
        """(k,) m, D where Theta = 0."""
        return self.reached(0.0)

    @property
    def angles(self) -> Array:
        """(k,) rad, Theta where D = 0: the chord of what is left of the cone is concave in it."""
        return np.minimum(self.reached(1.0 / self.far) / self.far, np.pi)

    def moved(self, position: float, angle: float) -> Array:
        """(k, n) rad or m, e_j wherever the part stands in that triangle."""
        rho = np.maximum(position, angle * self.far)
        return self.moves * solved(self.slope, -self.second, rho)[:, None]


def solved(a: Array, b: Array, c: Array) -> Array:
    """(k,) the least y >= 0 with a y + b y^2 / 2 = c, at most `MOST`; that, too, where none is."""
    under = a**2 + 2.0 * b * c
    return np.where(under < 0.0, MOST, ratio(2.0 * c, a + np.sqrt(np.maximum(under, 0.0))))


def ratio(a: Array, b: Array) -> Array:
    """a / b, at most `MOST`; that also where b is 0."""
    full = np.full(np.broadcast_shapes(np.shape(a), b.shape), MOST)
    return np.minimum(np.divide(a, b, out=full, where=b > 0.0), MOST)


def left_to_limits(robot: Robot, a: Array, b: Array) -> Array:
    """(..., n) rad or m, from both limits to straight lines between a and b."""
    low, high = np.minimum(a, b), np.maximum(a, b)
    return np.maximum(np.minimum(low - robot.lower, robot.upper - high), 0.0)


def _norms(columns: Array) -> Array:
    """(k,) bounds of the norms of matrices with columns of these lengths (k, n)."""
    return np.asarray(np.sqrt((columns**2).sum(axis=1)))


def _falls(robot: Robot, levers: list[Array], steps: Array) -> Array:
    """(k,) how far the singular value falls at most while joints move by steps (k, n)."""
    point, axis = (_norms(column_changes(one, steps, robot.prismatic)) for one in levers)
    return np.hypot(point / robot.length_unit, axis)


def best_balls(case: Given, s: Parts) -> Balls:
    """Balls that reach about as far as any does, each no larger than what it was made for."""
    none, size = np.zeros(len(s.row)), np.full(len(s.row), MOST)
    made = balls_of(case, s, none, size)  # a guess: it holds for |v| = 0 alone
    for _ in range(BALLS):
        size = made.allowed(0.0).min(axis=1)
        made = balls_of(case, s, size, size)
    return made


def balls_of(case: Given, s: Parts, size: Array, most: Array) -> Balls:
    """What holds for |v| <= size (k,), m; y may be `most` (k,)."""
    robot, asked = case.robot, case.task.min_manipulability or 0.0
    a, b, slides = s.first, s.last, robot.prismatic
    steps, moves = np.abs(b.q - a.q), np.maximum(a.rows, b.rows)
    ends = (np.maximum(a.levers, b.levers), np.inf), (np.maximum(a.sines, b.sines), 1.0)
    along, within = (
        [largest_levers(levers, half, slides, cap) for levers, cap in ends]
        for half in (0.5 * steps, 0.5 * steps + size[:, None] * moves)
    )
    norm, off, turned = np.maximum(a.norms, b.norms).T
    changes = [_norms(column_changes(levers, steps, slides)) for levers in along]
    slope = np.maximum(1.0 - off - 0.5 * norm * changes[0], 0.0)
    second, bend = (second_derivative_bound(levers, moves, slides) for levers in within)
    singular = np.minimum(most, np.where(slope > 0.0, ratio(BELOW * slope, second), 0.0))
    if asked:
        spare = 0.5 * (a.sigma + b.sigma - _falls(robot, along, steps)) - asked
        rest = ratio(np.maximum(spare, 0.0), _falls(robot, within, moves))
        singular = np.minimum(singular, rest)
    limits = ratio(left_to_limits(robot, a.q, b.q), moves)
    far = np.maximum(*(np.linalg.norm(end.points - case.pivot, axis=1) for end in (a, b)))
    tilts = np.column_stack([turned + 0.5 * norm * changes[1], bend])
    return Balls(
        s.row, s.share, slope, second, tilts, moves,
        np.where(slides, 0.0, moves).sum(axis=1), np.column_stack([limits.min(axis=1), singular]),
        np.minimum(s.room, FREE) * [1.0, np.cos(0.5 * min(case.task.cone, 0.5 * np.pi))],
        np.maximum(far + 0.5 * (along[0] * steps).sum(axis=1), LEAST),
    )  # fmt: skip


def balls_along(case: Given, q: Array, room: Array) -> Iterator[Balls]:
    """Of stretches that are halved until configurations themselves have little more room."""
    ends, row = ends_of(case, q), np.arange(len(q) - 1)
    whole = np.tile([0.0, 1.0], (len(row), 1))
    left = Parts(row, whole, ends.of(row), ends.of(row + 1), room[row])
    here, most = replace(left, last=left.first), np.full(2, np.inf)
    for level in range(LEVELS + 1):
        found = best_balls(case, Parts.join(here, left))
        at, made = found.of(slice(len(here.row))), found.of(slice(len(here.row), None))
        most = np.minimum(most, [at.positions.min(), at.angles.min()])
        good = (made.positions >= CLOSE * most[0]) & (made.angles >= CLOSE * most[1])
        good |= level == LEVELS
        yield made.of(good)
        if good.all():
            return
        left, (low, high) = left.of(~good), left.share[~good].T
        middle, half = ends_of(case, 0.5 * (left.first.q + left.last.q)), 0.5 * (low + high)
        here = replace(left, first=middle, last=middle)
        left = Parts.join(
            replace(left, share=np.column_stack([low, half]), last=middle),
            replace(left, share=np.column_stack([half, high]), first=middle),
        )
