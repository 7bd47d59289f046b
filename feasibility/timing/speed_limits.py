"""What joints and tool may do, and how fast the tool is."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array, Protected
from coverable.errors import real
from feasibility.paths.order import PathError
from robots.chain import moved_by_joints
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

    Args:
        robot: the arm.
        tool_speed: m/s, largest speed of the tool point.
        velocity: rad/s or m/s, see `trajectory`.
        acceleration: rad/s^2 or m/s^2, see `trajectory`.

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


def tool_speeds(robot: Robot, q: Array, slope: Array) -> Array:
    """(m,) m, how fast the tool point moves when the joints q (m, n) move at `slope` (m, n).

    By the search's own kinematics, as Pinocchio takes far longer.
    """
    velocity = np.zeros((3, len(q)))
    for by_joint, rate in zip(moved_by_joints(robot.chain, q), slope.T, strict=True):
        velocity += by_joint * rate
    return np.asarray(np.sqrt((velocity**2).sum(axis=0)))
