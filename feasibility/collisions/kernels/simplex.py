"""The point of a simplex of up to four points that is closest to the origin.

C. Ericson, Real-Time Collision Detection (2005), section 5.1. A simplex is rows of an array whose
first three columns are the points; column WEIGHT gets each point's share in the closest one.
Rounding may pick a point that is not quite the closest: `separation.py` trusts no more than that
it gives a direction.
"""

from __future__ import annotations

import numpy as np

from feasibility.compiled import kernel

WEIGHT = 6


@kernel
def dot(s, i, j, k):  # type: ignore[no-untyped-def]
    """(s_j - s_i) . (s_k - s_i)."""
    x = (s[j, 0] - s[i, 0]) * (s[k, 0] - s[i, 0])
    y = (s[j, 1] - s[i, 1]) * (s[k, 1] - s[i, 1])
    return x + y + (s[j, 2] - s[i, 2]) * (s[k, 2] - s[i, 2])


@kernel
def towards_origin(s, i, j):  # type: ignore[no-untyped-def]
    """(s_j - s_i) . (0 - s_i)."""
    x = (s[j, 0] - s[i, 0]) * s[i, 0]
    y = (s[j, 1] - s[i, 1]) * s[i, 1]
    return -(x + y + (s[j, 2] - s[i, 2]) * s[i, 2])


@kernel
def on_segment(s, i, j):  # type: ignore[no-untyped-def]
    """Share of point j in the closest point of the segment from i to j."""
    length = dot(s, i, j, j)
    if not length > 0.0:
        return 0.0
    return min(max(towards_origin(s, i, j) / length, 0.0), 1.0)


@kernel
def on_triangle(s, i, j, k):  # type: ignore[no-untyped-def]
    """Shares of points i, j, k in the closest point of their triangle."""
    d1, d2 = towards_origin(s, i, j), towards_origin(s, i, k)
    if d1 <= 0.0 and d2 <= 0.0:
        return 1.0, 0.0, 0.0
    jj, jk, kk = dot(s, i, j, j), dot(s, i, j, k), dot(s, i, k, k)
    d3, d4 = d1 - jj, d2 - jk
    if d3 >= 0.0 and d4 <= d3:
        return 0.0, 1.0, 0.0
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        t = on_segment(s, i, j)
        return 1.0 - t, t, 0.0
    d5, d6 = d1 - jk, d2 - kk
    if d6 >= 0.0 and d5 <= d6:
        return 0.0, 0.0, 1.0
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        t = on_segment(s, i, k)
        return 1.0 - t, 0.0, t
    va = d3 * d6 - d5 * d4
    whole = va + vb + vc
    if (va <= 0.0 and d4 >= d3 and d5 >= d6) or not whole > 0.0:
        t = on_segment(s, j, k)
        return 0.0, 1.0 - t, t
    return va / whole, vb / whole, vc / whole


@kernel
def square_at(s, i, j, k, a, b, c):  # type: ignore[no-untyped-def]
    """Squared distance from the origin of the point with shares a, b, c."""
    total = 0.0
    for axis in range(3):
        total += (a * s[i, axis] + b * s[j, axis] + c * s[k, axis]) ** 2
    return total


@kernel
def origin_beyond(s, i, j, k, other):  # type: ignore[no-untyped-def]
    """Is the origin on the other side of the plane of i, j, k than the fourth point?"""
    ux, uy, uz = s[j, 0] - s[i, 0], s[j, 1] - s[i, 1], s[j, 2] - s[i, 2]
    vx, vy, vz = s[k, 0] - s[i, 0], s[k, 1] - s[i, 1], s[k, 2] - s[i, 2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    origin = -(nx * s[i, 0] + ny * s[i, 1] + nz * s[i, 2])
    fourth = nx * (s[other, 0] - s[i, 0]) + ny * (s[other, 1] - s[i, 1])
    fourth += nz * (s[other, 2] - s[i, 2])
    return not origin * fourth > 0.0  # a flat simplex has no inside


@kernel
def on_tetrahedron(s):  # type: ignore[no-untyped-def]
    """Set the weights of four points; all four have one where the origin is inside."""
    least = np.inf
    for other in range(4):
        i, j, k = (other + 1) % 4, (other + 2) % 4, (other + 3) % 4
        if origin_beyond(s, i, j, k, other):
            a, b, c = on_triangle(s, i, j, k)
            square = square_at(s, i, j, k, a, b, c)
            if square < least:
                least = square
                s[i, WEIGHT], s[j, WEIGHT], s[k, WEIGHT], s[other, WEIGHT] = a, b, c, 0.0
    if least == np.inf:
        for i in range(4):
            s[i, WEIGHT] = 0.25


@kernel
def reduce(s, size):  # type: ignore[no-untyped-def]
    """Set the weights of the first `size` points, and drop those without.

    Returns how many points are left: 4 where the origin is inside.
    """
    if size == 1:
        s[0, WEIGHT] = 1.0
    elif size == 2:
        t = on_segment(s, 0, 1)
        s[0, WEIGHT], s[1, WEIGHT] = 1.0 - t, t
    elif size == 3:
        s[0, WEIGHT], s[1, WEIGHT], s[2, WEIGHT] = on_triangle(s, 0, 1, 2)
    else:
        on_tetrahedron(s)
    kept = 0
    for i in range(size):
        if s[i, WEIGHT] > 0.0:
            for column in range(WEIGHT + 1):
                s[kept, column] = s[i, column]
            kept += 1
    return kept
