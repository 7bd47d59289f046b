"""Motions over the surface that follow no curve between cell centres.

The search moves along the curves between neighbouring centres. Where that joins two components by
no motion, there may still be one over the patch beside these curves. So the surface is cut into
finer cells, whose centres are waypoints only: the components found are copied there and spread over
the finer curves. Where two are joined, or one reaches a cell that it had missed, the motion becomes
an edge of the roadmap itself.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from coverable_arrays import Array, Ints
from coverable_kernels import allocating_entry
from feasibility.clock import Clock
from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.graph import (
    COMPONENTS,
    EDGES,
    NODES,
    Roadmap,
    add_motion,
    add_node,
    grown,
    root_of,
    roots_of_nodes,
)
from feasibility.roadmap.motions import arrays_of
from feasibility.roadmap.search import improve
from feasibility.roadmap.walk import edge_motion
from feasibility.task import Task
from surfaces import Finer

# Each cell is cut into so many by so many, until a motion is found: at first, and in the end.
COARSE, FINE = (3,), (9, 27)
MOST_CELLS = 20_000  # finer cells; more are not tried
MOST_EVALUATIONS = 400_000  # of the arm, over one set of finer cells
BRIDGES = 24  # pairs of nodes that a round tries to bridge for each two components
BRIDGING_ROUNDS, ROUNDS = 4, 3  # without gain: of bridges alone, and of self-motions too
MOST = 4  # components that a round works on


def refine(exploration: Exploration, task: Task, levels: tuple[int, ...]) -> bool:
    """Search over finer and finer cells, and take over the motions found; True when there were any.

    Args:
        exploration: a search that found no covering motion; its roadmap grows here.
        task: the task that it keeps to.
        levels: into how many by how many each cell is cut.

    Raises:
        OutOfTime: the deadline passed.
    """
    before = exploration.sizes()
    for parts in levels:
        finer = exploration.cells.finer(parts)
        if finer is None or len(finer.cells) > MOST_CELLS or not exploration.apart:
            break
        _search_over(exploration, task, finer)
        exploration.finest = max(exploration.finest, parts)
    return exploration.sizes() != before


def _search_over(exploration: Exploration, task: Task, finer: Finer) -> None:
    """`refine` over one set of finer cells."""
    exploration.tick("cutting the surface more finely")
    finer.cells.curves  # noqa: B018 - part of the cells, made once
    arrays = arrays_of(exploration.robot, finer.cells, task)
    arrays = arrays._replace(off_target_cost=exploration.arrays.off_target_cost)
    fine = Exploration(exploration.robot, finer.cells, arrays, exploration.seed)
    if not exploration.improvable and fine.parts.max() == exploration.parts.max():
        return  # the finer curves pass where the others do not either
    fine.clock = _Budget(exploration, fine)
    origin = _copy_nodes(exploration, fine, finer.same)
    try:
        fine.spread()
        idle = 0 if _take_over(exploration, fine, finer.same, origin) else 1
        while exploration.apart and fine.improvable and idle <= BRIDGING_ROUNDS + ROUNDS:
            fine.rounds += 1
            if idle > BRIDGING_ROUNDS:
                improve(fine, fine.roots()[:MOST])
            else:
                _bridge(fine)
            idle = 0 if _take_over(exploration, fine, finer.same, origin) else idle + 1
    except _BudgetSpentError:
        _take_over(exploration, fine, finer.same, origin)
    finally:
        exploration.work.counts[0] += fine.work.counts[0]
    exploration.spread()


class _BudgetSpentError(Exception):
    """The search over one set of finer cells has taken enough."""


class _Budget(Clock):
    """The clock of a search, for one over finer cells, which it ends after so many evaluations."""

    def __init__(self, exploration: Exploration, fine: Exploration) -> None:
        """Tick for `exploration`, until `fine` has spent its budget."""
        super().__init__()
        self._exploration, self._fine = exploration, fine

    def tick(self, done: int, total: int | None, text: str) -> None:
        """See `Clock.tick`; the cells reported are those of the search itself."""
        self._exploration.tick(f"finer cells: {text}")
        if self._fine.work.counts[0] > MOST_EVALUATIONS:
            raise _BudgetSpentError


def _bridge(fine: Exploration) -> None:
    """Try to bridge each two of the largest components."""
    top = fine.roots()[:MOST]
    for a, b in combinations(top, 2):
        one, other = (int(root_of(fine.roadmap, root)) for root in (a, b))
        if one != other:
            fine.tick("bridging components in finer cells")
            fine.bridge(one, other, BRIDGES)


def _copy_nodes(exploration: Exploration, fine: Exploration, same: Ints) -> dict[int, int]:
    """Copy every node to its finer cell, each component to a slot; returns old nodes by new."""
    old = exploration.roadmap
    slots = {root: slot for slot, root in enumerate(exploration.roots())}
    fine.roadmap.counters[COMPONENTS] = len(slots)
    while len(fine.roadmap.parent) < len(slots) + 2:
        fine.roadmap = grown(fine.roadmap)
    origin = {}
    for node, root in enumerate(roots_of_nodes(old).tolist()):
        fine.roadmap = grown(fine.roadmap)
        slot = slots[root]
        cell = int(same[old.cell[node]])
        new = add_node(fine.arrays, fine.work, fine.roadmap, cell, old.q[node], slot)
        origin[int(new)] = node
    return origin


def _take_over(
    exploration: Exploration, fine: Exploration, same: Ints, origin: dict[int, int]
) -> bool:
    """Take motions between components, and to cells that they miss, as edges; True for any."""
    routes = _Routes(fine.roadmap, origin)
    gained = False
    for edge in _joining(exploration, fine.roadmap, routes).tolist():
        a, b = fine.roadmap.ends[edge].tolist()
        x, y = int(routes.old[a]), int(routes.old[b])
        if _root(exploration, x) != _root(exploration, y):
            back = routes.to(b)[::-1]
            motion = np.vstack([routes.to(a), edge_motion(fine.roadmap, edge)[1:], back[1:]])
            add_motion(exploration.reserve(len(motion)), x, y, motion[1:])
            gained = True
    cell_of = np.full(len(fine.cells), -1)
    cell_of[same] = np.arange(len(same))
    for node in _covering(exploration, fine.roadmap, routes, cell_of).tolist():
        cell, x = int(cell_of[fine.roadmap.cell[node]]), int(routes.old[node])
        own = _root(exploration, x)
        if not exploration.roadmap.cover[own, cell]:
            motion = routes.to(node)
            roadmap = exploration.reserve(0)
            y = add_node(exploration.arrays, exploration.work, roadmap, cell, motion[-1], own)
            origin[node] = int(y)
            add_motion(exploration.reserve(len(motion)), x, int(y), motion[1:])
            gained = True
    return gained


def _joining(exploration: Exploration, roadmap: Roadmap, routes: _Routes) -> Ints:
    """Edges over finer cells that join two components; one joined stays so, so none is missed."""
    a, b = roadmap.ends[: roadmap.counters[EDGES]].T
    known = np.flatnonzero((routes.old[a] >= 0) & (routes.old[b] >= 0))
    root = roots_of_nodes(exploration.roadmap)
    return known[root[routes.old[a[known]]] != root[routes.old[b[known]]]]


def _covering(exploration: Exploration, roadmap: Roadmap, routes: _Routes, cell_of: Ints) -> Ints:
    """Nodes over the centre of a cell that their component misses."""
    cells = cell_of[roadmap.cell[: len(routes.old)]]
    there = np.flatnonzero((routes.old >= 0) & (cells >= 0))
    root = roots_of_nodes(exploration.roadmap)[routes.old[there]]
    return there[exploration.roadmap.cover[root, cells[there]] == 0]


def _root(exploration: Exploration, node: int) -> int:
    """The component of a node."""
    return int(root_of(exploration.roadmap, exploration.roadmap.component[node]))


class _Routes:
    """Shortest motions, in edges, from the nodes that stand for old ones to the others."""

    def __init__(self, roadmap: Roadmap, origin: dict[int, int]) -> None:
        self._roadmap = roadmap
        starts = np.array(sorted(origin), dtype=np.int64)
        nodes, edges = roadmap.counters[NODES], roadmap.counters[EDGES]
        source, self._before, self._edge = breadth_first(roadmap.ends[:edges], starts, nodes)
        known = np.array([origin[start] for start in starts.tolist()], dtype=np.int64)
        self.old = np.full(nodes, -1)
        """Of each node that a motion leads to: the old node that it begins at; else -1."""
        self.old[source >= 0] = known[source[source >= 0]]

    def to(self, node: int) -> Array:
        """(k, n) waypoints from the source of a node to it, both included."""
        parts = [self._roadmap.q[node][None]]
        while self._before[node] >= 0:
            before, edge = int(self._before[node]), int(self._edge[node])
            motion = edge_motion(self._roadmap, edge)
            if int(self._roadmap.ends[edge, 0]) != before:
                motion = motion[::-1]
            parts.append(motion[:-1])
            node = before
        return np.vstack(parts[::-1])


@allocating_entry
def breadth_first(ends, starts, nodes):  # type: ignore[no-untyped-def]
    """Of each node: which of `starts` is nearest in edges, and the node and edge before; or -1."""
    first = np.zeros(nodes + 1, dtype=np.int64)
    for edge in range(len(ends)):
        first[ends[edge, 0] + 1] += 1
        first[ends[edge, 1] + 1] += 1
    for node in range(nodes):
        first[node + 1] += first[node]
    at = np.empty(2 * len(ends), dtype=np.int64)
    filled = first[:-1].copy()
    for edge in range(len(ends)):
        for end in range(2):
            node = ends[edge, end]
            at[filled[node]] = edge
            filled[node] += 1
    source = np.full(nodes, -1)
    before = np.full(nodes, -1)
    by = np.full(nodes, -1)
    queue = np.empty(nodes, dtype=np.int64)
    tail = len(starts)
    for start in range(tail):
        queue[start] = starts[start]
        source[starts[start]] = start
    for head in range(nodes):
        if head == tail:
            break
        node = queue[head]
        for k in range(first[node], first[node + 1]):
            edge = at[k]
            other = ends[edge, 1] if ends[edge, 0] == node else ends[edge, 0]
            if source[other] < 0:
                source[other] = source[node]
                before[other] = node
                by[other] = edge
                queue[tail] = other
                tail += 1
    return source, before, by
