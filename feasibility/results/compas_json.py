"""A motion as `compas_fab` reads one: the JSON of its `JointTrajectory` (`compas.json_load`)."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from feasibility.timing.sampled_trajectory import Trajectory
from feasibility.verdict import Walk
from robots.robot import Robot

DTYPE = "compas_fab.robots/JointTrajectory"
REVOLUTE, PRISMATIC = 0, 2  # of compas_robots.model.Joint
EXACT = 10**9  # [ns/s]


def as_compas(robot: Robot, motion: Walk | Trajectory) -> str:
    """One object, in radians, metres and seconds; all points of a motion without times are at 0 s.

    Args:
        robot: the arm, whose joints have the types that compas_robots wants.
        motion: of this arm.

    Example:
        >>> from robots.library import load_robot
        >>> still = Walk(np.zeros((2, 6)), np.array([0, 1]))
        >>> json.loads(as_compas(load_robot("ur5"), still))["dtype"]
        'compas_fab.robots/JointTrajectory'
    """
    timed = motion if isinstance(motion, Trajectory) else None
    types = np.where(robot.prismatic, PRISMATIC, REVOLUTE).tolist()
    points = []
    for k, q in enumerate(motion.q.tolist()):
        seconds, rest = divmod(0 if timed is None else round(float(timed.time[k]) * EXACT), EXACT)
        point: dict[str, Any] = {
            "joint_names": list(robot.joint_names), "joint_types": types, "joint_values": q,
            "time_from_start": {"secs": seconds, "nsecs": rest},
        }  # fmt: skip
        if timed is not None:
            point["velocities"] = timed.dq[k].tolist()
            point["accelerations"] = timed.ddq[k].tolist()
        points.append(point)
    cells = [None if cell < 0 else cell for cell in motion.cell.tolist()]
    data = {
        "joint_names": list(robot.joint_names), "points": points, "start_configuration": None,
        "start_state": None, "fraction": 1.0, "planning_time": -1, "attributes": {"cells": cells},
    }  # fmt: skip
    return json.dumps({"dtype": DTYPE, "data": data}, allow_nan=False) + "\n"
