"""Boxes of joint values in which two bodies collide everywhere: balls and points inside them.

A ball inside a link, with its centre at a signed distance of s from a body at rest at the middle of
a box, is moved by no more than M in the box (`frames`). With r its radius, the two come nearer
than a clearance c everywhere in the box if s - r + M < c. Near the tool the centre is known better
from the target of the tool point, to which M then adds the tolerance. Of two links, the balls of
the outer one are looked at from the inner one, where only the joints between them move it.

Meshes that are not convex solids count with points of their triangles where they move, and not at
all where they are at rest, nor does the surface: what must confirm this knows no inside of theirs.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coverable_arrays import Array, Ints
from feasibility.collisions import Bodies, Pair
from feasibility.roadmap.joint_boxes.at_target import Target
from feasibility.roadmap.joint_boxes.frames import Frames, moves, moves_from_tool
from feasibility.roadmap.tool_alone import Distance, balls_inside, distance_from, is_convex
from robots import Chain, Robot, joint_alignments
from robots.shapes import Triangles

FINEST = 12  # parts of the widest side of a mesh, between whose corners points are placed
MOST_BALLS = 40  # of a link
SURE = 1e-6  # [m] deeper than needed


class Balls(NamedTuple):
    """Balls inside one link."""

    joint: int
    """The one that carries it."""
    centres: Array
    """(k, 3) m, in that joint's frame, turned so that its axis is z."""
    radii: Array
    """(k,) m"""

    @property
    def around(self) -> tuple[Array, float]:
        """Centre (3,) and radius (m) of a ball around all of them."""
        middle = 0.5 * (self.centres.min(axis=0) + self.centres.max(axis=0))
        wide = np.linalg.norm(self.centres - middle, axis=1) + self.radii
        return middle, float(wide.max())


class _BallTest(NamedTuple):
    """Balls that have to stay clear of a body at rest, or of the balls of another link."""

    pair: Pair
    balls: Balls
    other: Distance | Balls


class Deepest(NamedTuple):
    """Of m boxes, what is nearest to ruling each out."""

    ratio: Array
    """(m,) how far a ball is moved within the box, by how deep it is; below 1 the box is ruled
    out, inf where none is deep at all."""
    effect: Array
    """(m, n) m, how far each joint moves that ball."""
    pair: Ints
    """(m,) which pair it is; -1 for none."""


class BallTests:
    """All tests of one problem."""

    def __init__(self, robot: Robot, bodies: Bodies) -> None:
        """Place balls in the bodies of all pairs that have to stay clear."""
        self._chain, self.pairs = robot.chain, bodies.pairs
        self._tests = _tests_of(robot, bodies)

    def __bool__(self) -> bool:
        """Is there anything to collide with?"""
        return bool(self._tests)

    def deepest(self, frames: Frames, half: Array, target: Target) -> Deepest:
        """What is nearest to ruling out m boxes: frames at their middles, half widths (m, n)."""
        m, n = half.shape
        found = Deepest(np.full(m, np.inf), np.zeros((m, n)), np.full(m, -1))
        useful = np.zeros(len(self._tests), dtype=int)
        left = np.arange(m)
        for k, test in enumerate(self._tests):
            rows = _near(test, frames, left, target)
            if not len(rows):
                continue
            placed = _placed(self._chain, test, frames.some(rows), half[rows], target)
            ratio, effect = _ratios(test, frames.some(rows), placed)
            better = ratio < found.ratio[rows]
            rows = rows[better]
            found.ratio[rows], found.effect[rows] = ratio[better], effect[better]
            found.pair[rows] = self.pairs.index(test.pair)
            useful[k] = int((found.ratio[rows] < 1.0).sum())
            left = left[found.ratio[left] >= 1.0]
        # What ruled out most comes first: the next boxes are often alike.
        order = np.argsort(-useful, kind="stable")
        self._tests = [self._tests[k] for k in order]
        return found

    def spare(self, frames: Frames) -> Array:
        """(m,) m, the least distance beyond the clearance of any ball at some configurations.

        Where it is positive, no box around one can be ruled out.
        """
        least = np.full(len(frames.points), np.inf)
        for test in self._tests:
            balls = test.balls
            spare = _spare(test, frames, frames.carried(balls.joint, balls.centres))
            least = np.minimum(least, spare.min(axis=1))
        return least


class _Placed(NamedTuple):
    """Where balls are in m boxes, and how far from there they can be."""

    centres: Array
    """(m, k, 3) m"""
    by_joint: Array
    """(m, k, n) m, by how far each joint moves them."""
    off: Array
    """(m, k) m, how far else they may be from there."""


def _near(test: _BallTest, frames: Frames, rows: Ints, target: Target) -> Ints:
    """Those of some boxes (rows) in which a ball may be deep, as far as their middles show."""
    if isinstance(test.other, Balls):
        return rows
    middle, wide = test.balls.around
    some = frames.some(rows)
    at = some.carried(test.balls.joint, middle[None])[:, 0]
    tool = some.carried(frames.points.shape[1] - 1, target.tip[None])[:, 0]
    least = np.minimum(test.other(at), test.other(at + target.point - tool))
    return rows[least < wide + test.pair.clearance]


def _placed(chain: Chain, test: _BallTest, frames: Frames, half: Array, target: Target) -> _Placed:
    """Balls as they are known best: from the root, or from the target."""
    n, joint = half.shape[1], test.balls.joint
    x = frames.carried(joint, test.balls.centres)
    by_joint = np.zeros((*x.shape[:2], n))
    by_joint[..., :joint] = moves(chain, frames, half, x, joint).by_joint
    off = np.zeros(x.shape[:2])
    if isinstance(test.other, Balls):
        by_joint[..., : test.other.joint] = 0.0
        return _Placed(x, by_joint, off)
    tool, from_tool = moves_from_tool(chain, frames, half, x, joint)
    better = from_tool.sum(axis=2) + target.tolerance < by_joint.sum(axis=2)
    shifted = x + (target.point - tool)[:, None]
    return _Placed(
        np.where(better[..., None], shifted, x),
        np.where(better[..., None], from_tool, by_joint),
        np.where(better, target.tolerance, off),
    )


def _spare(test: _BallTest, frames: Frames, x: Array) -> Array:
    """(m, k) m, distances beyond the clearance of balls with their centres at x (m, k, 3)."""
    balls, other = test.balls, test.other
    if isinstance(other, Balls):
        y = frames.carried(other.joint, other.centres)
        away = np.linalg.norm(x[:, :, None] - y[:, None], axis=3) - other.radii
        return np.asarray(away.min(axis=2) - balls.radii - test.pair.clearance)
    return other(x) - balls.radii - test.pair.clearance


def _ratios(test: _BallTest, frames: Frames, placed: _Placed) -> tuple[Array, Array]:
    """Of the ball that is nearest to ruling out each box: the ratio (m,), and (m, n) m."""
    spare = _spare(test, frames, placed.centres) + placed.off
    deep = np.maximum(-spare - SURE, 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(deep > 0.0, placed.by_joint.sum(axis=2) / deep, np.inf)
    best, rows = ratio.argmin(axis=1), np.arange(len(ratio))
    return ratio[rows, best], placed.by_joint[rows, best]


def _tests_of(robot: Robot, bodies: Bodies) -> list[_BallTest]:
    """All pairs of which something can be shown."""
    moving, still = _links(robot, bodies), _at_rest(bodies)
    found: list[_BallTest] = []
    for pair in bodies.pairs:
        names = (pair.first, pair.second)
        if pair.first in moving and pair.second in moving:
            inner, outer = sorted((moving[name] for name in names), key=lambda balls: balls.joint)
            if (inner.radii > 0.0).any() or (outer.radii > 0.0).any():
                found.append(_BallTest(pair, outer, inner))
            continue
        mover, rest = names if pair.first in moving else names[::-1]
        if mover in moving:
            found += [_BallTest(pair, moving[mover], one) for one in still.get(rest, ())]
    return found


def _links(robot: Robot, bodies: Bodies) -> dict[str, Balls]:
    """Balls inside everything that moves."""
    turned = joint_alignments(robot.model)
    parts = dict[tuple[str, int], list[Array]]()
    for solid in bodies.solids:
        if solid.joint > 0:
            shape, place = solid.geometry, solid.placement
            if isinstance(shape, Triangles) and not is_convex(shape):
                balls = _on_triangles(shape)
            else:
                balls = balls_inside(shape)
            balls[:, :3] = balls[:, :3] @ place[:3, :3].T + place[:3, 3]
            balls[:, :3] = balls[:, :3] @ turned[solid.joint - 1]
            parts.setdefault((solid.owner, solid.joint), []).append(balls)
    found = {}
    for (owner, joint), several in parts.items():
        some = _spread(np.concatenate(several))
        found[owner] = Balls(joint, some[:, :3], some[:, 3])
    return found


def _on_triangles(mesh: Triangles) -> Array:
    """(k, 4) balls of no radius all over the triangles of a mesh."""
    corners = mesh.vertices[mesh.faces]
    edge = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    found = [mesh.vertices[np.unique(mesh.faces)]]
    for parts in range(2, FINEST + 1):
        wide = corners[edge > parts * float(np.ptp(mesh.vertices, axis=0).max()) / FINEST]
        shares = np.array([(i, k, parts - i - k) for i in range(parts) for k in range(parts - i)])
        found.append(np.einsum("sk,mki->msi", shares / parts, wide).reshape(-1, 3))
    points = np.concatenate(found)
    return np.column_stack([points, np.zeros(len(points))])


def _spread(balls: Array) -> Array:
    """The widest ball, then those that reach furthest from what is taken already."""
    chosen = [int(balls[:, 3].argmax())]
    out = np.full(len(balls), np.inf)
    while len(chosen) < min(MOST_BALLS, len(balls)):
        last = balls[chosen[-1]]
        away = np.linalg.norm(balls[:, :3] - last[:3], axis=1) + balls[:, 3] - last[3]
        out = np.minimum(out, away)
        out[chosen] = -np.inf
        chosen.append(int(out.argmax()))
    return balls[chosen]


def _at_rest(bodies: Bodies) -> dict[str, list[Distance]]:
    """Signed distances from convex bodies that do not move."""
    found = dict[str, list[Distance]]()
    for solid in bodies.solids:
        if solid.joint == 0 and is_convex(solid.geometry):
            one = distance_from(solid.geometry, solid.placement)
            found.setdefault(solid.owner, []).append(one)
    for thing in bodies.scene:
        if is_convex(thing.geometry):
            found[thing.name] = [distance_from(thing.geometry, thing.placement)]
    return found
