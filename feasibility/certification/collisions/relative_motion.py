"""How one body moves as seen from another, between waypoints too.

Seen from joint a, a body on joint b > a is moved by the joints a + 1 .. b. Along a straight segment
with the joint changes d_j, s from 0 to 1, each of its points x(s) obeys

    |x''| <= sum_j r_j |d_j| (|d_j| + 2 sum_(a < i < j) |d_i|),    |x - chord| <= max |x''| / 8,

where r_j is the largest distance of any of its points from axis j, and the d_i are those of
revolute joints; a prismatic joint j adds 2 |d_j| sum_i |d_i|. r_j is the distance of the centre
of a ball around the body, plus its radius. Along the segment only the joints behind j change it, so
with their rate L of motion it is at most (r_j(0) + r_j(1) + L) / 2.

No point moves further than M = sum_j r_j |d_j|.

A motion that is not straight, but strays at most e_j from the segment in each joint, moves each
point by another sum_j r_j e_j at most, with r_j enlarged by what the joints behind j stray.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from coverable_errors import ArgumentError
from robots import Kinematics, Robot

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, slots=True)
class Poses:
    """Where a body is, as seen from another, k times."""

    rotations: Array
    """(k, 3, 3)"""
    points: Array
    """(k, 3) m."""

    def of(self, chosen: NDArray[np.bool_] | NDArray[np.intp]) -> Poses:
        """Some of them."""
        return Poses(self.rotations[chosen], self.points[chosen])

    def and_(self, others: Poses) -> Poses:
        """These, and others behind them."""
        rotations = np.concatenate([self.rotations, others.rotations])
        return Poses(rotations, np.concatenate([self.points, others.points]))

    def moved(self, point: Array) -> Array:
        """(k, 3) m, where a point (3,) of the body is."""
        return np.asarray(self.rotations @ point + self.points)


@dataclass(frozen=True, eq=False, slots=True)
class Stretches:
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
    stray: Array
    """(k,) m, how far straying from straight joint motion may move it besides."""
    bound: Array
    """(k,) m, a lower bound of the distance along each that is known already."""

    def of(self, chosen: NDArray[np.bool_] | NDArray[np.intp]) -> Stretches:
        """Some of them."""
        return Stretches(
            self.row[chosen],
            self.share[chosen],
            self.length[chosen],
            self.first.of(chosen),
            self.last.of(chosen),
            self.delta[chosen],
            self.moved[chosen],
            self.stray[chosen],
            self.bound[chosen],
        )


class Motion:
    """A joint motion with Pinocchio's placements of every joint."""

    def __init__(self, robot: Robot, q: Array, strays: Array | None = None) -> None:
        """Place the arm.

        Args:
            robot: the arm, a serial chain.
            q: (m, n) rows, finite, m >= 2.
            strays: (m - 1, n) how far each joint may be from the straight line; none by default.

        Raises:
            ArgumentError: the joints form no serial chain.
        """
        if list(robot.model.parents)[1:] != list(range(robot.n)):
            raise ArgumentError(f"robot {robot.name!r}: its joints form no serial chain")
        self.q, self.prismatic = q, robot.prismatic
        self.strays = np.zeros((len(q) - 1, robot.n)) if strays is None else strays
        self._kinematics = Kinematics(robot)
        self._frames = self._kinematics.joints(q)
        self._twists = self._kinematics.twists(q).transpose(0, 2, 1)
        self._relative: dict[tuple[int, int], Poses] = {}
        self._levers: dict[tuple[int, bytes, float], Array] = {}

    def levers(self, joint: int, centre: Array, ball: float) -> Array:
        """(m, joint) m, r_j of a ball that `joint` carries, at each row; 1 for prismatic joints."""
        key = (joint, centre.tobytes(), ball)
        if key not in self._levers:
            points = self._frames.rotations[:, joint] @ centre + self._frames.points[:, joint]
            linear, angular = np.split(self._twists[:, :joint], 2, axis=2)
            away = np.linalg.norm(linear + np.cross(angular, points[:, None]), axis=2)
            self._levers[key] = np.where(self.prismatic[:joint], 1.0, away + ball)
        return self._levers[key]

    def stretches(self, a: int, b: int, centre: Array, ball: float) -> Stretches:
        """Every segment, as a body on joint b moves as seen from joint a <= b."""
        poses = self._poses(a, b)
        levers = self.levers(b, centre, ball)
        count = len(self.q) - 1
        steps = np.abs(np.diff(self.q, axis=0))
        bounds = chord_bounds(steps, levers, self.prismatic, self.strays, a, b)
        return Stretches(
            np.arange(count),
            np.zeros(count),
            np.ones(count),
            Poses(poses.rotations[:-1], poses.points[:-1]),
            Poses(poses.rotations[1:], poses.points[1:]),
            *bounds,
            np.full(count, -np.inf),
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
        return joined(before, behind)

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


def chord_bounds(
    steps: Array,
    levers: Array,
    prismatic: NDArray[np.bool_],
    strays: Array,
    a: int,
    b: int,
) -> tuple[Array, Array, Array]:
    """How far points of a body on joint b may be from their chords, and move, seen from joint a.

    Args:
        steps: (m - 1, n) |d_j|.
        levers: (m, b) r_j at the ends of the segments, see `Motion.levers`.
        prismatic: (n,) which joints slide.
        strays: (m - 1, n) e_j.
        a, b: joints, 0 <= a <= b <= n; 0 is the root.

    Returns:
        (m - 1,) m from the chords, for straight segments; (m - 1,) m that they move; and (m - 1,)
        m that straying adds.
    """
    turns = np.where(prismatic, 0.0, steps)
    second, rate, stray = (np.zeros(len(steps)) for _ in range(3))
    for j in range(b - 1, a - 1, -1):
        d, before = steps[:, j], turns[:, a:j].sum(axis=1)
        if prismatic[j]:
            second += 2.0 * d * before
            rate += d
            stray += strays[:, j]
            continue
        lever = 0.5 * (levers[:-1, j] + levers[1:, j] + rate)
        second += lever * d * (d + 2.0 * before)
        rate += lever * d
        stray += (lever + stray) * strays[:, j]
    return second / 8.0, rate, stray


def joined(one: Stretches, other: Stretches) -> Stretches:
    """Both, one behind the other."""
    return Stretches(
        np.concatenate([one.row, other.row]),
        np.concatenate([one.share, other.share]),
        np.concatenate([one.length, other.length]),
        one.first.and_(other.first),
        one.last.and_(other.last),
        np.concatenate([one.delta, other.delta]),
        np.concatenate([one.moved, other.moved]),
        np.concatenate([one.stray, other.stray]),
        np.concatenate([one.bound, other.bound]),
    )


def _seen_from(rotations: Array, points: Array, a: int, b: int) -> Poses:
    """Frame b in frame a, from those of all joints (k, n + 1, 3, 3) and (k, n + 1, 3)."""
    back = rotations[:, a].transpose(0, 2, 1)
    apart = points[:, b] - points[:, a]
    return Poses(back @ rotations[:, b], (back @ apart[:, :, None])[:, :, 0])
