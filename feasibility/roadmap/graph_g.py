"""Graph G of the best component: the cells, and one motion for each pair of neighbours."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from feasibility.roadmap.exploration import Exploration

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
    mine = np.flatnonzero(roadmap.roots_of_nodes() == best)
    for x in mine[::-1].tolist():  # a cell's first node counts
        graph.nodes[roadmap.cell[x]]["q"] = roadmap.q[x].copy()
    for (i, j), e in pair_edges(exploration).items():
        motion = roadmap.motion(e)
        if roadmap.cell[roadmap.edges[e].x] != i:
            motion = motion[::-1]
        graph.add_edge(i, j, motion=motion)
    return graph


def pair_edges(exploration: Exploration) -> dict[tuple[int, int], int]:
    """One edge of the best component for each connected pair of cells."""
    roadmap = exploration.roadmap
    edges: dict[tuple[int, int], int] = {}
    for e, (x, y, _) in enumerate(roadmap.edges):
        i, j = sorted((roadmap.cell[x], roadmap.cell[y]))
        if i != j and roadmap.root_of(x) == exploration.best:
            edges.setdefault((i, j), e)
    return edges
