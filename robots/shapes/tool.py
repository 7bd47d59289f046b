"""An arm's tool point, and how far its shapes reach beyond it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from robots.robot import Robot
from robots.shapes.bodies import Polytope, Solid, outline
from robots.shapes.links import LinkShapes

NEAR = 1e-3  # [m]


class Reach(NamedTuple):
    """How far one owner's bodies reach along the approach axis."""

    owner: str
    """A link, or 'tool'."""
    beyond: float
    """m beyond the tool point; negative where all ends behind it."""


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


def tool_reach(
    robot: Robot, shapes: LinkShapes, tool: Sequence[Polytope] = ()
) -> tuple[Reach, ...]:
    """How far the bodies on the last joint reach beyond the tool point, the furthest first.

    What reaches further than the standoff is inside a flat surface that is treated, whatever the
    arm does. Exact shapes count, not the convex bodies around them.

    Args:
        robot: the arm.
        shapes: of its links.
        tool: bodies on the last joint that are no link's.
    """
    frame = robot.model.frames[robot.tool_frame_id].placement
    axis, beyond = frame.rotation @ robot.approach_axis, dict[str, float]()
    ends = [(one.owner, _end(one, axis)) for one in shapes.solids if one.joint == robot.n]
    ends += [(one.owner, float((one.vertices @ axis).max()) + one.radius) for one in tool]
    for owner, end in ends:
        beyond[owner] = max(beyond.get(owner, -np.inf), end - float(frame.translation @ axis))
    return tuple(sorted(map(Reach._make, beyond.items()), key=lambda reach: -reach.beyond))


def _end(solid: Solid, axis: np.ndarray) -> float:
    """m, how far along a unit vector (3,) a shape reaches from the origin of its joint's frame."""
    own, place = solid.placement[:3, :3].T @ axis, float(solid.placement[:3, 3] @ axis)
    corners, radius, circle = outline(solid.geometry)
    return place + float((corners @ own).max()) + circle * math.hypot(own[0], own[1]) + radius
