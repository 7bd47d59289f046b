"""A curve with times: when it passes each place, and samples of it.

The speeds are the fastest that `parameterisation` finds. What accelerations are over, from toppra's
own rounding, is taken back by running slower there, or a little slower altogether, so that all
limits hold everywhere along the curve.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from feasibility.paths import PathError
from feasibility.timing.sampled_trajectory import Trajectory
from feasibility.timing.smoothing import Curve, inside
from feasibility.timing.speed_limits import MotionLimits, fine_grid, squared_speeds, tool_slopes
from feasibility.timing.time_optimal import acceleration_excess, parameterised
from robots import Robot

Array = NDArray[np.float64]

ALLOWED = 0.999  # [1] share of an acceleration limit that toppra is given
TRIES = 4  # runs of toppra, each slower where the one before was over an acceleration limit
MOST_OVER = 4.0  # [1] share of an acceleration limit that running slower altogether may mend
RUSHES = (1000.0, 100.0, 10.0, 1.0, 0.1)  # [1] times the median of (dk/dt)^2: caps, one by one
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
        PathError: toppra finds no timing.
    """
    spline = curve.spline()
    grid = fine_grid(robot, spline, curve.pieces)
    most = squared_speeds(robot, spline, grid, limits)
    # In s = k * unit, speeds are about 1, which is what the solver's tolerances are made for.
    typical = float(np.median(most))
    unit = 1.0 / np.sqrt(typical)
    # Over pieces on which the arm hardly moves, k could rush so that the solver's numbers run out.
    for rush in RUSHES:
        try:
            x = _within(spline, grid, unit, np.minimum(most, rush * typical), limits)
            break
        except PathError:
            if rush == RUSHES[-1]:
                raise
    over = acceleration_excess(spline, grid, x, limits.acceleration)
    worst = max(float(over.max()), float((x / most).max()))
    if worst > 1.0:
        if worst > MOST_OVER:
            raise PathError(
                f"no timing was found that keeps to the accelerations; they are {worst:.2g} times "
                "too large at a turn"
            )
        x = x / worst
    rate = np.sqrt(x)
    time = np.concatenate([[0.0], np.cumsum(2.0 * np.diff(grid) / (rate[:-1] + rate[1:]))])
    if not np.isfinite(time).all():
        raise PathError("no timing was found: the motion would have to stop in between")
    return TimedCurve(curve, grid, x, time, limits)


def _within(
    spline: BSpline, grid: Array, unit: float, allowed: Array, limits: MotionLimits
) -> Array:
    """(m,) (dk/dt)^2 at most `allowed` (m,), with accelerations over their limits where it must be.

    Raises:
        PathError: toppra finds none.
    """
    for _ in range(TRIES):
        x = parameterised(spline, grid, unit, allowed, ALLOWED * limits.acceleration) / unit**2
        over = acceleration_excess(spline, grid, x, limits.acceleration)
        if over.max() <= 1.0:
            break
        # Slower there and around, where toppra's own rounding has got too fast.
        wide = np.maximum.reduce([np.roll(np.append(over, 0.0), k) for k in range(-2, 4)])
        slower = np.minimum(allowed, x / np.maximum(wide, 1.0) ** 2)
        allowed = np.where(wide > 1.0, slower, allowed)
    return x


def samples(robot: Robot, timed: TimedCurve, period: float) -> Trajectory:
    """A timed curve every `period` seconds, and where it passes the centres of cells."""
    curve = timed.curve
    # Whole nanoseconds, which is what a ROS message can hold.
    passages = np.round(timed.time[np.searchsorted(timed.grid, curve.marks.astype(float))], 9)
    regular = np.round(np.arange(0.0, timed.duration, period), 9)
    nearest = np.searchsorted(passages, regular)
    apart = np.minimum(
        np.abs(regular - passages[np.minimum(nearest, len(passages) - 1)]),
        np.abs(regular - passages[np.maximum(nearest - 1, 0)]),
    )
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
