"""Covering walks: edges of one component in a row, one continuous motion over its cells.

The walk goes to the nearest cell that it has not visited, and among equally near ones by
Warnsdorff's rule. The witness repeats stored edges.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coverable_arrays import Array, Ints, Mask
from coverable_kernels import allocating, allocating_entry, put
from feasibility.roadmap.graph import EDGES, NODES, Roadmap, root_of
from feasibility.verdict import Walk

ZERO, NONE = np.int64(0), np.int64(-1)


class Links(NamedTuple):
    """The motions of one component, in CSR form."""

    inside: Mask
    """(nodes,) which nodes are the component's."""
    indptr: Ints
    """(nodes + 1,) the steps from node x are rows indptr[x] to indptr[x + 1]."""
    steps: Ints
    """(2 edges, 2) the node that a step leads to, and its edge + 1, negative if run backwards."""


@allocating_entry
def _adjacency(roadmap, component):  # type: ignore[no-untyped-def]
    """The arrays of `Links`."""
    nodes = roadmap.counters[NODES]
    edges = roadmap.counters[EDGES]
    inside = np.empty(nodes, dtype=np.bool_)
    for x in range(nodes):
        inside[x] = root_of(roadmap, roadmap.component[x]) == component
    indptr = _filled(nodes + 1, ZERO)
    for e in range(edges):
        if inside[roadmap.ends[e, 0]]:
            indptr[roadmap.ends[e, 0] + 1] += 1
            indptr[roadmap.ends[e, 1] + 1] += 1
    for x in range(nodes):
        indptr[x + 1] += indptr[x]
    fill = np.empty(nodes, dtype=np.int64)
    put(fill, indptr)
    steps = np.empty((indptr[nodes], 2), dtype=np.int64)
    for e in range(edges):
        x, y = roadmap.ends[e, 0], roadmap.ends[e, 1]
        if inside[x]:
            steps[fill[x], 0] = y
            steps[fill[x], 1] = e + 1
            fill[x] += 1
            steps[fill[y], 0] = x
            steps[fill[y], 1] = -(e + 1)
            fill[y] += 1
    return inside, indptr, steps


@allocating
def _filled(size, value):  # type: ignore[no-untyped-def]
    """(size,) integers, all the same."""
    result = np.empty(size, dtype=np.int64)
    for k in range(size):
        result[k] = value
    return result


@allocating
def _appended(route, length, path):  # type: ignore[no-untyped-def]
    """The route with more signed edges behind its first `length`, in an array that holds them."""
    more = path.shape[0]
    if length + more > route.shape[0]:
        wider = np.empty(2 * (length + more), dtype=np.int64)
        for k in range(length):
            wider[k] = route[k]
        route = wider
    for k in range(more):
        route[length + k] = path[k]
    return route


@allocating
def _open_ends(roadmap, links, wanted, node):  # type: ignore[no-untyped-def]
    """Number of steps from a node to wanted cells."""
    count = 0
    for k in range(links.indptr[node], links.indptr[node + 1]):
        if wanted[roadmap.cell[links.steps[k, 0]]]:
            count += 1
    return count


@allocating
def _to_nearest(roadmap, links, wanted, here, turn, search, first):  # type: ignore[no-untyped-def]
    """Signed edges of a shortest path to a node over a wanted cell, and that node.

    Among equally near nodes the one with the fewest steps to wanted cells is taken (Warnsdorff's
    rule, so that corners are not left behind).

    Args:
        roadmap, links: the `Roadmap`, and the motions of the component.
        wanted: (N,) cells.
        here: the node where the path begins.
        turn: another number for each search, from 1 on.
        search: (nodes, 4) for each node the last search that visited it, zero at first, the step
            that led to it and the node before it; and the queue.
        first: take the first node found that is more than one edge away, without the rule.

    Returns:
        No edges and -1 where there is no such node.
    """
    stamp, came, before, queue = search[:, 0], search[:, 1], search[:, 2], search[:, 3]
    head, tail, ring = 0, 1, 1
    found, fewest = -1, 1 << 60
    queue[0] = here
    stamp[here] = turn
    while head < tail:
        if head == ring:  # all nodes up to this distance have been visited
            if found >= 0:
                break
            ring = tail
        x = queue[head]
        head += 1
        for k in range(links.indptr[x], links.indptr[x + 1]):
            y = links.steps[k, 0]
            if stamp[y] == turn:
                continue
            stamp[y], came[y], before[y], queue[tail] = turn, k, x, y
            tail += 1
            if wanted[roadmap.cell[y]]:
                open_ends = -1 if first and x != here else _open_ends(roadmap, links, wanted, y)
                if open_ends < fewest:
                    found, fewest = y, open_ends
    steps = 0
    x = found
    while found >= 0 and x != here:
        steps += 1
        x = before[x]
    path = np.empty(steps, dtype=np.int64)
    x = found
    for k in range(steps):
        path[steps - 1 - k] = links.steps[came[x], 1]
        x = before[x]
    return path, found


@allocating_entry
def _route(roadmap, links, wanted, start, first):  # type: ignore[no-untyped-def]
    """Signed edges of a walk from a node through the wanted cells, always to the nearest one.

    `wanted` (N,) is cleared where the walk passes; cells that no motion leads to stay set.
    """
    nodes = links.inside.shape[0]
    remaining = 0
    for k in range(wanted.shape[0]):
        remaining += wanted[k]
    search = np.zeros((nodes, 4), dtype=np.int64)
    route, length = np.empty(4 * nodes + 16, dtype=np.int64), 0
    here = start
    while here >= 0:
        if wanted[roadmap.cell[here]]:
            wanted[roadmap.cell[here]] = False
            remaining -= 1
        if remaining == 0:
            break
        # The number of cells left is different each time.
        path, here = _to_nearest(roadmap, links, wanted, here, remaining, search, first)
        route = _appended(route, length, path)
        length += path.shape[0]
    return route[:length]


@allocating_entry
def _string(roadmap, start, route):  # type: ignore[no-untyped-def]
    """Waypoints and cell marks of a route."""
    total = 1
    for k in range(route.shape[0]):
        total += roadmap.edge_rows[abs(route[k]) - 1, 1]
    n = roadmap.q.shape[1]
    q = np.empty((total, n))
    cell = _filled(total, NONE)
    put(q[0], roadmap.q[start])
    cell[0] = roadmap.cell[start]
    row = 1
    for k in range(route.shape[0]):
        e = abs(route[k]) - 1
        first, rows = roadmap.edge_rows[e, 0], roadmap.edge_rows[e, 1]
        if route[k] > 0:
            for i in range(rows):
                put(q[row + i], roadmap.waypoints[first + i])
            node = roadmap.ends[e, 1]
        else:
            for i in range(rows - 1):
                put(q[row + i], roadmap.waypoints[first + rows - 2 - i])
            node = roadmap.ends[e, 0]
            put(q[row + rows - 1], roadmap.q[node])
        row += rows
        cell[row - 1] = roadmap.cell[node]
    return q, cell


def links_of(roadmap: Roadmap, component: int) -> Links:
    """The motions inside a root component."""
    return Links(*_adjacency(roadmap, component))


def covering_walk(roadmap: Roadmap, component: int, start: int | None = None) -> Walk:
    """One continuous motion through every cell that a root component covers, at least one.

    It begins at the node `start`, at any by default; consecutive waypoints lie on certified
    segments of the roadmap's edges.
    """
    links = links_of(roadmap, component)
    if start is None:  # a node with the fewest steps: corners are best visited first
        steps = np.where(links.inside, np.diff(links.indptr), len(links.steps) + 1)
        start = int(np.argmin(steps))
    wanted = roadmap.cover[component].astype(bool)
    return Walk(*_string(roadmap, start, _route(roadmap, links, wanted, start, True)))


def route_walk(roadmap: Roadmap, start: int, route: Ints) -> Walk:
    """The motion from a node along a route.

    The route is of edges + 1, negative where one is run backwards, each from the end of the last.
    """
    return Walk(*_string(roadmap, start, route))


def patch_walk(roadmap: Roadmap, links: Links, wanted: Mask, start: int) -> Walk:
    """One continuous motion through the wanted cells: the motion that covers one patch.

    It may lead over any cell of the component; only the wanted ones have to be visited.

    Args:
        roadmap, links: the roadmap, and the motions of the component.
        wanted: (N,) cells to visit; the component covers them.
        start: a node of the component over a wanted cell.

    Raises:
        ValueError: the component does not reach a wanted cell.
    """
    left = np.array(wanted)
    route = _route(roadmap, links, left, start, False)
    if left.any():
        raise ValueError(f"no motion of the component leads to cell {int(np.argmax(left))}")
    return Walk(*_string(roadmap, start, route))


def edge_motion(roadmap: Roadmap, edge: int) -> Array:
    """(k, n) waypoints of one edge, from its first node to its second, both included."""
    first, rows = roadmap.edge_rows[edge]
    start = roadmap.q[roadmap.ends[edge, 0]]
    return np.vstack([start[None], roadmap.waypoints[first : first + rows]])
