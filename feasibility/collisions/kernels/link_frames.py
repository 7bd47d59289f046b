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

import numpy as np

from coverable.kernels import kernel
from feasibility.collisions.kernels import tables as T
from feasibility.collisions.kernels.tables import row, rows_of


@kernel
def pose_of(m, slot, joint):
    """The place of a joint's pose in a slot; joint 0 is the root."""
    return row(m, T.POSES, slot * (rows_of(m, T.JOINTS) + 1) + joint)


@kernel
def link_frames(m, q, root):
    """Poses of all joints in the root frame, each turned so that its axis is z.

    Args:
        m: the memory.
        q: place of the configuration.
        root: place of the first pose, the root's; those of the joints follow.
    """
    for k in range(12):
        m[root + k] = 1.0 if k == 0 or k == 4 or k == 8 else 0.0
    for i in range(rows_of(m, T.JOINTS)):
        before, c = root + 12 * i, row(m, T.JOINTS, i)
        now, turn, shift = before + 12, c + T.ROTATION, c + T.TRANSLATION
        slides = m[c + T.SLIDES] > 0.0
        cos, sin = (1.0, 0.0) if slides else (np.cos(m[q + i]), np.sin(m[q + i]))
        along = m[q + i] if slides else 0.0
        for axis in range(3):
            at, out = before + 3 * axis, now + 3 * axis
            x, y, z = m[at], m[at + 1], m[at + 2]
            place = m[before + 9 + axis] + x * m[shift] + y * m[shift + 1] + z * m[shift + 2]
            u = x * m[turn] + y * m[turn + 3] + z * m[turn + 6]
            v = x * m[turn + 1] + y * m[turn + 4] + z * m[turn + 7]
            w = x * m[turn + 2] + y * m[turn + 5] + z * m[turn + 8]
            m[out], m[out + 1], m[out + 2] = cos * u + sin * v, cos * v - sin * u, w
            m[now + 9 + axis] = place + along * w


@kernel
def transformed(m, pose, v):
    """The point at place v, placed by a pose."""
    a, b, c, p = m[v], m[v + 1], m[v + 2], pose
    x = m[p] * a + m[p + 1] * b + m[p + 2] * c + m[p + 9]
    y = m[p + 3] * a + m[p + 4] * b + m[p + 5] * c + m[p + 10]
    z = m[p + 6] * a + m[p + 7] * b + m[p + 8] * c + m[p + 11]
    return x, y, z


@kernel
def from_axis(m, pose, x, y, z):
    """Squared distance of a point from the z axis of a pose."""
    x, y, z = x - m[pose + 9], y - m[pose + 10], z - m[pose + 11]
    along = m[pose + 2] * x + m[pose + 5] * y + m[pose + 8] * z
    return max(x * x + y * y + z * z - along * along, 0.0)


@kernel
def place_bodies(m, slot):
    """Evaluate the configuration of a slot: poses of joints, and levers of all groups."""
    root, groups = pose_of(m, slot, np.int64(0)), rows_of(m, T.GROUPS)
    link_frames(m, row(m, T.CONFIGURATIONS, slot), root)
    for b in range(groups):
        group, levers = row(m, T.GROUPS, b), row(m, T.LEVERS, slot * groups + b)
        joint = np.int64(m[group + T.JOINT])
        pose = root + 12 * joint
        x0, y0, z0 = transformed(m, pose, group + T.END_0)
        x1, y1, z1 = transformed(m, pose, group + T.END_1)
        for j in range(joint):
            axis = root + 12 * (j + 1)
            if m[row(m, T.JOINTS, j) + T.SLIDES] > 0.0:
                m[levers + j] = 1.0
            elif j == joint - 1:
                m[levers + j] = m[group + T.OWN_LEVER]
            else:
                far = max(from_axis(m, axis, x0, y0, z0), from_axis(m, axis, x1, y1, z1))
                m[levers + j] = np.sqrt(far) + m[group + T.THICKNESS]


@kernel
def bound_levers(m, group, here, there):
    """Set r_j and M of a group for the segment between the configurations of two slots."""
    b, groups = np.int64(m[group + T.NUMBER]), rows_of(m, T.GROUPS)
    q0, q1 = row(m, T.CONFIGURATIONS, here), row(m, T.CONFIGURATIONS, there)
    r0, r1 = row(m, T.LEVERS, here * groups + b), row(m, T.LEVERS, there * groups + b)
    largest, reach = row(m, T.LARGEST, b), row(m, T.REACH, b)
    joint, behind = np.int64(m[group + T.JOINT]), 0.0
    m[reach + joint] = 0.0
    for j in range(joint - 1, -1, -1):
        lever = 0.5 * (m[r0 + j] + m[r1 + j])
        if not m[row(m, T.JOINTS, j) + T.SLIDES] > 0.0:
            lever += 0.5 * behind
        m[largest + j] = lever
        behind += lever * abs(m[q1 + j] - m[q0 + j])
        m[reach + j] = behind


@kernel
def chord_deviation(m, group, inner, here, there):
    """delta of a group, seen from joint `inner`, between the configurations of two slots."""
    q0, q1 = row(m, T.CONFIGURATIONS, here), row(m, T.CONFIGURATIONS, there)
    largest = row(m, T.LARGEST, np.int64(m[group + T.NUMBER]))
    total, before = 0.0, 0.0
    for j in range(inner, np.int64(m[group + T.JOINT])):
        d = abs(m[q1 + j] - m[q0 + j])
        if m[row(m, T.JOINTS, j) + T.SLIDES] > 0.0:
            total += 2.0 * d * before
        else:
            total += m[largest + j] * d * (d + 2.0 * before)
            before += d
    return total / 8.0
