"""How the roadmap grows: spreading over the surface, self-motions, closing pairs.

Each kernel connects nodes by motions that `feasibility.roadmap.motions.segment_bound` certifies.
"""

from __future__ import annotations

import numpy as np

from coverable_kernels import allocating, allocating_entry, kernel, put
from feasibility.roadmap.graph import (
    BUDGET,
    COVERED,
    CURSOR,
    DONE,
    FULL,
    HEAD,
    TAIL,
    WAYPOINTS,
    add_edge,
    add_node,
    is_full,
    root_of,
    unite,
)
from feasibility.roadmap.motions import OVERFLOW, connect, look_at, project_near_cell, track

MOST_FAILURES = np.int64(12)  # failed connections after which a pair of components is left alone
MOST_RIVALS = 6  # other components that a new configuration tries to join, the nearest first
CONNECT_STEPS = np.int64(60)  # steps of one self-motion
AIM_STEPS = np.int64(30)  # Newton steps that project a random configuration
NOBODY, NONE = np.int64(-1), np.int64(0)
FREE = np.bool_(False)  # a track without a goal


@kernel
def _nearest_rival(roadmap, cell, q, own, tried, most):
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


@allocating
def join(arrays, work, roadmap, cell, q, own, rows, most):
    """Try to reach, by self-motion from q over `cell`, a node of another component.

    Waypoints go to `roadmap.waypoints` behind the `rows` rows that are pending there.

    Returns:
        (node, rows written), or (-1, 0); (-1, OVERFLOW) when `waypoints` is full.
    """
    tried = np.empty(MOST_RIVALS, dtype=np.int64)
    here = np.empty(q.shape[0])
    for k in range(MOST_RIVALS):
        tried[k] = -1
    for k in range(MOST_RIVALS):
        node = _nearest_rival(roadmap, cell, q, own, tried, most)
        if node < 0:
            break
        tried[k] = root_of(roadmap, roadmap.component[node])
        put(here, q)
        look_at(arrays, work, cell)
        written, reached = connect(
            arrays, work, here, roadmap.q[node], roadmap.waypoints,
            roadmap.counters[WAYPOINTS] + rows, CONNECT_STEPS,
        )  # fmt: skip
        if written == OVERFLOW:
            return -1, OVERFLOW
        if reached:
            return node, written
        if own >= 0:
            roadmap.failures[own, tried[k]] += 1
            roadmap.failures[tried[k], own] += 1
    return -1, 0


@allocating_entry
def spread_out(arrays, work, roadmap, indptr, indices, links, budget):
    """Spread every queued node into the neighbouring cells that its component does not cover yet.

    Args:
        arrays, work, roadmap: the `SearchArrays`, the `Work` and the `Roadmap`.
        indptr, indices: (N + 1,) where each cell's neighbours begin in `indices` (k,).
        links: (k,) the curve to each, see `Neighbours.links`.
        budget: evaluations of the arm before returning.

    Returns:
        DONE when the queue is empty, COVERED when a component covers every cell, BUDGET after
        `budget` evaluations of the arm, FULL when an array is full; call again to continue.
    """
    count = roadmap.counters
    cells = roadmap.first_node.shape[0]
    q = np.empty(roadmap.q.shape[1])
    stop = work.counts[0] + budget
    while count[HEAD] < count[TAIL]:
        x = roadmap.queue[count[HEAD]]
        cell = roadmap.cell[x]
        first, last = indptr[cell], indptr[cell + 1]
        while first + count[CURSOR] < last:
            if work.counts[0] > stop:
                return BUDGET
            if is_full(roadmap):
                return FULL
            target = indices[first + count[CURSOR]]
            own = root_of(roadmap, roadmap.component[x])
            if roadmap.cover[own, target]:
                count[CURSOR] += 1
                continue
            put(q, roadmap.q[x])
            begin, end = (0.0, 1.0) if cell < target else (1.0, 0.0)
            rows = track(
                arrays, work, links[first + count[CURSOR]], begin, end, q, q, FREE,
                roadmap.waypoints, count[WAYPOINTS],
            )  # fmt: skip
            if rows == OVERFLOW:
                return FULL
            count[CURSOR] += 1
            if rows < 0:
                former = roadmap.blocked[target, 2]
                if former < 0 or roadmap.size[own] >= roadmap.size[root_of(roadmap, former)]:
                    roadmap.blocked[target, 0] = work.stop_reason[0]
                    roadmap.blocked[target, 1] = work.stop_reason[1]
                    roadmap.blocked[target, 2] = own
                continue
            node, more = join(arrays, work, roadmap, target, q, own, rows, MOST_FAILURES)
            if more == OVERFLOW:
                count[CURSOR] -= 1
                return FULL
            if node >= 0:
                add_edge(roadmap, x, node, rows + more)
                own = unite(roadmap, own, roadmap.component[node])
            else:
                node = add_node(arrays, work, roadmap, target, q, own)
                add_edge(roadmap, x, node, rows)
            if roadmap.size[own] == cells:
                return COVERED
        count[HEAD] += 1
        count[CURSOR] = 0
    return DONE


@allocating_entry
def explore_self_motions(arrays, work, roadmap, cell, guesses, most):
    """Explore the self-motion manifold over one cell, and merge the components that it connects.

    A rapidly exploring random tree for each component: the node nearest to a random configuration
    of the manifold moves towards it as far as it can, and from there tries to join the other
    components. New nodes are queued, because they may reach a neighbouring cell that the old ones
    could not.

    Args:
        arrays, work, roadmap, cell: as in `seed_cell`.
        guesses: (k, n) random configurations.
        most: failed connections after which two components are left alone.

    Returns:
        (status, guesses used, mergers): status is DONE, or FULL when an array is full.
    """
    count = roadmap.counters
    merged = 0
    q = np.empty(guesses.shape[1])
    tried = np.empty(MOST_RIVALS, dtype=np.int64)
    goal = np.empty(guesses.shape[1])
    for g in range(guesses.shape[0]):
        for k in range(MOST_RIVALS):
            tried[k] = -1
        for k in range(MOST_RIVALS):
            if is_full(roadmap):
                return FULL, g, merged
            if k == 0:
                # Head for a random configuration of the manifold.
                put(goal, guesses[g])
                if not project_near_cell(arrays, work, cell, goal, AIM_STEPS):
                    break
            node = _nearest_rival(roadmap, cell, goal, NOBODY, tried, NONE)
            if node < 0:
                break
            own = root_of(roadmap, roadmap.component[node])
            tried[k] = own
            put(q, roadmap.q[node])
            look_at(arrays, work, cell)
            rows, _ = connect(
                arrays, work, q, goal, roadmap.waypoints, count[WAYPOINTS], CONNECT_STEPS
            )
            if rows == OVERFLOW:
                return FULL, g, merged
            if rows < 2:
                continue
            new = add_node(arrays, work, roadmap, cell, q, own)
            add_edge(roadmap, node, new, rows)
            rival, more = join(arrays, work, roadmap, cell, q, own, NONE, most)
            if more == OVERFLOW:
                return FULL, g, merged
            if rival >= 0:
                add_edge(roadmap, new, rival, more)
                unite(roadmap, own, roadmap.component[rival])
                merged += 1
    return DONE, guesses.shape[0], merged


@kernel
def _nearest_nodes(roadmap, i, j, component):
    """The two nodes of a component over cells i and j that are nearest to each other; or -1, -1."""
    best_x, best_y, nearest = -1, -1, np.inf
    x = roadmap.first_node[i]
    while x >= 0:
        if root_of(roadmap, roadmap.component[x]) == component:
            y = roadmap.first_node[j]
            while y >= 0:
                if root_of(roadmap, roadmap.component[y]) == component:
                    distance = 0.0
                    for k in range(roadmap.q.shape[1]):
                        distance += (roadmap.q[x, k] - roadmap.q[y, k]) ** 2
                    if distance < nearest:
                        best_x, best_y, nearest = x, y, distance
                y = roadmap.following[y]
        x = roadmap.following[x]
    return best_x, best_y


@allocating_entry
def close_pairs(arrays, work, roadmap, pairs, state, component, budget):
    """Try to connect every neighbouring pair of cells inside one component by a motion of its own.

    Args:
        arrays, work: the `SearchArrays` and the `Work`.
        roadmap: the `Roadmap`; a motion that cannot be connected to a node ends in a new one.
        pairs: (M, 2) neighbouring cells, one for each curve.
        state: (M + 1,) 1 where the pair has an edge, 2 where none was found; the last entry is
            the next pair to try. Filled here.
        component: the root component.
        budget: evaluations of the arm before returning.

    Returns:
        DONE, BUDGET or FULL, as `spread_out`.
    """
    count = roadmap.counters
    stop = work.counts[0] + budget
    q = np.empty(roadmap.q.shape[1])
    arrival = np.empty(roadmap.q.shape[1])
    m = pairs.shape[0]
    while state[m] < m:
        k = state[m]
        if state[k] == 0:
            if work.counts[0] > stop:
                return BUDGET
            if is_full(roadmap):
                return FULL
            best_x, best_y = _nearest_nodes(roadmap, pairs[k, 0], pairs[k, 1], component)
            state[k] = 2
            if best_x >= 0:
                for attempt in range(4):
                    a, b = (best_x, best_y) if attempt % 2 == 0 else (best_y, best_x)
                    begin, end = (0.0, 1.0) if attempt % 2 == 0 else (1.0, 0.0)
                    j = roadmap.cell[b]
                    put(q, roadmap.q[a])
                    rows = track(
                        arrays, work, k, begin, end, q, roadmap.q[b], attempt < 2,
                        roadmap.waypoints, count[WAYPOINTS],
                    )  # fmt: skip
                    if rows == OVERFLOW:
                        state[k] = 0
                        return FULL
                    if rows < 0:
                        continue
                    put(arrival, q)
                    look_at(arrays, work, j)
                    more, reached = connect(
                        arrays, work, q, roadmap.q[b], roadmap.waypoints, count[WAYPOINTS] + rows,
                        CONNECT_STEPS,
                    )  # fmt: skip
                    if more == OVERFLOW:
                        state[k] = 0
                        return FULL
                    if reached:
                        add_edge(roadmap, a, b, rows + more)
                        state[k] = 1
                        break
                    if attempt == 3:
                        # The motion reaches the cell, with a configuration of its own.
                        new = add_node(arrays, work, roadmap, j, arrival, component)
                        add_edge(roadmap, a, new, rows)
                        state[k] = 1
        state[m] += 1
    return DONE
