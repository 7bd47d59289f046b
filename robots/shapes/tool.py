"""An arm's tool point, and how far its shapes reach beyond it."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from robots.robot import Robot
from robots.shapes.bodies import Solid, outline

NEAR = 1e-3  # [m]


class ToolLine(NamedTuple):
    """From the flange to the tool point."""

    flange: str
    """The link that the tool is mounted on."""
    joint: int
    """Pinocchio's, that carries both."""
    ends: np.ndarray
    """(2, 3) m in the joint's frame: the flange and the tool point, which may be one."""


def tool_line(robot: Robot) -> ToolLine:
    """The flange is the link of the tool frame, or the last before it that is elsewhere.

    Example:
        >>> from coverable import load_robot
        >>> line = tool_line(load_robot("ur5", tcp=((0, 0, 0.15), (0, 0, 0))))
        >>> line.flange, (line.ends[1] - line.ends[0]).round(9).tolist()
        ('tool0', [0.0, 0.15, 0.0])
    """
    frames, tcp = robot.model.frames, robot.model.frames[robot.tool_frame_id]
    end, number = tcp.placement.translation, robot.tool_link_id
    while number and frames[number].parentJoint == tcp.parentJoint:
        frame = frames[number]
        start = frame.placement.translation
        if frame.type == pin.FrameType.BODY and np.linalg.norm(end - start) > NEAR:
            return ToolLine(frame.name, int(tcp.parentJoint), np.stack([start, end]))
        number = frame.parentFrame
    return ToolLine(robot.tool_frame, int(tcp.parentJoint), np.stack([end, end]))


def tool_reach(robot: Robot, solids: Iterable[Solid]) -> dict[str, float]:
    """By owner, how far (m) bodies on the last joint reach beyond the tool point, furthest first.

    What reaches further than the standoff is inside a flat surface that is treated, whatever the
    arm does. Exact shapes count, not the convex bodies around them.
    """
    frame = robot.model.frames[robot.tool_frame_id].placement
    axis, beyond = frame.rotation @ robot.approach_axis, dict[str, float]()
    tip = float(frame.translation @ axis)
    for one in (one for one in solids if one.joint == robot.n):
        own, (corners, radius, circle) = one.placement[:3, :3].T @ axis, outline(one.geometry)
        end = float(one.placement[:3, 3] @ axis) + float((corners @ own).max()) + radius
        end += circle * math.hypot(own[0], own[1])
        beyond[one.owner] = max(beyond.get(one.owner, -np.inf), end - tip)
    return dict(sorted(beyond.items(), key=lambda reach: -reach[1]))
