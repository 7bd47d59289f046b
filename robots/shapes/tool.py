"""How far an arm's shapes reach beyond its tool point."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from robots.robot import Robot
from robots.shapes.bodies import Geometry, Polytope, Solid, Triangles
from robots.shapes.hulls import Hull, hull_of, rims
from robots.shapes.links import LinkShapes
from robots.urdf import Cylinder

NEAR = 1e-3  # [m]


class Reach(NamedTuple):
    """The place of one owner's bodies that is furthest along the approach axis."""

    owner: str
    """A link, or 'tool'."""
    beyond: float
    """m beyond the tool point; negative where all ends behind it."""
    radius: float
    """m, largest distance from the axis of what ends there, or within 1 mm of it."""


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
