"""What moves with the tool beside what is at rest: points of one, and how deep they are in another.

A mesh that is no convex solid is deep where balls inside it are. At rest meshes have points all
over their triangles, and so has the surface. What is left out here proves nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array
from feasibility.certification.collisions.depths import Balls, depths, points_inside
from feasibility.collisions.problem_bodies import Bodies, Pair
from feasibility.collisions.scene import Obstacle
from robots.robot import Robot
from robots.shapes.bodies import Solid, Triangles

GUARD = 1e-7  # [m] that an overlap has to be larger by
FINEST = 40  # parts of the tool's reach that triangles of a sheet are cut to
CUTS = 40  # of a triangle, at most
KEPT = 64  # bodies that are remembered

Depth = Callable[[Array], Array]
"""From points (..., 3) m to how deep they are at least, (...) m."""


class _Body(NamedTuple):
    """A body in the frame of what carries it."""

    points: Array
    """(k, 3) m"""
    deep: Array
    """(k,) m, how deep they are."""
    depth: Depth | None
    """None where no point of it is known to be deep."""


class ToolPair(NamedTuple):
    """Points of one body, and how deep they are in another that it has to stay clear of."""

    pair: Pair
    points: Array
    """(k, 3) m, in the frame of the last joint, or in the root's where they are at rest."""
    deep: Array
    """(k,) m, how deep they are in their own body, and the clearance, less a guard."""
    moving: bool
    """Do they move with the tool?"""
    depth: Depth
    """Of the other body, in the other of the two frames."""

    def overlaps(self, rotations: Array, places: Array) -> tuple[Array, Array]:
        """By how much (k, E) m they are too near at poses (k, 3, 3), (k, 3) m of the last joint.

        And the E points as they are seen from that joint, (k, E, 3) m.
        """
        if self.moving:
            there = self.points @ rotations.transpose(0, 2, 1) + places[:, None]
            own = np.broadcast_to(self.points, there.shape)
        else:
            there = own = (self.points - places[:, None]) @ rotations
        return self.deep + self.depth(there), own


def tool_pairs(robot: Robot, bodies: Bodies, target: Array) -> list[ToolPair]:
    """Everything that moves with the tool beside what is at rest and near the target (3,) m."""
    frame = robot.model.frames[robot.tool_frame_id]
    tip, joint = frame.placement.translation, int(frame.parentJoint)
    tool, rest = dict[str, list[_Body]](), dict[str, list[_Body]]()
    for solid in bodies.solids:
        if solid.joint in (0, joint):
            (tool if solid.joint else rest).setdefault(solid.owner, []).append(_body(solid))
    reach = max((_reach(one, tip) for many in tool.values() for one in many), default=0.0)
    for thing in bodies.scene:
        rest[thing.name] = [_body(thing)]
        if isinstance(thing.geometry, Triangles):
            corners = thing.geometry.vertices @ thing.placement[:3, :3].T + thing.placement[:3, 3]
            rest[thing.name].append(_sheet(corners[thing.geometry.faces], 0.0, target, reach))
    for soup in bodies.soups:
        if soup.owner not in rest:
            rest[soup.owner] = [_sheet(soup.triangles, soup.deviation, target, reach)]
    return [
        made
        for pair in bodies.pairs
        for mover, still in ((pair.first, pair.second), (pair.second, pair.first))
        for one in tool.get(mover, ())
        for other in rest.get(still, ())
        for made in _between(pair, one, other, target, reach)
    ]


def _between(pair: Pair, tool: _Body, rest: _Body, target: Array, reach: float) -> list[ToolPair]:
    """Points of either body against the other, where something may be too near."""
    spare, found = pair.clearance - GUARD, []
    if rest.depth is not None and len(tool.points):
        found.append(ToolPair(pair, tool.points, tool.deep + spare, True, rest.depth))
    away = np.linalg.norm(rest.points - target, axis=1)
    near = away <= reach + np.maximum(rest.deep + pair.clearance, 0.0)
    if tool.depth is not None and near.any():
        deep = rest.deep[near] + spare
        found.append(ToolPair(pair, rest.points[near], deep, False, tool.depth))
    return found


def _reach(tool: _Body, tip: Array) -> float:
    """m, about how far a body is from the tool point at most."""
    return float((np.linalg.norm(tool.points - tip, axis=1) + tool.deep).max(initial=0.0))


@lru_cache(maxsize=KEPT)
def _body(thing: Solid | Obstacle) -> _Body:
    """Points in a body and their depths."""
    rotation, place = thing.placement[:3, :3], thing.placement[:3, 3]
    points, deep = points_inside(thing.geometry)
    known = depths(thing.geometry, np.zeros(3)) is not None
    shape = thing.geometry if known or not len(points) else Balls.among(points, deep)

    def depth(x: Array) -> Array:
        found = depths(shape, (x - place) @ rotation)
        return np.full(x.shape[:-1], -np.inf) if found is None else found

    return _Body(points @ rotation.T + place, deep, depth)


def _sheet(triangles: Array, deviation: float, target: Array, reach: float) -> _Body:
    """Points all over those of some triangles (k, 3, 3) m that the tool may meet over a target."""
    for _ in range(CUTS):
        middles = triangles.mean(axis=1)
        wide = np.linalg.norm(triangles - middles[:, None], axis=2).max(axis=1, initial=0.0)
        near = np.linalg.norm(middles - target, axis=1) <= reach + wide
        triangles, large = triangles[near], wide[near] > reach / FINEST
        if not large.any():
            break
        some = triangles[large]  # halved at their longest sides: narrow ones do not stay narrow
        sides = np.linalg.norm(some - np.roll(some, -1, axis=1), axis=2)
        order = (sides.argmax(axis=1)[:, None] + np.arange(3)) % 3
        a, b, c = np.take_along_axis(some, order[:, :, None], axis=1).transpose(1, 0, 2)
        parts = [np.stack(half, axis=1) for half in ((a, 0.5 * (a + b), c), (0.5 * (a + b), b, c))]
        triangles = np.concatenate([triangles[~large], *parts])
    points = triangles.mean(axis=1)
    return _Body(points, np.full(len(points), -deviation), None)
