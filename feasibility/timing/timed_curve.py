"""A curve with times: when it passes each place, and samples of it.

The speeds are the fastest that toppra finds. What accelerations are over, from its own rounding, is
taken back by running slower there, or a little slower altogether, so that all limits hold
everywhere along the curve.

Between two places of the grid d^2s/dt^2 = u is constant, so x = (ds/dt)^2 runs straight there, and
d^2q/dt^2 = q'(s) u + q''(s) x is a parabola in s, whose Bernstein coefficients bound it.

H. Pham and Q.-C. Pham, A new approach to time-optimal path parameterization based on reachability
analysis, IEEE Transactions on Robotics 34 (2018).
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.spatial import cKDTree

from feasibility.paths import PathError
from feasibility.timing.sampled_trajectory import Trajectory
from feasibility.timing.smoothing import Curve, inside
from feasibility.timing.speed_limits import MotionLimits, fine_grid, squared_speeds, tool_slopes
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


def parameterised(
    spline: BSpline, grid: Array, unit: float, most: Array, acceleration: Array
) -> Array:
    """(m,) the largest (ds/dt)^2 from rest to rest, s = unit * k, as toppra finds it."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # its sources hold escapes that Python frowns at
        from toppra.algorithm import TOPPRA
        from toppra.constraint import JointAccelerationConstraint, LinearConstraint
        from toppra.interpolator import AbstractGeometricPath

    class Path(AbstractGeometricPath):
        """The curve in the form that toppra needs."""

        dof = spline.c.shape[1]
        path_interval = np.array([grid[0], grid[-1]]) * unit

        def __call__(self, s: Any, order: int = 0) -> Array:
            """Derivatives by s."""
            k = np.clip(np.asarray(s) / unit, grid[0], grid[-1])
            return np.asarray(spline.derivative(order)(k)) / unit**order

    class Speed(LinearConstraint):
        """Bounds on (ds/dt)^2."""

        def __init__(self) -> None:
            """No other variables."""
            super().__init__()
            self.identical = True

        def compute_constraint_params(self, path: Any, gridpoints: Array) -> tuple[Any, ...]:
            """Only the bounds on (ds/dt)^2."""
            bounds = np.column_stack([np.zeros(len(gridpoints)), most * unit**2])
            return None, None, None, None, None, None, bounds

    solver = TOPPRA(
        [Speed(), JointAccelerationConstraint(np.column_stack([-acceleration, acceleration]))],
        Path(), gridpoints=grid * unit, solver_wrapper="seidel",
    )  # fmt: skip
    _, rate, _ = solver.compute_parameterization(0.0, 0.0)
    if rate is None or not np.isfinite(rate).all():
        raise PathError("no timing was found that keeps to the velocities and accelerations")
    return np.asarray(rate) ** 2
