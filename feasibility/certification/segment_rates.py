"""How fast the tool may run along a straight line of joints, and how near singularities it comes.

**Speed.** On a segment q(s) = q_0 + s d, s from 0 to 1, the tool point moves at p'(s) = J(q(s)) d
by s. Run so that it has the speed v, joint j turns at v |d_j| / |p'(s)|: inside its limit V_j while

    v <= |p'(s)| min_j V_j / |d_j|.

|p''| <= D (`lever_bounds`), so |p'| >= (|p'(0)| + |p'(1)| - D) / 2, and
|p'| >= |p(1) - p(0)| - D / 2. Halves of a segment have a quarter of D.

**Singularities.** sigma is the smallest of the five singular values that count of the Jacobian of
tool point (over the arm's reach) and approach axis; for arms of fewer joints the smallest of as
many as there are. It changes by no more than the norm of the Jacobian's change (Weyl), the columns
of which change along the segment as `column_changes` says. So with L the root of the sum of their
squares, sigma is at least (sigma(0) + sigma(1) - L) / 2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coverable.arrays import Array, Ints, Mask
from feasibility.certification.bisection import Stretches, bisected
from feasibility.certification.lever_bounds import (
    Jacobians,
    column_changes,
    jacobians,
    levers_along,
    longest_levers,
    second_derivative_bound,
    smallest_singular,
)
from robots.kinematics import Kinematics
from robots.robot import Robot

LOOSE = 0.005  # [1] share by which a bound may be below an exact value, before it is good enough
LEVELS = 14  # halvings of a segment
MOST = 400_000  # stretches that are halved, of all segments together


@dataclass(frozen=True, eq=False, slots=True)
class SegmentRates:
    """Of m segments."""

    speed: Array
    """(m,) m/s, lower bound of the speed that the tool may have all along; inf at a standstill."""
    sampled_speed: Array
    """(m,) m/s, upper bound: at an exact configuration no more is possible."""
    joint: Ints
    """(m,) the joint that allows no more."""
    share: Array
    """(m,) where that is on the segment, 0..1."""
    sigma: Array
    """(m,) lower bound of the smallest singular value; inf where it was not asked for."""
    sampled_sigma: Array
    """(m,) upper bound: that of an exact configuration."""


@np.errstate(invalid="ignore")  # NaN where the velocity of a joint is not known
def segment_rates(
    robot: Robot,
    starts: Array,
    ends: Array,
    speed: float | None = None,
    sigma: float | None = None,
    group: Ints | None = None,
    resting: Mask | None = None,
) -> SegmentRates:
    """Rates along straight segments of joints.

    Segments are halved until the least bound of each group is close to an exact value, or what is
    asked for is decided.

    Args:
        robot: the arm.
        starts, ends: (m, n) rad or m.
        speed: m/s, of which it only has to be known whether it is possible; None for all there is.
        sigma: the same for singular values; inf for all there is, None where they do not matter.
        group: (m,) which group each segment is of, from 0 on; one for all by default.
        resting: (m,) segments on which any speed will do; none by default.
    """
    steps, m = np.abs(ends - starts), len(starts)
    with np.errstate(divide="ignore"):
        allowed = np.where(steps > 0.0, robot.max_velocity / steps, np.inf)
    rate, joint = allowed.min(axis=1, initial=np.inf), allowed.argmin(axis=1)
    rate = rate if resting is None else np.where(resting, np.inf, rate)
    groups = np.zeros(m, dtype=np.int64) if group is None else group

    def speeds(p: Stretches[Jacobians]) -> tuple[Array, ...]:
        r, found = rate[p.row], _way_bounds(robot, (ends - starts)[p.row], p)
        return tuple(np.where(np.isinf(r), np.inf, value * r) for value in found)

    def sigmas(p: Stretches[Jacobians]) -> tuple[Array, ...]:
        return _sigma_bounds(robot, steps[p.row], p)

    v, s = _Least(groups, speed), _Least(groups, sigma)
    figures = [(v, speeds), (s, sigmas)][: 1 if sigma is None else 2]

    def decided(p: Stretches[Jacobians]) -> Mask:
        bounds = [(one, bound(p)) for one, bound in figures]
        good = np.asarray(np.all([one.seen(p, *known) for one, known in bounds], axis=0))
        for one, (low, _, _) in bounds:
            one.keep(p.row[good], low[good])
        return good

    def halves(p: Stretches[Jacobians]) -> Stretches[Jacobians]:
        q = starts[p.row] + p.middle[:, None] * (ends - starts)[p.row]
        return p.halves(jacobians(kinematics, q))

    kinematics, row = Kinematics(robot), np.arange(m)
    at = jacobians(kinematics, np.vstack([starts, ends]))
    whole = Stretches(row, np.zeros(m), np.ones(m), at.of(row), at.of(m + row))
    left = bisected(whole, decided, halves, LEVELS, MOST)
    for one, bound in figures:
        one.keep(left.row, bound(left)[0])
    return SegmentRates(v.low, v.exact, joint, v.share, s.low, s.exact)


class _Least:
    """The least of one figure along each segment: a bound, and the least exact value."""

    def __init__(self, groups: Ints, asked: float | None) -> None:
        m = len(groups)
        self.groups, self.asked = groups, asked
        self.low, self.exact, self.share = np.full(m, np.inf), np.full(m, np.inf), np.zeros(m)

    def seen(self, p: Stretches[Jacobians], low: Array, first: Array, last: Array) -> Mask:
        """Take note of exact values at the ends of stretches (k,); which of them are decided."""
        for values, where in ((first, p.low), (last, p.high)):
            better = values < self.exact[p.row]
            np.minimum.at(self.exact, p.row, values)
            self.share[p.row[better]] = where[better]
        if self.asked is not None and np.isfinite(self.asked):
            return np.asarray(~((low < self.asked) & (self.exact[p.row] >= self.asked)))
        least = np.full(int(self.groups.max(initial=0)) + 1, np.inf)
        np.minimum.at(least, self.groups, self.exact)
        return np.asarray(~(low < (1.0 - LOOSE) * least[self.groups[p.row]]))

    def keep(self, row: Ints, low: Array) -> None:
        """Take bounds of stretches that are not halved any more."""
        np.minimum.at(self.low, row, np.maximum(low, 0.0))


def _way_bounds(robot: Robot, ways: Array, p: Stretches[Jacobians]) -> tuple[Array, Array, Array]:
    """Lower bound of |p'| by the segment's own parameter, and its values at both ends, (k,)."""
    at, steps = (p.start, p.end), np.abs(ways) * p.length[:, None]
    levers = levers_along(steps, robot.prismatic, at[0].levers, at[1].levers, np.inf)
    second = second_derivative_bound(levers, steps, robot.prismatic)
    first, last = (np.linalg.norm(np.einsum("kij,kj->ki", end.point, ways), axis=1) for end in at)
    chord = np.linalg.norm(at[1].points - at[0].points, axis=1)
    low = np.maximum(0.5 * ((first + last) * p.length - second), chord - 0.5 * second)
    return low / p.length, first, last


def _sigma_bounds(
    robot: Robot, steps: Array, p: Stretches[Jacobians]
) -> tuple[Array, Array, Array]:
    """Lower bound of the singular value, and its values at both ends, (k,)."""
    square, steps = np.zeros(len(steps)), steps * p.length[:, None]
    for first, last, cap, unit in (
        (p.start.levers, p.end.levers, np.inf, robot.length_unit),
        (p.start.sines, p.end.sines, 1.0, 1.0),
    ):
        most = levers_along(steps, robot.prismatic, first, last, cap)
        change = column_changes(most, steps, robot.prismatic)
        square += ((change / unit) ** 2).sum(axis=1)
    first, last = (smallest_singular(end, robot.length_unit) for end in (p.start, p.end))
    return 0.5 * (first + last - np.sqrt(square)), first, last


def smallest_singular_values(robot: Robot, q: Array) -> Array:
    """(k,) of configurations q (k, n), see the module."""
    return smallest_singular(jacobians(Kinematics(robot), q), robot.length_unit)


def fastest_anywhere(robot: Robot) -> float:
    """m/s, more than the tool point can have anywhere: every joint at its limit, all links in line.

    inf where a joint that slides has no limits.
    """
    levers = longest_levers(robot, robot.lower, robot.upper)
    with np.errstate(invalid="ignore"):
        each = np.where(robot.prismatic, 1.0, levers) * robot.max_velocity
    return float(each.sum())
