"""Is a point inside a closed body of triangles? A ray from it then meets an odd number of them.

A body that is clear of all triangles of a solid may still be inside it. A motion cannot get there
without touching, so this is asked of single configurations alone.
"""

from __future__ import annotations

import numpy as np

from coverable.kernels import kernel
from feasibility.collisions.kernels import tables as T

# The ray's direction: no simple fractions, so that no edge of a drawn shape is met but by chance.
DX, DY, DZ = 0.4361758092437, 0.5814733161593, 0.6868015227371
NEXT_TO = 1e-12  # m, added to boxes for rounding


@kernel
def ray_meets_box(m, node, x, y, z):  # type: ignore[no-untyped-def]
    """Does the ray from a point meet a node's box?"""
    low, high = 0.0, np.inf
    x, y, z = x - m[node + T.MIDDLE], y - m[node + T.MIDDLE + 1], z - m[node + T.MIDDLE + 2]
    for i in range(3):
        k, half = node + T.AXES + 3 * i, m[node + T.HALF + i] + NEXT_TO
        at = x * m[k] + y * m[k + 1] + z * m[k + 2]
        rate = DX * m[k] + DY * m[k + 1] + DZ * m[k + 2]
        if rate == 0.0:
            if abs(at) > half:
                return False
        else:
            a, b = (-half - at) / rate, (half - at) / rate
            low, high = max(low, min(a, b)), min(high, max(a, b))
    return low <= high


@kernel
def ray_meets_triangle(m, a, x, y, z):  # type: ignore[no-untyped-def]
    """Does the ray meet the triangle with corners from place a? By Moeller and Trumbore (1997)."""
    ux, uy, uz = m[a + 3] - m[a], m[a + 4] - m[a + 1], m[a + 5] - m[a + 2]
    vx, vy, vz = m[a + 6] - m[a], m[a + 7] - m[a + 1], m[a + 8] - m[a + 2]
    px, py, pz = DY * vz - DZ * vy, DZ * vx - DX * vz, DX * vy - DY * vx
    volume = ux * px + uy * py + uz * pz
    if volume == 0.0:
        return False
    x, y, z = x - m[a], y - m[a + 1], z - m[a + 2]
    u = (x * px + y * py + z * pz) / volume
    qx, qy, qz = y * uz - z * uy, z * ux - x * uz, x * uy - y * ux
    v = (DX * qx + DY * qy + DZ * qz) / volume
    ahead = (vx * qx + vy * qy + vz * qz) / volume
    return u >= 0.0 and v >= 0.0 and u + v <= 1.0 and ahead > 0.0


@kernel
def inside_tree(m, root, x, y, z):  # type: ignore[no-untyped-def]
    """Is a point (root frame) inside the closed body whose tree begins at a node?"""
    top, crossed = 1, False
    m[T.STACK] = root
    while top > 0:
        top -= 1
        node = np.int64(m[T.STACK + top])
        if not ray_meets_box(m, node, x, y, z):
            continue
        if m[node + T.LEFT] >= 0.0:
            m[T.STACK + top], m[T.STACK + top + 1] = m[node + T.LEFT], m[node + T.RIGHT]
            top += 2
        elif ray_meets_triangle(m, np.int64(m[node + T.FIRST]), x, y, z):
            crossed = not crossed
    return crossed
