"""The point of a simplex of up to four points that is closest to the origin.

C. Ericson, Real-Time Collision Detection (2005), section 5.1. The simplex is the first rows of the
table `simplex`; a point is the place of its row, whose first three columns are its coordinates;
column WEIGHT gets its share in the closest point, and what is in the others goes with it. Rounding
may pick one that is not quite the closest: `separation.py` trusts no more than that it gives a
direction.
"""

import numpy as np

from coverable.kernels import kernel
from feasibility.collisions.kernels.tables import SIMPLEX

WEIGHT = 6
WIDTH = 10  # of a row


@kernel
def dot(m, i, j, k):
    """(j - i) . (k - i)."""
    x = (m[j] - m[i]) * (m[k] - m[i])
    y = (m[j + 1] - m[i + 1]) * (m[k + 1] - m[i + 1])
    return x + y + (m[j + 2] - m[i + 2]) * (m[k + 2] - m[i + 2])


@kernel
def towards_origin(m, i, j):
    """(j - i) . (0 - i)."""
    x = (m[j] - m[i]) * m[i]
    y = (m[j + 1] - m[i + 1]) * m[i + 1]
    return -(x + y + (m[j + 2] - m[i + 2]) * m[i + 2])


@kernel
def on_segment(m, i, j):
    """Share of point j in the closest point of the segment from i to j."""
    length = dot(m, i, j, j)
    if not length > 0.0:
        return 0.0
    return min(max(towards_origin(m, i, j) / length, 0.0), 1.0)


@kernel
def on_triangle(m, i, j, k):
    """Shares of points i, j, k in the closest point of their triangle."""
    d1, d2 = towards_origin(m, i, j), towards_origin(m, i, k)
    if d1 <= 0.0 and d2 <= 0.0:
        return 1.0, 0.0, 0.0
    jj, jk, kk = dot(m, i, j, j), dot(m, i, j, k), dot(m, i, k, k)
    d3, d4 = d1 - jj, d2 - jk
    if d3 >= 0.0 and d4 <= d3:
        return 0.0, 1.0, 0.0
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        t = on_segment(m, i, j)
        return 1.0 - t, t, 0.0
    d5, d6 = d1 - jk, d2 - kk
    if d6 >= 0.0 and d5 <= d6:
        return 0.0, 0.0, 1.0
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        t = on_segment(m, i, k)
        return 1.0 - t, 0.0, t
    va = d3 * d6 - d5 * d4
    whole = va + vb + vc
    if (va <= 0.0 and d4 >= d3 and d5 >= d6) or not whole > 0.0:
        t = on_segment(m, j, k)
        return 0.0, 1.0 - t, t
    return va / whole, vb / whole, vc / whole


@kernel
def square_at(m, i, j, k, a, b, c):
    """Squared distance from the origin of the point with shares a, b, c."""
    total = 0.0
    for axis in range(3):
        total += (a * m[i + axis] + b * m[j + axis] + c * m[k + axis]) ** 2
    return total


@kernel
def origin_beyond(m, i, j, k, other):
    """Is the origin on the other side of the plane of i, j, k than the fourth point?"""
    ux, uy, uz = m[j] - m[i], m[j + 1] - m[i + 1], m[j + 2] - m[i + 2]
    vx, vy, vz = m[k] - m[i], m[k + 1] - m[i + 1], m[k + 2] - m[i + 2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    origin = -(nx * m[i] + ny * m[i + 1] + nz * m[i + 2])
    fourth = nx * (m[other] - m[i]) + ny * (m[other + 1] - m[i + 1])
    fourth += nz * (m[other + 2] - m[i + 2])
    return not origin * fourth > 0.0  # a flat simplex has no inside


@kernel
def on_tetrahedron(m):
    """Set the weights of four points; all four have one where the origin is inside."""
    least = np.inf
    for corner in range(4):
        other = SIMPLEX + WIDTH * corner
        i = SIMPLEX + WIDTH * ((corner + 1) % 4)
        j = SIMPLEX + WIDTH * ((corner + 2) % 4)
        k = SIMPLEX + WIDTH * ((corner + 3) % 4)
        if origin_beyond(m, i, j, k, other):
            a, b, c = on_triangle(m, i, j, k)
            square = square_at(m, i, j, k, a, b, c)
            if square < least:
                least = square
                m[i + WEIGHT], m[j + WEIGHT], m[k + WEIGHT], m[other + WEIGHT] = a, b, c, 0.0
    if least == np.inf:
        for corner in range(4):
            m[SIMPLEX + WIDTH * corner + WEIGHT] = 0.25


@kernel
def reduce(m, size):
    """Set the weights of the first `size` points, and drop those without.

    Returns how many points are left: 4 where the origin is inside.
    """
    i, j, k = SIMPLEX, SIMPLEX + WIDTH, SIMPLEX + 2 * WIDTH
    if size == 1:
        m[i + WEIGHT] = 1.0
    elif size == 2:
        t = on_segment(m, i, j)
        m[i + WEIGHT], m[j + WEIGHT] = 1.0 - t, t
    elif size == 3:
        m[i + WEIGHT], m[j + WEIGHT], m[k + WEIGHT] = on_triangle(m, i, j, k)
    else:
        on_tetrahedron(m)
    kept = 0
    for point in range(size):
        old, new = SIMPLEX + WIDTH * point, SIMPLEX + WIDTH * kept
        if m[old + WEIGHT] > 0.0:
            for column in range(WIDTH):
                m[new + column] = m[old + column]
            kept += 1
    return kept
