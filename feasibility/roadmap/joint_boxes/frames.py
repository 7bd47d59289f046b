"""Where the joints of an arm are over boxes of joint values, and how far points can move in them.

**Lemma.** Let a point be carried by joint i, r_j its distance from the axis of joint j <= i at the
middle of a box, and h_j the half widths. Set m_j = min(h_j, 2) L_j with L_j = r_j + sum_{k>j} m_k
for joints that turn, and m_j = h_j for joints that slide. Then, seen from joint l, the point is
moved in the box by no more than sum_{l<j<=i} m_j. *Proof.* Change the joints one by one, the last
first. Its distance from axis j depends on the joints behind j alone, so it is at most L_j when
joint j is changed, by h_j at most, along a chord of 2 sin(h_j / 2) L_j. QED

Where the tool point p is known to be near a target T, a point x near the tool is known better from
there: x = p + (x - p), and only the difference changes. Joints behind i change it as they move p;
the others turn it, with |z_j x (x - p)| in place of r_j, and not at all where they slide.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coverable_arrays import Array, Ints, Mask
from robots import Chain


class Boxes(NamedTuple):
    """m boxes of joint values."""

    low: Array
    """(m, n) rad or m"""
    high: Array
    """(m, n)"""

    @property
    def centre(self) -> Array:
        """(m, n)"""
        return 0.5 * (self.low + self.high)

    @property
    def half(self) -> Array:
        """(m, n) half widths."""
        return 0.5 * (self.high - self.low)

    def some(self, which: Mask | Ints | slice) -> Boxes:
        """Some of the boxes."""
        return Boxes(self.low[which], self.high[which])


class Frames(NamedTuple):
    """The frames of the joints at m configurations, each turned so that its axis is z."""

    rotations: Array
    """(m, n + 1, 3, 3); the root's first"""
    points: Array
    """(m, n + 1, 3) m"""

    def some(self, which: Mask | Ints) -> Frames:
        """Those at some of the configurations."""
        return Frames(self.rotations[which], self.points[which])

    def carried(self, joint: int, places: Array) -> Array:
        """(m, k, 3) m, points (k, 3) of a joint's frame in the root frame."""
        turned = places @ self.rotations[:, joint].transpose(0, 2, 1)
        return np.asarray(turned + self.points[:, joint, None])


def frames_at(chain: Chain, q: Array) -> Frames:
    """The frames at configurations q (m, n)."""
    m, n = q.shape
    rotations, points = np.empty((m, n + 1, 3, 3)), np.empty((m, n + 1, 3))
    rotations[:, 0], points[:, 0] = np.eye(3), 0.0
    for j in range(n):
        before = rotations[:, j]
        points[:, j + 1] = points[:, j] + before @ chain.translations[j]
        turned = before @ chain.rotations[j]
        if chain.prismatic[j]:
            rotations[:, j + 1] = turned
            points[:, j + 1] += turned[:, :, 2] * q[:, j, None]
            continue
        cosine, sine = np.cos(q[:, j])[:, None], np.sin(q[:, j])[:, None]
        x, y = turned[:, :, 0], turned[:, :, 1]
        rotations[:, j + 1, :, 0] = cosine * x + sine * y
        rotations[:, j + 1, :, 1] = cosine * y - sine * x
        rotations[:, j + 1, :, 2] = turned[:, :, 2]
    return Frames(rotations, points)


class Moves(NamedTuple):
    """How far k points carried by joint i can move in m boxes."""

    levers: Array
    """(m, k, i) L_j, the largest distance from each axis; 1 where a joint slides."""
    by_joint: Array
    """(m, k, i) m_j of the lemma."""


def moves(chain: Chain, frames: Frames, half: Array, points: Array, joint: int) -> Moves:
    """The bounds of the lemma.

    Args:
        chain: the arm.
        frames: at the middles of m boxes.
        half: (m, n) half widths.
        points: (m, k, 3) m, in the root frame.
        joint: i, the one that carries them.
    """
    levers, by_joint = np.ones((2, *points.shape[:2], joint))
    behind = np.zeros(points.shape[:2])
    for j in range(joint - 1, -1, -1):
        h = half[:, j, None]
        if chain.prismatic[j]:
            by_joint[..., j] = h
        else:
            axis = frames.rotations[:, j + 1, :, 2][:, None]
            across = _cross(axis, points - frames.points[:, j + 1, None])
            levers[..., j] = np.sqrt((across**2).sum(axis=2)) + behind
            by_joint[..., j] = levers[..., j] * np.minimum(h, 2.0)
        behind = behind + by_joint[..., j]
    return Moves(levers, by_joint)


def moves_from_tool(
    chain: Chain, frames: Frames, half: Array, points: Array, joint: int
) -> tuple[Array, Array]:
    """The same bounds for the difference of points and the tool point.

    Returns:
        (m, 3) m, the tool points; and (m, k, n) m, the bounds by joint.
    """
    n = half.shape[1]
    tool = frames.carried(n, chain.translations[n][None])
    by_joint = np.zeros((*points.shape[:2], n))
    by_joint[..., joint:] = moves(chain, frames, half, tool, n).by_joint[..., joint:]
    behind, away = by_joint.sum(axis=2), points - tool
    for j in range(joint - 1, -1, -1):
        if not chain.prismatic[j]:
            across = _cross(frames.rotations[:, j + 1, :, 2][:, None], away)
            lever = np.sqrt((across**2).sum(axis=2)) + behind
            by_joint[..., j] = lever * np.minimum(half[:, j, None], 2.0)
            behind = behind + by_joint[..., j]
    return tool[:, 0], by_joint


def _cross(a: Array, b: Array) -> Array:
    """Cross products of the last axes; `np.cross` takes twice as long."""
    x = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    y = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    z = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return np.stack([x, y, z], axis=-1)
