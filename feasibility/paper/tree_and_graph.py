"""Tree T and graph G of one run of Algorithm 2, and both as people read them, in networkx.

The paper keeps one configuration for each cell, the one its search arrived with. Tree T is one
continuous motion, once its edges are run through depth first: out along an edge when a cell is
entered, and back along the same edge when nothing is left behind it. The other edges of graph G
begin at a cell's configuration and end somewhere in the neighbouring cell, so they do not compose
with each other.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from coverable.arrays import Array, Ints
from feasibility.verdict import Verdict, Walk
from robots.kinematics import Kinematics
from surfaces.cells import Cells

if TYPE_CHECKING:
    import networkx as nx

    from feasibility.paper.continuity import JSpace

SAME = 1e-12  # [rad] or [m]: by how much equal moves may differ, which is rounding


@dataclass(slots=True)
class Tree:
    """Tree T and graph G of one run of Algorithm 2; grows while it runs."""

    space: JSpace
    start: int | None
    """Flat index of ec_1; None for an empty tree."""
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
    capped: int = 0
    """Calls that stopped at the cap: unknown, not "no"."""
    complete: bool = True
    """False when the time limit stopped the search."""

    def motion(self, a: int, b: int) -> Array:
        """Configurations (k, n) along the edge between cells a and b, from a to b."""
        forward = self.edges.get((a, b))
        return self.space.q(self.edges[b, a][::-1] if forward is None else forward)


def graph_of(tree: Tree, cells: Cells) -> nx.Graph:
    """Graph G over all cells: `q` on those that the tree touches, `motion` on the edges."""
    from feasibility.cell_graph import cell_graph

    graph = cell_graph(cells, np.isin(np.arange(len(cells)), list(tree.jcell)))
    for cell, jcell in tree.jcell.items():
        graph.nodes[cell]["q"] = tree.space.q(jcell)
    for low, high in map(sorted, tree.edges):
        graph.add_edge(low, high, motion=tree.motion(low, high))
    return graph


def tree_of(tree: Tree) -> nx.DiGraph | None:
    """Tree T, its edges from parent to child, with `motion` in that direction; None if empty."""
    import networkx as nx

    if not tree.jcell:
        return None
    graph: nx.DiGraph = nx.DiGraph()
    graph.add_nodes_from((cell, {"q": tree.space.q(jcell)}) for cell, jcell in tree.jcell.items())
    for child, parent in tree.parent.items():
        graph.add_edge(parent, child, motion=tree.motion(parent, child))
    return graph


def tree_walk(verdict: Verdict) -> Walk | None:
    """One continuous motion that enters every cell that a greedy search touched.

    The replay has been over each of its straight lines, because they are those of the tree. The
    greedy search touches cells without visiting their centres, so few rows are at one.

    Args:
        verdict: of the method "greedy".

    Returns:
        The motion from the start on; None where there is no tree.
    """
    if verdict.tree is None or verdict.start is None:
        return None
    q = corners(there_and_back(verdict.tree, verdict.start))
    return Walk(q=q, cell=_at_centres(verdict, q))


def there_and_back(tree: nx.DiGraph, root: int) -> Array:
    """(k, n) one motion along the tree depth first, up to the last cell; rad or m."""
    import networkx as nx

    parts: list[Array] = [np.atleast_2d(tree.nodes[root]["q"])]
    last = 0  # part that enters the last cell
    for parent, child, kind in nx.dfs_labeled_edges(tree, root):
        if parent != child:
            motion = tree.edges[parent, child]["motion"]
            parts.append(motion[1:] if kind == "forward" else motion[::-1][1:])
            last = len(parts) if kind == "forward" else last
    return np.concatenate(parts[: max(last, 1)])


def corners(q: Array) -> Array:
    """The rows of q (k, n) where the motion turns: equal moves in a row are one straight line."""
    if len(q) < 3:
        return q
    moves = np.diff(q, axis=0)
    turns = (np.abs(np.diff(moves, axis=0)) > SAME).any(axis=1)
    return q[np.concatenate([[True], turns, [True]])]


def _at_centres(verdict: Verdict, q: Array) -> Ints:
    """(k,) the cell at whose centre target the tool point is within the tolerance, or -1."""
    from scipy.spatial import KDTree

    points, _ = Kinematics(verdict.robot).tools(q)
    away, cell = KDTree(verdict.task.targets(verdict.cells).points).query(points)
    return np.where(away <= verdict.task.effective_tolerance, cell, -1).astype(np.int64)
