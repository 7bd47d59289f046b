"""Lower bounds of the distances of pairs, at one configuration or all along a segment.

Two groups: the least over their pairs of polytopes. Balls decide what is far; `separation` decides
the rest, and begins with the direction that separated the same two bodies the last time. A group
and a tree of triangles: the least over its polytopes (`tree_distances.py`), of which the one that
was nearest the last time is first, since what is further off than others need not be looked at
closely.

For a segment the second body is the hull of its places at both ends. What this bounds is also a
bound for the body at each of them.

A body that is clear of all triangles of a solid may still be inside it: a ray from one of its
points then meets an odd number of them. A motion cannot get there without touching, so this is
asked of single configurations alone.
"""

import numpy as np

from coverable.kernels import kernel
from feasibility.collisions.kernels import tables as T
from feasibility.collisions.kernels.link_frames import pose_of, transformed
from feasibility.collisions.kernels.separation import BEST, MOST_TURNS, remember, separation
from feasibility.collisions.kernels.tree_distances import of_tree
from feasibility.collisions.kernels.witness import record

# The ray's direction: no simple fractions, so that no edge of a drawn shape is met but by chance.
DX, DY, DZ = 0.4361758092437, 0.5814733161593, 0.6868015227371
NEXT_TO = 1e-12  # m, added to boxes for rounding


@kernel
def ray_meets_box(m, node, x, y, z):
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
def ray_meets_triangle(m, a, x, y, z):
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
def inside_tree(m, root, x, y, z):
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


@kernel
def set_relative(m, item, here, there):
    """Write the poses of an item's second body, seen from its first, in two slots."""
    for end in range(2):
        slot = there if end == 1 else here
        a = pose_of(m, slot, np.int64(m[item + T.INNER]))
        b = pose_of(m, slot, np.int64(m[item + T.OUTER]))
        out = T.RELATIVE + 12 * end
        x, y, z = m[b + 9] - m[a + 9], m[b + 10] - m[a + 10], m[b + 11] - m[a + 11]
        for i in range(3):
            ax, ay, az = m[a + i], m[a + 3 + i], m[a + 6 + i]
            for k in range(3):
                m[out + 3 * i + k] = ax * m[b + k] + ay * m[b + 3 + k] + az * m[b + 6 + k]
            m[out + 9 + i] = ax * x + ay * y + az * z


@kernel
def swept_ball(m, b, ends):
    """Centre and radius of a ball around a polytope in its relative poses."""
    x, y, z = transformed(m, T.RELATIVE, b + T.CENTRE)
    radius = m[b + T.BALL]
    if ends == 2:
        x1, y1, z1 = transformed(m, T.RELATIVE + 12, b + T.CENTRE)
        radius += 0.5 * np.sqrt((x1 - x) ** 2 + (y1 - y) ** 2 + (z1 - z) ** 2)
        x, y, z = 0.5 * (x + x1), 0.5 * (y + y1), 0.5 * (z + z1)
    return x, y, z, radius


@kernel
def of_polytopes(m, a, b, direction, ends, need, want, least):
    """Lower bound of the distance of two polytopes in the relative poses; see `separation`.

    `direction` is the row of the one that separated them the last time.
    """
    x, y, z, radius = swept_ball(m, b, ends)
    x, y, z = x - m[a + T.CENTRE], y - m[a + T.CENTRE + 1], z - m[a + T.CENTRE + 2]
    lower = np.sqrt(x * x + y * y + z * z) - radius - m[a + T.BALL]
    if lower >= want:
        return lower
    d = direction
    if m[d] == 0.0 and m[d + 1] == 0.0 and m[d + 2] == 0.0:
        m[d], m[d + 1], m[d + 2] = x, y, z
    m[BEST], m[BEST + 1], m[BEST + 2] = m[d], m[d + 1], m[d + 2]
    radii = m[a + T.RADIUS] + m[b + T.RADIUS]
    bound = separation(m, a, b, ends, need + radii, want + radii, least + radii, MOST_TURNS, d)
    remember(m, d, bound)
    m[d], m[d + 1], m[d + 2] = m[BEST], m[BEST + 1], m[BEST + 2]
    return max(lower, bound - radii)


@kernel
def of_groups(m, item, ends, need, want, least):
    """Lower bound of the distance of two groups in the relative poses."""
    a, b = np.int64(m[item + T.ITEM_A]), np.int64(m[item + T.ITEM_B])
    direction, result = np.int64(m[item + T.DIRECTION]), np.inf
    for i in range(np.int64(m[a + T.FIRST]), np.int64(m[a + T.LAST]), T.POLYTOPE_COLUMNS):
        for k in range(np.int64(m[b + T.FIRST]), np.int64(m[b + T.LAST]), T.POLYTOPE_COLUMNS):
            goal = min(want, result)
            bound = of_polytopes(m, i, k, direction, ends, need, goal, least)
            if least == -np.inf and bound < goal:
                record(m, m[i + T.RADIUS], k, bound)
            result = min(result, bound)
            direction += T.DIRECTION_COLUMNS
            if result < least:
                return result
    return result


@kernel
def of_item(m, item, here, there, need, want, least):
    """Lower bound, m, of an item's distance at slot `here`, or between two slots.

    Args:
        m: the memory.
        item: which.
        here, there: the slots; the same twice for a single configuration.
        need, want, least: see `separation`.
    """
    set_relative(m, item, here, there)
    ends = 1 if here == there else 2
    if m[item + T.TREE] < 0.0:
        return of_groups(m, item, ends, need, want, least)
    group, root, result = np.int64(m[item + T.ITEM_B]), np.int64(m[item + T.TREE]), np.inf
    first, last = np.int64(m[group + T.FIRST]), np.int64(m[group + T.LAST])
    known = np.int64(m[item + T.DIRECTION])  # a row for each polytope; the first has the nearest
    nearest = first + np.int64(m[known + T.NEAREST])
    for k in range(first - T.POLYTOPE_COLUMNS, last, T.POLYTOPE_COLUMNS):
        if k == nearest:
            continue
        b = k if k >= first else nearest
        place = known + T.DIRECTION_COLUMNS * ((b - first) // T.POLYTOPE_COLUMNS)
        bound = of_tree(m, root, b, place, result, ends, need, want, least)
        if bound < result:
            m[known + T.NEAREST], result = b - first, bound
        if result < least:
            return result
        if ends == 1 and m[item + T.CLOSED] > 0.0:
            x, y, z = transformed(m, T.RELATIVE, np.int64(m[b + T.FIRST]))
            if inside_tree(m, root, x, y, z):
                return -abs(result)
    return result
