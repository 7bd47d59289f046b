"""Lower bounds of the distances of pairs, at one configuration or all along a segment.

Two groups: the least over their pairs of polytopes. A group and a tree of triangles: nodes are
opened, the nearer child first, until each is far enough or a triangle is too near. Balls and
capsules decide what is far; `separation` decides the rest, and begins with the direction that
separated the same two bodies the last time.

For a segment the second body is the hull of its places at both ends. What this bounds is also a
bound for the body at each of them.
"""

from __future__ import annotations

import numpy as np

from feasibility.collisions.kernels.inside import inside_tree
from feasibility.collisions.kernels.link_frames import transformed
from feasibility.collisions.kernels.separation import BEST, separation
from feasibility.collisions.kernels.tables import (
    AXES,
    BALL,
    CENTRE,
    CLOSED,
    DIRECTION,
    FIRST,
    HALF,
    INNER,
    ITEM_A,
    ITEM_B,
    LAST,
    LEFT,
    MIDDLE,
    OUTER,
    RADIUS,
    RIGHT,
    SOUP,
)
from feasibility.collisions.kernels.witness import record
from feasibility.compiled import kernel

OPENED = 24  # nodes of a tree that are opened for a bound larger than needed


@kernel
def set_relative(t, item, here, there):  # type: ignore[no-untyped-def]
    """Write the poses of an item's second body, seen from its first, in two slots."""
    n = t.joints.shape[0]
    for end in range(2):
        root = (there if end == 1 else here) * (n + 1)
        a = t.poses[root + np.int64(t.items[item, INNER])]
        b = t.poses[root + np.int64(t.items[item, OUTER])]
        out = t.relative[end]
        x, y, z = b[9] - a[9], b[10] - a[10], b[11] - a[11]
        for i in range(3):
            ax, ay, az = a[i], a[3 + i], a[6 + i]
            for k in range(3):
                out[3 * i + k] = ax * b[k] + ay * b[3 + k] + az * b[6 + k]
            out[9 + i] = ax * x + ay * y + az * z


@kernel
def swept_ball(t, b, ends):  # type: ignore[no-untyped-def]
    """Centre and radius of a ball around a polytope in its relative poses."""
    x, y, z = transformed(t.relative[0], t.polytopes[b], CENTRE)
    radius = t.polytopes[b, BALL]
    if ends == 2:
        x1, y1, z1 = transformed(t.relative[1], t.polytopes[b], CENTRE)
        radius += 0.5 * np.sqrt((x1 - x) ** 2 + (y1 - y) ** 2 + (z1 - z) ** 2)
        x, y, z = 0.5 * (x + x1), 0.5 * (y + y1), 0.5 * (z + z1)
    return x, y, z, radius


@kernel
def of_polytopes(t, a, b, direction, ends, need, want, least):  # type: ignore[no-untyped-def]
    """Lower bound of the distance of two polytopes in the relative poses; see `separation`."""
    x, y, z, radius = swept_ball(t, b, ends)
    first, second, s = t.polytopes[a], t.polytopes[b], t.simplex
    x, y, z = x - first[CENTRE], y - first[CENTRE + 1], z - first[CENTRE + 2]
    lower = np.sqrt(x * x + y * y + z * z) - radius - first[BALL]
    if lower >= want:
        return lower
    known = t.directions[direction]
    if known[0] == 0.0 and known[1] == 0.0 and known[2] == 0.0:
        known[0], known[1], known[2] = x, y, z
    s[BEST, 0], s[BEST, 1], s[BEST, 2] = known[0], known[1], known[2]
    radii = first[RADIUS] + second[RADIUS]
    rows_a = (np.int64(first[FIRST]), np.int64(first[LAST]))
    rows_b = (np.int64(second[FIRST]), np.int64(second[LAST]))
    bound = separation(
        t.vertices, rows_a, rows_b, t.relative, ends, s, need + radii, want + radii, least + radii
    )
    known[0], known[1], known[2] = s[BEST, 0], s[BEST, 1], s[BEST, 2]
    return max(lower, bound - radii)


@kernel
def of_groups(t, item, ends, need, want, least):  # type: ignore[no-untyped-def]
    """Lower bound of the distance of two groups in the relative poses."""
    a, b = t.groups[np.int64(t.items[item, ITEM_A])], t.groups[np.int64(t.items[item, ITEM_B])]
    direction, result = np.int64(t.items[item, DIRECTION]), np.inf
    for i in range(np.int64(a[FIRST]), np.int64(a[LAST])):
        for k in range(np.int64(b[FIRST]), np.int64(b[LAST])):
            goal = min(want, result)
            bound = of_polytopes(t, i, k, direction, ends, need, goal, least)
            if least == -np.inf and bound < goal:
                record(t, t.polytopes[i, RADIUS], k, bound)
            result = min(result, bound)
            direction += 1
            if result < least:
                return result
    return result


@kernel
def ball_from_box(node, x, y, z, radius):  # type: ignore[no-untyped-def]
    """Distance of a ball from a box, m; its thinnest direction, pointing to the ball's side."""
    x, y, z = x - node[MIDDLE], y - node[MIDDLE + 1], z - node[MIDDLE + 2]
    square, side = 0.0, 1.0
    for i in range(3):
        k = AXES + 3 * i
        along = x * node[k] + y * node[k + 1] + z * node[k + 2]
        beyond = max(abs(along) - node[HALF + i], 0.0)
        square += beyond * beyond
        side = 1.0 if along >= 0.0 else -1.0
    return np.sqrt(square) - radius, side


@kernel
def of_box(t, node, b, ball, ends, need, want, least):  # type: ignore[no-untyped-def]
    """Lower bound of the distance of a node's box, or of a leaf's triangle, from a polytope."""
    row, s = t.nodes[node], t.simplex
    lower, side = ball_from_box(row, ball[0], ball[1], ball[2], ball[3])
    if lower >= want:
        return lower
    for k in range(3):
        s[BEST, k] = side * row[AXES + 6 + k]
    radius = t.polytopes[b, RADIUS]
    rows_a = (np.int64(row[FIRST]), np.int64(row[LAST]))
    rows_b = (np.int64(t.polytopes[b, FIRST]), np.int64(t.polytopes[b, LAST]))
    bound = separation(
        t.vertices,
        rows_a,
        rows_b,
        t.relative,
        ends,
        s,
        need + radius,
        want + radius,
        least + radius,
    )
    return max(lower, bound - radius)


@kernel
def of_tree(t, root, b, best, ends, need, want, least):  # type: ignore[no-untyped-def]
    """Lower bound of the distance of the triangles of a tree from polytope b, where below `best`.

    `OPENED` boxes may be opened for a bound up to `want`, the others only up to `need`.
    """
    ball = swept_ball(t, b, ends)
    stack = t.stack[0]
    stack[0], top, opened, result = root, 1, 0, best
    while top > 0:
        top -= 1
        node = np.int64(stack[top])
        goal = min(want if opened < OPENED else min(need, want), result)
        left, right = np.int64(t.nodes[node, LEFT]), np.int64(t.nodes[node, RIGHT])
        leaf = left < 0
        bound = of_box(t, node, b, ball, ends, min(need, goal), goal, least if leaf else goal)
        if leaf or bound >= goal:
            if least == -np.inf and bound < goal:
                record(t, 0.0, b, bound)
            result = min(result, bound)
            if result < least:
                return result
            continue
        opened += 1
        to_left, _ = ball_from_box(t.nodes[left], ball[0], ball[1], ball[2], 0.0)
        to_right, _ = ball_from_box(t.nodes[right], ball[0], ball[1], ball[2], 0.0)
        nearer, further = (left, right) if to_left <= to_right else (right, left)
        stack[top], stack[top + 1] = further, nearer
        top += 2
    return result


@kernel
def of_item(t, item, here, there, need, want, least):  # type: ignore[no-untyped-def]
    """Lower bound, m, of an item's distance at slot `here`, or between two slots.

    Args:
        t, item, here, there: which; the same slot twice for a configuration.
        need, want, least: see `separation`.
    """
    set_relative(t, item, here, there)
    ends = 1 if here == there else 2
    if t.items[item, SOUP] < 0.0:
        return of_groups(t, item, ends, need, want, least)
    group, result = t.groups[np.int64(t.items[item, ITEM_B])], np.inf
    root = np.int64(t.items[item, SOUP])
    for b in range(np.int64(group[FIRST]), np.int64(group[LAST])):
        result = of_tree(t, root, b, result, ends, need, want, least)
        if result < least:
            return result
        if ends == 1 and t.items[item, CLOSED] > 0.0:
            first = t.vertices[np.int64(t.polytopes[b, FIRST])]
            x, y, z = transformed(t.relative[0], first, 0)
            if inside_tree(t, root, x, y, z):
                return -abs(result)
    return result
