"""The same motion with joints some full turns away, where a shop would have them."""

from __future__ import annotations

import numpy as np

from feasibility.task import Task
from feasibility.verdict import Walk
from robots import Robot

TURN = 2.0 * np.pi


def unwound(robot: Robot, task: Task, walk: Walk) -> Walk:
    """A motion whose joints stay about as near to home, or the middle of their limits, as can be.

    Full turns of a joint place the arm alike. A search takes the turn that it comes upon, which may
    leave a joint with 300 deg where it could have -60. Where the arm has a start nothing is turned.

    Args:
        robot: the arm.
        task: home, where it has one.
        walk: the motion.
    """
    if robot.start is not None or not len(walk.q):
        return walk
    low, high = walk.q.min(axis=0), walk.q.max(axis=0)
    bounded = np.isfinite(robot.lower) & np.isfinite(robot.upper)
    wanted = np.where(bounded, 0.5 * (robot.lower + robot.upper), 0.0)
    if task.home_deg is not None:
        wanted = np.radians(task.home_deg)
    with np.errstate(invalid="ignore"):
        turns = np.round((wanted - 0.5 * (low + high)) / TURN)
        most = np.floor((robot.upper - high) / TURN + 1e-12)
        least = np.ceil((robot.lower - low) / TURN - 1e-12)
    turns = np.clip(turns, np.minimum(least, 0.0), np.maximum(most, 0.0))
    turns = np.where(robot.prismatic, 0.0, turns)
    if not turns.any():
        return walk
    # Rounding must not move a joint past its limit.
    q = np.where(turns != 0.0, np.clip(walk.q + TURN * turns, robot.lower, robot.upper), walk.q)
    return Walk(q=q, cell=walk.cell)
