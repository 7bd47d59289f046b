"""Algorithm 2 of the paper: tree search over the E-cells, from one start configuration."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from feasibility.clock import Clock
from feasibility.paper.continuity import CallOutcome, JSpace
from feasibility.paper.tree_and_graph import Tree
from surfaces.cells import Cells


def tree_search(space: JSpace, cells: Cells, start: int, clock: Clock | None = None) -> Tree:
    """Algorithm 2: grow T and G from the start configuration of `space`, which lies over `start`.

    The recursion of the paper's TREESEARCH is the list `waiting`: the cells from ec_1 to the one in
    hand, each with those of its neighbours, clockwise, that are still to be tried. A pair that
    failed from one side is tried again from the other, as printed.

    Args:
        space: the J-cells around jc_1.
        cells: the E-cells.
        start: flat index of ec_1.
        clock: when to give up; it reports how many cells are touched, after each new one.
    """
    clock = Clock() if clock is None else clock
    tree = Tree(space, start)
    tree.jcell[start] = np.zeros(len(space.start), dtype=np.int32)
    waiting: list[tuple[int, Iterator[int]]] = [(start, iter(cells.neighbours.of(start).tolist()))]
    while waiting:
        cell, neighbours = waiting[-1]
        entered = next((k for k in neighbours if _try_edge(tree, cell, k, clock)), None)
        if not tree.complete:
            break
        if entered is None:
            waiting.pop()
            continue
        waiting.append((entered, iter(cells.neighbours.of(entered).tolist())))
        clock.report(len(tree.jcell), len(cells), "greedy search")
    return tree


def _try_edge(tree: Tree, cell: int, neighbour: int, clock: Clock) -> bool:
    """Call Algorithm 1 for one pair that has no edge yet; True when it leads to a new cell of T."""
    if not tree.complete or (cell, neighbour) in tree.edges or (neighbour, cell) in tree.edges:
        return False
    if (min(cell, neighbour), max(cell, neighbour)) in tree.space.steps.barred:
        return False
    found = tree.space.continuity(tree.jcell[cell], neighbour, clock)
    tree.calls += 1
    tree.checked += found.checked
    tree.fk += found.fk
    tree.capped += found.outcome is CallOutcome.CAPPED
    tree.complete = found.outcome is not CallOutcome.OUT_OF_TIME and not clock.out_of_time
    if found.outcome is not CallOutcome.FOUND:
        return False
    tree.edges[cell, neighbour] = found.jcells
    if neighbour in tree.jcell:
        return False
    tree.jcell[neighbour] = found.jcells[-1]
    tree.parent[neighbour] = cell
    return True
