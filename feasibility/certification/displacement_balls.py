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
from feasibility.certification.jacobians import jacobians
from feasibility.certification.lever_bounds import (
    column_changes,
    largest_levers,
    second_derivative_bound,
)
from feasibility.certification.rates.segment_rates import smallest_singular
from feasibility.certification.rows import Rows
from feasibility.task import Task
from feasibility.verdict import Bound
from robots.kinematics import Kinematics
from robots.robot import Robot

CLOSE = 0.97  # [1] of the least room at a configuration: stretches with so much are not halved
LEVELS = 12  # halvings of a segment
BALLS = 3  # that are tried, each of the size that the one before allows
MOST = 10.0  # [m] no larger ball is tried
ROUNDS = 40  # halvings of the angle that is looked for
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

    def allowed(self, theta: Array) -> Array:
        """(k, 4) m, y with the part turned by theta (k,), by `BOUNDS`; below 0 where not so far."""
        left = self.room - theta[:, None]
        chord = 2.0 * np.sin(0.5 * np.clip(left[:, 0], 0.0, np.pi))
        first, bend = self.tilts.T
        tilt = ratio(2.0 * chord, first + np.sqrt(first**2 + 2.0 * bend * chord))
        tilt = np.where(np.isinf(left[:, 0]), MOST, tilt)
        roll = ratio(np.maximum(left[:, 1], 0.0), self.turns)
        both = np.where(left < 0.0, -1.0, np.stack([tilt, roll], axis=1))
        return np.column_stack([self.caps[:, 0], both, self.caps[:, 1]])

    def reached(self, theta: Array) -> Array:
        """(k,) m, f of that; below 0 where the part must not be turned so far."""
        y = self.allowed(theta).min(axis=1)
        return np.where(y < 0.0, -1.0, self.slope * y - 0.5 * self.second * y**2)

    @property
    def positions(self) -> Array:
        """(k,) m, D where Theta = 0."""
        return self.reached(np.zeros(len(self.row)))

    @property
    def angles(self) -> Array:
        """(k,) rad, Theta where D = 0."""
        low, high = np.zeros(len(self.row)), np.minimum(self.room.min(axis=1), np.pi)
        for _ in range(ROUNDS):
            middle = 0.5 * (low + high)
            good = self.reached(middle) >= middle * self.far
            low, high = np.where(good, middle, low), np.where(good, high, middle)
        return low

    def moved(self, position: float, angle: float) -> Array:
        """(k, n) rad or m, e_j wherever the part stands in that triangle."""
        rho = np.maximum(position, angle * self.far)
        root = np.sqrt(np.maximum(self.slope**2 - 2.0 * self.second * rho, 0.0))
        return self.moves * ratio(2.0 * rho, self.slope + root)[:, None]


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
        size = made.allowed(none).min(axis=1)
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
    spare = 0.5 * (a.sigma + b.sigma - _falls(robot, along, steps)) - asked
    singular = ratio(np.maximum(spare, 0.0), _falls(robot, within, moves))
    singular = np.minimum(singular, np.where(slope > 0.0, ratio(BELOW * slope, second), 0.0))
    singular = np.minimum(singular, most)
    limits = ratio(left_to_limits(robot, a.q, b.q), moves)
    far = np.maximum(*(np.linalg.norm(end.points - case.pivot, axis=1) for end in (a, b)))
    tilts = np.column_stack([turned + 0.5 * norm * changes[1], bend])
    return Balls(
        s.row, s.share, slope, second, tilts, moves,
        np.where(slides, 0.0, moves).sum(axis=1), np.column_stack([limits.min(axis=1), singular]),
        s.room * [1.0, np.cos(0.5 * min(case.task.cone, 0.5 * np.pi))],
        far + 0.5 * (along[0] * steps).sum(axis=1),
    )  # fmt: skip


def balls_along(case: Given, q: Array, room: Array) -> Iterator[Balls]:
    """Of stretches that are halved until configurations themselves have little more room."""
    ends, row = ends_of(case, q), np.arange(len(q) - 1)
    whole = np.tile([0.0, 1.0], (len(row), 1))
    left = Parts(row, whole, ends.of(row), ends.of(row + 1), room[row])
    middle, most = left.first, np.full(2, np.inf)
    for level in range(LEVELS + 1):
        at = best_balls(case, replace(left, first=middle, last=middle))
        most = np.minimum(most, [at.positions.min(), at.angles.min()])
        if level:
            low, high = left.share.T
            half = 0.5 * (low + high)
            left = Parts.join(
                replace(left, share=np.column_stack([low, half]), last=middle),
                replace(left, share=np.column_stack([half, high]), first=middle),
            )
        made = best_balls(case, left)
        good = (made.positions >= CLOSE * most[0]) & (made.angles >= CLOSE * most[1])
        good |= level == LEVELS
        yield made.of(good)
        if good.all():
            return
        left = left.of(~good)
        middle = ends_of(case, 0.5 * (left.first.q + left.last.q))
