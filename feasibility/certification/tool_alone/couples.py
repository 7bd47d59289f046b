"""Parts of the tool against bodies at rest: do they collide, and still do after a small motion?"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
import pinocchio as pin

from coverable_arrays import Array
from feasibility.certification.collisions import Piece, piece_of, sheet_piece
from feasibility.certification.tool_alone.erosion import eroded
from feasibility.collisions import Bodies, HalfSpace, Obstacle
from robots import Robot
from robots.shapes import Solid, Triangles, with_contacts
from robots.urdf import Box, Capsule, Cylinder

SLACK = 1e-5  # [m] more than coal is off
SLABS = 4  # that long shapes of the tool are cut into
LEAST = 1e-6  # [m] left of a shape, that coal is called for
KEPT = 64  # bodies that are remembered, with what is left of them


class Body:
    """A shape, as it is and eroded, in the frame of what carries it."""

    def __init__(self, shape: Any, placement: Array, piece: Piece | None = None) -> None:
        """A shape that the judge knows, or a `piece` of its own that has no inside."""
        self.shape, self.placement = shape, placement
        self.half_space = isinstance(shape, HalfSpace)
        self.whole = piece_of(shape, placement).truth if piece is None else piece
        self._left: dict[float, Piece | None] = {}

    def left(self, by: float) -> Piece | None:
        """What an erosion by m leaves; None where that is nothing, or not known."""
        if by not in self._left:
            rest = eroded(self.shape, by + LEAST)
            self._left[by] = None if rest is None else piece_of(rest, self.placement)
        return self._left[by]

    def lowest(self, normal: Array) -> float:
        """m, least n . x over the points x of it."""
        mesh = isinstance(self.shape, Triangles) or self.shape is None
        if mesh:
            return float((self.whole.corners @ normal).min())
        return -float(self.whole.support(-normal[None])[0])


class Couple:
    """A body that moves with the tool, and one at rest that it has to stay clear of."""

    def __init__(self, moving: Body, still: Body, wanted: float, tip: Array, axis: Array) -> None:
        """With the clearance (m), tool point and tool axis in the frame of the last joint.

        A body with a radius is all that is within it of its core. Where a point of the core goes,
        the ball around it goes without turning, so the motion of the core is what counts.
        """
        self.moving, self.still, self.wanted = moving, still, wanted
        away = moving.whole.corners - tip
        across = away - np.outer(away @ axis, axis)
        self.reach = float(np.linalg.norm(away, axis=1).max())
        self.lateral = float(np.linalg.norm(across, axis=1).max())

    def near(self, point: Array) -> bool:
        """May they meet with the tool point at a place?"""
        if self.still.half_space:
            return True
        away = float(np.linalg.norm(self.still.whole.centre - point))
        wide = self.still.whole.ball + self.moving.whole.radius
        return away <= wide + self.reach + abs(self.wanted) + SLACK

    def collides(self, pose: pin.SE3, moved: float) -> bool:
        """Do they come too near at a pose of the last joint, and if moved by up to so much (m)?"""
        by = moved + SLACK - self.wanted
        if self.still.half_space:
            place = self.still.placement
            normal = place[:3, 2]
            lowest = self.moving.lowest(pose.rotation.T @ normal)
            return bool(lowest + normal @ (pose.translation - place[:3, 3]) < -by)
        if by < 0.0:
            return _meet(self.moving.whole, pose, self.still.whole, -by)
        left = self.still.left(by)
        if left is not None and _meet(self.moving.whole, pose, left):
            return True
        left = self.moving.left(by)
        return left is not None and _meet(left, pose, self.still.whole)


def couples_of(robot: Robot, bodies: Bodies, axis: Array) -> list[Couple]:
    """Every part of the tool with everything at rest that it has to stay clear of.

    Args:
        robot: the arm.
        bodies: its bodies, and the pairs that are checked.
        axis: (3,) the tool axis in the frame of the last joint.
    """
    frame = robot.model.frames[robot.tool_frame_id]
    tip = frame.placement.translation
    moving, still = dict[str, list[Body]](), dict[str, list[tuple[Body, float]]]()
    for solid in bodies.solids:
        if solid.joint == int(frame.parentJoint):
            moving.setdefault(solid.owner, []).extend(_parts(solid, tuple(tip.tolist())))
        elif solid.joint == 0:
            still.setdefault(solid.owner, []).append((_at_rest(solid), 0.0))
    for thing in bodies.scene:
        still[thing.name] = [(_at_rest(thing), 0.0)]
    for soup in bodies.soups:
        if soup.owner not in still:
            sheet = sheet_piece(soup.triangles, soup.closed)
            still[soup.owner] = [(Body(None, np.eye(4), sheet), soup.deviation)]
    found = []
    for pair in bodies.pairs:
        ways = (pair.first, pair.second), (pair.second, pair.first)
        found += [
            Couple(one, other, pair.clearance - deviation, tip, axis)
            for mover, rest in ways
            for one in moving.get(mover, ())
            for other, deviation in still.get(rest, ())
        ]
    return found


@lru_cache(maxsize=KEPT)
def _at_rest(thing: Solid | Obstacle) -> Body:
    """A body that does not move."""
    return Body(thing.geometry, thing.placement)


@lru_cache(maxsize=KEPT)
def _parts(solid: Solid, tip: tuple[float, ...]) -> list[Body]:
    """A shape in slabs across its longest side, or a mesh as it is and in groups of triangles."""
    shape: Any = solid.geometry
    placement = solid.placement
    if isinstance(shape, Triangles):
        whole = Body(shape, placement)
        groups = _groups(whole.whole, np.array(tip))
        return [whole, *(Body(None, placement, part) for part in groups)]
    axis, length = 2, getattr(shape, "length", 0.0)
    if isinstance(shape, Box):
        axis, length = int(np.argmax(shape.size)), max(shape.size)
    if not length:
        return [Body(shape, placement)]
    slabs = [Body(shape, placement)]
    for k in range(SLABS):
        place = placement.copy()
        place[:3, 3] += placement[:3, axis] * length * ((k + 0.5) / SLABS - 0.5)
        slabs.append(Body(_shorter(shape, axis, length / SLABS), place))
    return slabs


def _shorter(shape: Any, axis: int, length: float) -> Any:
    """The same shape with another length along an axis."""
    if isinstance(shape, Box):
        x, y, z = (length if k == axis else side for k, side in enumerate(shape.size))
        return Box((x, y, z))
    kind = Capsule if isinstance(shape, Capsule) else Cylinder
    return kind(shape.radius, length)


def _groups(mesh: Any, tip: Array) -> list[Piece]:
    """The triangles of a mesh in groups, those nearest to the tool point first."""
    if len(mesh.faces) < SLABS:
        return []
    away = np.linalg.norm(mesh.vertices[mesh.faces] - tip, axis=2).max(axis=1)
    return [mesh.of(group) for group in np.array_split(np.argsort(away), SLABS)]


def _meet(moving: Piece, pose: pin.SE3, still: Piece, margin: float = 0.0) -> bool:
    """Do two pieces come nearer than a margin (m), the first one carried by a pose?"""
    import coal

    request = with_contacts(coal.CollisionRequest())
    request.security_margin = margin
    place = pose.homogeneous @ moving.placement
    first = coal.Transform3s(place[:3, :3], place[:3, 3])
    second = coal.Transform3s(still.placement[:3, :3], still.placement[:3, 3])
    found = coal.CollisionResult()
    coal.collide(moving.geometry, first, still.geometry, second, request, found)
    return bool(found.isCollision())
