"""The roadmap of the complete search: (cell, configuration) nodes joined by certified motions.

The paper keeps one configuration per cell, so its answer depends on where it starts. Here a cell
may hold many nodes, one for each connected component that was found over it, and a union-find gives
the nodes that one continuous motion can visit. A component that covers every cell is a covering
motion; the cells that the best component does not cover are the missed ones.

The arrays are made and grown in Python; the compiled loops fill them and return when an array is
full, when their budget is spent (so that Ctrl-C and time limits work), or when they are done.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coverable_arrays import Array, Ints
from coverable_kernels import entry, kernel
from feasibility.roadmap.motions import NEXT, effects, place

NODES, EDGES, WAYPOINTS, COMPONENTS, HEAD, TAIL, CURSOR, BEST = range(8)
"""Indices into `Roadmap.counters`."""
DONE, BUDGET, FULL, COVERED = range(4)
"""Why a compiled loop returned."""


class Roadmap(NamedTuple):
    """The search's state as plain arrays; rows beyond the counters are unused."""

    cell: Ints
    """(nodes,) the cell of each node."""
    q: Array
    """(nodes, n) the configuration of each node, over its cell's centre."""
    effect: Array
    """(nodes, n) how much each joint moves the tool there, see `self_motion.effects`."""
    component: Ints
    """(nodes,) the component slot that the node was made in; `root_of` gives the present one."""
    following: Ints
    """(nodes,) next node over the same cell, -1 at the end."""
    first_node: Ints
    """(N,) first node over each cell, -1 where there is none."""
    queue: Ints
    """(nodes,) nodes to be spread to neighbouring cells, between HEAD and TAIL."""
    ends: Ints
    """(edges, 2) nodes that each edge joins."""
    edge_rows: Ints
    """(edges, 2) first row and number of rows of the edge's waypoints in `waypoints`."""
    waypoints: Array
    """(rows, n) waypoints of all edges; an edge's start is not among them, its end is."""
    parent: Ints
    """(components,) union-find over component slots."""
    cover: NDArray[np.uint8]
    """(components, N) cells that each root component covers."""
    size: Ints
    """(components,) number of cells that each root component covers."""
    failures: Ints
    """(components, components) failed connections between two root components."""
    blocked: Ints
    """(N, 3) why a motion into each cell stopped: a code of `arrays`, a joint, and the component
    that it came from (the largest that was stopped there); -1 where none was."""
    counters: Ints
    """(8,) see NODES ... BEST."""


def empty_roadmap(cells: int, n: int) -> Roadmap:
    """A roadmap without nodes, with space for one node per cell."""
    nodes = cells + 64
    components = 16
    return Roadmap(
        cell=np.empty(nodes, dtype=np.int64),
        q=np.empty((nodes, n)),
        effect=np.empty((nodes, n)),
        component=np.empty(nodes, dtype=np.int64),
        following=np.empty(nodes, dtype=np.int64),
        first_node=np.full(cells, -1, dtype=np.int64),
        queue=np.empty(nodes, dtype=np.int64),
        ends=np.empty((4 * nodes, 2), dtype=np.int64),
        edge_rows=np.empty((4 * nodes, 2), dtype=np.int64),
        waypoints=np.empty((16 * nodes, n)),
        parent=np.arange(components),
        cover=np.zeros((components, cells), dtype=np.uint8),
        size=np.zeros(components, dtype=np.int64),
        failures=np.zeros((components, components), dtype=np.int64),
        blocked=np.full((cells, 3), -1, dtype=np.int64),
        counters=np.zeros(8, dtype=np.int64),
    )


def grown(roadmap: Roadmap) -> Roadmap:
    """The same roadmap, with longer arrays wherever one is nearly full."""

    def longer(array: NDArray, used: int, spare: int) -> NDArray:
        if used + spare <= len(array):
            return array
        result = np.zeros((2 * len(array) + spare, *array.shape[1:]), dtype=array.dtype)
        result[: len(array)] = array
        return result

    count = roadmap.counters
    fields = roadmap._asdict()
    for name in ("cell", "q", "effect", "component", "following"):
        fields[name] = longer(fields[name], count[NODES], 8)
    fields["queue"] = longer(fields["queue"], count[TAIL], 8)
    for name in ("ends", "edge_rows"):
        fields[name] = longer(fields[name], count[EDGES], 16)
    fields["waypoints"] = longer(fields["waypoints"], count[WAYPOINTS], 4096)
    slots = len(roadmap.parent)
    if count[COMPONENTS] + 2 > slots:
        fields["parent"] = np.concatenate([roadmap.parent, np.arange(slots, 2 * slots)])
        fields["cover"] = longer(roadmap.cover, slots, 1)[: 2 * slots]
        fields["size"] = longer(roadmap.size, slots, 1)[: 2 * slots]
        failures = np.zeros((2 * slots, 2 * slots), dtype=np.int64)
        failures[:slots, :slots] = roadmap.failures
        fields["failures"] = failures
    return Roadmap(**fields)


@kernel
def is_full(roadmap):  # type: ignore[no-untyped-def]
    """Has an array no space for two more nodes, or three more edges?"""
    count = roadmap.counters
    nodes = max(count[NODES] - roadmap.cell.shape[0], count[TAIL] - roadmap.queue.shape[0])
    return nodes + 2 > 0 or count[EDGES] + 3 > roadmap.ends.shape[0]


@entry
def root_of(roadmap, slot):  # type: ignore[no-untyped-def]
    """The root component of a slot, with path halving."""
    while roadmap.parent[slot] != slot:
        roadmap.parent[slot] = roadmap.parent[roadmap.parent[slot]]
        slot = roadmap.parent[slot]
    return slot


def roots_of_nodes(roadmap: Roadmap) -> Ints:
    """(nodes,) the root component of every node."""
    root = roadmap.component[: roadmap.counters[NODES]]
    while np.any(roadmap.parent[root] != root):
        root = roadmap.parent[root]
    return root


def nodes_over(roadmap: Roadmap, cell: int) -> list[int]:
    """The nodes over a cell, the latest first."""
    found, node = list[int](), int(roadmap.first_node[cell])
    while node >= 0:
        found.append(node)
        node = int(roadmap.following[node])
    return found


@entry
def unite(roadmap, a, b):  # type: ignore[no-untyped-def]
    """Merge two components and the cells that they cover; returns the root."""
    a = root_of(roadmap, a)
    b = root_of(roadmap, b)
    if a == b:
        return a
    if roadmap.size[a] < roadmap.size[b]:
        a, b = b, a
    roadmap.parent[b] = a
    total = 0
    for k in range(roadmap.cover.shape[1]):
        roadmap.cover[a, k] |= roadmap.cover[b, k]
        total += roadmap.cover[a, k]
    roadmap.size[a] = total
    for k in range(roadmap.counters[COMPONENTS]):
        worst = max(roadmap.failures[a, k], roadmap.failures[b, k])
        roadmap.failures[a, k] = worst
        roadmap.failures[k, a] = worst
    if total > roadmap.size[roadmap.counters[BEST]]:
        roadmap.counters[BEST] = a
    if roadmap.counters[BEST] == b:
        roadmap.counters[BEST] = a
    return a


@entry
def add_node(arrays, work, roadmap, cell, q, component):  # type: ignore[no-untyped-def]
    """Append a node to a component, and queue it; returns its index."""
    count = roadmap.counters
    node = count[NODES]
    roadmap.cell[node] = cell
    for j in range(q.shape[0]):
        roadmap.q[node, j] = q[j]
    place(arrays, work, NEXT, q)
    effects(arrays, work, NEXT, roadmap.effect[node])
    roadmap.component[node] = component
    roadmap.following[node] = roadmap.first_node[cell]
    roadmap.first_node[cell] = node
    if roadmap.cover[component, cell] == 0:
        roadmap.cover[component, cell] = 1
        roadmap.size[component] += 1
    if roadmap.size[component] > roadmap.size[count[BEST]]:
        count[BEST] = component
    roadmap.queue[count[TAIL]] = node
    count[TAIL] += 1
    count[NODES] += 1
    return node


@entry
def add_edge(roadmap, x, y, rows):  # type: ignore[no-untyped-def]
    """Append an edge whose waypoints are the next `rows` rows of `waypoints`."""
    count = roadmap.counters
    edge = count[EDGES]
    roadmap.ends[edge, 0] = x
    roadmap.ends[edge, 1] = y
    roadmap.edge_rows[edge, 0] = count[WAYPOINTS]
    roadmap.edge_rows[edge, 1] = rows
    count[EDGES] += 1
    count[WAYPOINTS] += rows


def add_motion(roadmap: Roadmap, x: int, y: int, motion: Array) -> None:
    """Add an edge from node x to node y by a motion (k, n), its first configuration left out.

    Their components become one. The arrays need space for it, see `Exploration.reserve`.
    """
    first = roadmap.counters[WAYPOINTS]
    roadmap.waypoints[first : first + len(motion)] = motion
    add_edge(roadmap, x, y, len(motion))
    unite(roadmap, roadmap.component[x], roadmap.component[y])


@entry
def joined_pairs(roadmap, pairs, component, state):  # type: ignore[no-untyped-def]
    """Mark the pairs of cells that an edge of the component joins already (state = 1)."""
    for e in range(roadmap.counters[EDGES]):
        x, y = roadmap.ends[e, 0], roadmap.ends[e, 1]
        if root_of(roadmap, roadmap.component[x]) != component:
            continue
        i, j = roadmap.cell[x], roadmap.cell[y]
        if i > j:
            i, j = j, i
        # Pairs are sorted: bisect.
        low, high = 0, pairs.shape[0]
        while low < high:
            middle = (low + high) // 2
            if pairs[middle, 0] < i or (pairs[middle, 0] == i and pairs[middle, 1] < j):
                low = middle + 1
            else:
                high = middle
        if low < pairs.shape[0] and pairs[low, 0] == i and pairs[low, 1] == j:
            state[low] = 1
