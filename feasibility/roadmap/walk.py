"""A covering walk: edges of one component strung together into one continuous motion."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from feasibility.compiled import kernel, put
from feasibility.roadmap.graph import EDGES, NODES, Roadmap, root_of
from feasibility.verdict import Walk

ZERO, NONE = np.int64(0), np.int64(-1)


@kernel
def _adjacency(roadmap, component):  # type: ignore[no-untyped-def]
    """CSR lists of (node, edge + 1, negative when walked backwards) for one component."""
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
    links = np.empty((indptr[nodes], 2), dtype=np.int64)
    for e in range(edges):
        x, y = roadmap.ends[e, 0], roadmap.ends[e, 1]
        if inside[x]:
            links[fill[x], 0] = y
            links[fill[x], 1] = e + 1
            fill[x] += 1
            links[fill[y], 0] = x
            links[fill[y], 1] = -(e + 1)
            fill[y] += 1
    return inside, indptr, links


@kernel
def _filled(size, value):  # type: ignore[no-untyped-def]
    """(size,) whole numbers, all the same."""
    result = np.empty(size, dtype=np.int64)
    for k in range(size):
        result[k] = value
    return result


@kernel
def _appended(route, length, links):  # type: ignore[no-untyped-def]
    """The route with more signed edges behind its first `length`, in an array with room for it."""
    more = links.shape[0]
    if length + more > route.shape[0]:
        wider = np.empty(2 * (length + more), dtype=np.int64)
        for k in range(length):
            wider[k] = route[k]
        route = wider
    for k in range(more):
        route[length + k] = links[k]
    return route


@kernel
def _next_node(roadmap, indptr, links, seen, here):  # type: ignore[no-untyped-def]
    """The link to the neighbour over an unseen cell that has fewest unseen ones itself; or -1.

    Warnsdorff's rule: so that corners are not left behind.
    """
    best, fewest = -1, 1 << 60
    for k in range(indptr[here], indptr[here + 1]):
        y = links[k, 0]
        if seen[roadmap.cell[y]]:
            continue
        open_ends = 0
        for i in range(indptr[y], indptr[y + 1]):
            if not seen[roadmap.cell[links[i, 0]]]:
                open_ends += 1
        if open_ends < fewest:
            best, fewest = k, open_ends
    return best


@kernel
def _to_nearest_unseen(roadmap, indptr, links, seen, here, turn, search):  # type: ignore[no-untyped-def]
    """Signed edges of a shortest path to a node over an unseen cell, and that node.

    Args:
        roadmap: the `Roadmap`.
        indptr: see `_adjacency`.
        links: the same.
        seen: (N,) cells.
        here: where the path begins.
        turn: another number for each search, from 1 on.
        search: (nodes, 4) for each node the last search that met it, zero at first, the link by
            which it was met and the node before it; and the queue.

    Returns:
        No edges and -1 where there is no such node.
    """
    stamp, came, before, queue = search[:, 0], search[:, 1], search[:, 2], search[:, 3]
    head, tail, found = 0, 1, -1
    queue[0] = here
    stamp[here] = turn
    while head < tail and found < 0:
        x = queue[head]
        head += 1
        for k in range(indptr[x], indptr[x + 1]):
            y = links[k, 0]
            if stamp[y] == turn:
                continue
            stamp[y], came[y], before[y] = turn, k, x
            if not seen[roadmap.cell[y]]:
                found = y
                break
            queue[tail] = y
            tail += 1
    steps = 0
    x = found
    while found >= 0 and x != here:
        steps += 1
        x = before[x]
    path = np.empty(steps, dtype=np.int64)
    x = found
    for k in range(steps):
        path[steps - 1 - k] = links[came[x], 1]
        x = before[x]
    return path, found


@kernel
def _route(roadmap, component):  # type: ignore[no-untyped-def]
    """Signed edges of a walk that visits every cell of a component, and the node it starts at.

    Steps to a neighbour over an unvisited cell while there is one; from a dead end, along a
    shortest path to the nearest node over such a cell.
    """
    inside, indptr, links = _adjacency(roadmap, component)
    nodes = inside.shape[0]
    seen = np.empty(roadmap.first_node.shape[0], dtype=np.bool_)
    remaining = 0
    for k in range(seen.shape[0]):
        seen[k] = not roadmap.cover[component, k]
        if not seen[k]:
            remaining += 1
    # Start where there is least room: at a node of smallest degree.
    start, fewest = -1, 1 << 60
    for x in range(nodes):
        if inside[x] and indptr[x + 1] - indptr[x] < fewest:
            start, fewest = x, indptr[x + 1] - indptr[x]
    search = np.zeros((nodes, 4), dtype=np.int64)
    route, length = np.empty(4 * nodes + 16, dtype=np.int64), 0
    here = start
    seen[roadmap.cell[here]] = True
    remaining -= 1
    while remaining > 0:
        link = _next_node(roadmap, indptr, links, seen, here)
        if link >= 0:
            route = _appended(route, length, links[link : link + 1, 1])
            length += 1
            here = links[link, 0]
        else:
            # The cells left are another number each time.
            path, here = _to_nearest_unseen(roadmap, indptr, links, seen, here, remaining, search)
            if here < 0:
                return start, route[:0]  # not connected: an error of the caller's
            route = _appended(route, length, path)
            length += path.shape[0]
        seen[roadmap.cell[here]] = True
        remaining -= 1
    return start, route[:length]


@kernel
def _string(roadmap, start, route):  # type: ignore[no-untyped-def]
    """Waypoints and cell marks of a route."""
    total = 1
    for k in range(route.shape[0]):
        total += roadmap.way[abs(route[k]) - 1, 1]
    n = roadmap.q.shape[1]
    q = np.empty((total, n))
    cell = _filled(total, NONE)
    put(q[0], roadmap.q[start])
    cell[0] = roadmap.cell[start]
    row = 1
    for k in range(route.shape[0]):
        e = abs(route[k]) - 1
        first, rows = roadmap.way[e, 0], roadmap.way[e, 1]
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


def covering_walk(roadmap: Roadmap, component: int) -> Walk:
    """One continuous motion through every cell that a component covers.

    Args:
        roadmap: the roadmap.
        component: a root component that covers at least one cell.

    Returns:
        The walk; consecutive waypoints lie on certified segments of the roadmap's edges.
    """
    start, route = _route(roadmap, component)
    q, cell = _string(roadmap, start, route)
    return Walk(q=q, cell=cell)


def edge_motion(roadmap: Roadmap, edge: int) -> NDArray[np.float64]:
    """(k, n) waypoints of one edge, from its first node to its second, both included."""
    first, rows = roadmap.way[edge]
    start = roadmap.q[roadmap.ends[edge, 0]]
    return np.vstack([start[None], roadmap.waypoints[first : first + rows]])
