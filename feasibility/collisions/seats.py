"""Which joint carries each object of the scene: one that does not move is at rest, or is carried.

Objects are placed in the world or on a link. Where a link carries the surface, it is the surface
that is at rest for the search and the judge, and the world may move.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from feasibility.collisions.outer_bodies import below
from feasibility.collisions.problem_bodies import Seat
from feasibility.collisions.scene import Obstacle
from feasibility.collisions.shapes import HalfSpace
from robots.robot import Robot
from robots.shapes.bodies import Fineness, Polytope, Solid, Triangles
from robots.shapes.links import outer_bodies
from robots.urdf.link_shapes import Box


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


def carried_solid(seat: Seat, reach: float) -> Solid:
    """A carried object as a body of the arm; of a half space the box that any body can reach.

    Args:
        seat: with a joint.
        reach: m, no body gets further from the origin of the joint's frame.
    """
    one = seat.obstacle
    if not isinstance(one.geometry, HalfSpace):
        return Solid(one.name, seat.joint, one.placement, one.geometry)
    middle, size = below(one.placement, reach)
    placement = one.placement.copy()
    placement[:3, 3] += one.placement[:3, :3] @ middle
    placement.flags.writeable = False
    x, y, z = size.tolist()
    return Solid(one.name, seat.joint, placement, Box((x, y, z)))


def carried_bodies(
    seats: Sequence[Seat], reach: float, fineness: Fineness
) -> tuple[list[Solid], list[Polytope]]:
    """Carried objects, exact and as convex bodies."""
    solids = [carried_solid(seat, reach) for seat in seats if seat.joint]
    convex = list[Polytope]()
    for solid in solids:  # one hull would close the hollows of a fixture
        hollow = isinstance(solid.geometry, Triangles)
        convex += outer_bodies(solid, "pieces" if hollow else fineness)
    return solids, convex


def furthest(points: np.ndarray) -> float:
    """m, of points (..., 3) from the origin; 0 where there are none."""
    return float(np.linalg.norm(points, axis=-1).max(initial=0.0))
