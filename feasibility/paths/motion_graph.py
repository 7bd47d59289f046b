"""Known motions among configurations over cells, and new ones made on demand.

A node is a configuration over a cell's centre, an edge a certified motion between two nodes over
neighbouring cells, or over one cell. The graph begins with what a verdict holds (the motions of its
graph and its witness); a path adds what it tracks. Every motion can be run backwards.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import pairwise

import networkx as nx
import numpy as np

from coverable.arrays import Array, Ints
from feasibility.roadmap.motions.aiming import look_at
from feasibility.roadmap.motions.search_arrays import SearchArrays, arrays_of
from feasibility.roadmap.motions.self_motion import connect
from feasibility.roadmap.motions.tracking import track
from feasibility.roadmap.motions.working_memory import Work, work_for
from feasibility.verdict import Verdict, Walk
from surfaces.cells import Cells

Motion = Array
"""(k, n) waypoints, both ends included."""
GOALS = 2  # nodes over the next cell that are headed for, besides those that are joined already
NEAREST = 6  # nodes over one cell that a self-motion is tried to
TURN = 2.0 * math.pi
TURNS = (-1, 1, -2, 2)  # full turns of one joint that are tried
# [rad] or [m]: arrivals nearer to a known node than this are it, if a motion joins them.
SAME = 1e-3


@dataclass
class MotionGraph:
    """Nodes, and the motions that join them."""

    arrays: SearchArrays
    work: Work
    pairs: dict[tuple[int, int], int]
    """Which pair of `cells.pairs` two cells i < j are."""
    cell: list[int] = field(default_factory=list)
    """The cell of each node."""
    q: list[Array] = field(default_factory=list)
    """The configuration of each node, (n,)."""
    over: dict[int, list[int]] = field(default_factory=dict)
    """Nodes over each cell."""
    edges: nx.Graph = field(default_factory=nx.Graph)
    """Each with its `motion`, from the node of lower index to the other, and its `length`."""
    grows: bool = True
    """May motions be made that are not known yet?"""
    _known: dict[tuple[int, bytes], int] = field(default_factory=dict)

    @staticmethod
    def of(arrays: SearchArrays, work: Work, cells: Cells) -> "MotionGraph":
        """A graph over cells, without nodes."""
        pairs = {(int(i), int(j)): k for k, (i, j) in enumerate(cells.pairs.tolist())}
        return MotionGraph(arrays, work, pairs)

    def node(self, cell: int, q: Array) -> int:
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

    def copy(self) -> "MotionGraph":
        """A graph that can grow on its own; the motions themselves are shared."""
        return replace(
            self,
            cell=list(self.cell),
            q=list(self.q),
            over={cell: list(nodes) for cell, nodes in self.over.items()},
            edges=self.edges.copy(),
            _known=dict(self._known),
        )

    def nearest(self, q: Array) -> int:
        """The node whose configuration is nearest to q (n,)."""
        return int(np.argmin([np.abs(own - q).max() for own in self.q]))

    def touch(self, a: int, b: int) -> bool:
        """Do two cells touch?"""
        return (min(a, b), max(a, b)) in self.pairs

    def joined_cells(self) -> Ints:
        """(M, 2) pairs i < j of different cells that a motion joins."""
        ends = [(self.cell[x], self.cell[y]) for x, y in self.edges.edges]
        found = {(min(a, b), max(a, b)) for a, b in ends if a != b}
        return np.array(sorted(found), dtype=np.int64).reshape(-1, 2)


def joint_length(motion: Motion) -> float:
    """How far the joints travel along a motion: the length of its line in joint space."""
    return float(np.sqrt((np.diff(motion, axis=0) ** 2).sum(axis=1)).sum())


def motion_graph_of(verdict: Verdict, *, witness_alone: bool = False) -> MotionGraph:
    """The motions that a verdict holds: those of its graph, and those of its witness.

    Those of the witness alone make a graph that does not grow.
    """
    arrays = arrays_of(verdict.robot, verdict.cells, verdict.task)
    graph = MotionGraph.of(arrays, work_for(verdict.robot.n), verdict.cells)
    graph.grows = not witness_alone
    for first, last, motion in _motions(verdict, witness_alone):
        graph.join(graph.node(first, motion[0]), graph.node(last, motion[-1]), motion)
    return graph


def _motions(verdict: Verdict, witness_alone: bool) -> Iterator[tuple[int, int, Motion]]:
    """First cell, last cell and waypoints of each motion of a verdict."""
    for i, j, motion in () if witness_alone else verdict.graph.edges(data="motion"):
        low, high = (int(i), int(j)) if i < j else (int(j), int(i))
        yield low, high, np.ascontiguousarray(motion, dtype=float)
    walk = verdict.witness
    if walk is None:
        return
    marks = np.flatnonzero(walk.cell >= 0).tolist()
    for a, b in pairwise(2 * marks if len(marks) == 1 else marks):
        yield int(walk.cell[a]), int(walk.cell[b]), np.array(walk.q[a : b + 1])


def step_to(graph: MotionGraph, x: int, cell: int) -> list[int]:
    """Nodes over a neighbouring cell that one motion from node x reaches.

    Besides the motions that are known, the surface is followed freely, keeping away from limits
    and the boundary of the cone, and towards the nearest nodes that are known there.
    """
    found = [y for y in graph.edges.neighbors(x) if graph.cell[y] == cell]
    if not graph.grows:
        return found
    near = [y for y in _nearest(graph, cell, graph.q[x]) if y not in found]
    found += [y for y in near[:GOALS] if _head_for(graph, x, y)]
    free = _follow(graph, x, cell, None)
    if free is not None:
        known = _nearest(graph, cell, free[-1])[:1]
        if not any(np.abs(graph.q[y] - free[-1]).max() < SAME and y in found for y in known):
            y = graph.node(cell, free[-1])
            graph.join(x, y, free)
            found.append(y)
    return found


def join_self_motions(graph: MotionGraph, x: int) -> None:
    """Join a node with the nearest others over its cell, where a self-motion does."""
    for y in _nearest(graph, graph.cell[x], graph.q[x])[: NEAREST if graph.grows else 0]:
        if y == x or graph.edges.has_edge(x, y):
            continue
        for a, b in ((x, y), (y, x)):
            motion = _self_motion(graph, graph.cell[x], graph.q[a], graph.q[b])
            if motion is not None:
                graph.join(a, b, motion)
                break


def _nearest(graph: MotionGraph, cell: int, q: Array) -> list[int]:
    """Nodes over a cell, the nearest to q first."""
    nodes = graph.over.get(cell, [])
    away = [float(np.abs(graph.q[y] - q).sum()) for y in nodes]
    return [nodes[k] for k in np.argsort(away, kind="stable")]


def _head_for(graph: MotionGraph, x: int, y: int) -> bool:
    """Join x with a node over a neighbouring cell; True where a motion does."""
    motion = _follow(graph, x, graph.cell[y], graph.q[y])
    if motion is None:
        return False
    turn = _self_motion(graph, graph.cell[y], motion[-1], graph.q[y])
    if turn is None:
        return False
    arrival = graph.node(graph.cell[y], motion[-1])
    graph.join(x, arrival, motion)
    graph.join(arrival, y, turn)
    if arrival != y:
        graph.join(x, y, np.vstack([motion, turn[1:]]))
    return True


def _follow(graph: MotionGraph, x: int, cell: int, goal: Array | None) -> Array | None:
    """(k, n) waypoints along the surface from x to a neighbouring cell's centre; None if stuck."""
    q, here = graph.q[x], graph.cell[x]
    # The curve between two cells runs from the one of lower index to the other.
    ends = (0.0, 1.0) if here < cell else (1.0, 0.0)
    curve = graph.pairs[min(here, cell), max(here, cell)]
    motion, _ = track(graph.arrays, graph.work, curve, ends, q, goal)
    return None if motion is None else np.vstack([q, motion])


def _self_motion(graph: MotionGraph, cell: int, start: Array, goal: Array) -> Array | None:
    """(k, n) waypoints over one cell's centre from start to goal; None where none was found."""
    if np.array_equal(start, goal):
        return start[None].copy()
    look_at(graph.arrays, graph.work, cell)
    motion, reached = connect(graph.arrays, graph.work, start, goal)
    return np.vstack([start, motion]) if reached else None


def windings(graph: MotionGraph, nodes: list[int]) -> list[Array]:
    """(n,) each, rad: full turns of one joint that keep a motion inside the limits.

    A joint that may run over more than a full turn can do the same work from another turn. A path
    that has got to the end of such a joint goes on if all of it is run one turn earlier.
    """
    motions = [graph.q[nodes[0]][None], *(graph.motion(x, y) for x, y in pairwise(nodes))]
    lowest = np.min([motion.min(axis=0) for motion in motions], axis=0)
    highest = np.max([motion.max(axis=0) for motion in motions], axis=0)
    lower, upper = graph.arrays.lower, graph.arrays.upper
    found = []
    for joint in np.flatnonzero(~graph.arrays.chain.prismatic):
        for by in (times * TURN for times in TURNS):
            if lowest[joint] + by >= lower[joint] and highest[joint] + by <= upper[joint]:
                found.append(by * np.eye(len(lowest))[joint])
    return found


def rewound(graph: MotionGraph, nodes: list[int], winding: Array) -> list[int]:
    """The nodes of the same motion in another winding, which is added to the graph."""
    moved = [graph.node(graph.cell[x], graph.q[x] + winding) for x in nodes]
    for (x, y), (a, b) in zip(pairwise(nodes), pairwise(moved), strict=True):
        graph.join(a, b, graph.motion(x, y) + winding)
    return moved
