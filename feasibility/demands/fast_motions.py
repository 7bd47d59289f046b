"""What is left of a search at a speed, or at a distance from singularities.

A motion that is too slow somewhere joins nothing: components fall apart into what the others join.
As `check` does at a speed, more motions are made first, from every configuration that is known.
"""

import numpy as np

from feasibility.clock import OutOfTime
from feasibility.demands.rated_graph import RatedGraph, grow
from feasibility.demands.routes import roadmap_of
from feasibility.paths.motion_graph import MotionGraph
from feasibility.roadmap.exploration import Exploration
from feasibility.task import Task
from feasibility.verdict import Cause, CauseKind
from surfaces.adjacency import components


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
    reached, cells = exploration.reached, len(exploration.cells)
    rated = _rated(exploration, task)
    cell = rated.graph.cell
    ends, over = np.array(rated.enough, dtype=np.int64).reshape(-1, 2), np.array(cell)
    if cells > 1:  # without parts over one cell alone
        part = components(ends, len(cell))[ends[:, 0]]
        ends = ends[np.isin(part, part[over[ends[:, 0]] != over[ends[:, 1]]])]
    edges = [(x, y) for x, y in ends.tolist()]
    exploration.roadmap = roadmap_of(rated.graph, np.unique(ends).tolist(), edges, cells)
    lost = np.flatnonzero(reached & ~exploration.reached).tolist()
    best = rated.fastest_to_cells((x, y) for x, y in rated.rated if cell[x] != cell[y])
    kind, none = CauseKind.DISCONNECTED, "no motion leads to it"
    return {c: Cause(c, kind, False, rated.fault(best[c]) if c in best else none) for c in lost}


def _rated(exploration: Exploration, task: Task) -> RatedGraph:
    """The motions of a search, and more of them, rated."""
    roadmap, cells = exploration.roadmap, exploration.cells
    graph = MotionGraph.of(exploration.arrays, exploration.work, cells)
    for edge, (x, y, _) in enumerate(roadmap.edges):
        motion = roadmap.motion(edge)
        ends = graph.node(roadmap.cell[x], motion[0]), graph.node(roadmap.cell[y], motion[-1])
        graph.join(*ends, motion)
    rated = RatedGraph(exploration.robot, cells, task, graph)
    try:
        grow(rated, exploration.clock)
    except OutOfTime:
        rated.rate()
    return rated
