"""What joints and tool may do, how much of that a motion uses, and what it passes joint limits by.

Between samples accelerations run straight, so their largest values are at the ends; velocities are
parabolas and places are cubics, largest at the ends or where they turn. The tool is looked at in
`PLACES` of each piece, and twice what a parabola through them may be higher is allowed for.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array, Protected
from coverable.errors import real
from feasibility.paths.order import PathError
from feasibility.timing.sampled_trajectory import Trajectory, bends, tool_speeds
from robots.robot import Robot

ACCELERATION_TIME = 0.5  # [s], in which a joint gets to its largest velocity, by default
# [rad/s], [m/s] or their acceleration: more is no limit, less does not move; both are refused.
LEAST, MOST = 1e-6, 1e6


@dataclass(frozen=True, eq=False, slots=True)
class MotionLimits(Protected):
    """What a timed motion keeps to."""

    velocity: Array
    """(n,) rad/s or m/s, of each joint."""
    acceleration: Array
    """(n,) rad/s^2 or m/s^2, of each joint."""
    tool_speed: float
    """m/s, of the tool point."""


def motion_limits(
    robot: Robot,
    tool_speed: float,
    velocity: ArrayLike | None = None,
    acceleration: ArrayLike | None = None,
) -> MotionLimits:
    """Check limits, and fill in what is not given.

    Their meaning and units are those of `trajectory`.

    Raises:
        PathError: a number is not positive and finite, or the URDF gives a joint no velocity.

    Example:
        >>> from coverable import load_robot
        >>> limits = motion_limits(load_robot("puma560"), tool_speed=0.1)
        >>> limits.velocity.tolist(), limits.acceleration.tolist()
        ([3.0, 3.0, 3.0, 3.0, 3.0, 3.0], [6.0, 6.0, 6.0, 6.0, 6.0, 6.0])
    """
    faults: list[str] = []
    speed = real(tool_speed)
    if not LEAST <= speed <= MOST:
        faults.append(
            f"the tool speed must be a positive number of metres per second in {LEAST:g} .. "
            f"{MOST:g}, got {tool_speed!r}"
        )
    if velocity is None:
        fastest = robot.max_velocity
        known = (fastest > 0.0) & (fastest <= MOST)
        names = [name for name, fine in zip(robot.joint_names, known, strict=True) if not fine]
        if names:
            faults.append(
                f"robot {robot.name!r} has no velocity limit for {', '.join(names)}; give velocity "
                "(rad/s or m/s), one number for all joints or one for each; an axis of "
                "[[robot.axis]] takes max_velocity_deg or max_velocity_m"
            )
    else:
        fastest = _per_joint(robot, "velocity", "rad/s or m/s", velocity, faults)
    quickest = np.minimum(fastest, MOST) / ACCELERATION_TIME  # more is refused below
    if acceleration is not None:
        quickest = _per_joint(robot, "acceleration", "rad/s^2 or m/s^2", acceleration, faults)
    if faults:
        raise PathError(faults)
    return MotionLimits(fastest, quickest, speed)


def _per_joint(robot: Robot, name: str, unit: str, value: ArrayLike, faults: list[str]) -> Array:
    """(n,) one number for each joint; if something is wrong with them, it is added to `faults`."""
    try:
        numbers = np.broadcast_to(np.array(value, dtype=float), (robot.n,))
    except (TypeError, ValueError):
        numbers = np.full(robot.n, math.nan)
    if not ((numbers >= LEAST) & (numbers <= MOST)).all():
        allowed = f"in {LEAST:g} .. {MOST:g} ({unit})"
        form = f"{name} must be one positive number {allowed}, or {robot.n} for the joints"
        faults.append(f"{form}, got {value!r}")
    return numbers


PLACES = 4  # at which the tool is looked at on each piece, its first end among them


@dataclass(frozen=True, eq=False, slots=True)
class Used:
    """How much of its limits a motion uses; 1 is all."""

    velocity: Array
    """(n,) share of each joint's velocity."""
    acceleration: Array
    """(n,) the same for accelerations."""
    tool_speed: float
    """Share of the tool's speed."""

    @property
    def too_fast(self) -> float:
        """How many times slower all must run to keep to the limits."""
        root = float(np.sqrt(self.acceleration.max(initial=0.0)))
        return max(float(self.velocity.max(initial=0.0)), root, self.tool_speed)


def used(robot: Robot, run: Trajectory, limits: MotionLimits) -> Used:
    """How much of its limits a motion uses, as the spline that it is; of one sample, nothing."""
    most = used_each(robot, run, limits).max(axis=0, initial=0.0)
    return Used(most[: robot.n], most[robot.n : -1], float(most[-1]))


def used_each(robot: Robot, run: Trajectory, limits: MotionLimits) -> Array:
    """(k - 1, 2 n + 1) the same between any two of k samples: velocities, accelerations, tool."""
    if len(run) < 2:
        return np.zeros((0, 2 * robot.n + 1))
    first, last = bends(run)
    steps = np.diff(run.time)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        turn = np.clip(np.nan_to_num(first / (first - last), posinf=0.0, neginf=0.0), 0.0, 1.0)
    peaks = run.dq[:-1] + turn * steps * (first + 0.5 * turn * (last - first))
    velocity = np.max(np.abs([run.dq[:-1], peaks, run.dq[1:]]), axis=0)
    acceleration = np.max(np.abs([first, last, run.ddq[:-1], run.ddq[1:]]), axis=0)
    inner = (run.time[:-1, None] + np.arange(PLACES) / PLACES * steps).ravel()
    tool = tool_speeds(robot, run.at(inner), run.at(inner, 1)).reshape(-1, PLACES)
    rows = np.column_stack([tool, np.append(tool[1:, 0], run.tool_speed[-1])])
    # Between two places a parabola is higher by up to 1/8 of its second difference.
    most = rows.max(axis=1) + 0.25 * np.abs(np.diff(rows, n=2, axis=1)).max(axis=1)
    return np.column_stack(
        [velocity / limits.velocity, acceleration / limits.acceleration, most / limits.tool_speed]
    )


def past_limits(robot: Robot, run: Trajectory) -> Array:
    """(n,) rad or m, how far each joint goes past its limits; negative where it keeps away."""
    low, high = run.q.min(axis=0), run.q.max(axis=0)
    turns = run.spline.derivative().roots(extrapolate=False) if len(run) > 1 else ()
    for joint, times in enumerate(turns):  # NaN follows the beginning of a rest
        q = run.at(times[np.isfinite(times)])[:, joint]
        low[joint], high[joint] = q.min(initial=low[joint]), q.max(initial=high[joint])
    return np.asarray(np.maximum(robot.lower - low, high - robot.upper))
