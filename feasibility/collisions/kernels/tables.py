"""The memory of the compiled clearance: one flat array of numbers, seen as tables.

A search kernel knows no more of collisions than this array, and is compiled once, whether they are
checked or not. Its first number holds the address of the compiled function (see `calls.py`), the
next ones say where each table begins and how large it is. Whole numbers are kept as floats, which
is exact up to 2^53. The array holds working memory too: it serves one thread.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ADDRESS = 0  # the number that holds the function's address
HEADER = 64  # numbers ahead of the first table: three for each table from number 1 on

# Columns of `joints`: the joint's frame in that of the joint before it, as in `robots.Chain`.
ROTATION, TRANSLATION, SLIDES = 0, 9, 12
JOINT_COLUMNS = 13
# Columns of `groups`: all polytopes of one owner, moved by one joint.
JOINT, FIRST, LAST, END_0, END_1, THICKNESS, OWN_LEVER = 0, 1, 2, 3, 6, 9, 10
GROUP_COLUMNS = 11
# Columns of `polytopes`; FIRST and LAST are 1 and 2 here too, of its vertices.
RADIUS, CENTRE, BALL = 3, 4, 7
POLYTOPE_COLUMNS = 8
# Columns of `nodes`: boxes around triangles. FIRST and LAST are 1 and 2, of its corners.
LEFT, RIGHT, MIDDLE, AXES, HALF = 3, 4, 5, 8, 17
NODE_COLUMNS = 20
# Columns of `items`: what is asked for, two groups or a soup and a group.
ITEM_A, ITEM_B, SOUP, INNER, OUTER, CLEARANCE, PAIR, DIRECTION, CLOSED = 0, 1, 2, 3, 4, 5, 6, 7, 8
ITEM_COLUMNS = 9
# Columns of `state`.
CALLS, BOUNDS, SWEPT, DECIDED, BY_BUDGET, ASKED, BLAMED, FRAMES = 0, 1, 2, 3, 4, 5, 6, 7
VALID = 8  # and 9: whether slots 0 and 1 hold a configuration
SIZE, WISH = 10, 11  # of the push; its influence distance
STATE_COLUMNS = 12

STACK = 64  # a tree of 2^31 triangles needs half of it
SLOTS = 4  # 0 and 1: the ends of the last segment; 2 and 3: those of a part of it


class Tables(NamedTuple):
    """Views of the flat array, each of two dimensions."""

    joints: Array
    """(n, JOINT_COLUMNS)"""
    groups: Array
    polytopes: Array
    vertices: Array
    """(V, 3) m, of polytopes in the frame of their joint, its axis along z; of boxes and triangles
    in the root frame."""
    nodes: Array
    items: Array
    directions: Array
    """(D, 3) the direction that last separated two bodies, in the frame of the first."""
    state: Array
    """(1, STATE_COLUMNS) counters, and what was found."""
    asked: Array
    """(3, n) the ends of the segment that is asked for; last the push that is made."""
    configurations: Array
    """(SLOTS, n)"""
    poses: Array
    """(SLOTS (n + 1), 12) of each joint in each slot: rotation and translation; first the root."""
    levers: Array
    """(SLOTS G, n) m, how far each group reaches from each joint's axis, in each slot."""
    largest: Array
    """(G, n) m, the same all along the present segment."""
    reach: Array
    """(G, n + 1) m, how far a group moves at most in the frame of each joint before it."""
    bounds: Array
    """(2, items) m, lower bounds of the distances in slots 0 and 1."""
    relative: Array
    """(2, 12) poses of the second body in the frame of the first, at both ends."""
    simplex: Array
    """(7, 8) working memory of `separation.py`."""
    stack: Array
    """(1, STACK) nodes of a tree that wait."""
    found: Array
    """(1, 10) of the nearest bodies: bound, direction, a point of the first, one of the second."""


NAMES = Tables._fields


def flat(tables: Tables) -> Array:
    """One array that holds copies of all tables; the address is still missing."""
    size = HEADER + sum(table.size for table in tables)
    memory = np.zeros(size)
    start = HEADER
    for number, table in enumerate(tables):
        memory[1 + 3 * number : 4 + 3 * number] = start, *table.shape
        memory[start : start + table.size] = table.ravel()
        start += table.size
    return memory


def views(memory: Array) -> Tables:
    """The tables inside a flat array; what is written to them is written to it."""

    def view(number: int) -> Array:
        start, rows, columns = memory[1 + 3 * number : 4 + 3 * number].astype(int)
        return memory[start : start + rows * columns].reshape(rows, columns)

    return Tables(*(view(number) for number in range(len(NAMES))))
