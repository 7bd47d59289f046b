"""A curve with times: when it passes each place, and samples of it.

Between two places of the grid d^2s/dt^2 = u is constant, so x = (ds/dt)^2 runs straight there, and
d^2q/dt^2 = q'(s) u + q''(s) x is a parabola in s, whose Bernstein coefficients bound it. The speeds
are the fastest with which these and x are inside their limits (`fastest_speeds`), so that all
limits hold everywhere along the curve. What rounding adds is taken back by running slower.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.spatial import cKDTree

from feasibility.paths import PathError
from feasibility.timing.fastest_speeds import fastest_speeds
from feasibility.timing.sampled_trajectory import Trajectory
from feasibility.timing.smoothing import Curve, inside
from feasibility.timing.speed_limits import MotionLimits, fine_grid, squared_speeds, tool_slopes
from robots import Robot

Array = NDArray[np.float64]

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
        q, slope, bend = (spline.derivative(order)(k) for order in range(3))
        return q, slope * rate, bend * rate**2 + slope * u[:, None]


def timed_curve(robot: Robot, curve: Curve, limits: MotionLimits) -> TimedCurve:
    """Time along a curve.

    Raises:
        PathError: the motion would have to stop in between.
    """
    spline = curve.spline()
    grid = fine_grid(robot, spline, curve.pieces)
    most = squared_speeds(robot, spline, grid, limits)
    first, last = acceleration_rows(spline, grid)
    shares = np.tile(limits.acceleration, 3)
    x = fastest_speeds(most, first / shares, last / shares)
    over = acceleration_excess(spline, grid, x, limits.acceleration)
    x = x / max(float(over.max()), float((x / most).max()), 1.0)
    rate = np.sqrt(x)
    time = np.concatenate([[0.0], np.cumsum(2.0 * np.diff(grid) / (rate[:-1] + rate[1:]))])
    if not np.isfinite(time).all():
        raise PathError("no timing was found: the motion would have to stop in between")
    return TimedCurve(curve, grid, x, time, limits)


def samples(robot: Robot, timed: TimedCurve, period: float) -> Trajectory:
    """A timed curve every `period` seconds, and where it passes the centres of cells."""
    curve = timed.curve
    # Whole nanoseconds, which is what a ROS message can hold.
    passages = np.round(timed.time[np.searchsorted(timed.grid, curve.marks.astype(float))], 9)
    regular = np.round(np.arange(0.0, timed.duration, period), 9)
    apart, _ = cKDTree(passages[:, None]).query(regular[:, None], p=1)
    regular = regular[apart > CROWDED * period]
    time = np.concatenate([passages, regular])
    order = np.argsort(time, kind="stable")
    time = time[order]
    cell = np.concatenate([curve.cell, np.full(len(regular), -1, dtype=np.int64)])[order]
    q, dq, ddq = timed.at(time)
    q = inside(robot, q)
    return Trajectory(
        joint_names=robot.joint_names, time=time, q=q, dq=dq + 0.0, ddq=ddq + 0.0,
        tool_speed=tool_slopes(robot, q, dq), cell=cell,
    )  # fmt: skip


def acceleration_excess(spline: BSpline, grid: Array, x: Array, most: Array) -> Array:
    """(m - 1,) largest share of its limit that a joint's acceleration has on each piece."""
    h = np.diff(grid)
    u = 0.5 * np.diff(x) / h
    slope, bend = spline.derivative(1), spline.derivative(2)
    values = [
        slope(grid[:-1] + part * h) * u[:, None]
        + bend(grid[:-1] + part * h) * (x[:-1] + part * np.diff(x))[:, None]
        for part in (0.0, 0.5, 1.0)
    ]
    # The last place of a piece is evaluated on the piece: second derivatives are continuous.
    inner = 2.0 * values[1] - 0.5 * (values[0] + values[2])
    shares = [(np.abs(value) / most).max(axis=1) for value in (values[0], inner, values[2])]
    return np.asarray(np.max(shares, axis=0))


def acceleration_rows(spline: BSpline, grid: Array) -> tuple[Array, Array]:
    """(m - 1, 3 n) twice: what x at the beginning and at the end of a piece adds to accelerations.

    Those at its two ends, and between them the middle Bernstein coefficient.
    """
    h = np.diff(grid)[:, None]
    slope, bend = spline.derivative(1), spline.derivative(2)
    middle = grid[:-1] + 0.5 * h[:, 0]
    slopes, bends = slope(grid), bend(grid)
    per = 0.5 / h  # u is (y - x) of that
    begin = bends[:-1] - per * slopes[:-1], per * slopes[:-1]
    end = -per * slopes[1:], bends[1:] + per * slopes[1:]
    bent, sloped = 0.5 * bend(middle), per * slope(middle)
    inner = [
        2.0 * (bent + sign * sloped) - 0.5 * (a + b)
        for sign, a, b in zip((-1.0, 1.0), begin, end, strict=True)
    ]
    first, last = (np.hstack([begin[k], inner[k], end[k]]) for k in (0, 1))
    return first, last
