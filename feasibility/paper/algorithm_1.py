"""Algorithm 1 of the paper: continuity between two neighbouring E-cells, searched over J-cells.

`extend_search` is the paper's procedure CONT, and differs from the printed one only where that
cannot run: its recursion is an explicit stack, the checked J-cells are an exact hash table, it
stops at a cap, and the result of the inner calls is kept.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coverable.arrays import Array, Ints
from coverable.kernels import allocating, allocating_entry
from feasibility.paper.jcell_grid import (
    HAIR,
    cell_of,
    distance,
    move_tool,
    neighbour,
    place_joints,
    place_tool,
    rolls_within,
)

RUNNING, FOUND, EXHAUSTED, CAPPED = 0, 1, 2, 3  # what a call is doing: counters[STATE]
STATE, DEPTH, NODES, PLACED, CALL = 0, 1, 2, 3, 4  # places in `Memory.counters`

REFRESH = 256  # levels of the stack between full evaluations of the tool: keeps rounding below HAIR


class Memory(NamedTuple):
    """Working memory of one call; all that it takes to stop it and go on later.

    There is room for as many J-cells as a call may check; the system gives it when it is used.
    """

    counters: Ints
    """(5,) STATE, DEPTH, NODES (the first, and those checked), PLACED (joint frames), CALL."""
    table: Ints
    """(2^k,) open-addressing hash table over `nodes`: CALL << 32 | node."""
    nodes: NDArray[np.int32]
    """(m, n) offsets of every J-cell checked in this call; row 0 is where it began."""
    stack_node: Ints
    """(s,) J-cells from the first to the one being expanded."""
    stack_next: Ints
    """(s,) number of the next neighbour to look at, for each of them."""
    stack_tool: Array
    """(s, 7) tool point, approach axis, distance from the target point, for each of them."""


@allocating
def _mixed(key):
    """Spread the bits of a linear key over the word."""
    key ^= key >> 29
    key *= -7046029254386353131
    key ^= key >> 32
    return key


@allocating
def _key(offsets):
    """A linear key of a J-cell: a neighbour's follows by adding one term per moved joint."""
    key = 0
    for i in range(offsets.shape[0]):
        key += np.int64(offsets[i]) * _weight(i)
    return key


@allocating
def _weight(i):
    """An odd 64-bit factor for joint i (wraps around on purpose)."""
    return (2 * i + 1) * -7070675565921424023 + 2 * i


@allocating_entry
def begin_search(chain, grid, offsets, target, memory):
    """Start a call of Algorithm 1 at the J-cell `offsets` (n,) towards the point `target` (3,)."""
    counters = memory.counters
    counters[STATE], counters[DEPTH], counters[NODES] = RUNNING, 0, 1
    counters[PLACED] = offsets.shape[0]
    counters[CALL] += 1
    memory.nodes[0] = offsets
    slot = _mixed(_key(offsets)) & (memory.table.shape[0] - 1)
    memory.table[slot] = counters[CALL] << 32
    memory.stack_node[0], memory.stack_next[0] = 0, 0
    place_tool(chain, grid, offsets, memory.stack_tool[0, :6], np.empty(3))
    memory.stack_tool[0, 6] = distance(memory.stack_tool[0], target)


@allocating
def _first_visit(table, nodes, call, count, offsets, delta, key):
    """Enter the J-cell offsets + delta as nodes[count]; False when it was checked already."""
    n = offsets.shape[0]
    mask = table.shape[0] - 1
    for i in range(n):
        key += delta[i] * _weight(i)
    slot = _mixed(key) & mask
    while table[slot] >> 32 == call:
        node = table[slot] & 0xFFFFFFFF
        same = True
        for i in range(n):
            same &= nodes[node, i] == offsets[i] + delta[i]
        if same:
            return False
        slot = (slot + 1) & mask
    table[slot] = call << 32 | count
    for i in range(n):
        nodes[count, i] = offsets[i] + delta[i]
    return True


@allocating
def _inside(lowest, highest, offsets, delta):
    """True when the J-cell offsets + delta obeys the joint limits."""
    inside = True
    for i in range(offsets.shape[0]):
        inside &= lowest[i] <= offsets[i] + delta[i] <= highest[i]
    return inside


@allocating
def _placed_for(delta, rotations, translations, prismatic, origin, step, offsets, placed, base):
    """Bring the joint frames in `base` up to date up to the last that moves; how many are."""
    top = delta.shape[0] - 1
    while delta[top] == 0:
        top -= 1
    if top < placed:
        return placed
    place_joints(rotations, translations, prismatic, origin, step, offsets, placed, top, base)
    return top + 1


@allocating_entry
def extend_search(chain, patch_kernel, triangles, grid, target, target_cell, budget, cap, memory):
    """Go on with a call of Algorithm 1 for at most `budget` more neighbours.

    Leaves counters[STATE] at FOUND (the stack and the last node are the path), EXHAUSTED (no
    unchecked neighbour is left), CAPPED (`cap` J-cells were checked) or RUNNING (call again).

    Args:
        chain, grid: a `Chain` and a `Grid`.
        patch_kernel, triangles: a `PatchKernel` or a `TriangleKernel`, and None for the other.
        target, target_cell: (3,) p_T, m, and the flat index of ec_T.
        budget, cap: neighbours to look at now, and J-cells that the call may check in all.
        memory: started by `begin_search`.
    """
    # Arrays are read out of their tuples once, here: numba counts references each time it is done.
    rotations, translations, prismatic = chain.rotations, chain.translations, chain.prismatic
    origin, step, sine, cosine = grid.origin, grid.step, grid.sine, grid.cosine
    side, height, tolerance, moves_all = grid.side, grid.height, grid.tolerance, grid.moves_all
    lowest, highest, facing, approach = grid.lowest, grid.highest, grid.cone_cosine, grid.approach
    counters, table, nodes = memory.counters, memory.table, memory.nodes
    stack_node, stack_next, stack_tool = memory.stack_node, memory.stack_next, memory.stack_tool
    n, placed, state = nodes.shape[1], 0, EXHAUSTED  # placed: frames in `base` of this J-cell
    base, partial = np.empty((n, 12)), np.empty((n + 1, 6))
    offsets, delta, held = np.zeros(n, np.int64), np.zeros(n, np.int64), np.zeros(n, np.int64)
    call, count, depth = counters[CALL], counters[NODES], counters[DEPTH]
    tool = partial[0]
    while depth >= 0:
        shared = _expand(nodes, stack_node[depth], stack_tool[depth], offsets, held, partial)
        placed = min(placed, shared)
        key, away = _key(offsets), stack_tool[depth, 6]
        number, deeper, nearer = stack_next[depth], False, away
        while not deeper and neighbour(number, moves_all, delta):
            if count > cap or budget == 0:
                state = RUNNING if budget == 0 else CAPPED
                break
            budget -= 1
            number += 1
            if not _inside(lowest, highest, offsets, delta) or not _first_visit(
                table, nodes, call, count, offsets, delta, key
            ):
                continue
            count += 1
            counters[PLACED] -= placed
            placed = _placed_for(
                delta, rotations, translations, prismatic, origin, step, offsets, placed, base
            )
            counters[PLACED] += placed
            move_tool(prismatic, step, sine, cosine, base, delta, held, partial)
            cell = cell_of(patch_kernel, triangles, side, height, tolerance, facing, approach, tool)
            if cell >= 0 and grid.roll[1] < np.inf:
                counters[PLACED] += n
                row = nodes[count - 1]
                cell = cell if rolls_within(chain, patch_kernel, triangles, grid, row, tool) else -1
            if cell == target_cell:
                state = FOUND
                break
            nearer = distance(tool, target)
            deeper = cell >= 0 and nearer < away - HAIR
        stack_next[depth] = number
        if state != EXHAUSTED:
            break
        depth += 1 if deeper else -1
        if deeper:
            stack_node[depth], stack_next[depth] = count - 1, 0
            stack_tool[depth, :6] = tool
            stack_tool[depth, 6] = nearer
            if depth % REFRESH == 0:
                place_tool(chain, grid, nodes[count - 1], stack_tool[depth, :6], np.empty(3))
                counters[PLACED] += n
    counters[STATE], counters[DEPTH], counters[NODES] = state, depth, count


@allocating
def _expand(nodes, node, tool, offsets, held, partial):
    """Make `node`, with its tool (7,), the present J-cell.

    Returns:
        How many joint frames, from the base on, it shares with the J-cell before it: a joint's own
        motion leaves its frame (before that motion) where it is.
    """
    n = offsets.shape[0]
    shared = 1
    while shared < n and offsets[shared - 1] == nodes[node, shared - 1]:
        shared += 1
    offsets[:] = nodes[node]
    held[:] = 2
    partial[n] = tool[:6]
    return shared
