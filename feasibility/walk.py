"""A covering walk: edges of one component strung together into one continuous motion."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from feasibility.kernels import kernel, put
from feasibility.roadmap import EDGES, NODES, Roadmap, root_of
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
def _longer(route):  # type: ignore[no-untyped-def]
    """The same route with twice the room."""
    result = np.empty(2 * route.shape[0], dtype=np.int64)
    for k in range(route.shape[0]):
        result[k] = route[k]
    return result


@kernel
def _route(roadmap, component):  # type: ignore[no-untyped-def]
    """Signed edges of a walk that visits every cell of a component, and the node it starts at.

    Steps to the unvisited neighbour that has the fewest unvisited neighbours itself (Warnsdorff's
    rule, so that corners are not left behind); from a dead end, along a shortest path to the
    nearest node over an unvisited cell.
    """
    inside, indptr, links = _adjacency(roadmap, component)
    nodes = inside.shape[0]
    seen = np.empty(roadmap.first_node.shape[0], dtype=np.bool_)
    remaining = 0
    for k in range(seen.shape[0]):
        seen[k] = False
        if roadmap.cover[component, k]:
            remaining += 1
    # Start where there is least room: at a node of smallest degree.
    start, fewest = -1, 1 << 60
    for x in range(nodes):
        if inside[x] and indptr[x + 1] - indptr[x] < fewest:
            start, fewest = x, indptr[x + 1] - indptr[x]
    route = np.empty(4 * nodes + 16, dtype=np.int64)
    length = 0
    came = _filled(nodes, NONE)
    stamp = _filled(nodes, ZERO)
    queue = np.empty(nodes, dtype=np.int64)
    here, turn = start, 0
    seen[roadmap.cell[here]] = True
    remaining -= 1
    while remaining > 0:
        best, best_link, fewest = -1, -1, 1 << 60
        for k in range(indptr[here], indptr[here + 1]):
            y = links[k, 0]
            if seen[roadmap.cell[y]]:
                continue
            open_ends = 0
            for i in range(indptr[y], indptr[y + 1]):
                if not seen[roadmap.cell[links[i, 0]]]:
                    open_ends += 1
            if open_ends < fewest:
                best, best_link, fewest = y, k, open_ends
        if best >= 0:
            path_first = length
            length += 1
            if length >= route.shape[0]:
                route = _longer(route)
            route[path_first] = links[best_link, 1]
            here = best
        else:
            turn += 1
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
                    stamp[y] = turn
                    came[y] = k
                    if not seen[roadmap.cell[y]]:
                        found = y
                        break
                    queue[tail] = y
                    tail += 1
            if found < 0:
                return start, route[:0]  # not connected: an error of the caller's
            steps = 0
            x = found
            while x != here:
                steps += 1
                k = came[x]
                # The link k leaves its owner; the owner is the other end of the edge.
                e = abs(links[k, 1]) - 1
                x = roadmap.ends[e, 0] if links[k, 1] > 0 else roadmap.ends[e, 1]
            while length + steps >= route.shape[0]:
                route = _longer(route)
            x = found
            for i in range(steps):
                k = came[x]
                route[length + steps - 1 - i] = links[k, 1]
                e = abs(links[k, 1]) - 1
                x = roadmap.ends[e, 0] if links[k, 1] > 0 else roadmap.ends[e, 1]
            length += steps
            here = found
        if not seen[roadmap.cell[here]]:
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
                put(q[row + i], roadmap.ways[first + i])
            node = roadmap.ends[e, 1]
        else:
            for i in range(rows - 1):
                put(q[row + i], roadmap.ways[first + rows - 2 - i])
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
    return np.vstack([start[None], roadmap.ways[first : first + rows]])
