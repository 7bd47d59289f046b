"""The memory of the compiled clearance: one flat array of numbers, read as tables.

A search kernel knows no more of collisions than this array, and is compiled once, whether they are
checked or not. Its first number holds the address of the compiled function (see `calls.py`), the
next ones say where each table begins and how large it is. Inside, a row is a *place*: the number at
which it begins, so `m[item + CLEARANCE]` is a column of an item. Tables refer to each other by
places too. Whole numbers are kept as floats, which is exact up to 2^53. The array holds working
memory as well: it serves one thread.

The reason for this plainness: numba passes each array as seven numbers and counts its references,
which made the same kernels, given the tables as arrays, take three times as long to compile.
"""

from typing import NamedTuple

import numpy as np

from coverable.arrays import Array
from coverable.kernels import kernel

ADDRESS = 0  # the number that holds the function's address
HEADER = 64  # numbers ahead of the first table: three for each table, from number 1 on

# Columns of `joints`: the joint's frame in that of the joint before it, as in `robots.Chain`.
ROTATION, TRANSLATION, SLIDES = 0, 9, 12
JOINT_COLUMNS = 13
# Columns of `groups`: all polytopes of one owner, moved by one joint. NUMBER counts them.
JOINT, FIRST, LAST, END_0, END_1, THICKNESS, OWN_LEVER, NUMBER = 0, 1, 2, 3, 6, 9, 10, 11
GROUP_COLUMNS = 12
# Columns of `polytopes`; FIRST and LAST are 1 and 2 here too, of its vertices.
# CENTRE and BALL are of a ball around it; SIDES halves of those of a box about the same centre.
RADIUS, CENTRE, BALL, SIDES = 3, 4, 7, 8
POLYTOPE_COLUMNS = 17
# Columns of `nodes`: boxes around triangles. FIRST and LAST are 1 and 2, of its corners.
LEFT, RIGHT, MIDDLE, AXES, HALF = 3, 4, 5, 8, 17
NODE_COLUMNS = 20
# Columns of `items`: what is asked for, two groups, or a tree of triangles and a group. WISH is
# how far beyond its clearance it pushes (`push.py`). BOUND and
# the column after it are lower bounds of its distance in slots 0 and 1.
ITEM_A, ITEM_B, TREE, INNER, OUTER, CLEARANCE, PAIR, DIRECTION, CLOSED, WISH, BOUND = range(11)
ITEM_COLUMNS = 12
# Columns of `directions`: how far behind its group's first the nearest polytope was; how many
# points the simplex had from which the shortest difference was found, and of each the places of the
# first and the second body's vertex, and the pose, 0 or 1.
NEAREST, KNOWN, CORNERS = 1, 3, 4
DIRECTION_COLUMNS = 13
# Columns of `state`: what was found, and what is asked for.
BLAMED, FIRST_ASKED, SIZE, VALID = 0, 1, 2, 3  # VALID: of slot 0, then of slot 1
STATE_COLUMNS = 8

SLOTS = 4  # 0 and 1: the ends of the last segment; 2 and 3: those of a part of it


class Tables(NamedTuple):
    """Views of the flat array. The first six are as large in every one."""

    state: Array
    """(1, STATE_COLUMNS)"""
    relative: Array
    """(2, 12) poses of the second body in the frame of the first, at both ends."""
    simplex: Array
    """(7, 10) working memory of `separation.py`."""
    found: Array
    """(1, 10) of the nearest bodies: bound, direction, a point of the first, one of the second."""
    placed: Array
    """(2, 12) the box around a polytope in its relative poses; see `tree_distances.py`."""
    stack: Array
    """(1, 128) nodes of a tree that wait, with bounds; one of 2^31 triangles needs half of it."""
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
    """(D, DIRECTION_COLUMNS) the direction that last separated two bodies, in the frame of the
    first, and where they were nearest. For a tree: the place of the leaf that was nearest to a
    polytope, and where; in the first row also NEAREST."""
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


NAMES = Tables._fields
STATE, RELATIVE = np.int64(HEADER), np.int64(HEADER + STATE_COLUMNS)
SIMPLEX, FOUND = RELATIVE + 24, RELATIVE + 94
PLACED = FOUND + 10
STACK = PLACED + 24
JOINTS, GROUPS, ITEMS, ASKED, CONFIGURATIONS, POSES, LEVERS, LARGEST, REACH = (
    np.int64(NAMES.index(name))
    for name in (
        "joints", "groups", "items", "asked", "configurations", "poses", "levers", "largest",
        "reach",
    )
)  # fmt: skip


@kernel
def rows_of(m, table):
    """How many rows a table has."""
    return np.int64(m[2 + 3 * table])


@kernel
def row(m, table, k):
    """The place of a table's row."""
    return np.int64(m[1 + 3 * table]) + k * np.int64(m[3 + 3 * table])


def flat(tables: Tables) -> Array:
    """One array that holds copies of all tables; the address is still missing."""
    memory = np.zeros(HEADER + sum(table.size for table in tables))
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
