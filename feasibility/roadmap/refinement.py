"""Motions over the surface that follow no curve between cell centres.

The search moves along the curves between neighbouring centres. Where that joins two components by
no motion, there may still be one over the patch beside these curves. So the surface is cut into
finer cells, whose centres are waypoints only: the components found are put there, spread over the
finer curves, and where they meet, or reach a cell that they had missed, the motion becomes an edge
of the roadmap itself.
"""

from __future__ import annotations

from collections import deque
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

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
    for ways in levels:
        finer = exploration.cells.finer(ways)
        if finer is None or len(finer.cells) > MOST_CELLS or not exploration.apart:
            break
        _search_over(exploration, task, finer)
        exploration.finest = max(exploration.finest, ways)
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
    origin = _put_there(exploration, fine, finer.same)
    try:
        fine.spread()
        dry = 0 if _take_over(exploration, fine, finer.same, origin) else 1
        while exploration.apart and fine.improvable and dry <= BRIDGING_ROUNDS + ROUNDS:
            fine.rounds += 1
            if dry > BRIDGING_ROUNDS:
                improve(fine, fine.roots()[:MOST])
            else:
                _bridge(fine)
            dry = 0 if _take_over(exploration, fine, finer.same, origin) else dry + 1
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


def _put_there(
    exploration: Exploration, fine: Exploration, same: NDArray[np.int64]
) -> dict[int, int]:
    """Put every node over its finer cell, a component a slot; returns old nodes by new ones."""
    old = exploration.roadmap
    slots = {root: slot for slot, root in enumerate(exploration.roots())}
    fine.roadmap.counters[COMPONENTS] = len(slots)
    while len(fine.roadmap.parent) < len(slots) + 2:
        fine.roadmap = grown(fine.roadmap)
    origin = {}
    for node in range(old.counters[NODES]):
        fine.roadmap = grown(fine.roadmap)
        slot = slots[int(root_of(old, old.component[node]))]
        cell = int(same[old.cell[node]])
        new = add_node(fine.arrays, fine.work, fine.roadmap, cell, old.q[node], slot)
        origin[int(new)] = node
    return origin


def _take_over(
    exploration: Exploration,
    fine: Exploration,
    same: NDArray[np.int64],
    origin: dict[int, int],
) -> bool:
    """Take motions between components, and to cells that they miss, as edges; True for any."""
    routes = _Routes(fine.roadmap, origin)
    gained = False
    for edge in range(fine.roadmap.counters[EDGES]):
        a, b = (int(node) for node in fine.roadmap.ends[edge])
        if a not in routes.source or b not in routes.source:
            continue
        x, y = origin[routes.source[a]], origin[routes.source[b]]
        if _root(exploration, x) != _root(exploration, y):
            back = routes.to(b)[::-1]
            motion = np.vstack([routes.to(a), edge_motion(fine.roadmap, edge)[1:], back[1:]])
            add_motion(exploration.reserve(len(motion)), x, y, motion[1:])
            gained = True
    cell_of = np.full(len(fine.cells), -1)
    cell_of[same] = np.arange(len(same))
    for node in sorted(routes.source):
        cell = int(cell_of[fine.roadmap.cell[node]])
        x = origin[routes.source[node]]
        own = _root(exploration, x)
        if cell >= 0 and not exploration.roadmap.cover[own, cell]:
            motion = routes.to(node)
            roadmap = exploration.reserve(0)
            y = add_node(exploration.arrays, exploration.work, roadmap, cell, motion[-1], own)
            origin[node] = int(y)
            add_motion(exploration.reserve(len(motion)), x, int(y), motion[1:])
            gained = True
    return gained


def _root(exploration: Exploration, node: int) -> int:
    """The component of a node."""
    return int(root_of(exploration.roadmap, exploration.roadmap.component[node]))


class _Routes:
    """Shortest motions, in edges, from the nodes that stand for old ones to the others."""

    def __init__(self, roadmap: Roadmap, origin: dict[int, int]) -> None:
        self._roadmap = roadmap
        self.source = {node: node for node in origin}
        """Of each node that a motion leads to: where it begins."""
        self._came: dict[int, tuple[int, int]] = {}
        count = roadmap.counters[EDGES]
        at: dict[int, list[tuple[int, int]]] = {}
        for edge, (a, b) in enumerate(roadmap.ends[:count].tolist()):
            at.setdefault(a, []).append((b, edge))
            at.setdefault(b, []).append((a, edge))
        queue = deque(sorted(origin))
        while queue:
            node = queue.popleft()
            for other, edge in at.get(node, ()):
                if other not in self.source:
                    self.source[other] = self.source[node]
                    self._came[other] = (node, edge)
                    queue.append(other)

    def to(self, node: int) -> NDArray[np.float64]:
        """(k, n) waypoints from the source of a node to it, both included."""
        parts = [self._roadmap.q[node][None]]
        while node in self._came:
            before, edge = self._came[node]
            motion = edge_motion(self._roadmap, edge)
            if int(self._roadmap.ends[edge, 0]) != before:
                motion = motion[::-1]
            parts.append(motion[:-1])
            node = before
        return np.vstack(parts[::-1])
