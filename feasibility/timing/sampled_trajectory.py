"""A trajectory: what each joint does at sampled times, and what a controller makes of that.

A ROS `joint_trajectory_controller` runs quintics through positions, velocities and accelerations,
or cubics where no accelerations are given. Both are written by Bernstein coefficients here: a
polynomial nowhere leaves the range of its coefficients, so these bound it everywhere.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from coverable_arrays import Array, Ints, Mask
from coverable_errors import ArgumentError
from feasibility.timing.speed_limits import MotionLimits, tool_slopes
from feasibility.verdict import Walk
from robots import Robot

Kind = Literal["quintic", "cubic"]
KINDS: tuple[Kind, ...] = get_args(Kind)

PLACES = 4  # at which each polynomial is evaluated, its first end among them
ROUNDING = 1e-12  # [rad] or [m] that is left free inside a joint's limits
HALVINGS = 3  # times that each polynomial is halved, so that its coefficients bound it closely


@dataclass(frozen=True, eq=False, slots=True)
class Trajectory:
    """k samples of a motion of n joints, from rest to rest.

    Raises:
        ArgumentError: the arrays do not fit together, a number is not finite, or the times do not
            rise from 0 or later.
    """

    joint_names: tuple[str, ...]
    """The n joints."""
    time: Array
    """(k,) s, rising."""
    q: Array
    """(k, n) rad or m."""
    dq: Array
    """(k, n) rad/s or m/s."""
    ddq: Array
    """(k, n) rad/s^2 or m/s^2; from the sample on, where it jumps."""
    tool_speed: Array
    """(k,) m/s."""
    cell: Ints
    """(k,) flat index of the cell whose centre the tool point passes then; -1 in between."""
    collisions: tuple[str, ...] = ()
    """What the replay of the motion checked: some of self, surface and scene."""
    working: Mask | None = None
    """(k,) at which samples the tool works, neither lifted nor beyond the border, nor on its way to
    the surface; None for all."""

    def __post_init__(self) -> None:
        """Copy, check and write-protect the arrays."""
        object.__setattr__(self, "joint_names", tuple(self.joint_names))
        for name in ("time", "q", "dq", "ddq", "tool_speed", "cell"):
            array = np.array(getattr(self, name), dtype=np.int64 if name == "cell" else float)
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        if self.working is not None:
            working = np.array(self.working, dtype=bool)
            working.flags.writeable = False
            object.__setattr__(self, "working", working)
        faults = self._faults()
        if faults:
            raise ArgumentError(faults, "trajectory")

    def _faults(self) -> list[str]:
        """All that is wrong with the arrays."""
        k, n = len(self.time), len(self.joint_names)
        faults = []
        if n == 0 or len(set(self.joint_names)) < n:
            faults.append("there must be at least one joint, and no name twice")
        if self.time.ndim != 1 or k == 0:
            faults.append("there must be at least one sample")
        for name, shape in (
            ("q", (k, n)), ("dq", (k, n)), ("ddq", (k, n)), ("tool_speed", (k,)), ("cell", (k,))
        ):  # fmt: skip
            array = getattr(self, name)
            if array.shape != shape:
                faults.append(f"{name} must have shape {shape}, got {array.shape}")
            elif not np.isfinite(array).all():
                faults.append(f"{name} must hold finite numbers")
        if self.working is not None and self.working.shape != (k,):
            faults.append(f"working must have shape {(k,)}, got {self.working.shape}")
        if not np.isfinite(self.time).all() or not (self.time >= 0.0).all():
            faults.append("times must be finite and not negative (seconds)")
        elif not (np.diff(self.time) > 0.0).all():
            faults.append("times must rise from sample to sample")
        if (self.cell < -1).any():
            faults.append("cells must be flat indices, or -1 in between")
        return faults

    def __len__(self) -> int:
        """Number of samples."""
        return len(self.time)

    @property
    def duration(self) -> float:
        """Seconds from the first sample to the last."""
        return float(self.time[-1] - self.time[0])

    @property
    def tool_way(self) -> float:
        """m, length of the tool point's path, from its speed at the samples (trapezoidal rule)."""
        return float(np.trapezoid(self.tool_speed, self.time))

    @property
    def walk(self) -> Walk:
        """The samples as a motion of straight lines, which a replay can check."""
        return Walk(q=self.q, cell=self.cell)

    def __repr__(self) -> str:
        """One line: joints, samples and seconds."""
        n = len(self.joint_names)
        return f"Trajectory({n} joints, {len(self)} samples, {self.duration:.2f} s)"


def coefficients(run: Trajectory, kind: Kind) -> Array:
    """(degree + 1, m, n) Bernstein coefficients of the m polynomials between m + 1 samples."""
    h = np.diff(run.time)[:, None]
    q, last, slope, end_slope = run.q[:-1], run.q[1:], h * run.dq[:-1], h * run.dq[1:]
    if kind == "cubic":
        return np.stack([q, q + slope / 3.0, last - end_slope / 3.0, last])
    second, end_second = h**2 * run.ddq[:-1], h**2 * run.ddq[1:]
    return np.stack(
        [
            q,
            q + slope / 5.0,
            q + 2.0 * slope / 5.0 + second / 20.0,
            last - 2.0 * end_slope / 5.0 + end_second / 20.0,
            last - end_slope / 5.0,
            last,
        ]
    )


def derivative(run: Trajectory, points: Array) -> Array:
    """Bernstein coefficients of the derivative by time."""
    h = np.diff(run.time)[:, None]
    return np.asarray((len(points) - 1) * np.diff(points, axis=0) / h)


def accelerations(run: Trajectory, kind: Kind) -> Array:
    """Bernstein coefficients of the second derivatives by time, as `derivative` twice; quicker."""
    h = np.diff(run.time)[:, None]
    start, end = run.dq[:-1], run.dq[1:]
    ahead = np.diff(run.q, axis=0) / h
    if kind == "cubic":
        first = (6.0 * ahead - 4.0 * start - 2.0 * end) / h
        return np.stack([first, (2.0 * start + 4.0 * end - 6.0 * ahead) / h])
    first, last = run.ddq[:-1], run.ddq[1:]
    inner = (20.0 * ahead - 12.0 * start - 8.0 * end) / h - 2.0 * first + last
    other = (12.0 * end + 8.0 * start - 20.0 * ahead) / h + first - 2.0 * last
    return np.stack([first, inner, other, last])


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


def largest(points: Array, of: Callable[[Array], Array] = np.asarray) -> Array:
    """(n,) the largest value `of` polynomials, such as `np.abs` of them; a close bound.

    Only what may exceed the values at all ends is halved.
    """
    reached = of(points[[0, -1]]).max(axis=(0, 1))
    more = (of(points).max(axis=0) > reached).any(axis=1)
    if not more.any():
        return np.asarray(reached)
    return np.maximum(reached, of(closely(points[:, more])).max(axis=(0, 1)))


def values(points: Array, places: int) -> Array:
    """(m * places, n) values of the m polynomials at 0, 1/places, ... of each, in order."""
    degree = len(points) - 1
    t = np.arange(places)[:, None] / places
    k = np.arange(degree + 1)
    basis = np.array([math.comb(degree, i) for i in k]) * t**k * (1.0 - t) ** (degree - k)
    return np.einsum("tk,kin->itn", basis, points).reshape(-1, points.shape[2])


def at_times(run: Trajectory, time: Array) -> Array:
    """(k, n) joints at times (k,) s, on the quintics through the samples; at rest outside them."""
    if len(run) == 1:
        return np.tile(run.q, (len(time), 1))
    inside = np.clip(time, run.time[0], run.time[-1])
    piece = np.clip(np.searchsorted(run.time, inside, side="right") - 1, 0, len(run) - 2)
    points = coefficients(run, "quintic")[:, piece]
    share = ((inside - run.time[piece]) / np.diff(run.time)[piece])[:, None]
    while len(points) > 1:  # de Casteljau
        points = (1.0 - share) * points[:-1] + share * points[1:]
    return np.asarray(points[0])


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
    """Share of the tool's speed, from `PLACES` between any two samples; 0 where joints alone are
    looked at."""

    @property
    def too_fast(self) -> float:
        """How many times slower all must run to keep to the limits."""
        root = float(np.sqrt(self.acceleration.max(initial=0.0)))
        return max(float(self.velocity.max(initial=0.0)), root, self.tool_speed)


def used_by_joints(run: Trajectory, limits: MotionLimits) -> Used:
    """`used` without the tool, which takes far less time."""
    velocity, acceleration = np.zeros((2, run.q.shape[1]))
    for kind in KINDS if len(run) > 1 else ():
        velocity = np.maximum(velocity, largest(derivative(run, coefficients(run, kind)), np.abs))
        acceleration = np.maximum(acceleration, largest(accelerations(run, kind), np.abs))
    return Used(velocity / limits.velocity, acceleration / limits.acceleration, 0.0)


def accelerations_each(run: Trajectory, limits: MotionLimits) -> Array:
    """(k - 1, n) the same between any two samples; where it is at most 1 perhaps too large."""
    most = np.zeros((len(run) - 1, run.q.shape[1]))
    for kind in KINDS:
        shares = accelerations(run, kind) / limits.acceleration
        share = np.abs(shares).max(axis=0)
        over = np.flatnonzero(share.max(axis=1) > 1.0)
        if len(over):
            halves = np.abs(closely(shares[:, over])).max(axis=0)
            share[over] = halves.reshape(-1, len(over), share.shape[1]).max(axis=0)
        most = np.maximum(most, share)
    return most


def past_limits(robot: Robot, run: Trajectory) -> Array:
    """(n,) rad or m, how far each joint may go past its limits, however samples are interpolated.

    A bound; negative where the joint keeps that far away from both.
    """
    past = np.full(robot.n, -np.inf)
    for kind in KINDS:
        q = coefficients(run, kind) if len(run) > 1 else run.q[None]
        past = np.maximum.reduce([past, largest(q) - robot.upper, largest(-q) + robot.lower])
    return past


def held_inside(robot: Robot, run: Trajectory) -> Trajectory:
    """The same motion, drawn in by what joints may pass their limits by between samples.

    Each of them is scaled about the middle of its limits (or moved, where it has one limit only),
    its velocities and accelerations too: the polynomials between samples are linear in all three,
    so they are scaled alike.
    """
    past = past_limits(robot, run) + ROUNDING
    if not (past > 0.0).any():
        return run
    past = np.maximum(past, 0.0)
    both = np.isfinite(robot.lower) & np.isfinite(robot.upper)
    lower, upper = np.where(both, robot.lower, -1.0), np.where(both, robot.upper, 1.0)
    middle, half = 0.5 * (lower + upper), 0.5 * (upper - lower)
    share = np.where(both & (past > 0.0), np.maximum(half - ROUNDING, 0.0) / (half + past), 1.0)
    moved = np.where(both, 0.0, np.where(np.isfinite(robot.lower), past, -past))
    q = np.where(past > 0.0, middle + share * (run.q - middle) + moved, run.q)
    dq, ddq = share * run.dq, share * run.ddq
    return replace(run, q=q, dq=dq, ddq=ddq, tool_speed=tool_slopes(robot, q, dq))
