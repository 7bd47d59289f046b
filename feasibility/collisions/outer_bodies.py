"""Convex bodies around the objects of the scene and the shapes of the tool, for the search.

Each holds the exact shape, so what stays clear of it stays clear of the shape. Boxes, balls and
capsules are exact, a cylinder gets a prism around it, and a mesh that is not convex stays
triangles.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from coverable.arrays import Array
from feasibility.collisions.problem_bodies import Soup
from feasibility.collisions.scene import Obstacle, ToolShape
from feasibility.collisions.shapes import HalfSpace
from feasibility.collisions.words import TOOL
from robots.robot import Robot
from robots.shapes.bodies import Polytope, Solid, Triangles
from robots.shapes.hulls import is_convex
from robots.shapes.links import outer_bodies

Points = Array

MOST_VERTICES = 64  # of a convex mesh: its hull would be thinned, so one with more stays triangles
_CUBE = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))


def polytopes_of(obstacle: Obstacle, reach: float) -> tuple[Polytope, ...] | None:
    """Convex bodies that together hold an object; None where it is a mesh that is not convex.

    A half space becomes a box from its plane downwards. Every point x of the arm is within `reach`
    of the root's origin. The box begins beneath the origin, at its projection onto the plane, and
    is `reach` wide to each side and reach + |height of the origin| deep, so the place of the half
    space that is nearest to x, which is x itself or its projection onto the plane, lies in the box:
    their distances to x are one.

    Args:
        obstacle: of the scene.
        reach: m, no point of the arm is ever further from the origin of the root frame.
    """
    geometry, placement = obstacle.geometry, obstacle.placement
    if isinstance(geometry, HalfSpace):
        middle, size = below(placement, reach)
        vertices = _moved(placement, middle + _CUBE * (0.5 * size))
        return (Polytope(obstacle.name, 0, vertices, 0.0),)
    if isinstance(geometry, Triangles) and not _is_convex(geometry):
        return None
    return tuple(outer_bodies(Solid(obstacle.name, 0, placement, geometry)))


def soup_of(obstacle: Obstacle) -> Soup | None:
    """The triangles of an object that is a mesh and not convex; None for any other."""
    geometry = obstacle.geometry
    if not isinstance(geometry, Triangles) or _is_convex(geometry):
        return None
    corners = _moved(obstacle.placement, geometry.vertices)[geometry.faces]
    return Soup(obstacle.name, corners, 0.0, geometry.closed)


def tool_solids(tool: Sequence[ToolShape], robot: Robot) -> tuple[Solid, ...]:
    """The shapes of the tool as they are, on the last joint; their owner is 'tool'."""
    frame = robot.model.frames[robot.tool_link_id]
    mount = frame.placement.homogeneous
    return tuple(
        Solid(TOOL, int(frame.parentJoint), mount @ shape.placement, shape.geometry)
        for shape in tool
    )


def _is_convex(shape: Triangles) -> bool:
    """Is it a convex solid whose hull needs no thinning?"""
    return len(shape.vertices) <= MOST_VERTICES and is_convex(shape)


def below(placement: Points, reach: float) -> tuple[Points, Points]:
    """The box that stands for a half space, see `polytopes_of`: its middle and its sides, (3,) m.

    Both are in the half space's own frame.
    """
    own = np.linalg.inv(placement)[:3, 3]  # the origin of the root frame, seen from the plane
    deep = reach + abs(own[2])
    middle = np.array([own[0], own[1], -deep / 2.0])
    return middle, np.array([2.0 * reach, 2.0 * reach, deep])


def _moved(placement: Points, points: Points) -> Points:
    """Points after the rigid motion of a (4, 4) matrix."""
    return points @ placement[:3, :3].T + placement[:3, 3]
