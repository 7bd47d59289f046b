"""Where two bodies are nearest, as the last `separation` left it."""

from __future__ import annotations

import numpy as np

from feasibility.collisions.kernels.link_frames import transformed
from feasibility.collisions.kernels.separation import BEST, COUNT, TOUCHING, UPPER, support
from feasibility.collisions.kernels.simplex import WEIGHT
from feasibility.collisions.kernels.tables import FIRST, INNER, LAST, RADIUS
from feasibility.compiled import kernel


@kernel
def record(t, radius, b, bound):  # type: ignore[no-untyped-def]
    """Keep bound, direction and nearest points of a body with a radius and of polytope b.

    Where the two overlap, the point of b is the one deepest in the other along the best direction
    that was tried, and the point of the other lies straight above it.
    """
    s, found, body = t.simplex, t.found[0], t.polytopes[b]
    found[0] = bound
    for k in range(3):
        found[1 + k] = s[BEST, k]
    apart = s[UPPER, 0] > TOUCHING and s[COUNT, 2] > 0.0
    if not apart:
        pose = t.relative[0]
        x = -(pose[0] * found[1] + pose[3] * found[2] + pose[6] * found[3])
        y = -(pose[1] * found[1] + pose[4] * found[2] + pose[7] * found[3])
        z = -(pose[2] * found[1] + pose[5] * found[2] + pose[8] * found[3])
        vertex, _ = support(t.vertices, np.int64(body[FIRST]), np.int64(body[LAST]), x, y, z)
        found[7], found[8], found[9] = transformed(pose, t.vertices[vertex], 0)
    for k in range(3):
        if apart:
            on_a, apart_by = 0.0, 0.0
            for i in range(np.int64(s[COUNT, 2])):
                on_a += s[i, WEIGHT] * s[i, 3 + k]
                apart_by += s[i, WEIGHT] * s[i, k]
            found[4 + k] = on_a + radius * found[1 + k]
            found[7 + k] = on_a + apart_by - body[RADIUS] * found[1 + k]
        else:
            found[7 + k] -= body[RADIUS] * found[1 + k]
            found[4 + k] = found[7 + k] - bound * found[1 + k]


@kernel
def witness(t, item, slot):  # type: ignore[no-untyped-def]
    """Put what was found for an item into the root frame: direction and both points, in place."""
    found = t.found[0]
    pose = t.poses[slot * (t.joints.shape[0] + 1) + np.int64(t.items[item, INNER])]
    found[4], found[5], found[6] = transformed(pose, found, 4)
    found[7], found[8], found[9] = transformed(pose, found, 7)
    x, y, z = transformed(pose, found, 1)
    found[1], found[2], found[3] = x - pose[9], y - pose[10], z - pose[11]
