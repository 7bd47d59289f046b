"""Where a motion begins that has a start: over which cell, or how far from the nearest one."""

import numpy as np

from coverable.errors import ArgumentError, Fault
from feasibility.roll import roll_of
from feasibility.task import Targets, Task
from robots.kinematics import Kinematics
from robots.robot import Robot
from surfaces.cells import Cells

EXACT = 1e-9  # [m] and [rad], for a start that was rounded


def start_cell(robot: Robot, cells: Cells, task: Task) -> int | None:
    """The cell whose target the arm's start is at; None where the arm has no start.

    Raises:
        ArgumentError: it is at none: the message has distance and angles to the nearest target.
    """
    if robot.start is None or len(cells) == 0:
        return None
    targets, (point, axis) = task.targets(cells), Kinematics(robot).tool(robot.start)
    distance = np.linalg.norm(targets.points - point, axis=1)
    tilt = np.arccos(np.clip(targets.approaches @ axis, -1.0, 1.0))
    off = _off_roll(robot, task, targets)
    near = distance <= task.effective_tolerance + EXACT
    over = near & (tilt <= task.cone + EXACT) & (off <= EXACT)
    if over.any():
        return int(np.argmin(np.where(over, distance, np.inf)))
    nearest = int(np.argmin(np.where(near, tilt + np.maximum(off, 0.0) - np.pi, distance)))
    said = (
        f"is not on the motion set: the target of the nearest cell, "
        f"{list(cells.unravel(nearest))}, is {1e3 * distance[nearest]:.3g} mm from its tool point "
        f"(tolerance {1e3 * task.effective_tolerance:g} mm), the tool axis "
        f"{np.degrees(tilt[nearest]):.3g} deg off the approach direction (cone {task.cone_deg:g} "
        "deg)"
    )
    if task.roll is not None:
        beyond = np.degrees(max(float(off[nearest]), 0.0))
        said += f", and the roll {beyond:.3g} deg beyond its range"
    raise ArgumentError([Fault("start", said)])


def _off_roll(robot: Robot, task: Task, targets: Targets) -> np.ndarray:
    """(N,) rad, by how much the roll over each cell is beyond its range; negative inside it."""
    if task.roll is None or targets.references is None or robot.start is None:
        return np.full(len(targets.points), -np.inf)
    start, shape = robot.start[None], targets.approaches.shape
    a, x = (np.broadcast_to(one, shape) for one in Kinematics(robot).held(start)[1:])
    roll = roll_of(x, a, targets.references, targets.approaches)
    return np.asarray(np.abs(task.roll.off(roll)) - task.roll.half)
