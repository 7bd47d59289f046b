"""Known motions among configurations over cells, and new ones made on demand.

A node is a configuration over a cell's centre, an edge a certified motion between two nodes over
neighbouring cells, or over one cell. The net begins with what a verdict holds (the motions of its
graph and its witness); a path adds what it tracks. Every motion can be gone backwards.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from feasibility.roadmap import Problem, Work, problem_of, work_for
from feasibility.verdict import Verdict

Motion = NDArray[np.float64]
"""(k, n) waypoints, both ends included."""


@dataclass
class MotionNet:
    """Nodes, and the motions that join them."""

    problem: Problem
    work: Work
    pairs: dict[tuple[int, int], int]
    """Which pair of `cells.pairs` two cells i < j are."""
    cell: list[int] = field(default_factory=list)
    """The cell of each node."""
    q: list[NDArray[np.float64]] = field(default_factory=list)
    """The configuration of each node, (n,)."""
    over: dict[int, list[int]] = field(default_factory=dict)
    """Nodes over each cell."""
    links: list[dict[int, Motion]] = field(default_factory=list)
    """For each node the nodes that a motion joins it with, and that motion from here to there."""
    lengths: list[dict[int, float]] = field(default_factory=list)
    """For each node the `joint_length` of these motions."""
    _known: dict[tuple[int, bytes], int] = field(default_factory=dict)

    def node(self, cell: int, q: NDArray[np.float64]) -> int:
        """The node with this configuration over this cell, made where there is none."""
        key = (cell, q.tobytes())
        if key not in self._known:
            self._known[key] = len(self.cell)
            self.over.setdefault(cell, []).append(len(self.cell))
            self.cell.append(cell)
            self.q.append(q.copy())
            self.links.append({})
            self.lengths.append({})
        return self._known[key]

    def link(self, x: int, y: int, motion: Motion) -> None:
        """Join two nodes by a motion from x to y, unless a shorter one joins them already."""
        if x == y:
            return
        length = joint_length(motion)
        if y not in self.links[x] or length < self.lengths[x][y]:
            self.links[x][y], self.links[y][x] = motion, motion[::-1]
            self.lengths[x][y] = self.lengths[y][x] = length

    def copy(self) -> MotionNet:
        """A net that can grow on its own; the motions themselves are shared."""
        return replace(
            self,
            cell=list(self.cell),
            q=list(self.q),
            over={cell: list(nodes) for cell, nodes in self.over.items()},
            links=[dict(near) for near in self.links],
            lengths=[dict(near) for near in self.lengths],
            _known=dict(self._known),
        )

    def touch(self, a: int, b: int) -> bool:
        """Do two cells touch?"""
        return (min(a, b), max(a, b)) in self.pairs

    def linked_pairs(self) -> NDArray[np.int64]:
        """(M, 2) pairs i < j of different cells that a motion joins."""
        found = {
            (min(a, b), max(a, b))
            for x, near in enumerate(self.links)
            for a, b in ((self.cell[x], self.cell[y]) for y in near)
            if a != b
        }
        return np.array(sorted(found), dtype=np.int64).reshape(-1, 2)


def joint_length(motion: Motion) -> float:
    """How far the joints travel along a motion: the length of its line in joint space."""
    return float(np.sqrt((np.diff(motion, axis=0) ** 2).sum(axis=1)).sum())


def net_of(verdict: Verdict) -> MotionNet:
    """The motions that a verdict holds: those of its graph, and those of its witness."""
    pairs = {(int(i), int(j)): k for k, (i, j) in enumerate(verdict.cells.pairs.tolist())}
    problem = problem_of(verdict.robot, verdict.cells, verdict.task)
    net = MotionNet(problem, work_for(verdict.robot.n), pairs)
    for first, last, motion in _motions(verdict):
        net.link(net.node(first, motion[0]), net.node(last, motion[-1]), motion)
    return net


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
