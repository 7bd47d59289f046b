"""Is a point inside a closed body of triangles? A ray from it then meets an odd number of them.

A body that is clear of all triangles of a solid may still be inside it. A motion cannot get there
without touching, so this is asked of single configurations alone.
"""

from __future__ import annotations

import numpy as np

from feasibility.collisions.kernels.tables import AXES, FIRST, HALF, LEFT, MIDDLE, RIGHT
from feasibility.compiled import kernel

# The ray's direction: no simple fractions, so that no edge of a drawn shape is met but by chance.
DX, DY, DZ = 0.4361758092437, 0.5814733161593, 0.6868015227371


@kernel
def ray_meets_box(node, x, y, z):  # type: ignore[no-untyped-def]
    """Does the ray from a point meet a node's box?"""
    low, high = 0.0, np.inf
    x, y, z = x - node[MIDDLE], y - node[MIDDLE + 1], z - node[MIDDLE + 2]
    for i in range(3):
        k, half = AXES + 3 * i, node[HALF + i] + 1e-12
        at = x * node[k] + y * node[k + 1] + z * node[k + 2]
        rate = DX * node[k] + DY * node[k + 1] + DZ * node[k + 2]
        if rate == 0.0:
            if abs(at) > half:
                return False
        else:
            a, b = (-half - at) / rate, (half - at) / rate
            low, high = max(low, min(a, b)), min(high, max(a, b))
    return low <= high


@kernel
def ray_meets_triangle(corners, first, x, y, z):  # type: ignore[no-untyped-def]
    """Does the ray meet the triangle in three rows? By Moeller and Trumbore (1997)."""
    a, b, c = corners[first], corners[first + 1], corners[first + 2]
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    px, py, pz = DY * vz - DZ * vy, DZ * vx - DX * vz, DX * vy - DY * vx
    volume = ux * px + uy * py + uz * pz
    if volume == 0.0:
        return False
    x, y, z = x - a[0], y - a[1], z - a[2]
    u = (x * px + y * py + z * pz) / volume
    qx, qy, qz = y * uz - z * uy, z * ux - x * uz, x * uy - y * ux
    v = (DX * qx + DY * qy + DZ * qz) / volume
    ahead = (vx * qx + vy * qy + vz * qz) / volume
    return u >= 0.0 and v >= 0.0 and u + v <= 1.0 and ahead > 0.0


@kernel
def inside_tree(t, root, x, y, z):  # type: ignore[no-untyped-def]
    """Is a point (root frame) inside the closed body whose tree begins at a node?"""
    stack, top, crossed = t.stack[0], 1, False
    stack[0] = root
    while top > 0:
        top -= 1
        node = t.nodes[np.int64(stack[top])]
        if not ray_meets_box(node, x, y, z):
            continue
        if node[LEFT] >= 0.0:
            stack[top], stack[top + 1] = node[LEFT], node[RIGHT]
            top += 2
        elif ray_meets_triangle(t.vertices, np.int64(node[FIRST]), x, y, z):
            crossed = not crossed
    return crossed
