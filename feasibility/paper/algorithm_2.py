"""Algorithm 2 of the paper: tree search over the E-cells, from one start configuration.

The paper keeps one configuration for each cell, the one its search arrived with. Tree T is one
continuous motion (out along a branch, and back). The other edges of graph G begin at a cell's
configuration and end somewhere in the neighbouring cell, so they do not compose with each other.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from feasibility.paper.continuity import JSpace, Outcome
from feasibility.search import Progress
from surfaces.patches import GridCells


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
    """Forward kinematics computed, in whole chains."""
    capped: int = 0
    """Calls that stopped at the cap: unknown, not "no"."""
    complete: bool = True
    """False when the time limit stopped the search."""

    def motion(self, a: int, b: int) -> NDArray[np.float64]:
        """Configurations (k, n) along the edge between cells a and b, from a to b."""
        forward = self.edges.get((a, b))
        return self.space.q(self.edges[b, a][::-1] if forward is None else forward)


def tree_search(
    space: JSpace,
    cells: GridCells,
    start: int,
    deadline: float = math.inf,
    progress: Progress | None = None,
) -> Tree:
    """Algorithm 2: grow T and G from the start configuration of `space`, which lies over `start`.

    The recursion of the paper's TREESEARCH is the list `waiting`: the cells from ec_1 to the one in
    hand, each with those of its neighbours, clockwise, that are still to be tried. A pair that
    failed from one side is tried again from the other, as printed.

    Args:
        space: the J-cells around jc_1.
        cells: the E-cells.
        start: flat index of ec_1.
        deadline: value of `time.perf_counter` at which to give up.
        progress: told how many cells are touched, after each new one.
    """
    tree = Tree(space, start)
    tree.jcell[start] = np.zeros(len(space.start), dtype=np.int32)
    waiting: list[tuple[int, Iterator[int]]] = [(start, iter(cells.neighbours.of(start).tolist()))]
    while waiting:
        cell, neighbours = waiting[-1]
        entered = next((k for k in neighbours if _try_edge(tree, cell, k, deadline)), None)
        if not tree.complete:
            break
        if entered is None:
            waiting.pop()
            continue
        waiting.append((entered, iter(cells.neighbours.of(entered).tolist())))
        if progress is not None:
            progress(len(tree.jcell), len(cells), "greedy search")
    return tree


def _try_edge(tree: Tree, cell: int, neighbour: int, deadline: float) -> bool:
    """Call Algorithm 1 for one pair that has no edge yet; True when it leads to a new cell of T."""
    if not tree.complete or (cell, neighbour) in tree.edges or (neighbour, cell) in tree.edges:
        return False
    found = tree.space.continuity(tree.jcell[cell], neighbour, deadline)
    tree.calls += 1
    tree.checked += found.checked
    tree.fk += found.fk
    tree.capped += found.outcome is Outcome.CAPPED
    tree.complete = found.outcome is not Outcome.OUT_OF_TIME
    if not found.found:
        return False
    tree.edges[cell, neighbour] = found.jcells
    if neighbour in tree.jcell:
        return False
    tree.jcell[neighbour] = found.jcells[-1]
    tree.parent[neighbour] = cell
    return True
