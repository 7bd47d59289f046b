"""The roadmap of the complete search: (cell, configuration) nodes joined by certified motions.

The paper keeps one configuration a cell, so its answer depends on where it starts. Here a cell may
hold many nodes, one for each connected component that was found over it, and a union-find says
which nodes one continuous motion can visit. A component that covers every cell is a covering
motion; cells that no component shares with the best one are what the surface is missing.

The arrays live in Python and grow there; the compiled loops fill them and come back when an array
is full, when their budget is spent (so that Ctrl-C and time limits work), or when they are done.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from feasibility.continuation import Problem, connect, correct, effects, place, settle, track

NODES, EDGES, WAYS, COMPONENTS, HEAD, TAIL, CURSOR, BEST = range(8)
"""Places in `Roadmap.counters`."""
DONE, BUDGET, FULL, COVERED = range(4)
"""Why a compiled loop came back."""
MOST_FAILURES = 12  # failed connections after which a pair of components is left alone
MOST_RIVALS = 6  # other components that an arrival tries to join, the nearest first
CONNECT_STEPS = 60  # steps of one self-motion


class Roadmap(NamedTuple):
    """The search's state as plain arrays; rows beyond the counters are unused."""

    cell: NDArray[np.int64]
    """(nodes,) the cell of each node."""
    q: NDArray[np.float64]
    """(nodes, n) the configuration of each node, over its cell's centre."""
    effect: NDArray[np.float64]
    """(nodes, n) how much each joint moves the tool there, see `continuation.effects`."""
    component: NDArray[np.int64]
    """(nodes,) the component slot that the node was made in; `root_of` gives the present one."""
    following: NDArray[np.int64]
    """(nodes,) next node over the same cell, -1 at the end."""
    first_node: NDArray[np.int64]
    """(N,) first node over each cell, -1 where there is none."""
    queue: NDArray[np.int64]
    """(nodes,) nodes that are still to be spread from."""
    ends: NDArray[np.int64]
    """(edges, 2) nodes that each edge joins."""
    way: NDArray[np.int64]
    """(edges, 2) first row and number of rows of the edge's waypoints in `ways`."""
    ways: NDArray[np.float64]
    """(rows, n) waypoints of all edges; an edge's start is not among them, its end is."""
    parent: NDArray[np.int64]
    """(components,) union-find over component slots."""
    cover: NDArray[np.uint8]
    """(components, N) cells that each root component covers."""
    size: NDArray[np.int64]
    """(components,) number of cells that each root component covers."""
    failures: NDArray[np.int64]
    """(components, components) failed connections between two root components."""
    blocked: NDArray[np.int64]
    """(N, 2) why the last motion into each cell stopped: a code of `continuation`, and a joint."""
    counters: NDArray[np.int64]
    """(8,) see NODES ... BEST."""


def empty_roadmap(cells: int, n: int) -> Roadmap:
    """A roadmap without nodes, with room for one node a cell."""
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
        way=np.empty((4 * nodes, 2), dtype=np.int64),
        ways=np.empty((16 * nodes, n)),
        parent=np.arange(components),
        cover=np.zeros((components, cells), dtype=np.uint8),
        size=np.zeros(components, dtype=np.int64),
        failures=np.zeros((components, components), dtype=np.int64),
        blocked=np.zeros((cells, 2), dtype=np.int64),
        counters=np.zeros(8, dtype=np.int64),
    )


def grown(roadmap: Roadmap) -> Roadmap:
    """The same roadmap with room for more wherever an array is nearly full."""

    def longer(array: NDArray, used: int, room: int) -> NDArray:
        if used + room <= len(array):
            return array
        result = np.zeros((2 * len(array) + room, *array.shape[1:]), dtype=array.dtype)
        result[: len(array)] = array
        return result

    count = roadmap.counters
    fields = roadmap._asdict()
    for name in ("cell", "q", "effect", "component", "following"):
        fields[name] = longer(fields[name], count[NODES], 8)
    fields["queue"] = longer(fields["queue"], count[TAIL], 8)
    for name in ("ends", "way"):
        fields[name] = longer(fields[name], count[EDGES], 16)
    fields["ways"] = longer(fields["ways"], count[WAYS], 4096)
    slots = len(roadmap.parent)
    if count[COMPONENTS] + 2 > slots:
        fields["parent"] = np.concatenate([roadmap.parent, np.arange(slots, 2 * slots)])
        fields["cover"] = longer(roadmap.cover, slots, 1)[: 2 * slots]
        fields["size"] = longer(roadmap.size, slots, 1)[: 2 * slots]
        failures = np.zeros((2 * slots, 2 * slots), dtype=np.int64)
        failures[:slots, :slots] = roadmap.failures
        fields["failures"] = failures
    return Roadmap(**fields)


@njit(cache=True)
def root_of(roadmap, slot):  # type: ignore[no-untyped-def]
    """The root component of a slot; paths are halved on the way."""
    while roadmap.parent[slot] != slot:
        roadmap.parent[slot] = roadmap.parent[roadmap.parent[slot]]
        slot = roadmap.parent[slot]
    return slot


@njit(cache=True)
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


@njit(cache=True)
def add_node(problem, work, roadmap, cell, q, component):  # type: ignore[no-untyped-def]
    """Append a node to a component, and queue it; returns its index."""
    count = roadmap.counters
    node = count[NODES]
    roadmap.cell[node] = cell
    for j in range(q.shape[0]):
        roadmap.q[node, j] = q[j]
    place(problem, work, 1, q)
    effects(problem, work, 1, roadmap.effect[node])
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


@njit(cache=True)
def add_edge(roadmap, x, y, rows):  # type: ignore[no-untyped-def]
    """Append an edge whose waypoints are the next `rows` rows of `ways`."""
    count = roadmap.counters
    edge = count[EDGES]
    roadmap.ends[edge, 0] = x
    roadmap.ends[edge, 1] = y
    roadmap.way[edge, 0] = count[WAYS]
    roadmap.way[edge, 1] = rows
    count[EDGES] += 1
    count[WAYS] += rows


@njit(cache=True)
def _rival(roadmap, cell, q, own, tried, most):  # type: ignore[no-untyped-def]
    """The node over `cell` nearest to q in a component that is neither `own` nor tried; or -1."""
    best, nearest = -1, np.inf
    node = roadmap.first_node[cell]
    while node >= 0:
        component = root_of(roadmap, roadmap.component[node])
        fresh = component != own
        for k in range(tried.shape[0]):
            if tried[k] == component:
                fresh = False
        if fresh and (own < 0 or roadmap.failures[own, component] < most):
            distance = 0.0
            for j in range(q.shape[0]):
                distance += ((roadmap.q[node, j] - q[j]) * roadmap.effect[node, j]) ** 2
            if distance < nearest:
                best, nearest = node, distance
        node = roadmap.following[node]
    return best


@njit(cache=True)
def join(problem, work, roadmap, cell, q, own, rows, most):  # type: ignore[no-untyped-def]
    """Try to reach, by self-motion from q over `cell`, a node of another component.

    Waypoints go to `ways` behind the `rows` rows that are pending there.

    Returns:
        (node, rows written), or (-1, 0); (-1, -2) when `ways` is full.
    """
    tried = np.full(MOST_RIVALS, -1, dtype=np.int64)
    here = np.empty_like(q)
    for k in range(MOST_RIVALS):
        node = _rival(roadmap, cell, q, own, tried, most)
        if node < 0:
            break
        tried[k] = root_of(roadmap, roadmap.component[node])
        here[:] = q
        written, reached = connect(
            problem, work, problem.points[cell], problem.approaches[cell], here, roadmap.q[node],
            roadmap.ways, roadmap.counters[WAYS] + rows, CONNECT_STEPS,
        )  # fmt: skip
        if written == -2:
            return -1, -2
        if reached:
            return node, written
        if own >= 0:
            roadmap.failures[own, tried[k]] += 1
            roadmap.failures[tried[k], own] += 1
    return -1, 0


@njit(cache=True)
def spread_out(problem, work, roadmap, indptr, indices, budget):  # type: ignore[no-untyped-def]
    """Spread every queued node into the neighbouring cells that its component does not cover yet.

    Returns DONE when the queue is empty, COVERED when a component covers every cell, BUDGET after
    `budget` evaluations of the arm, FULL when an array has no room left; call again to go on.
    """
    count = roadmap.counters
    cells = roadmap.first_node.shape[0]
    q = np.empty(roadmap.q.shape[1])
    stop = work.count[0] + budget
    while count[HEAD] < count[TAIL]:
        x = roadmap.queue[count[HEAD]]
        cell = roadmap.cell[x]
        first, last = indptr[cell], indptr[cell + 1]
        while first + count[CURSOR] < last:
            if work.count[0] > stop:
                return BUDGET
            if count[NODES] + 2 > roadmap.cell.shape[0] or count[EDGES] + 2 > len(roadmap.ends):
                return FULL
            if count[TAIL] + 2 > roadmap.queue.shape[0]:
                return FULL
            target = indices[first + count[CURSOR]]
            own = root_of(roadmap, roadmap.component[x])
            if roadmap.cover[own, target]:
                count[CURSOR] += 1
                continue
            q[:] = roadmap.q[x]
            rows = track(
                problem, work, problem.points[cell], problem.points[target], q, q, False,
                roadmap.ways, count[WAYS],
            )  # fmt: skip
            if rows == -2:
                return FULL
            count[CURSOR] += 1
            if rows < 0:
                roadmap.blocked[target, 0] = work.blame[0]
                roadmap.blocked[target, 1] = work.blame[1]
                continue
            node, more = join(problem, work, roadmap, target, q, own, rows, MOST_FAILURES)
            if more == -2:
                count[CURSOR] -= 1
                return FULL
            if node >= 0:
                add_edge(roadmap, x, node, rows + more)
                own = unite(roadmap, own, roadmap.component[node])
            else:
                node = add_node(problem, work, roadmap, target, q, own)
                add_edge(roadmap, x, node, rows)
            if roadmap.size[own] == cells:
                return COVERED
        count[HEAD] += 1
        count[CURSOR] = 0
    return DONE


@njit(cache=True)
def roomy(problem, work, cell, guesses):  # type: ignore[no-untyped-def]
    """Put guesses (in place) onto the fibre over a cell, and say how much room each has.

    Returns:
        (k,) the share of its half range, or of the cone, that the tightest constraint leaves free:
        1 in the middle of everything, 0 at a limit or at the rim, -1 where Newton failed.
    """
    room = np.full(guesses.shape[0], -1.0)
    for g in range(guesses.shape[0]):
        q = guesses[g]
        for k in range(3):
            work.target[0, k] = problem.points[cell, k]
            work.target[1, k] = problem.approaches[cell, k]
        place(problem, work, 1, q)
        work.wish[:] = 0.0
        if not correct(problem, work, q, 1e-6, np.inf, 60):
            continue
        settle(problem, work, problem.points[cell], problem.approaches[cell], q, 40)
        room[g] = max(0.0, 1.0 - work.error[0, 1] / problem.rim)
        for j in range(q.shape[0]):
            half = 0.5 * (problem.upper[j] - problem.lower[j])
            if half > 0.0 and half < np.inf:
                room[g] = min(room[g], 1.0 - abs((q[j] - problem.lower[j]) / half - 1.0))
    return room


@njit(cache=True)
def seed_cell(problem, work, roadmap, cell, guesses):  # type: ignore[no-untyped-def]
    """Newton from guesses to configurations over one cell's centre; new ones become components.

    Args:
        problem: the `Problem`.
        work: the `Work`.
        roadmap: the `Roadmap`; needs room for a node and a component per guess, see `grown`.
        cell: the cell.
        guesses: (k, n) configurations inside the limits.

    Returns:
        (configurations found, new components made).
    """
    count = roadmap.counters
    found, made = 0, 0
    q = np.empty(guesses.shape[1])
    for g in range(guesses.shape[0]):
        if count[COMPONENTS] >= roadmap.parent.shape[0]:
            break
        if count[NODES] + 2 > roadmap.cell.shape[0] or count[EDGES] + 2 > len(roadmap.ends):
            break
        if count[TAIL] + 2 > roadmap.queue.shape[0]:
            break
        q[:] = guesses[g]
        for k in range(3):
            work.target[0, k] = problem.points[cell, k]
            work.target[1, k] = problem.approaches[cell, k]
        place(problem, work, 1, q)
        work.wish[:] = 0.0
        if not correct(problem, work, q, 1e-6, np.inf, 60):
            continue
        found += 1
        settle(problem, work, problem.points[cell], problem.approaches[cell], q, 40)
        node, more = join(problem, work, roadmap, cell, q, -1, 0, 0)
        if node >= 0:
            continue
        component = count[COMPONENTS]
        count[COMPONENTS] += 1
        add_node(problem, work, roadmap, cell, q, component)
        made += 1
    return found, made


@njit(cache=True)
def stir(problem, work, roadmap, cell, guesses, most):  # type: ignore[no-untyped-def]
    """Explore the fibre over one cell from the nodes there, and join the components that meet.

    A rapidly exploring tree for each component: the node nearest to a random point of the fibre
    moves towards it as far as the fibre lets it, and from there tries to reach the other
    components. New nodes are queued, because they may reach a neighbouring cell that the old ones
    could not.

    Args:
        problem: the `Problem`.
        work: the `Work`.
        roadmap: the `Roadmap`.
        cell: the cell.
        guesses: (k, n) random configurations.
        most: failed connections after which two components are left alone.

    Returns:
        (status, guesses used, mergers): status is DONE, or FULL when an array has no room.
    """
    count = roadmap.counters
    merged = 0
    q = np.empty(guesses.shape[1])
    tried = np.empty(MOST_RIVALS, dtype=np.int64)
    aimed = np.empty(guesses.shape[1])
    for g in range(guesses.shape[0]):
        tried[:] = -1
        for k in range(MOST_RIVALS):
            if count[NODES] + 2 > roadmap.cell.shape[0] or count[EDGES] + 3 > len(roadmap.ends):
                return FULL, g, merged
            if count[TAIL] + 2 > roadmap.queue.shape[0]:
                return FULL, g, merged
            if k == 0:
                # Aim at a point of the fibre: a random guess, put onto it.
                aimed[:] = guesses[g]
                for i in range(3):
                    work.target[0, i] = problem.points[cell, i]
                    work.target[1, i] = problem.approaches[cell, i]
                place(problem, work, 1, aimed)
                work.wish[:] = 0.0
                if not correct(problem, work, aimed, 1e-6, np.inf, 30):
                    break
            node = _rival(roadmap, cell, aimed, -1, tried, 0)
            if node < 0:
                break
            own = root_of(roadmap, roadmap.component[node])
            tried[k] = own
            q[:] = roadmap.q[node]
            rows, _ = connect(
                problem, work, problem.points[cell], problem.approaches[cell], q, aimed,
                roadmap.ways, count[WAYS], CONNECT_STEPS,
            )  # fmt: skip
            if rows == -2:
                return FULL, g, merged
            if rows < 2:
                continue
            new = add_node(problem, work, roadmap, cell, q, own)
            add_edge(roadmap, node, new, rows)
            rival, more = join(problem, work, roadmap, cell, q, own, 0, most)
            if more == -2:
                return FULL, g, merged
            if rival >= 0:
                add_edge(roadmap, new, rival, more)
                unite(roadmap, own, roadmap.component[rival])
                merged += 1
    return DONE, guesses.shape[0], merged


@njit(cache=True)
def close_pairs(problem, work, roadmap, pairs, state, component, budget):  # type: ignore[no-untyped-def]
    """Try to join every neighbouring pair of cells inside one component by a motion of its own.

    Args:
        problem: the `Problem`.
        work: the `Work`.
        roadmap: the `Roadmap`.
        pairs: (M, 2) neighbouring cells.
        state: (M + 1,) 1 where the pair has an edge, 2 where none was found; the last entry is
            the next pair to look at. Filled here.
        component: the root component.
        budget: evaluations of the arm before coming back.

    Returns:
        DONE, BUDGET or FULL, as `spread_out`.
    """
    count = roadmap.counters
    stop = work.count[0] + budget
    q = np.empty(roadmap.q.shape[1])
    m = pairs.shape[0]
    while state[m] < m:
        k = state[m]
        if state[k] == 0:
            if work.count[0] > stop:
                return BUDGET
            if count[EDGES] + 2 > len(roadmap.ends):
                return FULL
            best_x, best_y, nearest = -1, -1, np.inf
            x = roadmap.first_node[pairs[k, 0]]
            while x >= 0:
                if root_of(roadmap, roadmap.component[x]) == component:
                    y = roadmap.first_node[pairs[k, 1]]
                    while y >= 0:
                        if root_of(roadmap, roadmap.component[y]) == component:
                            distance = 0.0
                            for j in range(q.shape[0]):
                                distance += (roadmap.q[x, j] - roadmap.q[y, j]) ** 2
                            if distance < nearest:
                                best_x, best_y, nearest = x, y, distance
                        y = roadmap.following[y]
                x = roadmap.following[x]
            state[k] = 2
            if best_x >= 0:
                for attempt in range(4):
                    a, b = (best_x, best_y) if attempt % 2 == 0 else (best_y, best_x)
                    i, j = roadmap.cell[a], roadmap.cell[b]
                    q[:] = roadmap.q[a]
                    rows = track(
                        problem, work, problem.points[i], problem.points[j], q, roadmap.q[b],
                        attempt < 2, roadmap.ways, count[WAYS],
                    )  # fmt: skip
                    if rows == -2:
                        state[k] = 0
                        return FULL
                    if rows < 0:
                        continue
                    more, reached = connect(
                        problem, work, problem.points[j], problem.approaches[j], q, roadmap.q[b],
                        roadmap.ways, count[WAYS] + rows, CONNECT_STEPS,
                    )  # fmt: skip
                    if more == -2:
                        state[k] = 0
                        return FULL
                    if reached:
                        add_edge(roadmap, a, b, rows + more)
                        state[k] = 1
                        break
        state[m] += 1
    return DONE


@njit(cache=True)
def joined_pairs(roadmap, pairs, component, state):  # type: ignore[no-untyped-def]
    """Mark the pairs of cells that an edge of the component joins already (state = 1)."""
    for e in range(roadmap.counters[EDGES]):
        x, y = roadmap.ends[e]
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


__all__ = ["Problem", "Roadmap", "close_pairs", "empty_roadmap", "grown", "seed_cell", "spread_out"]
