"""Lower bounds of the distance of a polytope from a tree of triangles.

Nodes are opened, the nearer child first, until each is far enough or a triangle is too near. What
a node costs, the cheapest first: its box against the box around the polytope, along its own axes;
the polytope itself along its thinnest; a few directions more where the node is small beside the
polytope and the bound is needed. The triangle that was nearest the last time is asked first.
"""

import numpy as np

from coverable.kernels import kernel
from feasibility.collisions.kernels import tables as T
from feasibility.collisions.kernels.link_frames import transformed
from feasibility.collisions.kernels.separation import (
    BEST,
    FEW_TURNS,
    MOST_TURNS,
    NOT_KNOWN,
    remember,
    separation,
)
from feasibility.collisions.kernels.witness import record

OPENED = 6  # nodes that are opened for a bound larger than needed
SEARCHED = 20  # the same where a nearest triangle is looked for and none is met yet
ENOUGH = 0.5  # of the least distance that was met: a bound as large is not made sharper
ONE_TURN = np.int64(1)


@kernel
def place_box(m, b, ends):
    """Write the box around a polytope in its relative poses: centre, and halves of its sides."""
    for end in range(ends):
        p, out = T.RELATIVE + 12 * end, T.PLACED + 12 * end
        m[out], m[out + 1], m[out + 2] = transformed(m, p, b + T.CENTRE)
        for side in range(out + 3, out + 12, 3):
            v = b + T.SIDES + side - out - 3
            x, y, z = transformed(m, p, v)
            m[side], m[side + 1], m[side + 2] = x - m[p + 9], y - m[p + 10], z - m[p + 11]


@kernel
def between_boxes(m, node, ends):
    """Lower bound of the distance of a node's box from the placed boxes and all between them."""
    square = 0.0
    for i in range(3):
        k = node + T.AXES + 3 * i
        x, y, z = m[k], m[k + 1], m[k + 2]
        at = x * m[node + T.MIDDLE] + y * m[node + T.MIDDLE + 1] + z * m[node + T.MIDDLE + 2]
        beyond, below = np.inf, np.inf
        for p in range(T.PLACED, T.PLACED + 12 * ends, 12):
            middle = x * m[p] + y * m[p + 1] + z * m[p + 2] - at
            half = m[node + T.HALF + i]
            for side in range(p + 3, p + 12, 3):
                half += abs(x * m[side] + y * m[side + 1] + z * m[side + 2])
            beyond, below = min(beyond, middle - half), min(below, -middle - half)
        square += max(beyond, below, 0.0) ** 2
    return np.sqrt(square)


@kernel
def of_node(m, node, b, ends, bound, need, goal, least, known):
    """Make the bound of a node larger: a leaf's up to `goal`, another one's as far as it is cheap.

    The first direction is across its thinnest side, unless more is `known`, see `separation`.
    """
    axis, side, beyond, around = node + T.AXES + 6, 0.0, 0.0, m[b + T.RADIUS]
    last = T.PLACED + 12 * (ends - 1)
    for k in range(3):
        side += m[axis + k] * (m[T.PLACED + k] - m[node + T.MIDDLE + k])
        beyond += m[axis + k] * (m[last + k] - m[node + T.MIDDLE + k])
    for k in range(3):
        m[BEST + k] = m[axis + k] if side >= 0.0 else -m[axis + k]
    turns, given_up = MOST_TURNS, least
    if m[node + T.LEFT] >= 0.0:
        small = m[node + T.HALF] < 0.5 * m[b + T.BALL]
        turns, given_up = FEW_TURNS if small and bound < need else ONE_TURN, goal
        beyond = min(abs(side), beyond if side >= 0.0 else -beyond)
        if turns == ONE_TURN and beyond - m[node + T.HALF + 2] - around < goal:
            return bound  # even its middle is too near for that
    enough = min(need, goal) + around
    goal, given_up = goal + around, given_up + around
    found = separation(m, node, b, ends, enough, goal, given_up, turns, known) - around
    return bound if bound > found else found  # so that NaN is none


@kernel
def of_tree(m, root, b, known, best, ends, need, want, least):
    """Lower bound of the distance of the triangles of a tree from polytope b, where below `best`.

    `OPENED` boxes may be opened for a bound up to `want`, the others only up to `need`; where all
    is asked for (`need` is infinite), the bound is sharp. `known` is the row with the triangle that
    was nearest the last time.
    """
    place_box(m, b, ends)
    around, result, nearest = m[b + T.RADIUS], best, best
    floor, share = (need, ENOUGH) if need < np.inf else (-np.inf, 1.0)
    before, asked = np.int64(m[known]), False
    m[T.STACK], m[T.STACK + 1] = root, between_boxes(m, root, ends) - around
    top, opened = 1, 0
    if before > 0:
        m[T.STACK + 2], m[T.STACK + 3] = before, between_boxes(m, before, ends) - around
        top = 2
    while top > 0:
        top -= 1
        node, bound = np.int64(m[T.STACK + 2 * top]), m[T.STACK + 2 * top + 1]
        if node == before:
            if asked:
                continue
            asked = True
        searching = least == -np.inf and nearest == np.inf
        goal = want if opened < (SEARCHED if searching else OPENED) else min(need, want)
        goal = min(goal, max(floor, share * nearest if nearest > 0.0 else nearest))
        if not bound >= goal:
            points = known if node == before else NOT_KNOWN
            bound = of_node(m, node, b, ends, bound, need, goal, least, points)
        left, right = np.int64(m[node + T.LEFT]), np.int64(m[node + T.RIGHT])
        if left < 0 or bound >= goal:
            result = min(result, bound)
            if left < 0 and bound < goal:
                m[known], nearest = node, min(nearest, bound)
                remember(m, known, bound + around)
                if least == -np.inf:
                    record(m, 0.0, b, bound)
            if result < least:
                return result
            continue
        opened += 1
        one, other = between_boxes(m, left, ends), between_boxes(m, right, ends)
        if one > other:
            left, right, one, other = right, left, other, one
        place = T.STACK + 2 * top
        m[place], m[place + 1] = right, max(other - around, bound)
        m[place + 2], m[place + 3] = left, max(one - around, bound)
        top += 2
    return result
