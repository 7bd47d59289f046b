"""How fast a curve may be run at each place, and what the joints may do: limits and their bounds.

On a piece of a cubic spline q'(s) is a parabola, so its Bernstein coefficients bound it: the middle
one is q'(0) + q''(0) h / 2 for a piece of length h. And with |p''(s)| <= D on the piece, which the
lever arms give (`certification.second_derivatives`), the tool's |p'(s)| is at most its larger end
plus D h / 2. So the bounds hold on whole pieces, not only where they are evaluated.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import BSpline

from coverable_arrays import Array, Protected
from coverable_errors import real
from feasibility.certification import second_derivatives
from feasibility.paths import PathError
from robots import Kinematics, Robot, moved_by_joints

ACCELERATION_TIME = 0.5  # [s], in which a joint gets to its largest velocity, by default
LOOSE = 0.02  # [1] share by which the bound on the tool's speed may be too careful
FEWEST, FINEST = 2, 64  # places of the grid on one piece
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
        >>> from robots import load_robot
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


def fine_grid(robot: Robot, spline: BSpline, pieces: int) -> Array:
    """Places 0 .. pieces of a curve, all integers among them, at which to bound its speed.

    Between the integers there are so many that the tool's speed is bounded to `LOOSE`.
    """
    knots = np.arange(pieces + 1.0)
    tool, _, swing = _slopes(robot, spline, knots)
    slack = 0.5 * swing / np.maximum(np.maximum(tool[:-1], tool[1:]), 1e-300)
    count = np.clip(np.ceil(slack / LOOSE), FEWEST, FINEST).astype(np.int64)
    inner = [k + np.arange(m) / m for k, m in zip(knots[:-1], count, strict=True)]
    return np.append(np.concatenate(inner), knots[-1])


def squared_speeds(robot: Robot, spline: BSpline, grid: Array, limits: MotionLimits) -> Array:
    """(m,) upper bounds on (ds/dt)^2 at the m places of a grid, so that all pieces keep to limits.

    The grid has all knots of the spline among its places. Between two of them (ds/dt)^2 runs
    straight, so a limit that both ends keep to holds on all of the piece.
    """
    h = np.diff(grid)
    tool, fastest, swing = _slopes(robot, spline, grid)
    tool_most = np.maximum(tool[:-1], tool[1:]) + 0.5 * h * swing
    with np.errstate(divide="ignore"):
        piece = np.minimum((limits.velocity / fastest).min(axis=1), limits.tool_speed / tool_most)
    piece = np.minimum(piece, MOST / h) ** 2
    return np.minimum(np.append(piece, np.inf), np.concatenate([[np.inf], piece]))


def _slopes(robot: Robot, spline: BSpline, grid: Array) -> tuple[Array, Array, Array]:
    """|p'| (m,) at the places of a grid; on its pieces the most of |q'| (m - 1, n) and |p''|."""
    h = np.diff(grid)[:, None]
    q, slope, second = (spline.derivative(k)(grid) for k in range(3))
    middle = slope[:-1] + 0.5 * h * second[:-1]
    fastest = np.maximum(np.maximum(np.abs(slope[:-1]), np.abs(slope[1:])), np.abs(middle))
    most_second = np.maximum(np.abs(second[:-1]), np.abs(second[1:]))
    moved = moved_by_joints(robot.chain, q)
    levers = np.sqrt((moved**2).sum(axis=1)).T
    swing = second_derivatives(fastest * h, robot.prismatic, levers, np.inf, most_second * h**2)
    return speeds(moved, slope), fastest, swing / h[:, 0] ** 2


def speeds(moved: Array, slope: Array) -> Array:
    """(m,) how fast what each joint moves as `moved` (n, 3, m) says moves at `slope` (m, n)."""
    velocity = np.zeros(moved.shape[1:])
    for by_joint, rate in zip(moved, slope.T, strict=True):
        velocity += by_joint * rate
    return np.asarray(np.sqrt((velocity**2).sum(axis=0)))


def tool_slopes(robot: Robot, q: Array, slope: Array) -> Array:
    """(m,) m, how fast the tool point moves when the joints q (m, n) move at `slope` (m, n).

    By Pinocchio, for what users see.
    """
    return np.linalg.norm(Kinematics(robot).tool_velocities(q, slope), axis=1)
