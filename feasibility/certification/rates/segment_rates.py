"""How fast the tool may run along a straight line of joints, and how near singularities it comes.

**Speed.** On a segment q(s) = q_0 + s d, s from 0 to 1, the tool point moves at p'(s) = J(q(s)) d
by s. Run so that it has the speed v, joint j turns at v |d_j| / |p'(s)|: inside its limit V_j while

    v <= |p'(s)| min_j V_j / |d_j|.

|p''| <= D (`lever_bounds`), so |p'| >= (|p'(0)| + |p'(1)| - D) / 2, and
|p'| >= |p(1) - p(0)| - D / 2. Halves of a segment have a quarter of D.

**Singularities.** sigma is the smallest of the five singular values that count of the Jacobian of
tool point (over the arm's reach) and approach axis; for arms of fewer joints the smallest of as
many as there are. It changes by no more than the norm of the Jacobian's change (Weyl), and column j
of the tool point's part changes by at most

    r_j (sum of |d_i|, i up to j) + sum of r_i |d_i|, i behind j

along the segment, the axis' part likewise with s: second derivatives of chains, as in
`lever_bounds`. So with L the root of the sum of their squares, sigma is at least
(sigma(0) + sigma(1) - L) / 2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coverable.arrays import Array, Ints, Mask
from feasibility.certification.jacobians import Jacobians, jacobians
from feasibility.certification.lever_bounds import (
    column_changes,
    levers_along,
    longest_levers,
    second_derivative_bound,
)
from feasibility.certification.rows import Rows
from robots.kinematics import Kinematics
from robots.robot import Robot

LOOSE = 0.005  # [1] share by which a bound may be below an exact value, before it is good enough
LEVELS = 14  # halvings of a segment
MOST_PIECES = 400_000  # that are looked at, of all segments together


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


@dataclass(frozen=True, eq=False, slots=True)
class _Pieces(Rows):
    """Parts of segments that are still looked at."""

    owner: Ints
    low: Array
    high: Array
    first: Jacobians
    last: Jacobians
    sigmas: Array
    """(k, 2) the smallest singular values at both ends; NaN where they do not matter."""


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
    left = _whole(robot, starts, ends, sigma is not None)
    v, s = _Least(groups, speed), _Least(groups, sigma)
    for level in range(LEVELS + 1):
        width, r = left.high - left.low, rate[left.owner]
        low, first, last = _way_bounds(robot, (ends - starts)[left.owner], width, left)
        with np.errstate(invalid="ignore"):
            still = np.isinf(r)
            low, first, last = (np.where(still, np.inf, value * r) for value in (low, first, last))
        open_ = v.seen(left, low, first, last)
        if sigma is not None:
            scaled = _sigma_bounds(robot, steps[left.owner] * width[:, None], left)
            open_ |= s.seen(left, *scaled)
        if level == LEVELS or 2 * open_.sum() > MOST_PIECES:
            open_[:] = False
        v.keep(left.owner[~open_], low[~open_])
        if sigma is not None:
            s.keep(left.owner[~open_], scaled[0][~open_])
        left = _halved(robot, starts, ends, left.of(open_), sigma is not None)
        if not len(left.owner):
            break
    return SegmentRates(v.low, v.exact, joint, v.share, s.low, s.exact)


def _whole(robot: Robot, starts: Array, ends: Array, with_sigma: bool) -> _Pieces:
    """Segments (m, n) as they are; where one begins where another ends, the arm is asked once."""
    m = len(starts)
    alone = np.ones(m, dtype=bool)
    alone[:-1] = (ends[:-1] != starts[1:]).any(axis=1)
    at = jacobians(Kinematics(robot), np.vstack([starts, ends[alone]]))
    before, after = np.arange(m), np.arange(1, m + 1)
    after[alone] = m + np.arange(alone.sum())
    sigma = _sigma(robot, at, with_sigma)
    sigmas = np.column_stack([sigma[before], sigma[after]])
    return _Pieces(before, np.zeros(m), np.ones(m), at.of(before), at.of(after), sigmas)


def _sigma(robot: Robot, at: Jacobians, asked: bool) -> Array:
    """(k,) the smallest singular values, where they are asked for; NaN elsewhere."""
    if not asked:
        return np.full(len(at.points), np.nan)
    return smallest_singular(at, robot.length_unit)


class _Least:
    """The least of one figure along each segment: a bound, and the least exact value."""

    def __init__(self, groups: Ints, asked: float | None) -> None:
        m = len(groups)
        self.groups, self.asked = groups, asked
        self.low, self.exact, self.share = np.full(m, np.inf), np.full(m, np.inf), np.zeros(m)

    def seen(self, p: _Pieces, low: Array, first: Array, last: Array) -> Mask:
        """Take note of exact values at the ends of pieces (k,); which pieces are still open."""
        for values, where in ((first, p.low), (last, p.high)):
            better = values < self.exact[p.owner]
            np.minimum.at(self.exact, p.owner, values)
            self.share[p.owner[better]] = where[better]
        if self.asked is not None and np.isfinite(self.asked):
            return np.asarray((low < self.asked) & (self.exact[p.owner] >= self.asked))
        least = np.full(int(self.groups.max(initial=0)) + 1, np.inf)
        np.minimum.at(least, self.groups, self.exact)
        return np.asarray(low < (1.0 - LOOSE) * least[self.groups[p.owner]])

    def keep(self, owner: Ints, low: Array) -> None:
        """Take bounds of pieces that are not halved any more."""
        np.minimum.at(self.low, owner, np.maximum(low, 0.0))


def _halved(robot: Robot, starts: Array, ends: Array, left: _Pieces, with_sigma: bool) -> _Pieces:
    """Both halves of each piece."""
    if not len(left.owner):
        return left
    middle = 0.5 * (left.low + left.high)
    begins = starts[left.owner]
    at = jacobians(Kinematics(robot), begins + middle[:, None] * (ends[left.owner] - begins))
    sigma, (before, after) = _sigma(robot, at, with_sigma), left.sigmas.T
    sigmas = np.vstack([np.column_stack([before, sigma]), np.column_stack([sigma, after])])
    return _Pieces(
        np.concatenate([left.owner, left.owner]),
        np.concatenate([left.low, middle]),
        np.concatenate([middle, left.high]),
        Jacobians.join(left.first, at),
        Jacobians.join(at, left.last),
        sigmas,
    )


def _way_bounds(robot: Robot, ways: Array, width: Array, p: _Pieces) -> tuple[Array, Array, Array]:
    """Lower bound of |p'| by the segment's own parameter, and its values at both ends, (k,)."""
    steps = np.abs(ways) * width[:, None]
    levers = levers_along(steps, robot.prismatic, p.first.levers, p.last.levers, np.inf)
    second = second_derivative_bound(levers, steps, robot.prismatic)
    ends = [
        np.linalg.norm(np.einsum("kij,kj->ki", at.point, ways), axis=1) for at in (p.first, p.last)
    ]
    chord = np.linalg.norm(p.last.points - p.first.points, axis=1)
    low = np.maximum(0.5 * ((ends[0] + ends[1]) * width - second), chord - 0.5 * second)
    return low / width, ends[0], ends[1]


def _sigma_bounds(robot: Robot, steps: Array, p: _Pieces) -> tuple[Array, Array, Array]:
    """Lower bound of the singular value, and its values at both ends, (k,)."""
    scale = robot.length_unit
    square = np.zeros(len(steps))
    for first, last, cap, unit in (
        (p.first.levers, p.last.levers, np.inf, scale),
        (p.first.sines, p.last.sines, 1.0, 1.0),
    ):
        most = levers_along(steps, robot.prismatic, first, last, cap)
        change = column_changes(most, steps, robot.prismatic)
        square += ((change / unit) ** 2).sum(axis=1)
    first, last = p.sigmas.T
    return 0.5 * (first + last - np.sqrt(square)), first, last


def smallest_singular(at: Jacobians, scale: float) -> Array:
    """(k,) the smallest singular value that counts: of two directions of the axis, not three."""
    both = np.concatenate([at.point / scale, at.axis], axis=1)
    values = np.linalg.svd(both, compute_uv=False)
    return np.asarray(values[:, min(both.shape[2], 5) - 1])


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
