"""The covering motion of the greedy search: along its tree, there and back.

Tree T of the paper's Algorithm 2 is one continuous motion once its edges are run through depth
first: out along an edge when a cell is entered, and back along the same edge when nothing is left
behind it. Runs of equal moves lie on one straight line, of which the ends are enough.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from feasibility.verdict import Verdict, Walk
from robots import Kinematics

if TYPE_CHECKING:
    import networkx as nx

SAME = 1e-12  # [rad] or [m]: by how much equal moves may differ, which is rounding


def tree_walk(verdict: Verdict) -> Walk | None:
    """One continuous motion that enters every cell that a greedy search touched.

    The replay has been over each of its straight lines, because they are those of the tree. The
    greedy search touches cells without visiting their centres, so few rows stand at one.

    Args:
        verdict: of the method "greedy".

    Returns:
        The motion from the start on; None where there is no tree.
    """
    tree: nx.DiGraph | None = verdict.tree
    if tree is None or verdict.start is None:
        return None
    q = _corners(_there_and_back(tree, verdict.start))
    return Walk(q=q, cell=_at_centres(verdict, q))


def _there_and_back(tree: nx.DiGraph, root: int) -> NDArray[np.float64]:
    """(k, n) the tree's configurations depth first, up to the last cell; rad or m."""
    parts: list[NDArray[np.float64]] = [np.atleast_2d(tree.nodes[root]["q"])]
    branch: list[int] = [root]
    left = {cell: list(reversed(list(tree.successors(cell)))) for cell in tree}
    entered = 1
    while entered < len(tree):
        here = branch[-1]
        if left[here]:
            child = left[here].pop()
            parts.append(tree.edges[here, child]["motion"][1:])
            branch.append(child)
            entered += 1
        else:
            branch.pop()
            parts.append(tree.edges[branch[-1], here]["motion"][::-1][1:])
    return np.concatenate(parts)


def _corners(q: NDArray[np.float64]) -> NDArray[np.float64]:
    """The rows of q (k, n) at which the motion does not go straight on at the same pace."""
    if len(q) < 3:
        return q
    moves = np.diff(q, axis=0)
    turns = (np.abs(np.diff(moves, axis=0)) > SAME).any(axis=1)
    return q[np.concatenate([[True], turns, [True]])]


def _at_centres(verdict: Verdict, q: NDArray[np.float64]) -> NDArray[np.int64]:
    """(k,) the cell at whose centre target the tool point is within the tolerance, or -1."""
    from scipy.spatial import KDTree

    task = verdict.task
    tolerance = task.effective_tolerance
    points, _ = Kinematics(verdict.robot).tools(q)
    away, cell = KDTree(task.targets(verdict.cells).points).query(points)
    return np.where(away <= tolerance, cell, -1).astype(np.int64)
