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
from functools import cached_property

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
    across: Array
    """(k, 3) the normal of the plane that gave it, 0 where it is from elsewhere."""

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
            self.across[chosen],
        )


@dataclass(frozen=True, eq=False, slots=True)
class Sways:
    """How bodies, each within a ball on a joint, move along every segment, seen from any joint.

    All arrays have the axes (n + 1, m - 1, B): the joint from which body b is seen, 0 for the root;
    the segment; the body. They are 0 from the joint on that carries it.
    """

    delta: Array
    """m, how far a point may leave its chord."""
    moved: Array
    """m, how far a point may move."""
    stray: Array
    """m, how far straying from straight joint motion may move it besides."""


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
        self._relative: dict[tuple[int, int], Poses] = {}

    def centres(self, joints: NDArray[np.intp], centres: Array) -> Array:
        """(m, B, 3) m, points (B, 3) that `joints` (B,) carry, in the root frame at each row."""
        turned = np.einsum("mbij,bj->mbi", self._frames.rotations[:, joints], centres)
        return np.asarray(turned + self._frames.points[:, joints])

    def seen_from(self, joint: int, points: Array) -> Array:
        """(m, k, 3) m, points of the root frame at each row, as seen from a joint."""
        apart = points - self._frames.points[:, None, joint]
        return np.asarray(apart @ self._frames.rotations[:, joint])

    def sways(self, joints: NDArray[np.intp], centres: Array, balls: Array) -> Sways:
        """How balls with `centres` (B, 3) and radii `balls` (B,), m, on `joints` (B,) move."""
        levers = self._levers(self.centres(joints, centres)) + balls
        steps = np.abs(np.diff(self.q, axis=0))
        return chord_bounds(steps, levers, self.prismatic, self.strays, joints)

    def _levers(self, points: Array) -> Array:
        """(m, n, B) m, distances of points (m, B, 3) from each joint's axis.

        The velocity of a point that a joint alone turns at 1 rad/s: angular x point + linear.
        """
        cross, linear = self._turns
        velocities = cross @ points.transpose(0, 2, 1) + linear
        velocities = velocities.reshape(len(points), -1, 3, points.shape[1])
        return np.asarray(np.sqrt(np.einsum("mnib,mnib->mnb", velocities, velocities)))

    @cached_property
    def _turns(self) -> tuple[Array, Array]:
        """(m, 3 n, 3) and (m, 3 n, 1): what gives each joint's velocities of a point.

        The angular velocity of each joint as the matrix of its cross product, and its linear part
        at the origin. In its own frame a joint's twist is always the same; Pinocchio says which at
        the first row.
        """
        rotations, points = self._frames.rotations[:, 1:], self._frames.points[:, 1:]
        linear, angular = np.split(self._kinematics.twists(self.q[:1])[0].T, 2, axis=1)
        back = rotations[0].transpose(0, 2, 1)
        own = back @ (linear - np.cross(points[0], angular))[:, :, None]
        x, y, z = np.moveaxis((rotations @ (back @ angular[:, :, None]))[..., 0], 2, 0)
        nothing = np.zeros_like(x)
        cross = np.stack([nothing, -z, y, z, nothing, -x, -y, x, nothing], axis=-1)
        cross = cross.reshape(*x.shape, 3, 3)
        there = rotations @ own - cross @ points[..., None]
        m, n = x.shape
        return cross.reshape(m, 3 * n, 3), there.reshape(m, 3 * n, 1)

    def stretches(self, a: int, b: int, centre: Array, ball: float) -> Stretches:
        """Every segment, as a body on joint b within a ball moves as seen from joint a <= b."""
        sways = self.sways(np.array([b]), centre[None], np.array([ball]))
        return self.stretches_of(sways, a, b, 0, np.full(len(self.q) - 1, -np.inf))

    def stretches_of(self, sways: Sways, a: int, b: int, body: int, bound: Array) -> Stretches:
        """The same of a body of `sways` on joint b, with bounds (m - 1,) m that are known."""
        poses, count = self._poses(a, b), len(self.q) - 1
        return Stretches(
            np.arange(count),
            np.zeros(count),
            np.ones(count),
            Poses(poses.rotations[:-1], poses.points[:-1]),
            Poses(poses.rotations[1:], poses.points[1:]),
            sways.delta[a, :, body],
            sways.moved[a, :, body],
            sways.stray[a, :, body],
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
    joints: NDArray[np.intp],
) -> Sways:
    """How far points of bodies may be from their chords, and move, seen from every joint.

    With T_j the sum of the |d_i| of revolute joints i <= j, the sum in the module's first bound is

        sum_j r_j |d_j| (|d_j| + 2 T_(j-1)) - 2 T_a sum_j r_j |d_j|,    j = a + 1 .. b,

    so that running sums from the tip on give it for all a.

    Args:
        steps: (m - 1, n) |d_j|.
        levers: (m, n, B) m, r_j at the ends of the segments.
        prismatic: (n,) which joints slide.
        strays: (m - 1, n) e_j.
        joints: (B,) which joint carries each body, 0 for the root.
    """
    count, n = steps.shape
    turns = np.where(prismatic, 0.0, steps)
    before = np.cumsum(turns, axis=1) - turns
    found = Sways(*(np.zeros((n + 1, count, len(joints))) for _ in range(3)))
    second, first, rate, stray = (np.zeros((count, len(joints))) for _ in range(4))
    for j in range(n - 1, -1, -1):
        d, ahead, off = steps[:, j, None], before[:, j, None], strays[:, j, None]
        carried = (joints > j).astype(float)
        if prismatic[j]:
            second, first = second + carried * (2.0 * d * ahead), first + carried * d
            rate, stray = rate + carried * d, stray + carried * off
        else:
            lever = 0.5 * carried * (levers[:-1, j] + levers[1:, j] + rate)
            way = lever * d
            second, first = second + way * (d + 2.0 * ahead), first + way
            rate, stray = rate + way, stray + carried * (lever + stray) * off
        found.delta[j] = np.maximum(second - 2.0 * ahead * first, 0.0) / 8.0
        found.moved[j], found.stray[j] = rate, stray
    return found


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
        np.concatenate([one.across, other.across]),
    )


def _seen_from(rotations: Array, points: Array, a: int, b: int) -> Poses:
    """Frame b in frame a, from those of all joints (k, n + 1, 3, 3) and (k, n + 1, 3)."""
    back = rotations[:, a].transpose(0, 2, 1)
    apart = points[:, b] - points[:, a]
    return Poses(back @ rotations[:, b], (back @ apart[:, :, None])[:, :, 0])
