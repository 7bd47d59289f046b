"""What is left of a search at a speed, or at a distance from singularities.

A motion that is too slow somewhere joins nothing: components fall apart into what the others join.
As `check` does at a speed, more motions are made first, from every configuration that is known.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from feasibility.clock import OutOfTime
from feasibility.paths import MotionGraph
from feasibility.roadmap import EDGES, Exploration, Roadmap, edge_motion
from feasibility.speed.rated_graph import Edge, RatedGraph, grow
from feasibility.task import Task
from feasibility.verdict import Cause, CauseKind
from surfaces import components


def keep_fast_motions(exploration: Exploration, task: Task) -> dict[int, Cause]:
    """Leave only motions in a search that hold what a task requires, and only cells that they join.

    A cell to which no such motion leads is in no component any more: that the arm can hold still
    over it is not enough. A single cell is kept where there is nothing else.

    Args:
        exploration: a search, which is changed; its clock's time counts.
        task: with a speed or a least singular value.

    Returns:
        Cells that lose their last component, and why.
    """
    reached = exploration.reached
    rated = _rated(exploration, task)
    exploration.roadmap = _roadmap_of(exploration.roadmap, rated.graph, rated.enough)
    lost = np.flatnonzero(reached & ~exploration.reached).tolist()
    cell = rated.graph.cell
    best = rated.fastest_to_cells((x, y) for x, y in rated.rated if cell[x] != cell[y])
    kind, none = CauseKind.DISCONNECTED, "no motion leads to it"
    return {c: Cause(c, kind, False, rated.fault(best[c]) if c in best else none) for c in lost}


def _rated(exploration: Exploration, task: Task) -> RatedGraph:
    """The motions of a search, and more of them, rated."""
    roadmap, cells = exploration.roadmap, exploration.cells
    graph = MotionGraph.of(exploration.arrays, exploration.work, cells)
    for edge in range(int(roadmap.counters[EDGES])):
        x, y = (int(roadmap.cell[node]) for node in roadmap.ends[edge])
        motion = edge_motion(roadmap, edge)
        graph.join(graph.node(x, motion[0]), graph.node(y, motion[-1]), motion)
    rated = RatedGraph(exploration.robot, cells, task, graph)
    try:
        grow(rated, exploration.clock)
    except OutOfTime:
        rated.rate()
    return rated


def _roadmap_of(roadmap: Roadmap, graph: MotionGraph, edges: Sequence[Edge]) -> Roadmap:
    """A roadmap of some motions, with each connected part of their nodes as a component."""
    ends = np.array(edges, dtype=np.int64).reshape(-1, 2)
    over = np.array(graph.cell, dtype=np.int64)
    if len(roadmap.first_node) > 1:  # without parts over one cell alone
        part = components(ends, len(over))
        several = np.zeros(int(part.max(initial=-1)) + 1, dtype=bool)
        several[part[ends[over[ends[:, 0]] != over[ends[:, 1]], 0]]] = True
        ends = ends[several[part[ends[:, 0]]]]
    nodes, of = np.unique(ends, return_inverse=True)
    ends = of.reshape(-1, 2).astype(np.int64)
    component, cell = components(ends, len(nodes)), over[nodes]
    motions = [graph.motion(*pair)[1:] for pair in nodes[ends].tolist()]
    rows = np.array([len(motion) for motion in motions], dtype=np.int64)
    slots = max(int(component.max(initial=-1)) + 1, 1)
    cover = np.zeros((slots, len(roadmap.first_node)), dtype=np.uint8)
    cover[component, cell] = 1
    size = cover.sum(axis=1, dtype=np.int64)
    following = np.full(len(nodes), -1, dtype=np.int64)
    first = np.full(cover.shape[1], -1, dtype=np.int64)
    for node, where in enumerate(cell.tolist()):
        following[node], first[where] = first[where], node
    n = roadmap.q.shape[1]
    q = np.array([graph.q[node] for node in nodes.tolist()]).reshape(-1, n)
    best = int(size.argmax())
    counters = [len(nodes), len(ends), int(rows.sum()), slots, 0, 0, 0, best]
    return roadmap._replace(
        cell=cell, q=q, effect=np.zeros_like(q), component=component.astype(np.int64),
        following=following, first_node=first, queue=np.empty(len(nodes), dtype=np.int64),
        ends=ends, edge_rows=np.column_stack([np.cumsum(rows) - rows, rows]),
        waypoints=np.vstack([*motions, np.zeros((0, n))]), parent=np.arange(slots), cover=cover,
        size=size, failures=np.zeros((slots, slots), dtype=np.int64), counters=np.array(counters),
    )  # fmt: skip
