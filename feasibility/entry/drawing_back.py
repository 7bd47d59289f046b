"""The tool drawn back from the surface along a straight line, its axis held."""

from __future__ import annotations

import numpy as np

from coverable_arrays import Array
from feasibility.certification import placements, second_derivatives
from feasibility.division import tool_moved
from feasibility.paths import PathError
from robots import Robot

STEP = 0.005  # [m] of the tool point from row to row, at most
MOST_HALVINGS = 6  # of that, until the motion is straight enough between rows
NEWTON = 20
CLOSE = 1e-7  # [m], and [1] of the axis


def drawn_back(
    robot: Robot, q: Array, direction: Array, distance: float, tolerance: float
) -> Array:
    """Configurations (k, n) rad or m, from q on, that move the tool point straight back.

    Args:
        robot: the arm.
        q: (n,) where it begins.
        direction: (3,) unit, where to.
        distance: m, how far.
        tolerance: m, how far the tool point may be off the line, between rows too.

    Raises:
        PathError: a limit or a singularity prevents it.
    """
    count = max(2, int(np.ceil(distance / STEP)))
    why = "the joints would have to turn too far meanwhile"
    for _ in range(MOST_HALVINGS):
        rows = tool_moved(robot, q, distance * direction, count, NEWTON, CLOSE)
        if len(rows) <= count:
            why = _in_the_way(robot, rows[-1], distance * (len(rows) - 1) / count)
            break
        poses = placements(robot, rows)
        steps = np.abs(np.diff(rows, axis=0))
        bound = second_derivatives(steps, robot.prismatic, poses.levers, np.inf)
        if bound.max() / 8.0 + CLOSE <= tolerance:
            return rows
        count *= 2
    raise PathError(f"the tool cannot be drawn back by {1e3 * distance:g} mm: {why}")


def _in_the_way(robot: Robot, q: Array, done: float) -> str:
    """What stops the tool at a configuration, after `done` m."""
    margin = np.minimum(q - robot.lower, robot.upper - q)
    joint = int(np.argmin(margin))
    after = f"after {1e3 * done:.3g} mm"
    if margin[joint] < 1e-6:
        return f"{after} {robot.joint_names[joint]} is at its limit"
    return f"{after} the arm cannot follow, being stretched out or folded up"
