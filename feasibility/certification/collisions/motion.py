"""How bodies move as seen from a joint, between rows too.

Seen from joint a, a body on joint b > a is moved by the joints a + 1 .. b. Along a straight segment
with the joint changes d_j, s from 0 to 1, each of its points x(s) obeys

    |x''| <= sum_j r_j |d_j| (|d_j| + 2 sum_(a < i < j) |d_i|),    |x - chord| <= max |x''| / 8,

where r_j is the largest distance of any of its points from axis j, and the d_i are those of
revolute joints; a prismatic joint j adds 2 |d_j| sum_i |d_i|. r_j is the distance of the centre
of a ball around the body, plus its radius. Along the segment only the joints behind j change it, so
with their rate L of motion it is at most (r_j(0) + r_j(1) + L) / 2.

No point moves further than M = sum_j r_j |d_j|, nor than its chord and 4 delta: x' differs from the
chord by at most max |x''| / 2. Where joints make up for each other, chords are much shorter than M.

A motion that is not straight, but deviates at most e_j from the segment in each joint, moves each
point by another sum_j r_j e_j at most, with r_j enlarged by what the joints behind j deviate.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coverable.arrays import Array
from coverable.errors import ArgumentError
from robots.kinematics import Kinematics
from robots.robot import Robot


class Chords(NamedTuple):
    """How B bodies move along every segment, seen from every joint: (n + 1, m - 1, B) each.

    The first axis is the joint from which a body is seen, 0 for the root; all is 0 from the joint
    on that carries it.
    """

    delta: Array
    """m, how far a point may leave its chord."""
    moved: Array
    """m, how far a point may move."""
    deviation: Array
    """m, how far deviating from straight joint motion may move it besides."""


class ArmMotion:
    """A joint motion, straight between its rows, with Pinocchio's placements of every joint."""

    def __init__(self, robot: Robot, q: Array, deviations: Array | None = None) -> None:
        """Place an arm at rows q (m, n), finite, m >= 2.

        Its joints may be so far off straight lines, (m - 1, n): by default not at all.

        Raises:
            ArgumentError: the joints form no serial chain.
        """
        if list(robot.model.parents)[1:] != list(range(robot.n)):
            raise ArgumentError(f"robot {robot.name!r}: its joints form no serial chain")
        self.q, self._prismatic, self._kinematics = q, robot.prismatic, Kinematics(robot)
        self.steps = np.abs(np.diff(q, axis=0))
        none = np.zeros_like(self.steps)
        self.deviations: Array = none if deviations is None else np.abs(deviations)
        self.frames = self._kinematics.joints(q)
        self._seen = dict[tuple[int, int], tuple[Array, Array]]()

    def chords(self, joints: NDArray[np.intp], centres: Array, balls: Array) -> Chords:
        """How balls about `centres` (B, 3) with radii `balls` (B,), m, on `joints` (B,) move."""
        n = self.q.shape[1]
        found = Chords(*np.zeros((3, n + 1, len(self.steps), len(joints))))
        turns = np.where(self._prismatic, 0.0, self.steps)
        turned = np.cumsum(turns, axis=1) - turns
        levers = self.levers(self.middles(joints, centres)) + balls
        second, first, off = np.zeros((3, len(self.steps), len(joints)))
        for j in range(n - 1, -1, -1):
            behind = joints > j
            d, ahead, e = (x[:, j, None] for x in (self.steps, turned, self.deviations))
            if self._prismatic[j]:
                second += behind * 2.0 * d * ahead
                first += behind * d
                off += behind * e
            else:
                mean = 0.5 * (levers[j, :-1] + levers[j, 1:] + first)
                second += behind * mean * d * (d + 2.0 * ahead)
                first += behind * mean * d
                off += behind * (mean + off) * e
            found.delta[j] = np.maximum(second - 2.0 * ahead * first, 0.0) / 8.0
            found.moved[j], found.deviation[j] = first, off
        return found

    def levers(self, points: Array) -> Array:
        """(n, m, B) m, how far points (m, B, 3) are from each joint's axis, if it turns."""
        twists = self._kinematics.twists(self.q).transpose(1, 2, 0)[..., None]
        (u, v, w), (x, y, z) = twists[3:], points.transpose(2, 0, 1)
        moved = v * z - w * y, w * x - u * z, u * y - v * x
        return np.asarray(np.sqrt(sum((a + b) ** 2 for a, b in zip(twists, moved, strict=False))))

    def middles(self, joints: NDArray[np.intp], centres: Array) -> Array:
        """(m, B, 3) m, where points `centres` (B, 3) of `joints` (B,) are at the rows."""
        turned = np.einsum("mbij,bj->mbi", self.frames.rotations[:, joints], centres)
        return np.asarray(turned + self.frames.points[:, joints])

    def chord_lengths(self, a: int, b: int, centre: Array, ball: float) -> Array:
        """(m - 1,) m, of the chords of any point in a ball on joint b, seen from a, at most."""
        rotations, points = self.poses(a, b)
        middles, turns = rotations @ centre + points, np.diff(rotations, axis=0)
        # A difference of rotations stretches any vector in a plane by the same.
        most = np.linalg.norm(turns, axis=(1, 2)) / np.sqrt(2.0)
        return np.asarray(np.linalg.norm(np.diff(middles, axis=0), axis=1) + most * ball)

    def poses(self, a: int, b: int, times: Array | None = None) -> tuple[Array, Array]:
        """Rotations (k, 3, 3) and points (k, 3) m of joint b seen from a at times (k,), in rows.

        At all rows by default.
        """
        if times is None:
            if (a, b) not in self._seen:
                self._seen[a, b] = _seen_from(self.frames.rotations, self.frames.points, a, b)
            return self._seen[a, b]
        row = np.minimum(times.astype(np.intp), len(self.q) - 2)
        share = (times - row)[:, None]
        frames = self._kinematics.joints(self.q[row] + share * (self.q[row + 1] - self.q[row]))
        return _seen_from(frames.rotations, frames.points, a, b)


def _seen_from(rotations: Array, points: Array, a: int, b: int) -> tuple[Array, Array]:
    """Frame b in frame a, from those of all joints (k, n + 1, 3, 3) and (k, n + 1, 3)."""
    back = rotations[:, a].transpose(0, 2, 1)
    apart = points[:, b] - points[:, a]
    return back @ rotations[:, b], (back @ apart[:, :, None])[:, :, 0]
