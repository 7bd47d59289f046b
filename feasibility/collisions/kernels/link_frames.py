"""Where every joint's frame is, how far bodies reach from its axis, and how far they can move.

Body b, moved by joints up to its own, seen from a body that joint `inner` moves, on the straight
segment q(s) = q0 + s d. With r_j the largest distance of any of its points from axis j on the
segment, no point moves further than M, nor leaves the straight line between its two ends further
than delta (`roadmap/segment_bound.py` derives the second derivative that this integrates):

    M     = sum_j r_j |d_j|
    delta = 1/8 sum_j r_j |d_j| (|d_j| + 2 sum_{i<j} |d_i|)

over revolute joints behind `inner`; one that slides adds |d_j| to M and 2 |d_j| sum_{i<j} |d_i| to
the second sum. The distance of a point from axis j changes only with the joints behind j, so
r_j <= (r_j(0) + r_j(1) + sum_{k>j} r_k |d_k|) / 2. A distance from a line is convex, so on the
capsule around a body it is largest at one of the capsule's ends.
"""

from __future__ import annotations

import numpy as np

from feasibility.collisions.kernels.tables import (
    END_0,
    END_1,
    FRAMES,
    JOINT,
    OWN_LEVER,
    ROTATION,
    SLIDES,
    THICKNESS,
    TRANSLATION,
)
from feasibility.compiled import kernel


@kernel
def link_frames(joints, q, poses, root):  # type: ignore[no-untyped-def]
    """Poses of all joints in the root frame, each turned so that its axis is z.

    Args:
        joints: (n, 13) constants of the chain.
        q: (n,)
        poses: rows `root` to `root + n`, out: rotation (9) and translation (3).
        root: the row of the root frame.
    """
    for k in range(12):
        poses[root, k] = 1.0 if k == 0 or k == 4 or k == 8 else 0.0
    for i in range(q.shape[0]):
        before, now, c = poses[root + i], poses[root + i + 1], joints[i]
        for row in range(3):
            x, y, z = before[3 * row], before[3 * row + 1], before[3 * row + 2]
            place = before[9 + row]
            for k in range(3):
                place += before[3 * row + k] * c[TRANSLATION + k]
                now[3 * row + k] = (
                    x * c[ROTATION + k] + y * c[ROTATION + 3 + k] + z * c[ROTATION + 6 + k]
                )
            now[9 + row] = place
        if joints[i, SLIDES] > 0.0:
            for row in range(3):
                now[9 + row] += now[3 * row + 2] * q[i]
        else:
            cos, sin = np.cos(q[i]), np.sin(q[i])
            for row in range(3):
                x, y = now[3 * row], now[3 * row + 1]
                now[3 * row], now[3 * row + 1] = cos * x + sin * y, cos * y - sin * x


@kernel
def transformed(pose, v, k):  # type: ignore[no-untyped-def]
    """The point v[k : k + 3], placed by a pose."""
    x = pose[0] * v[k] + pose[1] * v[k + 1] + pose[2] * v[k + 2] + pose[9]
    y = pose[3] * v[k] + pose[4] * v[k + 1] + pose[5] * v[k + 2] + pose[10]
    z = pose[6] * v[k] + pose[7] * v[k + 1] + pose[8] * v[k + 2] + pose[11]
    return x, y, z


@kernel
def from_axis(pose, x, y, z):  # type: ignore[no-untyped-def]
    """Squared distance of a point from the z axis of a pose."""
    x, y, z = x - pose[9], y - pose[10], z - pose[11]
    along = pose[2] * x + pose[5] * y + pose[8] * z
    return max(x * x + y * y + z * z - along * along, 0.0)


@kernel
def place_bodies(t, slot):  # type: ignore[no-untyped-def]
    """Evaluate the configuration of a slot: poses of joints, and levers of all groups."""
    n = t.joints.shape[0]
    root = slot * (n + 1)
    link_frames(t.joints, t.configurations[slot], t.poses, root)
    t.state[0, FRAMES] += 1.0
    for b in range(t.groups.shape[0]):
        group, levers = t.groups[b], t.levers[slot * t.groups.shape[0] + b]
        joint = np.int64(group[JOINT])
        pose = t.poses[root + joint]
        x0, y0, z0 = transformed(pose, group, END_0)
        x1, y1, z1 = transformed(pose, group, END_1)
        for j in range(joint):
            if t.joints[j, SLIDES] > 0.0:
                levers[j] = 1.0
            elif j == joint - 1:
                levers[j] = group[OWN_LEVER]
            else:
                axis = t.poses[root + j + 1]
                far = max(from_axis(axis, x0, y0, z0), from_axis(axis, x1, y1, z1))
                levers[j] = np.sqrt(far) + group[THICKNESS]


@kernel
def spread(t, b, here, there):  # type: ignore[no-untyped-def]
    """Set r_j and M of a group for the segment between the configurations of two slots."""
    groups = t.groups.shape[0]
    joint = np.int64(t.groups[b, JOINT])
    behind = 0.0
    t.reach[b, joint] = 0.0
    for j in range(joint - 1, -1, -1):
        d = abs(t.configurations[there, j] - t.configurations[here, j])
        lever = 0.5 * (t.levers[here * groups + b, j] + t.levers[there * groups + b, j])
        if not t.joints[j, SLIDES] > 0.0:
            lever += 0.5 * behind
        t.largest[b, j] = lever
        behind += lever * d
        t.reach[b, j] = behind


@kernel
def chord_deviation(t, b, inner, here, there):  # type: ignore[no-untyped-def]
    """delta of a group, seen from joint `inner`, between the configurations of two slots."""
    total, before = 0.0, 0.0
    for j in range(inner, np.int64(t.groups[b, JOINT])):
        d = abs(t.configurations[there, j] - t.configurations[here, j])
        if t.joints[j, SLIDES] > 0.0:
            total += 2.0 * d * before
        else:
            total += t.largest[b, j] * d * (d + 2.0 * before)
            before += d
    return total / 8.0
