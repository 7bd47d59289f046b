"""An arm's tool point and its shapes: how far they reach beyond it, and where none is near it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from scipy.optimize import nnls

from robots.robot import Robot
from robots.shapes.bodies import Geometry, Polytope, Solid, Triangles
from robots.shapes.hulls import Hull, hull_of, rims
from robots.shapes.links import LinkShapes
from robots.urdf.link_shapes import Cylinder

NEAR = 1e-3  # [m]
HEAVY = 1e3  # [1] of a sum of weights beside lengths
BARE = 0.02  # [m] from the tool point to the nearest body, from which on that is to be said


class Reach(NamedTuple):
    """The place of one owner's bodies that is furthest along the approach axis."""

    owner: str
    """A link, or 'tool'."""
    beyond: float
    """m beyond the tool point; negative where all ends behind it."""
    radius: float
    """m, largest distance from the axis of what ends there, or within 1 mm of it."""


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


def bare_length(robot: Robot, bodies: Iterable[Polytope]) -> float:
    """How far (m) the tool point is from the nearest body on its joint; 0 where one is near.

    At most the way from the flange, as nothing has to be between the two where they are one.
    """
    _, joint, (start, end) = tool_line(robot)
    length = least = float(np.linalg.norm(end - start))
    for body in bodies:
        if body.joint == joint and least > BARE:
            # The nearest point of the hull: weights of its corners, at least 0, that sum up to 1.
            apart = body.vertices - end
            rows = np.vstack([apart.T, np.full(len(apart), HEAVY * max(length, 1.0))])
            weights, _ = nnls(rows, np.append(np.zeros(3), rows[3, 0]))
            nearest = np.linalg.norm(weights @ apart / weights.sum())
            least = min(least, float(nearest) - body.radius)
    return least if least > BARE else 0.0


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
    axis = frame.rotation @ robot.approach_axis
    furthest: dict[str, Reach] = {}
    bodies: list[tuple[Solid | Polytope, np.ndarray, float]] = [
        (solid, *_points_of(solid)) for solid in shapes.solids if solid.joint == robot.n
    ]
    bodies += [(body, np.asarray(body.vertices), body.radius) for body in tool]
    for body, points, around in bodies:
        offsets = points - frame.translation
        along = offsets @ axis
        end = float(along.max())
        last = offsets[along > end - NEAR] - np.outer(along[along > end - NEAR], axis)
        # A ball around the last point ends on the parallel to the axis through its centre.
        reach = Reach(body.owner, end + around, float(np.linalg.norm(last, axis=1).max()))
        known = furthest.get(body.owner)
        if known is None or reach.beyond > known.beyond:
            furthest[body.owner] = reach
    return tuple(sorted(furthest.values(), key=lambda reach: -reach.beyond))


def _points_of(solid: Solid) -> tuple[np.ndarray, float]:
    """Points (k, 3) m in the joint's frame whose hull, thickened by a radius, is a shape's.

    Rims of cylinders are 360 points of them.
    """
    points, radius = _extreme_points(solid.geometry)
    return points @ solid.placement[:3, :3].T + solid.placement[:3, 3], radius


def _extreme_points(shape: Geometry) -> Hull:
    match shape:
        case Triangles(vertices):
            return Hull(vertices, 0.0)
        case Cylinder(radius, length):
            return Hull(rims(radius, length, 360), 0.0)
        case _:
            return hull_of(shape)
