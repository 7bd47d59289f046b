"""The tool drawn back from the surface along a straight line, its axis held."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from feasibility.certification import placements, second_derivatives
from feasibility.paths import PathError
from robots import Kinematics, Robot, configuration_near

Floats = NDArray[np.float64]

STEP = 0.005  # [m] of the tool point from row to row, at most
MOST_HALVINGS = 6  # of that, until the motion is straight enough between rows
NEWTON = 20
CLOSE = 1e-7  # [m], and [1] of the axis


def drawn_back(
    robot: Robot, q: Floats, direction: Floats, distance: float, tolerance: float
) -> Floats:
    """Configurations (k, n) rad or m, from q on, that move the tool point straight back.

    Args:
        robot: the arm.
        q: (n,) where it begins.
        direction: (3,) unit, where to.
        distance: m, how far.
        tolerance: m, how far the tool point may be off the line, between rows too.

    Raises:
        PathError: a limit or a singularity is in the way.
    """
    count = max(2, int(np.ceil(distance / STEP)))
    fault = ""
    for _ in range(MOST_HALVINGS):
        rows, fault = _rows(robot, q, direction * distance, count)
        if fault:
            break
        poses = placements(robot, rows)
        steps = np.abs(np.diff(rows, axis=0))
        bend = second_derivatives(steps, robot.prismatic, poses.levers, np.inf)
        if bend.max() / 8.0 + CLOSE <= tolerance:
            return rows
        count *= 2
    why = fault or "the joints would have to turn too far on the way"
    raise PathError(f"the tool cannot be drawn back by {1e3 * distance:g} mm: {why}")


def _rows(robot: Robot, q: Floats, way: Floats, count: int) -> tuple[Floats, str]:
    """The configurations, and why there are no more; empty where all were found."""
    kinematics = Kinematics(robot)
    point, axis = kinematics.tool(q)
    rows = [q]
    for k in range(1, count + 1):
        reached = configuration_near(
            kinematics, rows[-1], point + k / count * way, axis, NEWTON, CLOSE
        )
        if reached is None:
            done = f"{1e3 * np.linalg.norm(way) * (k - 1) / count:.3g} mm"
            return np.array(rows), _in_the_way(robot, rows[-1], done)
        rows.append(reached)
    return np.array(rows), ""


def _in_the_way(robot: Robot, q: Floats, done: str) -> str:
    """What stops the tool at a configuration."""
    margin = np.minimum(q - robot.lower, robot.upper - q)
    joint = int(np.argmin(margin))
    if margin[joint] < 1e-6:
        return f"after {done} {robot.joint_names[joint]} is at its limit"
    return f"after {done} the arm cannot follow, being stretched out or folded up"
