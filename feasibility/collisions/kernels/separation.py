"""A certified lower bound on the distance of two convex bodies.

Every unit direction n is a certificate: body B lies beyond body A by at least

    s(n) = min n.b - max n.a,

and the largest s(n) is their distance (the least depth, negative, where they overlap). The
algorithm of Gilbert, Johnson and Keerthi (1988) only proposes the directions, from A towards B; the
bound is what the vertices themselves say of the best one. So neither rounding nor a loop that ends
too soon can make it too large; they only weaken it.
"""

from __future__ import annotations

import numpy as np

from feasibility.collisions.kernels.simplex import WEIGHT, reduce
from feasibility.compiled import kernel

MOST_ITERATIONS = 40
COARSE = 0.1  # relative gap at which a bound that is large enough already is good enough
FINE = 1e-6  # the same for others
FARTHEST = 1e300  # m, above any distance
TOUCHING = 1e-10  # m, nearer than this there is no direction to be had
# Rows of the working memory: 0 to 3 the simplex, each with the difference of two points and the one
# of A; then the best direction (given: the first to try), the shortest difference, and counters.
BEST, SHORTEST, UPPER, COUNT = 4, 5, 6, 6


@kernel
def support(vertices, first, last, x, y, z):  # type: ignore[no-untyped-def]
    """Which vertex is furthest along a direction, and how far it is."""
    best, most = first, -np.inf
    for k in range(first, last):
        along = vertices[k, 0] * x + vertices[k, 1] * y + vertices[k, 2] * z
        if along > most:
            best, most = k, along
    return best, most


@kernel
def add_point(vertices, a, b, pose, s, row):  # type: ignore[no-untyped-def]
    """Write the difference of vertex b, placed by a pose, and vertex a into a row.

    Returns False where that difference is in the simplex already.
    """
    x, y, z = vertices[b, 0], vertices[b, 1], vertices[b, 2]
    for k in range(3):
        place = pose[3 * k] * x + pose[3 * k + 1] * y + pose[3 * k + 2] * z + pose[9 + k]
        s[row, k] = place - vertices[a, k]
        s[row, 3 + k] = vertices[a, k]
    for i in range(row):
        if s[i, 0] == s[row, 0] and s[i, 1] == s[row, 1] and s[i, 2] == s[row, 2]:
            return False
    return True


@kernel
def shortest(s, size):  # type: ignore[no-untyped-def]
    """Set the row SHORTEST from the weights; its length."""
    square = 0.0
    for k in range(3):
        value = 0.0
        for i in range(size):
            value += s[i, WEIGHT] * s[i, k]
        s[SHORTEST, k] = value
        square += value * value
    return np.sqrt(square)


@kernel
def separation(vertices, a, b, poses, ends, s, need, want, least):  # type: ignore[no-untyped-def]
    """Lower bound of the distance of two hulls of vertices, m, by at most 40 directions.

    Args:
        vertices: (V, 3) m.
        a, b: pairs (first, last) of rows of `vertices`.
        poses: (2, 12) of B in the frame of A.
        ends: 1, or 2 for the hull of B in both poses.
        s: (7, 8) working memory. Its row BEST holds the direction to begin with, of any length, and
            gets the best one; witness points are left in the simplex.
        need: m, a bound of at least this is enough: it is made sharper by a few more directions.
        want: m, nor are these tried once the bound has reached this.
        least: m, the bound is given up where the distance is less than this.
    """
    nx, ny, nz = s[BEST, 0], s[BEST, 1], s[BEST, 2]
    length = np.sqrt(nx * nx + ny * ny + nz * nz)
    if not length > 0.0:
        nx, length = 1.0, 1.0
    nx, ny, nz = nx / length, ny / length, nz / length
    lower, upper, size = -np.inf, FARTHEST, 0
    for _ in range(MOST_ITERATIONS):
        s[COUNT, 1] += 1.0
        i, top = support(vertices, a[0], a[1], nx, ny, nz)
        j, bottom, end = b[0], np.inf, 0
        for e in range(ends):
            p = poses[e]
            x = -(p[0] * nx + p[3] * ny + p[6] * nz)
            y = -(p[1] * nx + p[4] * ny + p[7] * nz)
            z = -(p[2] * nx + p[5] * ny + p[8] * nz)
            k, along = support(vertices, b[0], b[1], x, y, z)
            value = p[9] * nx + p[10] * ny + p[11] * nz - along
            if value < bottom:
                j, bottom, end = k, value, e
        if bottom - top > lower:
            lower = bottom - top
            s[BEST, 0], s[BEST, 1], s[BEST, 2] = nx, ny, nz
        gap = COARSE if lower >= need else FINE
        if lower >= want or upper - lower <= gap * upper:
            break
        if not add_point(vertices, i, j, poses[end], s, size):
            break
        size = reduce(s, size + 1)
        before, upper = upper, shortest(s, size)
        if size == 4:
            upper = 0.0  # the origin is inside: they overlap
        if upper < least or not TOUCHING < upper < before:
            break
        nx, ny, nz = s[SHORTEST, 0] / upper, s[SHORTEST, 1] / upper, s[SHORTEST, 2] / upper
    s[UPPER, 0], s[COUNT, 2] = upper, size
    return lower
