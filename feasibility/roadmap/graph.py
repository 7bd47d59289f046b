"""The roadmap of the complete search: (cell, configuration) nodes joined by certified motions.

The paper keeps one configuration per cell, so its answer depends on where it starts. Here a cell
may hold many nodes, one for each connected component that was found over it, and a union-find gives
the nodes that one continuous motion can visit. A component that covers every cell is a covering
motion; the cells that the best component does not cover are the missed ones.
"""

from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints, Mask


class RoadmapEdge(NamedTuple):
    """A motion from one node to another, which can be run backwards too."""

    x: int
    y: int
    motion: Array
    """(k, n) waypoints: the start, x, is not among them; the end, y, is."""


class Blocked(NamedTuple):
    """Why a motion into a cell stopped."""

    code: int
    """See `motions.arrays`."""
    joint: int
    """Or pair of bodies; -1 where none is to blame."""
    component: int
    """The one that it came from, the largest that was stopped there."""


class Roadmap:
    """Nodes and edges, and the components that they make.

    Components are numbered as they are made. Where two have become one, one of their numbers, the
    root, stands for both: only what is kept of roots counts.
    """

    def __init__(self, cells: int) -> None:
        """Nothing yet, over so many cells."""
        self.cell: list[int] = []
        """The cell of each node."""
        self.q: list[Array] = []
        """(n,) the configuration of each node, over its cell's centre."""
        self.effect: list[Array] = []
        """(n,) how much each joint moves the tool there, see `self_motion.effects`."""
        self._rows: Array = np.empty((0, 2, 0))
        """(at least nodes, 2, n) configurations and effects once more, to be looked through."""
        self.component: list[int] = []
        """The component that each node was made in."""
        self.edges: list[RoadmapEdge] = []
        self.over: list[list[int]] = [[] for _ in range(cells)]
        """The nodes over each cell."""
        self.reached = np.zeros(cells, dtype=bool)
        """(N,) cells with a node."""
        self.queue: deque[int] = deque()
        """Nodes that have not been spread to neighbouring cells yet."""
        self.blocked: dict[int, Blocked] = {}
        """By cell."""
        self.parent: list[int] = []
        """The root that each component is part of by now, itself for a root."""
        self.parts: list[list[int]] = []
        """The components that each root stands for."""
        self.cover: list[Mask] = []
        """(N,) cells that each component covers."""
        self.size: list[int] = []
        """How many these are."""
        self.failures: list[dict[int, int]] = []
        """How often each component could not be connected with others."""
        self.largest = 0
        """A component that covers most cells."""

    def root(self, component: int) -> int:
        """The root that a component is part of."""
        return self.parent[component]

    def root_of(self, node: int) -> int:
        """The root component of a node."""
        return self.root(self.component[node])

    def roots_of_nodes(self) -> Ints:
        """(nodes,) the root component of every node."""
        return np.array([self.parent[component] for component in self.component], dtype=np.int64)

    def covers(self, roots: Sequence[int]) -> Mask:
        """(K, N) the cells that each of some root components covers."""
        found = np.array([self.cover[root] for root in roots], dtype=bool)  # also of none
        return found.reshape(len(roots), len(self.over))

    def add_component(self) -> int:
        """A component without nodes."""
        self.parent.append(len(self.parent))
        self.parts.append([self.parent[-1]])
        self.cover.append(np.zeros(len(self.over), dtype=bool))
        self.size.append(0)
        self.failures.append({})
        return self.parent[-1]

    def add_node(self, cell: int, q: Array, effect: Array, root: int) -> int:
        """Add a node to a root component, and queue it; returns its number."""
        node = len(self.cell)
        self.cell.append(cell)
        self.q.append(q)
        self.effect.append(effect)
        if node == len(self._rows):
            more = np.empty((max(64, node), 2, len(q)))
            self._rows = np.concatenate([self._rows, more]) if node else more
        self._rows[node] = q, effect
        self.component.append(root)
        self.over[cell].append(node)
        self.reached[cell] = True
        self.queue.append(node)
        if not self.cover[root][cell]:
            self.cover[root][cell] = True
            self.size[root] += 1
        if self.size[root] > self.size[self.largest]:
            self.largest = root
        return node

    def add_edge(self, x: int, y: int, motion: Array) -> int:
        """Join two nodes by a motion (k, n), see `RoadmapEdge`; returns the root of both."""
        self.edges.append(RoadmapEdge(x, y, motion))
        a, b = self.root_of(x), self.root_of(y)
        if a == b:
            return a
        if self.size[a] < self.size[b]:
            a, b = b, a
        for component in self.parts[b]:
            self.parent[component] = a
        self.parts[a] += self.parts[b]
        self.cover[a] |= self.cover[b]
        self.size[a] = int(self.cover[a].sum())
        for other, count in self.failures[b].items():
            if other != a:
                most = max(self.failures[a].get(other, 0), count)
                self.failures[a][other] = self.failures[other][a] = most
        if self.size[a] > self.size[self.largest] or self.largest == b:
            self.largest = a
        return a

    def count_failure(self, a: int, b: int) -> None:
        """Two root components could not be connected somewhere."""
        for one, other in ((a, b), (b, a)):
            self.failures[one][other] = self.failures[one].get(other, 0) + 1

    def nearest(self, cell: int, q: Array, passed: set[int]) -> int | None:
        """The node over a cell nearest to q that is in none of the root components passed over.

        Near means that a motion there would move the tool little, see `self_motion.effects`.
        """
        root, made = self.parent, self.component
        nodes = [node for node in reversed(self.over[cell]) if root[made[node]] not in passed]
        if len(nodes) < 2:
            return nodes[0] if nodes else None
        rows = self._rows[nodes]
        off = (rows[:, 0] - q) * rows[:, 1]
        return nodes[int((off**2).sum(axis=1).argmin())]

    def nearest_two(self, cells: Sequence[int], root: int) -> tuple[int, int] | None:
        """The nodes of a root component over two cells that are nearest to each other."""
        first, second = (
            [node for node in reversed(self.over[cell]) if self.root_of(node) == root]
            for cell in cells
        )
        if len(first) * len(second) < 2:  # mostly there is one each
            return (first[0], second[0]) if first and second else None
        off = np.array([self.q[x] for x in first])[:, None] - [self.q[y] for y in second]
        x, y = divmod(int((off**2).sum(axis=2).argmin()), len(second))
        return first[x], second[y]

    def nearest_neighbours(self, pairs: Ints, one: int, other: int) -> list[tuple[int, int]]:
        """Nodes of two root components over neighbouring cells, the nearest first, as `nearest`.

        At a singularity two sheets are near although their joints are far apart. Of several nodes
        over a cell the latest counts.
        """
        roots, cells = self.roots_of_nodes(), np.array(self.cell, dtype=np.int64)
        latest = np.full((2, len(self.over)), -1)
        for over, root in zip(latest, (one, other), strict=True):
            over[cells[roots == root]] = np.flatnonzero(roots == root)
        both = np.column_stack([pairs.T, pairs.T[::-1]])
        nodes = np.column_stack([latest[0, both[0]], latest[1, both[1]]])
        found = [(x, y) for x, y in nodes[(nodes >= 0).all(axis=1)].tolist()]
        if not found:
            return []
        off = np.array([self.q[x] - self.q[y] for x, y in found])
        off *= 0.5 * np.array([self.effect[x] + self.effect[y] for x, y in found])
        order = np.argsort((off**2).sum(axis=1), kind="stable")
        return [found[k] for k in order.tolist()]

    def motion(self, edge: int) -> Array:
        """(k, n) waypoints of an edge, from its first node to its second, both included."""
        x, _, motion = self.edges[edge]
        return np.vstack([self.q[x], motion])
