"""The largest velocity of each joint, as the Pinocchio model or else the URDF says.

The gate that URDFs pass writes the tree again without velocities, so the model of a checked URDF
has none; the file itself is read for them, by the gate's own careful XML reader.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from robots import Robot, RobotError
from robots.urdf import BadValue, numbers, parse_xml, read_bytes


def joint_velocities(robot: Robot) -> NDArray[np.float64]:
    """(n,) rad/s or m/s, nan for a joint that no velocity is known of.

    Example:
        >>> from robots import load_robot
        >>> joint_velocities(load_robot("panda")).tolist()
        [2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61]
    """
    stated = np.array(robot.model.velocityLimit, dtype=float)
    known = np.isfinite(stated) & (stated > 0.0)
    if known.all():
        return stated
    of_file = _of_file(robot)
    read = np.array([of_file.get(name, math.nan) for name in robot.joint_names])
    return np.where(known, stated, read)


def _of_file(robot: Robot) -> dict[str, float]:
    """Joint name -> velocity, of the joints whose <limit> has a positive one."""
    if robot.urdf is None:
        return {}
    try:
        root = parse_xml(read_bytes(robot.urdf), robot.urdf)
    except RobotError:  # the file is gone or another: nothing is known, which the caller says
        return {}
    found: dict[str, float] = {}
    for joint in root.all("joint"):
        limit = joint.first("limit")
        if limit is None or "velocity" not in limit.attributes:
            continue
        try:
            (value,) = numbers(limit, "velocity", 1, bound=math.inf)
        except BadValue:
            continue
        if value > 0.0:
            found[joint.attributes.get("name", "")] = value
    return found
