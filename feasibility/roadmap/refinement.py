"""Motions over the surface that follow no curve between cell centres.

The search moves along the curves between neighbouring centres. Where that joins two components by
no motion, there may still be one over the patch beside these curves. So the surface is cut into
finer cells, whose centres are waypoints only: the components found are copied there and spread over
the finer curves. Where two are joined, or one reaches a cell that it had missed, the motion becomes
an edge of the roadmap itself.
"""

from collections import deque
from itertools import combinations

import numpy as np

from coverable.arrays import Array, Ints
from feasibility.clock import Clock
from feasibility.roadmap.connecting import bridge, improvable
from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.graph import Roadmap
from feasibility.roadmap.motions.search_arrays import arrays_of
from feasibility.roadmap.rounds import improve
from feasibility.task import Task
from surfaces.cells import Finer

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
    if not improvable(exploration) and fine.parts.max() == exploration.parts.max():
        return  # the finer curves pass where the others do not either
    fine.clock = _Budget(exploration, fine)
    origin = _copy_nodes(exploration, fine, finer.same)
    try:
        fine.spread()
        idle = 0 if _take_over(exploration, fine, finer.same, origin) else 1
        while exploration.apart and improvable(fine) and idle <= BRIDGING_ROUNDS + ROUNDS:
            fine.rounds += 1
            if idle > BRIDGING_ROUNDS:
                improve(fine, fine.roots()[:MOST])
            else:
                _bridge(fine)
            idle = 0 if _take_over(exploration, fine, finer.same, origin) else idle + 1
    except _BudgetSpentError:
        _take_over(exploration, fine, finer.same, origin)
    finally:
        exploration.take_over(int(fine.work.counts[0]))
    exploration.spread()


class _BudgetSpentError(Exception):
    """The search over one set of finer cells has taken enough."""


class _Budget(Clock):
    """The clock of a search, for one over finer cells, which it ends after so many evaluations."""

    def __init__(self, exploration: Exploration, fine: Exploration) -> None:
        """Tick for `exploration`, until `fine` has spent its budget."""
        super().__init__()
        self._exploration, self._fine = exploration, fine

    def affordable(self, most: int) -> int:
        """As the clock of the search itself says."""
        return self._exploration.clock.affordable(most)

    def tick(self, done: int, total: int | None, text: str, spent: int = 0) -> None:
        """See `Clock.tick`; the cells reported are those of the search itself."""
        self._exploration.tick(f"finer cells: {text}", spent)
        if self._fine.work.counts[0] > MOST_EVALUATIONS:
            raise _BudgetSpentError


def _bridge(fine: Exploration) -> None:
    """Try to bridge each two of the largest components."""
    top = fine.roots()[:MOST]
    for a, b in combinations(top, 2):
        one, other = (fine.roadmap.root(root) for root in (a, b))
        if one != other:
            fine.tick("bridging components in finer cells")
            bridge(fine, one, other, BRIDGES)


def _copy_nodes(exploration: Exploration, fine: Exploration, same: Ints) -> dict[int, int]:
    """Copy every node to its finer cell, and the components; returns old nodes by new."""
    old, grower = exploration.roadmap, fine.grower
    copies = {root: fine.roadmap.add_component() for root in exploration.roots()}
    origin = {}
    for node, cell in enumerate(old.cell):
        new = grower.add_node(int(same[cell]), old.q[node], copies[old.root_of(node)])
        origin[new] = node
    return origin


def _take_over(
    exploration: Exploration, fine: Exploration, same: Ints, origin: dict[int, int]
) -> bool:
    """Take motions between components, and to cells that they miss, as edges; True for any."""
    roadmap, finer = exploration.roadmap, fine.roadmap
    routes, gained = _Routes(finer, origin), False
    for edge, (a, b, _) in enumerate(finer.edges):
        if a not in routes.old:
            continue
        x, y = routes.old[a], routes.old[b]
        if roadmap.root_of(x) != roadmap.root_of(y):
            motion = np.vstack([routes.to(a), finer.motion(edge)[1:], routes.to(b)[-2::-1]])
            roadmap.add_edge(x, y, motion[1:])
            gained = True
    cell_of = {cell: k for k, cell in enumerate(same.tolist())}
    for node, x in sorted(routes.old.items()):
        cell, own = cell_of.get(finer.cell[node]), roadmap.root_of(x)
        if cell is not None and not roadmap.cover[own][cell]:
            motion = routes.to(node)
            y = exploration.grower.add_node(cell, motion[-1], own)
            origin[node] = y
            roadmap.add_edge(x, y, motion[1:])
            gained = True
    return gained


class _Routes:
    """Shortest motions, in edges, from the nodes that stand for old ones to the others."""

    def __init__(self, roadmap: Roadmap, origin: dict[int, int]) -> None:
        self._roadmap = roadmap
        self.old = dict(sorted(origin.items()))
        """Of each node that a motion leads to: the old node that it begins at."""
        self._came: dict[int, tuple[int, int]] = {}
        links: list[list[tuple[int, int]]] = [[] for _ in roadmap.cell]
        for edge, (x, y, _) in enumerate(roadmap.edges):
            links[x].append((y, edge))
            links[y].append((x, edge))
        queue = deque(self.old)
        while queue:
            node = queue.popleft()
            for other, edge in links[node]:
                if other not in self.old:
                    self.old[other], self._came[other] = self.old[node], (node, edge)
                    queue.append(other)

    def to(self, node: int) -> Array:
        """(k, n) waypoints from the source of a node to it, both included."""
        parts = [self._roadmap.q[node][None]]
        while node in self._came:
            node, edge = self._came[node]
            motion = self._roadmap.motion(edge)
            parts.append((motion if self._roadmap.edges[edge].x == node else motion[::-1])[:-1])
        return np.vstack(parts[::-1])
