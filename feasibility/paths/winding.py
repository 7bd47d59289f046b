"""The same motion with joints some full turns away, where a shop would have them."""

import numpy as np

from coverable.arrays import Array
from feasibility.task import Task
from feasibility.verdict import Walk
from robots.robot import Robot

TURN = 2.0 * np.pi
ROUNDING = 1e-12  # [1] of a turn


def turns_inside(robot: Robot, q: Array) -> Array:
    """(2, n) fewest and most full turns by which joints can be moved on all along q (m, n)."""
    with np.errstate(invalid="ignore"):
        fewest = np.ceil((robot.lower - q.min(axis=0)) / TURN - ROUNDING)
        most = np.floor((robot.upper - q.max(axis=0)) / TURN + ROUNDING)
    return np.where(robot.prismatic, 0.0, [np.minimum(fewest, 0.0), np.maximum(most, 0.0)])


def unwound(robot: Robot, task: Task, walk: Walk) -> Walk:
    """A motion whose joints stay about as near to home, or the middle of their limits, as can be.

    Full turns of a joint place the arm alike. A search takes the turn that it comes upon, which may
    leave a joint with 300 deg where it could have -60. Where the arm has a start nothing is turned.
    """
    if robot.start is not None or not len(walk.q):
        return walk
    bounded = np.isfinite(robot.lower) & np.isfinite(robot.upper)
    with np.errstate(invalid="ignore"):  # a joint without limits has no middle
        wanted = np.where(bounded, 0.5 * (robot.lower + robot.upper), 0.0)
        if task.home_deg is not None:
            wanted = np.radians(task.home_deg)
        turns = np.round((wanted - 0.5 * (walk.q.min(axis=0) + walk.q.max(axis=0))) / TURN)
    turns = np.clip(turns, *turns_inside(robot, walk.q))
    if not turns.any():
        return walk
    # Rounding must not move a joint past its limit.
    q = np.where(turns != 0.0, np.clip(walk.q + TURN * turns, robot.lower, robot.upper), walk.q)
    return Walk(q=q, cell=walk.cell)
