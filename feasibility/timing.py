"""Time along a path: as fast as joints and tool may, from rest to rest.

The path's straight lines are blended into a smooth curve (`blend`); toppra finds the largest speed
along it that velocities, accelerations and the tool's speed allow (`parameterisation`). Velocities
hold by construction (`speed_limits`). What accelerations are over, from toppra's own rounding, is
taken back by running everything a little slower. So all limits hold along the curve, between
samples too. (A controller that puts curves of its own through the samples may pass accelerations
for a moment; sample more densely where that matters.) The samples at last are replayed like any
witness, as a motion of straight lines.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from feasibility.blend import Curve, blended, inside
from feasibility.certificate import replay
from feasibility.coverage import CoveragePath
from feasibility.parameterisation import acceleration_excess, parameterised
from feasibility.route import PathError
from feasibility.speed_limits import (
    MotionLimits,
    fine_grid,
    motion_limits,
    number,
    squared_speeds,
    tool_slopes,
)
from feasibility.trajectory import Trajectory
from feasibility.verdict import Walk
from robots import Robot

Array = NDArray[np.float64]

DEFAULT_SPEED = 0.1  # [m/s] of the tool point
DEFAULT_PERIOD = 0.02  # [s] between samples
ALLOWED = 0.999  # [1] share of an acceleration limit that toppra is given
TRIES = 4  # runs of toppra, each slower where the one before was over an acceleration limit
MOST_OVER = 4.0  # [1] share of an acceleration limit that running slower altogether may mend
SHORTEST, LONGEST = 0.0001, 10.0  # [s], periods that can be asked for
FINER = 4  # times that the period may be halved
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

    def at(self, time: Array) -> tuple[Array, Array, Array]:
        """q, its velocity and its acceleration (k, n) at times (k,)."""
        i = np.clip(np.searchsorted(self.time, time, side="right") - 1, 0, len(self.time) - 2)
        u = 0.5 * (self.x[i + 1] - self.x[i]) / (self.grid[i + 1] - self.grid[i])
        past = time - self.time[i]
        rate = np.sqrt(self.x[i])
        k = np.clip(self.grid[i] + past * (rate + 0.5 * u * past), self.grid[i], self.grid[i + 1])
        rate = np.where(time < self.duration, np.maximum(rate + u * past, 0.0), 0.0)[:, None]
        spline = self.curve.spline()
        q, slope, bend = (spline.derivative(order)(k) for order in range(3))
        return q, slope * rate, bend * rate**2 + slope * u[:, None]


def trajectory(
    path: CoveragePath,
    speed: float = DEFAULT_SPEED,
    *,
    velocity: ArrayLike | None = None,
    acceleration: ArrayLike | None = None,
    period: float = DEFAULT_PERIOD,
) -> Trajectory:
    """Run a path as fast as its limits allow.

    Args:
        path: the path.
        speed: m/s, largest speed of the tool point.
        velocity: rad/s or m/s, of all joints or (n,) of each; the URDF's limits by default.
        acceleration: rad/s^2 or m/s^2, of all joints or (n,) of each; by default what takes a joint
            to its largest velocity in half a second.
        period: s between samples; a sample more stands where a cell's centre is passed. It is
            halved where the straight lines between samples would leave the tolerance.

    Returns:
        The samples, accepted by the independent replay as a motion of straight lines.

    Raises:
        PathError: a number is not as it should be, or no such motion was found.

    Example:
        >>> from feasibility import Task, check
        >>> from feasibility.coverage import coverage_path
        >>> from robots import load_robot
        >>> from surfaces import plane
        >>> plate = plane((0.4, 0.6), (-0.1, 0.1), position=(0, 0, 0.3), side="outside")
        >>> verdict = check(load_robot("ur5"), plate.cells(2, 3), Task(standoff=0.02, cone_deg=30))
        >>> run = trajectory(coverage_path(verdict), speed=0.1)
        >>> round(float(run.tool_speed.max()), 2), run.duration > run.tool_way / 0.1
        (0.1, True)
    """
    robot, cells, task = path.robot, path.cells, path.task
    limits = motion_limits(robot, speed, velocity, acceleration)
    if not SHORTEST <= number(period) <= LONGEST:
        raise PathError(f"the period must be {SHORTEST} to {LONGEST} seconds, got {period!r}")
    if len(np.unique(path.walk.q, axis=0)) == 1:
        return _standing(robot, path.walk)
    timed = timed_curve(robot, blended(robot, cells, task, path.walk), limits)
    refusal = ""
    for _ in range(FINER + 1):
        run = samples(robot, timed, period)
        replayed = replay(robot, cells, task, run.walk, path.needed)
        if replayed.accepted:
            return run
        refusal = replayed.refusal
        period *= 0.5
    raise PathError(f"the independent replay refuses the timed motion: {refusal}")


def timed_curve(robot: Robot, curve: Curve, limits: MotionLimits) -> TimedCurve:
    """Time along a curve.

    Raises:
        PathError: toppra finds no way to run it.
    """
    spline = curve.spline()
    grid = fine_grid(robot, spline, curve.pieces)
    most = squared_speeds(robot, spline, grid, limits)
    # In s = k * unit, speeds are about 1, which is what the solver's tolerances are made for.
    unit = 1.0 / float(np.sqrt(np.median(most)))
    allowed = most
    for _ in range(TRIES):
        x = parameterised(spline, grid, unit, allowed, ALLOWED * limits.acceleration) / unit**2
        over = acceleration_excess(spline, grid, x, limits.acceleration)
        if over.max() <= 1.0:
            break
        # Slower there and around, where toppra's own rounding has got too fast.
        wide = np.maximum.reduce([np.roll(np.append(over, 0.0), k) for k in range(-2, 4)])
        slower = np.minimum(allowed, x / np.maximum(wide, 1.0) ** 2)
        allowed = np.where(wide > 1.0, slower, allowed)
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
        raise PathError("no timing was found: the motion would have to stop on its way")
    return TimedCurve(curve, grid, x, time, limits)


def samples(robot: Robot, timed: TimedCurve, period: float) -> Trajectory:
    """A timed curve every `period` seconds, and where it passes the centres of cells."""
    curve = timed.curve
    passages = timed.time[np.searchsorted(timed.grid, curve.marks.astype(float))]
    regular = np.arange(0.0, timed.duration, period)
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
        joint_names=robot.joint_names, time=time, q=q, dq=dq, ddq=ddq,
        tool_speed=tool_slopes(robot, q, dq), cell=cell,
    )  # fmt: skip


def _standing(robot: Robot, walk: Walk) -> Trajectory:
    """The trajectory of a motion that stands still: one sample."""
    q, nothing = walk.q[:1], np.zeros((1, robot.n))
    return Trajectory(
        joint_names=robot.joint_names, time=np.zeros(1), q=q, dq=nothing, ddq=nothing,
        tool_speed=np.zeros(1), cell=walk.cell[:1],
    )  # fmt: skip
