"""A curve with times: fast speeds along it, and where a motion is when.

Between two places of a grid d^2s/dt^2 = u is constant, so x = (ds/dt)^2 runs straight there, and
d^2q/dt^2 = q'(s) u + q''(s) x. The speeds are the fastest with which velocities, accelerations and
the tool's speed are inside their limits at all places of the grid. Whether they are in between, as
a controller runs its samples, is judged later, by what comes of it.

They are found by reachability analysis, as in TOPP-RA. What limits allow on a piece is
|c x + d y| <= 1, row by row, for x at its beginning and y at its end. These sets are convex and
hold (0, 0), so from the last place, at rest, backwards the values of x from which rest can be
reached are 0 .. K, with K the largest x for which there is a y in 0 .. K' of the next place (a
linear program in two variables); and forwards, from rest, the largest y is the fastest.

For the largest x let lower(x) and upper(x) be the bounds on y. Their gap is concave, so where it is
negative, the lines that bound y there cross at an x which is not smaller than the largest: one goes
there, and on until there is a gap. As no line is met twice, that ends.

H. Pham and Q.-C. Pham, A new approach to time-optimal path parameterization based on reachability
analysis, IEEE Transactions on Robotics 34 (2018).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints
from coverable.kernels import entry, kernel
from feasibility.paths.order import PathError
from feasibility.timing.sampled_trajectory import tool_speeds
from feasibility.timing.smooth_curve import Curve, inside
from feasibility.timing.speed_limits import MotionLimits
from robots.robot import Robot

CROSSINGS = 100  # per place; with what is left over then, the speed is 0 there
ROUNDING = 1e-12  # [1]
LEAST_SHARE = 1e-13  # [1] of c, below which d is nothing
COARSEST, FINEST = 4, 32  # places of the grid on each piece of a curve
MOST_PLACES = 400_000  # of a grid
FASTEST = 1e6  # [1/s] of a curve that hardly moves
CROWDED = 0.2  # [1] share of the period; samples nearer to a passage of a centre are left out


class Rows(NamedTuple):
    """Limits |c x + d y| <= l of each piece, made ready for any l > 0."""

    lean: Array
    """(m - 1, r) c / d; 0 where d is nothing."""
    margin: Array
    """(m - 1, r) 1 / |d|; inf there."""
    alone: Array | None
    """(m - 1, r) 1 / |c| there and inf elsewhere; None where d is something everywhere."""

    @staticmethod
    def of(c: Array, d: Array) -> Rows:
        """From c and d (m - 1, r)."""
        alone = np.abs(d) <= LEAST_SHARE * np.abs(c)
        with np.errstate(divide="ignore", invalid="ignore"):
            margin = np.where(alone, np.inf, 1.0 / np.abs(d))
            lean = np.where(alone, 0.0, c / d)
            by_itself = np.where(alone, 1.0 / np.abs(c), np.inf) if alone.any() else None
        return Rows(lean, margin, by_itself)


def fastest_speeds(most: Array, rows: Rows, limits: Array | float = 1.0) -> Array:
    """(m,) the largest x from rest to rest; see the module.

    It is at most `most` (m,); of the rows of each piece `limits` are l (m - 1, r), or a number.

    Example:
        >>> rows = Rows.of(np.full((4, 1), -0.5), np.full((4, 1), 0.5))
        >>> fastest_speeds(np.full(5, 9.0), rows).round(9).tolist()
        [0.0, 2.0, 4.0, 2.0, 0.0]
    """
    # y is between -margin - lean x and margin - lean x.
    x = np.append(most[:-1], 0.0)
    if rows.alone is not None:
        x[:-1] = np.minimum(x[:-1], (rows.alone * limits).min(axis=1))
    _run_through(x, rows.margin * limits, rows.lean)
    return x


@entry
def _run_through(x, margin, lean):  # noqa: ANN001, ANN202
    """Set x (m,), upper bounds before, to the largest values; by two passes."""
    for i in range(x.shape[0] - 2, -1, -1):
        x[i] = _largest_start(x[i], x[i + 1], margin[i], lean[i])
    x[0] = 0.0
    for i in range(x.shape[0] - 1):
        y = x[i + 1]
        for j in range(margin.shape[1]):
            y = min(y, margin[i, j] - lean[i, j] * x[i])
        x[i + 1] = max(y, 0.0)


@kernel
def _largest_start(x, end, margin, lean):  # noqa: ANN001, ANN202
    """The largest x, at most the one given, that leads to some y in 0 .. end."""
    for _ in range(CROSSINGS):
        upper, upper_margin, upper_lean = end, end, 0.0
        lower, lower_margin, lower_lean = 0.0, 0.0, 0.0
        for j in range(margin.shape[0]):
            at = lean[j] * x
            if margin[j] - at < upper:
                upper, upper_margin, upper_lean = margin[j] - at, margin[j], lean[j]
            if -margin[j] - at > lower:
                lower, lower_margin, lower_lean = -margin[j] - at, margin[j], lean[j]
        if lower <= upper:
            return x
        crossing = (upper_margin + lower_margin) / (upper_lean - lower_lean)
        if not crossing < x * (1.0 - ROUNDING):
            return x * (1.0 - ROUNDING)
        x = crossing
    return 0.0


@dataclass(frozen=True, eq=False, slots=True)
class TimedCurve:
    """A curve with the time at which it passes each place of a grid."""

    curve: Curve
    grid: Array
    """(m,) places k of the curve."""
    x: Array
    """(m,) 1/s^2, (dk/dt)^2 at each place; it runs straight in between."""
    time: Array
    """(m,) s."""

    @property
    def duration(self) -> float:
        """Seconds from start to end."""
        return float(self.time[-1])

    def samples(self, robot: Robot, period: float) -> tuple[Array, Array, Ints]:
        """Times (k,), joints (k, n) and cells (k,) every `period` seconds and at cells' centres."""
        # Whole nanoseconds, which is what a ROS message can hold.
        marks = np.unique(np.concatenate([[0], self.curve.marks, [self.curve.pieces]]))
        passages = np.round(self.time[np.searchsorted(self.grid, marks.astype(float))], 9)
        cell = np.full(len(marks), -1, dtype=np.int64)
        cell[np.searchsorted(marks, self.curve.marks)] = self.curve.cell
        regular = np.round(np.arange(0.0, self.duration, period), 9)
        after = np.clip(np.searchsorted(passages, regular), 1, len(passages) - 1)
        apart = np.minimum(np.abs(regular - passages[after - 1]), np.abs(passages[after] - regular))
        regular = regular[apart > CROWDED * period]
        time = np.concatenate([passages, regular])
        order = np.argsort(time, kind="stable")
        cell = np.append(cell, np.full(len(regular), -1, dtype=np.int64))[order]
        return time[order], inside(robot, self.curve.spline()(self._places(time[order]))), cell

    def _places(self, time: Array) -> Array:
        """(k,) where on the curve the motion is at times (k,)."""
        i = np.clip(np.searchsorted(self.time, time, side="right") - 1, 0, len(self.time) - 2)
        u = 0.5 * (self.x[i + 1] - self.x[i]) / (self.grid[i + 1] - self.grid[i])
        past = time - self.time[i]
        place = self.grid[i] + past * (np.sqrt(self.x[i]) + 0.5 * u * past)
        return np.clip(place, self.grid[i], self.grid[i + 1])


@dataclass(frozen=True, eq=False, slots=True)
class CurveBounds:
    """A curve with all that bounds its speeds but the limits."""

    curve: Curve
    grid: Array
    """(m,) places k of the curve."""
    slope: Array
    """(m, n) |dq/dk| there."""
    tool: Array
    """(m,) m, how fast the tool moves there by k."""
    rows: Rows
    """(m - 1, 2 n) what (dk/dt)^2 at both ends of a piece adds to accelerations there."""

    @staticmethod
    def of(robot: Robot, curve: Curve) -> CurveBounds:
        """Of a curve."""
        count = int(np.clip(MOST_PLACES // curve.pieces, COARSEST, FINEST))
        grid = np.linspace(0.0, curve.pieces, count * curve.pieces + 1)
        grid[::count] = np.arange(curve.pieces + 1)
        spline = curve.spline()
        q, slope, bend = (spline.derivative(order)(grid) for order in range(3))
        per = 0.5 / np.diff(grid)[:, None]
        begin, end = per * slope[:-1], per * slope[1:]
        rows = Rows.of(np.hstack([bend[:-1] - begin, -end]), np.hstack([begin, bend[1:] + end]))
        return CurveBounds(curve, grid, np.abs(slope), tool_speeds(robot, q, slope), rows)

    def timed(self, limits: MotionLimits, share: Array, slower: float = 1.0) -> TimedCurve:
        """Time along the curve, within limits at the places of the grid; so many times slower.

        Of their velocities, accelerations and tool speed a share (m - 1, 2 n + 1) on each piece.

        Raises:
            PathError: the motion would have to stop in between.
        """
        n = self.slope.shape[1]
        there = np.minimum(share[np.r_[0, : len(share)]], share[np.r_[: len(share), -1]])
        with np.errstate(divide="ignore"):
            most = (there[:, :n] * limits.velocity / self.slope).min(axis=1)
            most = np.minimum(most, there[:, -1] * limits.tool_speed / self.tool)
        accelerations = np.tile(share[:, n:-1] * limits.acceleration, (1, 2))
        x = fastest_speeds(np.minimum(most, FASTEST) ** 2, self.rows, accelerations)
        rate = np.sqrt(x)
        with np.errstate(divide="ignore"):
            steps = 2.0 * np.diff(self.grid) / (rate[:-1] + rate[1:])
        time = np.concatenate([[0.0], np.cumsum(steps)])
        if not np.isfinite(time).all():
            raise PathError("no timing was found: the motion would have to stop in between")
        return TimedCurve(self.curve, self.grid, x / slower**2, time * slower)
