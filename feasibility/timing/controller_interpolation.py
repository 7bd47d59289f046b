"""What a controller makes of samples: the quintic or the cubic through two samples in a row.

A ROS `joint_trajectory_controller` runs quintics through positions, velocities and accelerations,
or cubics where no accelerations are given. Both are written by Bernstein coefficients here: a
polynomial nowhere leaves the range of its coefficients, so these bound it everywhere.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from feasibility.timing.sampled_trajectory import Trajectory
from feasibility.timing.speed_limits import MotionLimits, tool_slopes
from feasibility.verdict import Walk
from robots import Robot

Array = NDArray[np.float64]
Kind = Literal["quintic", "cubic"]
KINDS: tuple[Kind, ...] = get_args(Kind)

PLACES = 4  # at which each polynomial is evaluated, its first end among them
HALVINGS = 3  # times that each polynomial is halved, so that its coefficients bound it closely


def coefficients(run: Trajectory, kind: Kind) -> Array:
    """(degree + 1, m, n) Bernstein coefficients of the m polynomials between m + 1 samples."""
    h = np.diff(run.time)[:, None]
    q, last, slope, end_slope = run.q[:-1], run.q[1:], h * run.dq[:-1], h * run.dq[1:]
    if kind == "cubic":
        return np.stack([q, q + slope / 3.0, last - end_slope / 3.0, last])
    bend, end_bend = h**2 * run.ddq[:-1], h**2 * run.ddq[1:]
    return np.stack(
        [
            q,
            q + slope / 5.0,
            q + 2.0 * slope / 5.0 + bend / 20.0,
            last - 2.0 * end_slope / 5.0 + end_bend / 20.0,
            last - end_slope / 5.0,
            last,
        ]
    )


def derivative(run: Trajectory, points: Array) -> Array:
    """Bernstein coefficients of the derivative by time."""
    h = np.diff(run.time)[:, None]
    return np.asarray((len(points) - 1) * np.diff(points, axis=0) / h)


def halved(points: Array) -> Array:
    """Bernstein coefficients of both halves of each polynomial (de Casteljau), halves in a row."""
    left, right, row = [points[0]], [points[-1]], points
    while len(row) > 1:
        row = 0.5 * (row[:-1] + row[1:])
        left.append(row[0])
        right.append(row[-1])
    return np.concatenate([np.stack(left), np.stack(right[::-1])], axis=1)


def closely(points: Array) -> Array:
    """Coefficients after some halvings: their range is hardly wider than that of the values."""
    for _ in range(HALVINGS):
        points = halved(points)
    return points


def values(points: Array, places: int) -> Array:
    """(m * places, n) values of the m polynomials at 0, 1/places, ... of each, in order."""
    degree = len(points) - 1
    t = np.arange(places)[:, None] / places
    k = np.arange(degree + 1)
    basis = np.array([math.comb(degree, i) for i in k]) * t**k * (1.0 - t) ** (degree - k)
    return np.einsum("tk,kin->itn", basis, points).reshape(-1, points.shape[2])


def motion_between(run: Trajectory, kind: Kind, places: int) -> Walk:
    """The polynomials evaluated at some places each, as a motion that a replay can check."""
    q = np.vstack([values(coefficients(run, kind), places), run.q[-1:]])
    cell = np.full(len(q), -1, dtype=np.int64)
    cell[::places] = run.cell
    return Walk(q=q, cell=cell)


@dataclass(frozen=True, eq=False, slots=True)
class Used:
    """How much of its limits a controller uses that interpolates samples; 1 is all."""

    velocity: Array
    """(n,) share of each joint's velocity, a bound that holds between samples too."""
    acceleration: Array
    """(n,) the same for accelerations."""
    tool_speed: float
    """Share of the tool's speed, from `PLACES` between any two samples."""

    @property
    def too_fast(self) -> float:
        """How many times slower all must run to keep to the limits."""
        root = float(np.sqrt(self.acceleration.max(initial=0.0)))
        return max(float(self.velocity.max(initial=0.0)), root, self.tool_speed)


def used(robot: Robot, run: Trajectory, limits: MotionLimits) -> Used:
    """How much of its limits a trajectory uses, however it is interpolated.

    Args:
        robot: the arm.
        run: the samples; a single one is an arm at rest.
        limits: of joints and tool.
    """
    if len(run) < 2:
        return Used(np.zeros(robot.n), np.zeros(robot.n), 0.0)
    velocity, tool = np.zeros(robot.n), 0.0
    for kind in KINDS:
        points = coefficients(run, kind)
        slopes = derivative(run, points)
        velocity = np.maximum(velocity, np.abs(closely(slopes)).max(axis=(0, 1)))
        tool = max(
            tool, _fastest(tool_slopes(robot, values(points, PLACES), values(slopes, PLACES)))
        )
    share = accelerations_used(run, limits)
    return Used(velocity / limits.velocity, share, tool / limits.tool_speed)


def accelerations_used(run: Trajectory, limits: MotionLimits) -> Array:
    """(n,) share of its acceleration that each joint uses at most, however it is interpolated."""
    most = np.zeros(run.q.shape[1])
    for kind in KINDS:
        bends = derivative(run, derivative(run, coefficients(run, kind)))
        most = np.maximum(most, np.abs(closely(bends)).max(axis=(0, 1)))
    return np.asarray(most / limits.acceleration)


def _fastest(speed: Array) -> float:
    """m/s, the tool's largest speed over all polynomials, from its speed at `PLACES` of each.

    Between two places a parabola is higher by up to 1/8 of its second difference than the larger
    of both; twice that is allowed for.
    """
    rows = speed.reshape(-1, PLACES)
    rows = np.column_stack([rows, np.append(rows[1:, 0], 0.0)])  # it ends where the next begins
    bent = np.abs(np.diff(rows, n=2, axis=1)).max(axis=1)
    return float((rows.max(axis=1) + 0.25 * bent).max())


def past_limits(robot: Robot, run: Trajectory) -> float:
    """rad or m, how far a controller that interpolates samples may go past a joint's limits."""
    past = 0.0
    for kind in KINDS:
        q = closely(coefficients(run, kind))
        past = max(past, float(np.maximum(robot.lower - q, q - robot.upper).max(initial=0.0)))
    return past
