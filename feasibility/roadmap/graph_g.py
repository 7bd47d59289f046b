"""Graph G of the best component: the cells, and one motion for each pair of neighbours."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.graph import EDGES, roots_of_nodes
from feasibility.roadmap.walk import edge_motion

if TYPE_CHECKING:
    import networkx as nx


def graph_of(exploration: Exploration) -> nx.Graph:
    """Graph G of the best component: every cell, and one motion for each connected pair.

    Nodes carry what `cell_graph` gives them, and `q` (n,), a configuration over the cell's
    centre, None for cells that the component misses. Edges carry `motion` (k, n), from the smaller
    cell index to the larger.
    """
    from feasibility.cell_graph import cell_graph

    roadmap, best = exploration.roadmap, exploration.best
    graph = cell_graph(exploration.cells, exploration.covered)
    for x in np.flatnonzero(roots_of_nodes(roadmap) == best)[::-1]:  # a cell's first node counts
        graph.nodes[int(roadmap.cell[x])]["q"] = roadmap.q[x].copy()
    for (i, j), e in pair_edges(exploration).items():
        motion = edge_motion(roadmap, e)
        if roadmap.cell[roadmap.ends[e, 0]] != i:
            motion = motion[::-1]
        graph.add_edge(i, j, motion=motion)
    return graph


def pair_edges(exploration: Exploration) -> dict[tuple[int, int], int]:
    """One edge of the best component for each connected pair of cells."""
    roadmap = exploration.roadmap
    mine = roots_of_nodes(roadmap) == exploration.best
    edges: dict[tuple[int, int], int] = {}
    for e, (x, y) in enumerate(roadmap.ends[: roadmap.counters[EDGES]].tolist()):
        i, j = sorted((int(roadmap.cell[x]), int(roadmap.cell[y])))
        if i != j and mine[x]:
            edges.setdefault((i, j), e)
    return edges
