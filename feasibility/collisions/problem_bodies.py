"""Everything that can collide in one problem, and the pairs that are checked.

The search knows convex bodies around objects and tool. Each holds the exact shape, so what stays
clear of it stays clear of the shape. Boxes, balls and capsules are exact, a cylinder gets a prism
around it, and a mesh that is not convex stays triangles.

Objects are placed in the world or on a link. Where a link carries the surface, it is the surface
that is at rest for the search and the judge, and the world may move.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from coverable.arrays import Array
from feasibility.collisions.scene import Obstacle, ToolShape
from feasibility.collisions.shapes import HalfSpace
from feasibility.collisions.words import TOOL
from robots.robot import Robot
from robots.shapes.bodies import Polytope, Solid, Triangles
from robots.shapes.coal_shapes import coal_distance
from robots.shapes.hulls import is_convex
from robots.shapes.link_pairs import LeftOut
from robots.shapes.links import outer_bodies
from robots.urdf.link_shapes import Box

if TYPE_CHECKING:
    from surfaces.sheet import Sheet


@dataclass(frozen=True, eq=False, slots=True)
class Soup:
    """Triangles at rest that are no convex body: the surface, or a mesh of the scene."""

    owner: str
    """'surface', or the object's name."""
    triangles: Array
    """(k, 3, 3) m, in the root frame."""
    deviation: float
    """m, how far the body may stand out from its triangles; every clearance is larger by it."""
    closed: bool
    """True where they bound a solid, which has an inside."""
    sheet: Sheet | None = None
    """Where they are a surface's: the same triangles in its own frame, wherever it stands."""


class Seat(NamedTuple):
    """An object of the scene, and what carries it."""

    obstacle: Obstacle
    """With its placement in the frame of that joint (Pinocchio's)."""
    joint: int
    """0 where it is at rest in the root frame."""


@dataclass(frozen=True, slots=True)
class Pair:
    """Two owners of bodies that must stay apart."""

    first: str
    """A link or 'tool': it moves."""
    second: str
    """A link, 'tool', an object of the scene, or 'surface'."""
    clearance: float
    """m, the least distance between them."""


@dataclass(frozen=True, eq=False, slots=True)
class Bodies:
    """All bodies of one problem; pure data, for the search and for the judge alike."""

    solids: tuple[Solid, ...]
    """Exact shapes of links, tool and carried objects, for the judge and for pictures."""
    polytopes: tuple[Polytope, ...]
    """Convex bodies around them, and those of convex objects at rest (joint 0)."""
    soups: tuple[Soup, ...]
    """The surface, and objects at rest that are not convex."""
    scene: tuple[Obstacle, ...]
    """The objects at rest, with their place in the root frame, for the judge and for pictures."""
    pairs: tuple[Pair, ...]
    left_out: tuple[LeftOut, ...] = ()
    unchecked: tuple[str, ...] = ()
    """Links without any shape, and the way from flange to tool point where no body is on it."""
    checked: tuple[str, ...] = ()
    """Which of self, surface, scene are checked."""
    notes: tuple[str, ...] = ()
    """What a user should know, one sentence each."""
    carried: tuple[Seat, ...] = ()
    """The objects of the scene that move, for pictures."""


MOST_VERTICES = 64  # of a convex mesh: its hull would be thinned, so one with more stays triangles


def polytopes_of(obstacle: Obstacle, reach: float) -> tuple[Polytope, ...] | None:
    """Convex bodies that together hold an object; None where it is a mesh that is not convex.

    Args:
        obstacle: of the scene, at rest.
        reach: see `solid_of`.
    """
    if isinstance(obstacle.geometry, Triangles) and not _is_convex(obstacle.geometry):
        return None
    return tuple(outer_bodies(solid_of(obstacle, 0, reach)))


def soup_of(obstacle: Obstacle) -> Soup | None:
    """The triangles of an object that is a mesh and not convex; None for any other."""
    geometry = obstacle.geometry
    if not isinstance(geometry, Triangles) or _is_convex(geometry):
        return None
    rotation, position = obstacle.placement[:3, :3], obstacle.placement[:3, 3]
    corners = (geometry.vertices @ rotation.T + position)[geometry.faces]
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


def seats_of(robot: Robot, scene: Iterable[Obstacle]) -> tuple[Seat, ...]:
    """Where each object is; links that it names have to exist."""
    import pinocchio as pin

    model, found = robot.model, []
    for one in scene:
        number = robot.world_frame_id
        if one.frame is not None:
            number = model.getFrameId(one.frame, pin.FrameType.BODY)
        frame = model.frames[number]
        if number:  # frame 0 is the root frame
            placement = frame.placement.homogeneous @ one.placement
            one = replace(one, placement=placement, frame=None)
        found.append(Seat(one, int(frame.parentJoint)))
    return tuple(found)


def solid_of(obstacle: Obstacle, joint: int, reach: float) -> Solid:
    """An object on a joint as a body of the arm; a half space becomes a box beneath its plane.

    Every point x that matters is within `reach` of the origin. The box begins beneath the origin,
    at its projection onto the plane, and is `reach` wide to each side and reach + |height of the
    origin| deep, so the place of the half space that is nearest to x, which is x itself or its
    projection onto the plane, lies in the box: their distances to x are one.

    Args:
        obstacle: with its placement in the frame of that joint.
        joint: Pinocchio's, 0 at rest.
        reach: m, no point of a body gets further from the origin of the joint's frame.
    """
    if not isinstance(obstacle.geometry, HalfSpace):
        return Solid(obstacle.name, joint, obstacle.placement, obstacle.geometry)
    x, y, height = np.linalg.inv(obstacle.placement)[:3, 3]  # the origin, seen from the plane
    deep, placement = reach + abs(height), obstacle.placement.copy()
    placement[:3, 3] += placement[:3, :3] @ [x, y, -deep / 2.0]
    placement.flags.writeable = False
    return Solid(obstacle.name, joint, placement, Box((2.0 * reach, 2.0 * reach, float(deep))))


NOTED = 5e-3  # [m] of overlap: the base of a ur5, as drawn, ends 4 mm below its frame


def overlapping(bodies: Sequence[Polytope], pairs: Iterable[tuple[str, str]]) -> list[str]:
    """A sentence for each pair of owners at rest whose convex bodies overlap.

    Args:
        bodies: convex ones, each in the root frame.
        pairs: of owners.
    """
    of_owner: dict[str, list[Polytope]] = {}
    for body in bodies:
        of_owner.setdefault(body.owner, []).append(body)
    notes = []
    for first, second in pairs:
        both = of_owner.get(first, ()), of_owner.get(second, ())
        nearest = min((coal_distance(a, b) for a in both[0] for b in both[1]), default=0.0)
        if nearest < -NOTED:
            notes.append(
                f"{first} and {second} are rigid to each other, so the pair is not checked, but "
                f"they overlap by {-1e3 * nearest:.1f} mm"
            )
    return notes
