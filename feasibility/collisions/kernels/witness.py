"""Where two bodies are nearest, as the last `separation` left it."""

import numpy as np

from coverable.kernels import kernel
from feasibility.collisions.kernels import tables as T
from feasibility.collisions.kernels.link_frames import pose_of, transformed
from feasibility.collisions.kernels.separation import BEST, POINTS, TOUCHING, UPPER, support
from feasibility.collisions.kernels.simplex import WEIGHT, WIDTH

NORMAL, ON_FIRST, ON_SECOND = T.FOUND + 1, T.FOUND + 4, T.FOUND + 7


@kernel
def record(m, radius, b, bound):
    """Keep bound, direction and nearest points of a body with a radius and of polytope b.

    Where the two overlap, the point of b is the one deepest in the other along the best direction
    that was tried, and the point of the other lies straight above it.
    """
    m[T.FOUND] = bound
    for k in range(3):
        m[NORMAL + k] = m[BEST + k]
    if m[UPPER] > TOUCHING and m[POINTS] > 0.0:
        for k in range(3):
            on_first, between = 0.0, 0.0
            for i in range(T.SIMPLEX, T.SIMPLEX + WIDTH * np.int64(m[POINTS]), WIDTH):
                on_first += m[i + WEIGHT] * m[i + 3 + k]
                between += m[i + WEIGHT] * m[i + k]
            m[ON_FIRST + k] = on_first + radius * m[BEST + k]
            m[ON_SECOND + k] = on_first + between - m[b + T.RADIUS] * m[BEST + k]
        return
    p, n = T.RELATIVE, NORMAL
    x = -(m[p] * m[n] + m[p + 3] * m[n + 1] + m[p + 6] * m[n + 2])
    y = -(m[p + 1] * m[n] + m[p + 4] * m[n + 1] + m[p + 7] * m[n + 2])
    z = -(m[p + 2] * m[n] + m[p + 5] * m[n + 1] + m[p + 8] * m[n + 2])
    vertex, _ = support(m, b, x, y, z)
    m[ON_SECOND], m[ON_SECOND + 1], m[ON_SECOND + 2] = transformed(m, p, vertex)
    for k in range(3):
        m[ON_SECOND + k] -= m[b + T.RADIUS] * m[n + k]
        m[ON_FIRST + k] = m[ON_SECOND + k] - bound * m[n + k]


@kernel
def witness(m, item, slot):
    """Put what was found for an item into the root frame: direction and both points, in place."""
    pose = pose_of(m, slot, np.int64(m[item + T.INNER]))
    for point in range(NORMAL, ON_SECOND + 3, 3):
        x, y, z = transformed(m, pose, point)
        if point == NORMAL:
            x, y, z = x - m[pose + 9], y - m[pose + 10], z - m[pose + 11]
        m[point], m[point + 1], m[point + 2] = x, y, z
