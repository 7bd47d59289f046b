"""A curve with times: when it passes each place, and samples of it.

Between two places of the grid d^2s/dt^2 = u is constant, so x = (ds/dt)^2 runs straight there, and
d^2q/dt^2 = q'(s) u + q''(s) x is a parabola in s, whose Bernstein coefficients bound it. The speeds
are the fastest with which these and x are inside their limits (`fastest_speeds`), so that all
limits hold everywhere along the curve. What rounding adds is taken back by running slower.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import BSpline

from coverable_arrays import Array
from feasibility.paths import PathError
from feasibility.timing.fastest_speeds import Rows, fastest_speeds
from feasibility.timing.sampled_trajectory import Trajectory
from feasibility.timing.smoothing import Curve, inside
from feasibility.timing.speed_limits import MotionLimits, fine_grid, squared_speeds, tool_slopes
from robots import Robot

TICK = 1e-9  # [s]
CROWDED = 0.2  # [1] share of the period; samples nearer to a passage of a centre are left out


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
    limits: MotionLimits

    @property
    def duration(self) -> float:
        """Seconds from start to end."""
        return float(self.time[-1])

    def slowed(self, times: float) -> TimedCurve:
        """The same motion, so many times slower."""
        return replace(self, x=self.x / times**2, time=self.time * times)

    def at(self, time: Array) -> tuple[Array, Array, Array]:
        """q, its velocity and its acceleration (k, n) at times (k,)."""
        i = np.clip(np.searchsorted(self.time, time, side="right") - 1, 0, len(self.time) - 2)
        u = 0.5 * (self.x[i + 1] - self.x[i]) / (self.grid[i + 1] - self.grid[i])
        past = time - self.time[i]
        rate = np.sqrt(self.x[i])
        k = np.clip(self.grid[i] + past * (rate + 0.5 * u * past), self.grid[i], self.grid[i + 1])
        rate = np.where(time < self.duration - TICK, np.maximum(rate + u * past, 0.0), 0.0)[:, None]
        spline = self.curve.spline()
        q, slope, second = (spline.derivative(order)(k) for order in range(3))
        return q, slope * rate, second * rate**2 + slope * u[:, None]


@dataclass(frozen=True, eq=False, slots=True)
class SpeedBounds:
    """A curve with all that bounds its speeds but the limits of accelerations."""

    curve: Curve
    grid: Array
    """(m,) places k of the curve."""
    most: Array
    """(m,) 1/s^2, upper bounds on (dk/dt)^2."""
    rows: Rows
    """(m - 1, 3 n) what (dk/dt)^2 at both ends of a piece adds to accelerations in it."""
    limits: MotionLimits


def speed_bounds(robot: Robot, curve: Curve, limits: MotionLimits) -> SpeedBounds:
    """All that is known of a curve's speeds before accelerations are limited."""
    spline = curve.spline()
    grid = fine_grid(robot, spline, curve.pieces)
    most = squared_speeds(robot, spline, grid, limits)
    return SpeedBounds(curve, grid, most, Rows.of(*acceleration_rows(spline, grid)), limits)


def timed_curve(bounds: SpeedBounds, share: Array | float = 1.0) -> TimedCurve:
    """Time along a curve, with so much of each joint's acceleration, all of it by default.

    Args:
        bounds: the curve.
        share: (m - 1, n) of each piece.

    Raises:
        PathError: the motion would have to stop in between.
    """
    acceleration = np.atleast_2d(share * bounds.limits.acceleration)
    limits, grid, most, rows = bounds.limits, bounds.grid, bounds.most, bounds.rows
    all_three = np.tile(acceleration, (1, 3))
    x = fastest_speeds(most, rows, all_three)
    over = np.abs(rows.c * x[:-1, None] + rows.d * x[1:, None]) / all_three
    x = x / max(float(over.max()), float((x / most).max()), 1.0)
    rate = np.sqrt(x)
    time = np.concatenate([[0.0], np.cumsum(2.0 * np.diff(grid) / (rate[:-1] + rate[1:]))])
    if not np.isfinite(time).all():
        raise PathError("no timing was found: the motion would have to stop in between")
    return TimedCurve(bounds.curve, grid, x, time, limits)


def samples(robot: Robot, timed: TimedCurve, period: float, with_tool: bool = True) -> Trajectory:
    """A timed curve every `period` seconds, and where it passes the centres of cells.

    Without the tool its speeds are 0, which takes less time.
    """
    curve = timed.curve
    # Whole nanoseconds, which is what a ROS message can hold.
    passages = np.round(timed.time[np.searchsorted(timed.grid, curve.marks.astype(float))], 9)
    regular = np.round(np.arange(0.0, timed.duration, period), 9)
    after = np.searchsorted(passages, regular)
    known = np.concatenate([[-np.inf], passages, [np.inf]])
    apart = np.minimum(regular - known[after], known[after + 1] - regular)
    regular = regular[apart > CROWDED * period]
    time = np.concatenate([passages, regular])
    order = np.argsort(time, kind="stable")
    time = time[order]
    cell = np.concatenate([curve.cell, np.full(len(regular), -1, dtype=np.int64)])[order]
    q, dq, ddq = timed.at(time)
    q = inside(robot, q)
    return Trajectory(
        joint_names=robot.joint_names, time=time, q=q, dq=dq + 0.0, ddq=ddq + 0.0,
        tool_speed=tool_slopes(robot, q, dq) if with_tool else np.zeros(len(q)), cell=cell,
    )  # fmt: skip


def acceleration_rows(spline: BSpline, grid: Array) -> tuple[Array, Array]:
    """(m - 1, 3 n) twice: what x at the beginning and at the end of a piece adds to accelerations.

    Those at its two ends, and between them the middle Bernstein coefficient.
    """
    h = np.diff(grid)[:, None]
    slope, second = spline.derivative(1), spline.derivative(2)
    middle = grid[:-1] + 0.5 * h[:, 0]
    slopes, seconds = slope(grid), second(grid)
    per = 0.5 / h  # u is (y - x) of that
    begin = seconds[:-1] - per * slopes[:-1], per * slopes[:-1]
    end = -per * slopes[1:], seconds[1:] + per * slopes[1:]
    curved, sloped = 0.5 * second(middle), per * slope(middle)
    inner = [
        2.0 * (curved + sign * sloped) - 0.5 * (a + b)
        for sign, a, b in zip((-1.0, 1.0), begin, end, strict=True)
    ]
    first, last = (np.hstack([begin[k], inner[k], end[k]]) for k in (0, 1))
    return first, last
