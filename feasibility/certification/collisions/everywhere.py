"""Boxes of joint values in which two bodies overlap everywhere.

A point of body i that is r deep in it and s deep in another one
at the middle of a box shows that they come nearer than the clearance c all over the box if

    r + s + c > M,

M being how far the point can move in the box, seen from the other body. With x the point, v_k + w_k
x its velocity by joint k (Pinocchio's), and h_k the half widths, M = sum_k m_k over the joints
between the two, where m_k = min(h_k, 2) |v_k + w_k x| if joint k turns, and h_k if it slides: the
joints are moved one by one, the first first, so that those behind k are still at the middle, and
those before it have carried its axis along with the point. Or else, where the tool point p is
within e of a place T, the point is as far from T + x - p as that difference changes, and e: joints
beyond i move p, those up to i turn the difference.

Where the tool is looked at alone (`every_pose`), it is all that moves, and all is seen from T:
points at rest that are deep in it, too.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints, Rows
from feasibility.certification.collisions.collision_replay import collision_replay
from feasibility.certification.collisions.depths import (
    Balls,
    depths,
    planes_around,
    points_inside,
)
from feasibility.collisions.problem_bodies import Bodies
from robots.kinematics import Kinematics
from robots.robot import Robot
from robots.shapes.bodies import Geometry, Solid, Triangles

GUARD = 1e-7  # [m] that an overlap has to be larger by


class Points(NamedTuple):
    """Points of a body."""

    owner: str
    joint: int
    """0 at rest."""
    places: Array
    """(k, 3) m, in the frame of the joint."""
    deep: Array
    """(k,) m"""

    @staticmethod
    def of(solid: Solid) -> Points:
        """Of an exact shape."""
        (places, deep), place = points_inside(solid.geometry), solid.placement
        return Points(solid.owner, solid.joint, places @ place[:3, :3].T + place[:3, 3], deep)


_Couples = tuple[Points, list[tuple[Solid, Geometry | Balls, int]]]
"""Points, and the bodies that they may be inside: each with the shape, or balls, whose inside is
known, and the index of the pair."""


class Deepest(NamedTuple):
    """Of m boxes, the point that is nearest to ruling each out."""

    ratio: Array
    """(m,) how far it moves in the box by how far it may; below 1 the box is ruled out, inf where
    nothing overlaps at its middle."""
    effect: Array
    """(m, n) m, how far each joint moves it."""
    pair: Ints
    """(m,) which pair it is; -1 for none."""


@dataclass(frozen=True, eq=False, slots=True)
class _Middles(Rows):
    """Of m boxes, their half widths and what Pinocchio says of the arm at their middles."""

    half: Array
    """(m, n)"""
    rotations: Array
    """(m, n + 1, 3, 3)"""
    origins: Array
    """(m, n + 1, 3) m"""
    linear: Array
    """(m, n, 3) v_k"""
    angular: Array
    """(m, n, 3) w_k"""
    tool: Array
    """(m, 3) m"""
    target: Array
    """(m, 3) m"""
    off: Array
    """(m,) m, how far the tool point may be from the target in the box."""


class Overlapping:
    """Finds boxes in which bodies of one problem overlap everywhere."""

    def __init__(
        self, robot: Robot, bodies: Bodies, beside: Sequence[Points] | None = None
    ) -> None:
        """Place points in the bodies of all pairs; the tool alone has some at rest `beside` it."""
        self._robot, self._bodies, self._kinematics = robot, bodies, Kinematics(robot)
        self._alone, self._couples = beside is not None, _couples(bodies, beside)
        self.most_points = max((len(one.places) for one, _ in self._couples), default=0)
        """In any body; 0 where nothing can be proved."""

    def _middles(self, low: Array, high: Array, target: Array, off: Array | float) -> _Middles:
        """See `deepest`."""
        q = 0.5 * (low + high)
        frames, twists = self._kinematics.joints(q), self._kinematics.twists(q).transpose(0, 2, 1)
        return _Middles(
            0.5 * (high - low), frames.rotations, frames.points, twists[..., :3], twists[..., 3:],
            self._kinematics.tools(q)[0], np.broadcast_to(target, (len(q), 3)),
            np.broadcast_to(off, len(q)),
        )  # fmt: skip

    def deepest(self, low: Array, high: Array, target: Array, off: Array | float) -> Deepest:
        """What of m boxes is nearest to being too near all over, with the tool at its target.

        The tool point may be so far `off` (m,) from there, (m, 3) m, or (3,) for all.
        """
        m, n = low.shape
        found = Deepest(np.full(m, np.inf), np.zeros((m, n)), np.full(m, -1))
        if not m:
            return found
        boxes = self._middles(low, high, target, off)
        hits = np.zeros(len(self._couples), dtype=int)
        for k, couples in enumerate(self._couples):
            left = np.flatnonzero(found.ratio >= 1.0)
            if not len(left):
                break
            for pair, over, first, moves in self._measured(couples, boxes.of(left)):
                ratio = np.full(over.shape, np.inf)
                np.divide(sum(moves[first:]), over, out=ratio, where=over > 0.0)
                best = ratio.argmin(axis=1)
                ratio = ratio[np.arange(len(left)), best]
                (some,) = np.nonzero(ratio < found.ratio[left])
                nearer, best = left[some], best[some]
                found.ratio[nearer], found.pair[nearer] = ratio[some], pair
                found.effect[nearer] = 0.0
                for j in range(first, len(moves)):
                    found.effect[nearer, j] = moves[j][some, best]
            hits[k] = (found.ratio[left] < 1.0).sum()
        order = np.argsort(-hits, kind="stable")
        self._couples = [self._couples[k] for k in order]
        return found

    def clear(self, q: Array) -> bool:
        """Does the judge of collisions find all pairs apart at a configuration (n,)?"""
        return collision_replay(self._robot, self._bodies, np.array([q, q])).accepted

    def too_near(
        self, q: Array, target: Array, off: float, only: int | None = None
    ) -> tuple[Array, Ints, Ints]:
        """(m,) m, by how much bodies are too near for certain at configurations q (m, n).

        And which pair, and by points of which body; or by those of one body alone.
        """
        over, pair, which = np.full(len(q), -np.inf), *np.full((2, len(q)), -1)
        boxes = self._middles(q, q, target, off)
        for number in range(len(self._couples)) if only is None else (only,):
            for k, found, _, _ in self._measured(self._couples[number], boxes, False):
                nearest = found.max(axis=1)
                pair, which = (
                    np.where(nearest > over, one, other)
                    for one, other in ((k, pair), (number, which))
                )
                over = np.maximum(over, nearest)
        return over, pair, which

    def _measured(
        self, couples: _Couples, boxes: _Middles, moved: bool = True
    ) -> Iterator[tuple[int, Array, int, list[Array]]]:
        """What is known of k points of one body, for each other body and way to look at it.

        The pair; by how much points are too near, (m, k) m; the first joint that moves them, and by
        how much each does, (m, k) m, unless only places count.
        """
        (points, beside), steps, from_tool = couples, list[Array](), list[Array]()
        x = np.broadcast_to(points.places, (len(boxes.half), *points.places.shape))
        if points.joint:
            x = x @ boxes.rotations[:, points.joint].transpose(0, 2, 1)
            x = x + boxes.origins[:, points.joint, None]
        if moved and not self._alone:
            steps = [self._step(boxes, k, x) for k in range(points.joint)]
        if moved:
            from_tool = self._steps_from_tool(boxes, x, points.joint or self._robot.n)
        shifted = x if self._alone else x + (boxes.target - boxes.tool)[:, None]
        for body, shape, pair in beside:
            kept = points.deep + self._bodies.pairs[pair].clearance - GUARD
            seen = [] if self._alone else [(x, steps, body.joint, np.zeros((len(x), 1)))]
            if self._alone or body.joint == 0:
                seen.append((shifted, from_tool, 0, boxes.off[:, None]))
            for places, moves, first, off in seen:
                over = kept + _depths(body, shape, boxes, places, kept.max(initial=0.0)) - off
                yield pair, over, first, moves

    def _steps_from_tool(self, boxes: _Middles, x: Array, joint: int) -> list[Array]:
        """By how much (m, k) each joint changes the difference of points and the tool point."""
        tool, steps = boxes.tool[:, None], list[Array]()
        for k in range(joint):
            turning = _length_of_cross(boxes.angular[:, k, None], x - tool)  # none by a slide
            steps.append(np.minimum(boxes.half[:, k, None], 2.0) * turning)
        beyond = [self._step(boxes, k, tool) for k in range(joint, self._robot.n)]
        return steps + [np.broadcast_to(step, x.shape[:2]) for step in beyond]

    def _step(self, boxes: _Middles, k: int, x: Array) -> Array:
        """m_k of points (m, k, 3)."""
        if self._robot.prismatic[k]:
            return np.broadcast_to(boxes.half[:, k, None], x.shape[:2])
        lever = _length_of_cross(boxes.angular[:, k, None], x, boxes.linear[:, k, None])
        return np.asarray(np.minimum(boxes.half[:, k, None], 2.0) * lever)


def _length_of_cross(a: Array, b: Array, more: Array | None = None) -> Array:
    """(m, k) lengths of a x b + more (m, k, 3); `np.cross` takes several times as long."""
    x = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    y = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    z = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    if more is not None:
        x, y, z = x + more[..., 0], y + more[..., 1], z + more[..., 2]
    return np.asarray(np.sqrt(x * x + y * y + z * z))


def _depths(body: Solid, shape: Geometry | Balls, boxes: _Middles, x: Array, near: float) -> Array:
    """(m, k) m, how deep points (m, k, 3) are in a body at least; further out than `near`, -inf."""
    turned, shift = boxes.rotations[:, body.joint], body.placement[:3, 3]
    middle = boxes.origins[:, body.joint] + turned @ shift
    own = (x - middle[:, None]) @ (turned @ body.placement[:3, :3])
    if not isinstance(shape, Balls):
        return depths(shape, own)
    found, centre = np.full(x.shape[:2], -np.inf), shape.centres[0]  # balls take long
    wide = (np.linalg.norm(shape.centres - centre, axis=1) + shape.radii).max()
    rows = np.linalg.norm(own - centre, axis=2).min(axis=1) <= wide + near
    found[rows] = depths(shape, own[rows])
    return found


def _couples(bodies: Bodies, beside: Sequence[Points] | None) -> list[_Couples]:
    """The points of every body that moves, with all bodies with an inside that it may not meet.

    And points beside it, with those that move.
    """
    points = [Points.of(one) for one in bodies.exact if one.joint] + [*(beside or ())]
    inside = dict[str, list[tuple[Solid, Geometry | Balls]]]()
    for one in bodies.exact:
        shape, own = one.geometry, inside.setdefault(one.owner, [])
        solid = not isinstance(shape, Triangles) or planes_around(shape) is not None
        own += [(one, shape)] if solid else []
        if isinstance(shape, Triangles) and (one.joint > 0 if beside is None else not solid):
            own.append((one, Balls.among(*points_inside(shape))))
    found = []
    for some in points:
        inside_of = [
            (*body, k)
            for k, pair in enumerate(bodies.pairs)
            for one, other in ((pair.first, pair.second), (pair.second, pair.first))
            for body in (inside.get(other, ()) if one == some.owner else ())
            if some.joint > body[0].joint or some.joint == 0 < body[0].joint
        ]
        if inside_of and len(some.places):
            found.append((some, inside_of))
    return found
