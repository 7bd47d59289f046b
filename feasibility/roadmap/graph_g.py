"""Graph G of the best component: the cells, and one motion for each pair of neighbours."""

from __future__ import annotations

from typing import TYPE_CHECKING

from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.graph import EDGES, NODES, root_of
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
    for x in range(roadmap.counters[NODES] - 1, -1, -1):
        if root_of(roadmap, roadmap.component[x]) == best:
            graph.nodes[int(roadmap.cell[x])]["q"] = roadmap.q[x].copy()
    for (i, j), e in pair_edges(exploration).items():
        motion = edge_motion(roadmap, e)
        if roadmap.cell[roadmap.ends[e, 0]] != i:
            motion = motion[::-1]
        graph.add_edge(i, j, motion=motion)
    return graph


def pair_edges(exploration: Exploration) -> dict[tuple[int, int], int]:
    """One edge of the best component for each connected pair of cells."""
    roadmap, best = exploration.roadmap, exploration.best
    edges: dict[tuple[int, int], int] = {}
    for e in range(roadmap.counters[EDGES]):
        x, y = roadmap.ends[e]
        i, j = int(roadmap.cell[x]), int(roadmap.cell[y])
        if i != j and root_of(roadmap, roadmap.component[x]) == best:
            edges.setdefault((min(i, j), max(i, j)), e)
    return edges
