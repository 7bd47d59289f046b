"""Tree T and graph G of one run of Algorithm 2, and both as people read them, in networkx.

The paper keeps one configuration for each cell, the one its search arrived with. Tree T is one
continuous motion (out along a branch, and back). The other edges of graph G begin at a cell's
configuration and end somewhere in the neighbouring cell, so they do not compose with each other.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from feasibility.paper.continuity import JSpace

if TYPE_CHECKING:
    import networkx as nx


@dataclass(slots=True)
class Tree:
    """Tree T and graph G of one run of Algorithm 2; grows while it runs."""

    space: JSpace
    start: int
    """Flat index of ec_1."""
    jcell: dict[int, NDArray[np.int32]] = field(default_factory=dict)
    """The J-cell (n,) each cell of T was entered with, in the order of entering."""
    parent: dict[int, int] = field(default_factory=dict)
    """The cell it was entered from; the start cell has none."""
    edges: dict[tuple[int, int], NDArray[np.int32]] = field(default_factory=dict)
    """G: (from, to) -> the J-cells (k, n) of the motion found, in the direction it was searched."""
    calls: int = 0
    """Calls of Algorithm 1."""
    checked: int = 0
    """J-cells evaluated."""
    fk: float = 0.0
    """Forward kinematics computed, in chains."""
    capped: int = 0
    """Calls that stopped at the cap: unknown, not "no"."""
    complete: bool = True
    """False when the time limit stopped the search."""

    def motion(self, a: int, b: int) -> NDArray[np.float64]:
        """Configurations (k, n) along the edge between cells a and b, from a to b."""
        forward = self.edges.get((a, b))
        return self.space.q(self.edges[b, a][::-1] if forward is None else forward)

    def touched(self, count: int) -> NDArray[np.bool_]:
        """(count,) cells of T."""
        touched = np.zeros(count, dtype=bool)
        touched[list(self.jcell)] = True
        return touched


def graph_of(tree: Tree | None, count: int) -> nx.Graph:
    """Graph G over `count` cells: `q` on those that the tree touches, `motion` on the edges."""
    import networkx as nx

    graph: nx.Graph = nx.Graph()
    graph.add_nodes_from(range(count), q=None)
    if tree is not None:
        for cell, jcell in tree.jcell.items():
            graph.nodes[cell]["q"] = tree.space.q(jcell)
        for a, b in tree.edges:
            low, high = min(a, b), max(a, b)
            graph.add_edge(low, high, motion=tree.motion(low, high))
    return graph


def tree_of(tree: Tree | None) -> nx.DiGraph | None:
    """Tree T, its edges from parent to child, with `motion` in that direction."""
    import networkx as nx

    if tree is None:
        return None
    graph: nx.DiGraph = nx.DiGraph()
    for cell, jcell in tree.jcell.items():
        graph.add_node(cell, q=tree.space.q(jcell))
    for child, parent in tree.parent.items():
        graph.add_edge(parent, child, motion=tree.motion(parent, child))
    return graph
