"""Algorithm 1 of the paper: continuity between two neighbouring E-cells, searched over J-cells.

`extend_search` is the paper's procedure CONT, and differs from the printed one only where that
cannot run: its recursion is an explicit stack, the checked J-cells are an exact hash table, it
stops at a cap, and the result of the inner calls is kept.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coverable.arrays import Array, Ints
from coverable.kernels import entry, kernel
from feasibility.paper.jcell_grid import ROUNDING, cell_of, distance, neighbour, place_tool

RUNNING, FOUND, EXHAUSTED, CAPPED = 0, 1, 2, 3  # what a call is doing: counters[STATE]
STATE, DEPTH, NODES, CALL = 0, 1, 2, 3  # places in `Memory.counters`


class Memory(NamedTuple):
    """Working memory of one call; all that it takes to stop it and go on later.

    There is room for as many J-cells as a call may check; the system gives it when it is used.
    """

    counters: Ints
    """(4,) STATE, DEPTH, NODES (the first, and those checked), CALL."""
    table: Ints
    """(2^k,) open-addressing hash table over `nodes`: CALL << 32 | node."""
    nodes: NDArray[np.int32]
    """(m, n) offsets of every J-cell checked in this call; row 0 is where it began."""
    stack_node: Ints
    """(s,) J-cells from the first to the one being expanded."""
    stack_next: Ints
    """(s,) number of the next neighbour to look at, for each of them."""
    stack_away: Array
    """(s,) m, distance from the target point, for each of them."""
    offsets: Ints
    """(n,) the J-cell being expanded."""
    delta: Ints
    """(n,) moves to a neighbour."""
    q: Array
    """(n,) the neighbour's configuration."""
    placed: Array
    """(2 n + 3, 3) its frames, see `place_tool`."""


@kernel
def _mixed(key):
    """Spread the bits of a linear key over the word."""
    key ^= key >> 29
    key *= -7046029254386353131
    key ^= key >> 32
    return key


@kernel
def _key(offsets):
    """A linear key of a J-cell: a neighbour's follows by adding one term per moved joint."""
    key = 0
    for i in range(offsets.shape[0]):
        key += np.int64(offsets[i]) * _weight(i)
    return key


@kernel
def _weight(i):
    """An odd 64-bit factor for joint i (wraps around on purpose)."""
    return (2 * i + 1) * -7070675565921424023 + 2 * i


@entry
def begin_search(chain, grid, offsets, target, memory):
    """Start a call of Algorithm 1 at the J-cell `offsets` (n,) towards the point `target` (3,)."""
    counters = memory.counters
    counters[STATE], counters[DEPTH], counters[NODES] = RUNNING, 0, 1
    counters[CALL] += 1
    for i in range(offsets.shape[0]):
        memory.nodes[0, i] = offsets[i]
    slot = _mixed(_key(offsets)) & (memory.table.shape[0] - 1)
    memory.table[slot] = counters[CALL] << 32
    memory.stack_node[0], memory.stack_next[0] = 0, 0
    place_tool(chain, grid, offsets, memory.q, memory.placed)
    memory.stack_away[0] = distance(memory.placed[-3:], target)


@kernel
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


@kernel
def _inside(lowest, highest, offsets, delta):
    """True when the J-cell offsets + delta obeys the joint limits."""
    inside = True
    for i in range(offsets.shape[0]):
        inside &= lowest[i] <= offsets[i] + delta[i] <= highest[i]
    return inside


@entry
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
    counters, nodes = memory.counters, memory.nodes
    offsets, delta, tool = memory.offsets, memory.delta, memory.placed[-3:]
    call, count, depth, state = counters[CALL], counters[NODES], counters[DEPTH], EXHAUSTED
    while depth >= 0:
        for i in range(offsets.shape[0]):
            offsets[i] = nodes[memory.stack_node[depth], i]
        key, away = _key(offsets), memory.stack_away[depth]
        number, deeper, nearer = memory.stack_next[depth], False, away
        while not deeper and neighbour(number, grid.moves_all, delta):
            if count > cap or budget == 0:
                state = RUNNING if budget == 0 else CAPPED
                break
            budget -= 1
            number += 1
            if not _inside(grid.lowest, grid.highest, offsets, delta) or not _first_visit(
                memory.table, nodes, call, count, offsets, delta, key
            ):
                continue
            count += 1
            place_tool(chain, grid, nodes[count - 1], memory.q, memory.placed)
            cell = cell_of(patch_kernel, triangles, grid, tool)
            if cell == target_cell:
                state = FOUND
                break
            nearer = distance(tool, target)
            deeper = cell >= 0 and nearer < away - ROUNDING
        memory.stack_next[depth] = number
        if state != EXHAUSTED:
            break
        depth += 1 if deeper else -1
        if deeper:
            memory.stack_node[depth], memory.stack_next[depth] = count - 1, 0
            memory.stack_away[depth] = nearer
    counters[STATE], counters[DEPTH], counters[NODES] = state, depth, count
