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
    for e, (x, y, _) in enumerate(roadmap.edges):
        i, j = roadmap.cell[x], roadmap.cell[y]
        if i != j and roadmap.root_of(x) == best and not graph.has_edge(i, j):  # the first counts
            motion = roadmap.motion(e)
            graph.add_edge(i, j, motion=motion if i < j else motion[::-1])
    return graph
