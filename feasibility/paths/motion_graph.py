"""Known motions among configurations over cells, and new ones made on demand.

A node is a configuration over a cell's centre, an edge a certified motion between two nodes over
neighbouring cells, or over one cell. The graph begins with what a verdict holds (the motions of its
graph and its witness); a path adds what it tracks. Every motion can be run backwards.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import pairwise

import networkx as nx
import numpy as np
from numpy.typing import NDArray

from feasibility.roadmap import SearchArrays, Work, arrays_of, work_for
from feasibility.verdict import Verdict, Walk

Motion = NDArray[np.float64]
"""(k, n) waypoints, both ends included."""


@dataclass
class MotionGraph:
    """Nodes, and the motions that join them."""

    arrays: SearchArrays
    work: Work
    pairs: dict[tuple[int, int], int]
    """Which pair of `cells.pairs` two cells i < j are."""
    cell: list[int] = field(default_factory=list)
    """The cell of each node."""
    q: list[NDArray[np.float64]] = field(default_factory=list)
    """The configuration of each node, (n,)."""
    over: dict[int, list[int]] = field(default_factory=dict)
    """Nodes over each cell."""
    edges: nx.Graph = field(default_factory=nx.Graph)
    """Each with its `motion`, from the node of lower index to the other, and its `length`."""
    _known: dict[tuple[int, bytes], int] = field(default_factory=dict)

    def node(self, cell: int, q: NDArray[np.float64]) -> int:
        """The node with this configuration over this cell, made where there is none."""
        key = (cell, q.tobytes())
        if key not in self._known:
            x = self._known[key] = len(self.cell)
            self.over.setdefault(cell, []).append(x)
            self.cell.append(cell)
            self.q.append(q.copy())
            self.edges.add_node(x)
        return self._known[key]

    def join(self, x: int, y: int, motion: Motion) -> None:
        """Join two nodes by a motion from x to y, unless a shorter one joins them already."""
        length = joint_length(motion)
        if x != y and length < self.edges.get_edge_data(x, y, {"length": np.inf})["length"]:
            self.edges.add_edge(x, y, motion=motion if x < y else motion[::-1], length=length)

    def motion(self, x: int, y: int) -> Motion:
        """(k, n) waypoints from node x to node y, which are joined."""
        motion: Motion = self.edges[x][y]["motion"]
        return motion if x < y else motion[::-1]

    def length(self, x: int, y: int) -> float:
        """The `joint_length` of the motion between two nodes that are joined."""
        return float(self.edges[x][y]["length"])

    def walk(self, nodes: list[int]) -> Walk:
        """The motion from node to node, marked where it is over a cell's centre."""
        q, cell = [self.q[nodes[0]][None]], [self.cell[nodes[0]]]
        for x, y in pairwise(nodes):
            q.append(self.motion(x, y)[1:])
            cell += [-1] * (len(q[-1]) - 1) + [self.cell[y]]
        return Walk(q=np.vstack(q), cell=np.array(cell, dtype=np.int64))

    def copy(self) -> MotionGraph:
        """A graph that can grow on its own; the motions themselves are shared."""
        return replace(
            self,
            cell=list(self.cell),
            q=list(self.q),
            over={cell: list(nodes) for cell, nodes in self.over.items()},
            edges=self.edges.copy(),
            _known=dict(self._known),
        )

    def touch(self, a: int, b: int) -> bool:
        """Do two cells touch?"""
        return (min(a, b), max(a, b)) in self.pairs

    def joined_cells(self) -> NDArray[np.int64]:
        """(M, 2) pairs i < j of different cells that a motion joins."""
        ends = [(self.cell[x], self.cell[y]) for x, y in self.edges.edges]
        found = {(min(a, b), max(a, b)) for a, b in ends if a != b}
        return np.array(sorted(found), dtype=np.int64).reshape(-1, 2)


def joint_length(motion: Motion) -> float:
    """How far the joints travel along a motion: the length of its line in joint space."""
    return float(np.sqrt((np.diff(motion, axis=0) ** 2).sum(axis=1)).sum())


def motion_graph_of(verdict: Verdict) -> MotionGraph:
    """The motions that a verdict holds: those of its graph, and those of its witness."""
    pairs = {(int(i), int(j)): k for k, (i, j) in enumerate(verdict.cells.pairs.tolist())}
    arrays = arrays_of(verdict.robot, verdict.cells, verdict.task)
    graph = MotionGraph(arrays, work_for(verdict.robot.n), pairs)
    for first, last, motion in _motions(verdict):
        graph.join(graph.node(first, motion[0]), graph.node(last, motion[-1]), motion)
    return graph


def _motions(verdict: Verdict) -> Iterator[tuple[int, int, Motion]]:
    """First cell, last cell and waypoints of each motion of a verdict."""
    for i, j, motion in verdict.graph.edges(data="motion"):
        low, high = (int(i), int(j)) if i < j else (int(j), int(i))
        yield low, high, np.ascontiguousarray(motion, dtype=float)
    walk = verdict.witness
    if walk is None:
        return
    marks = np.flatnonzero(walk.cell >= 0)
    if len(marks) == 1:
        k = marks[0]
        yield int(walk.cell[k]), int(walk.cell[k]), np.array(walk.q[k : k + 1])
    for a, b in pairwise(marks.tolist()):
        yield int(walk.cell[a]), int(walk.cell[b]), np.array(walk.q[a : b + 1])
