"""Arms and tasks whose speeds cannot be judged, refused before any search."""

from __future__ import annotations

import numpy as np

from coverable_errors import ArgumentError, Fault
from feasibility.certification.rates.segment_rates import fastest_anywhere
from feasibility.task import Task
from robots import Robot


def check_rates(robot: Robot, task: Task) -> None:
    """Refuse a speed that no motion of this arm has, or that nobody can judge.

    Raises:
        ArgumentError: joints have no velocity limits, or the speed is beyond all of them together.
    """
    if task.speed is None:
        return
    unknown = [
        name
        for name, most in zip(robot.joint_names, robot.max_velocity.tolist(), strict=True)
        if not np.isfinite(most)
    ]
    if unknown:
        what = f"cannot be judged: the URDF of {robot.name!r} limits no velocity of "
        named = ", ".join(unknown)
        add = 'add velocity="..." to <limit>, or max_velocity_deg (_m) to [[robot.axis]]'
        raise ArgumentError(Fault("speed", what + named, expected=add), "task")
    most = fastest_anywhere(robot)
    if task.speed > most:
        what = f"got {task.speed:g}, but with all joints at their velocities the tool of "
        what += f"{robot.name!r} has less than {most:.3g} m/s anywhere"
        raise ArgumentError(Fault("speed", what, expected="give less"), "task")
