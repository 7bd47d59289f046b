"""How one body moves as seen from another, between waypoints too.

Seen from joint a, a body on joint b > a is moved by the joints a + 1 .. b. Along a straight segment
with the joint changes d_j, s from 0 to 1, each of its points x(s) obeys

    |x''| <= sum_j r_j |d_j| (|d_j| + 2 sum_(a < i < j) |d_i|),    |x - chord| <= max |x''| / 8,

where r_j is the largest distance of any of its points from axis j, and the d_i are those of
revolute joints; a prismatic joint j adds 2 |d_j| sum_i |d_i|. r_j is the distance of the centre
of a ball around the body, plus its radius. Along the segment only the joints behind j change it, so
with their rate L of motion it is at most (r_j(0) + r_j(1) + L) / 2.

No point moves further than M = sum_j r_j |d_j|.

A motion that is not straight, but deviates at most e_j from the segment in each joint, moves each
point by another sum_j r_j e_j at most, with r_j enlarged by what the joints behind j deviation.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from coverable_arrays import Array
from coverable_errors import ArgumentError
from feasibility.certification.collisions.outer_kernels import chord_bounds, outer_bounds
from feasibility.certification.rows import Rows
from robots import Kinematics, Robot

Indices = NDArray[np.intp]

KEPT = 16  # arms whose twists are remembered


@dataclass(frozen=True, eq=False, slots=True)
class Poses(Rows):
    """Where a body is, as seen from another, k times."""

    rotations: Array
    """(k, 3, 3)"""
    points: Array
    """(k, 3) m."""

    def moved(self, point: Array) -> Array:
        """(k, 3) m, where a point (3,) of the body is."""
        return np.asarray(self.rotations @ point + self.points)


@dataclass(frozen=True, eq=False, slots=True)
class Stretches(Rows):
    """Parts of segments between rows of a motion, and how a body moves along them."""

    row: NDArray[np.intp]
    """(k,) index of the row before."""
    share: Array
    """(k,) where it begins, 0 at that row, 1 at the next."""
    length: Array
    """(k,) its share of the segment."""
    first: Poses
    last: Poses
    delta: Array
    """(k,) m, how far a point may leave its chord."""
    moved: Array
    """(k,) m, how far a point may move."""
    deviation: Array
    """(k,) m, how far deviating from straight joint motion may move it besides."""
    bound: Array
    """(k,) m, a lower bound of the distance along each that is known already."""
    across: Array
    """(k, 3) the normal of the plane that gave it, 0 where it is from elsewhere."""


@dataclass(frozen=True, eq=False, slots=True)
class BodyMotions:
    """How bodies, each within a ball on a joint, move along every segment, seen from any joint.

    All arrays have the axes (n + 1, m - 1, B): the joint from which body b is seen, 0 for the root;
    the segment; the body. They are 0 from the joint on that carries it.
    """

    delta: Array
    """m, how far a point may leave its chord."""
    moved: Array
    """m, how far a point may move."""
    deviation: Array
    """m, how far deviating from straight joint motion may move it besides."""


class ArmMotion:
    """A joint motion with Pinocchio's placements of every joint."""

    def __init__(self, robot: Robot, q: Array, deviations: Array | None = None) -> None:
        """Place the arm.

        Args:
            robot: the arm, a serial chain.
            q: (m, n) rows, finite, m >= 2.
            deviations: (m - 1, n) how far each joint may be off the straight line; 0 by default.

        Raises:
            ArgumentError: the joints form no serial chain.
        """
        if list(robot.model.parents)[1:] != list(range(robot.n)):
            raise ArgumentError(f"robot {robot.name!r}: its joints form no serial chain")
        self._robot, self.q, self.prismatic = robot, q, robot.prismatic
        self.deviations = (
            np.zeros((len(q) - 1, robot.n))
            if deviations is None
            else np.ascontiguousarray(deviations)
        )
        self._kinematics = Kinematics(robot)
        self._frames = self._kinematics.joints(q)
        self._relative: dict[tuple[int, int], Poses] = {}

    def body_motions(self, joints: Indices, centres: Array, balls: Array) -> BodyMotions:
        """How balls with `centres` (B, 3) and radii `balls` (B,), m, on `joints` (B,) move."""
        steps, n = np.abs(np.diff(self.q, axis=0)), self.q.shape[1]
        turns = np.where(self.prismatic, 0.0, steps)
        turned = np.cumsum(turns, axis=1) - turns
        found = BodyMotions(*(np.zeros((n + 1, len(steps), len(joints))) for _ in range(3)))
        frames, levers = self._frames, np.empty((len(joints), n))
        chord_bounds(
            frames.rotations, frames.points, _own_twists(self._robot), self.prismatic, steps,
            turned, self.deviations, joints, centres, balls, levers, found.delta, found.moved,
            found.deviation,
        )  # fmt: skip
        return found

    def outer_bounds(
        self, moving: BodyMotions, joints: Indices, centres: Array, balls: Array, halves: Array,
        couples: Indices,
    ) -> Array:  # fmt: skip
        """(c, m - 1) m, how far couples (c, 2) of bodies stay apart, at least.

        By their balls, as in `moving`, and boxes with half the sides `halves` (B, 3), m.
        """
        frames, low = self._frames, np.empty((len(couples), len(self.q) - 1))
        outer_bounds(
            frames.rotations, frames.points, joints, centres, balls, halves, couples,
            moving.delta, moving.deviation, low,
        )  # fmt: skip
        return low

    def stretches(self, a: int, b: int, centre: Array, ball: float) -> Stretches:
        """Every segment, as a body on joint b within a ball moves as seen from joint a <= b."""
        moving = self.body_motions(np.array([b]), centre[None], np.array([ball]))
        return self.stretches_of(moving, a, b, 0, np.full(len(self.q) - 1, -np.inf))

    def stretches_of(
        self, moving: BodyMotions, a: int, b: int, body: int, bound: Array
    ) -> Stretches:
        """The same of a body of `moving` on joint b, with bounds (m - 1,) m that are known."""
        poses, count = self._poses(a, b), len(self.q) - 1
        return Stretches(
            np.arange(count),
            np.zeros(count),
            np.ones(count),
            Poses(poses.rotations[:-1], poses.points[:-1]),
            Poses(poses.rotations[1:], poses.points[1:]),
            moving.delta[a, :, body],
            moving.moved[a, :, body],
            moving.deviation[a, :, body],
            bound,
            np.zeros((count, 3)),
        )

    def halves(self, stretches: Stretches, a: int, b: int) -> Stretches:
        """Both halves of each stretch; what bounds the whole bounds them."""
        half = 0.5 * stretches.length
        share = stretches.share + half
        ahead = self.q[stretches.row + 1] - self.q[stretches.row]
        frames = self._kinematics.joints(self.q[stretches.row] + share[:, None] * ahead)
        middle = _seen_from(frames.rotations, frames.points, a, b)
        delta, moved = 0.25 * stretches.delta, 0.5 * stretches.moved
        before = replace(stretches, length=half, last=middle, delta=delta, moved=moved)
        behind = replace(before, share=share, first=middle, last=stretches.last)
        return Stretches.join(before, behind)

    def pose(self, a: int, b: int, row: int, share: float) -> Poses:
        """Pose of joint b as seen from joint a at one instant."""
        if share == 0.0:
            return self._poses(a, b).of(np.array([row]))
        q = self.q[row] + share * (self.q[row + 1] - self.q[row])
        frames = self._kinematics.joints(q[None])
        return _seen_from(frames.rotations, frames.points, a, b)

    def _poses(self, a: int, b: int) -> Poses:
        """Poses of joint b as seen from joint a at the rows."""
        if (a, b) not in self._relative:
            frames = self._frames
            self._relative[a, b] = _seen_from(frames.rotations, frames.points, a, b)
        return self._relative[a, b]


@lru_cache(maxsize=KEPT)
def _own_twists(robot: Robot) -> Array:
    """(n, 6) unit twists of the joints in their own frames, linear part first.

    There they are always the same; Pinocchio says which.
    """
    kinematics, q = Kinematics(robot), np.zeros((1, robot.n))
    frames = kinematics.joints(q)
    linear, angular = np.split(kinematics.twists(q)[0].T, 2, axis=1)
    there = np.stack([linear + np.cross(angular, frames.points[0, 1:]), angular], axis=1)
    return np.ascontiguousarray((there @ frames.rotations[0, 1:]).reshape(-1, 6))


def _seen_from(rotations: Array, points: Array, a: int, b: int) -> Poses:
    """Frame b in frame a, from those of all joints (k, n + 1, 3, 3) and (k, n + 1, 3)."""
    back = rotations[:, a].transpose(0, 2, 1)
    apart = points[:, b] - points[:, a]
    return Poses(back @ rotations[:, b], (back @ apart[:, :, None])[:, :, 0])
