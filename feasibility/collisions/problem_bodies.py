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
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin

from coverable.arrays import Array
from feasibility.collisions.scene import Obstacle, ToolShape
from feasibility.collisions.words import TOOL
from robots.robot import Robot
from robots.shapes.bodies import HalfSpace, Polytope, Solid, Triangles
from robots.shapes.coal_shapes import coal_distance
from robots.shapes.hulls import MOST_VERTICES, is_convex
from robots.shapes.link_pairs import LeftOut
from robots.shapes.links import outer_bodies
from robots.urdf.link_shapes import Box

if TYPE_CHECKING:
    from feasibility.collisions.settings import Collision
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
    """Exact shapes of links and tool, and of objects that they carry, without half spaces."""
    polytopes: tuple[Polytope, ...]
    """Convex bodies around them, and those of convex objects at rest (joint 0)."""
    soups: tuple[Soup, ...]
    """The surface, and objects at rest that are not convex."""
    scene: tuple[Solid, ...]
    """The objects as they are given, those that move, too."""
    pairs: tuple[Pair, ...]
    left_out: tuple[LeftOut, ...] = ()
    unchecked: tuple[str, ...] = ()
    """Links without any shape, and the way from flange to tool point where no body is on it."""
    checked: tuple[str, ...] = ()
    """Which of self, surface, scene are checked."""
    notes: tuple[str, ...] = ()
    """What a user should know, one sentence each."""

    @property
    def exact(self) -> tuple[Solid, ...]:
        """All that the judge sees, but for the surface."""
        return (*self.solids, *(one for one in self.scene if not one.joint))


def at_rest(solid: Solid, reach: float) -> list[Polytope] | Soup:
    """Convex bodies that together hold an object at rest; of a mesh not convex its triangles."""
    mesh, place = solid.geometry, solid.placement
    # The hull of a convex mesh with more vertices would be thinned.
    if isinstance(mesh, Triangles) and (len(mesh.vertices) > MOST_VERTICES or not is_convex(mesh)):
        corners = (mesh.vertices @ place[:3, :3].T + place[:3, 3])[mesh.faces]
        return Soup(solid.owner, corners, 0.0, mesh.closed)
    return outer_bodies(bounded(solid, reach))


def tool_solids(tool: Sequence[ToolShape], robot: Robot) -> tuple[Solid, ...]:
    """The shapes of the tool as they are, on the last joint; their owner is 'tool'."""
    return tuple(_on(robot, robot.tool_link_id, TOOL, shape) for shape in tool)


def scene_solids(scene: Sequence[Obstacle], robot: Robot) -> tuple[Solid, ...]:
    """Each object on what carries it; links that they name have to exist."""
    link, world = pin.FrameType.BODY, robot.world_frame_id
    frames = (robot.model.getFrameId(one.frame, link) if one.frame else world for one in scene)
    return tuple(_on(robot, frame, one.name, one) for frame, one in zip(frames, scene, strict=True))


def _on(robot: Robot, number: int, owner: str, shape: Obstacle | ToolShape) -> Solid:
    """A shape that a frame of the model carries."""
    frame = robot.model.frames[number]
    placement = frame.placement.homogeneous @ shape.placement
    return Solid(owner, int(frame.parentJoint), placement, shape.geometry)


def bounded(solid: Solid, reach: float) -> Solid:
    """The same, but for a half space, which becomes a box beneath its plane.

    Every point x that matters is within `reach` (m) of the origin of the joint's frame. The box
    begins beneath the origin, at its projection onto the plane, and is `reach` wide to each side
    and reach + |height of the origin| deep, so the place of the half space that is nearest to x,
    which is x itself or its projection onto the plane, lies in the box: their distances to x are
    one.
    """
    if not isinstance(solid.geometry, HalfSpace):
        return solid
    x, y, height = np.linalg.inv(solid.placement)[:3, 3]  # the origin, seen from the plane
    deep, placement = reach + abs(height), solid.placement.copy()
    placement[:3, 3] += placement[:3, :3] @ [x, y, -deep / 2.0]
    box = Box((2.0 * reach, 2.0 * reach, float(deep)))
    return replace(solid, placement=placement, geometry=box)


NOTED = 5e-3  # [m] of overlap: the base of a ur5, as drawn, ends 4 mm below its frame


def overlapping(
    collision: Collision, bodies: Sequence[Polytope], left_out: Iterable[LeftOut]
) -> list[str]:
    """A sentence for each object at rest that a link at rest overlaps, and is not allowed to."""
    notes, allowed = [], {frozenset(pair) for pair in collision.allow}
    objects = {one.name for one in collision.scene}
    for pair in (one for one in left_out if one.why == "rigid" and one.second in objects):
        if frozenset((pair.first, pair.second)) in allowed:
            continue
        still = [one for one in bodies if not one.joint]
        a, b = ([one for one in still if one.owner == who] for who in (pair.first, pair.second))
        nearest = min((coal_distance(*couple) for couple in product(a, b)), default=0.0)
        if nearest < -NOTED:
            notes.append(
                f"{pair.first} and {pair.second} are rigid to each other, so the pair is not "
                f"checked, but they overlap by {-1e3 * nearest:.1f} mm"
            )
    return notes
