"""Connected patches as an integer programme, to the proven optimum.

Let x[l, c] = 1 where cell c has label l, and r[l, c] = 1 where c is the root of a patch of label l,
one for each patch:

    minimise sum r   so that   sum_l x[l, c] = 1,   r <= x,   and for every set S of cells
    x[l, c] <= sum_{s in S} r[l, s] + sum_{b in N(S)} x[l, b]   for each c in S:

a patch with a cell in S has its root there, or goes on into one of the neighbours N(S) of S. These
are too many to write down. Only those that a solution violates are added, until none is violated
(node separators; Wang, Buchanan and Butenko, "On imposing connectivity constraints in integer
programming", 2017). Each optimum on the way is a lower bound and its labels are an upper one, so
stopping at any time leaves an honest gap.

Two things keep it small. Cells that have no choice and touch are one node. And the root of a patch
is its first node, which leaves one of many equal choices.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from feasibility.division.connected_labels import (
    Bools,
    Ints,
    Labels,
    Lists,
    count_of,
    neighbours_of,
    pieces_of,
)
from feasibility.division.set_covering import lower_bound

MOST_CUTS = 8  # nodes of one stray piece that get a constraint each
OPTIMAL, INFEASIBLE = 0, 2  # words of scipy.optimize.milp
Row = dict[int, float]


class _Programme:
    """Variables and constraints over nodes; x[l, c] is column `at[l, c]`, r the one `half` on."""

    def __init__(self, regions: Bools, neighbours: Lists) -> None:
        """Set up everything but the separators."""
        self.regions, self.neighbours = regions, neighbours
        self.half = int(regions.sum())
        self.at = np.full(regions.shape, -1, dtype=np.int64)
        self.at[regions] = np.arange(self.half)
        self.rows: list[Row] = []
        self.lower: list[float] = []
        self.upper: list[float] = []
        self.fixed = np.zeros(2 * self.half)  # columns that must be 1
        links = [(i, j) for i, near in enumerate(neighbours) for j in near if i < j]
        self.links = np.array(links, dtype=np.int64).reshape(-1, 2)
        alone = regions.sum(axis=0) == 1
        for c in range(regions.shape[1]):
            columns = [int(k) for k in self.at[regions[:, c], c]]
            self.add(dict.fromkeys(columns, 1.0), 1.0, 1.0)
            for label in np.flatnonzero(regions[:, c]).tolist():
                self._roots(label, c)
        for label in range(len(regions)):
            own = np.flatnonzero(alone & regions[label])
            self.fixed[self.at[label, own]] = 1.0
            # Nodes without a choice come first, so the first of them is the root of its patch.
            self.fixed[self.half + self.at[label, own[:1]]] = 1.0
            for c in own[1:].tolist():
                self.separate(label, {c}, [c], alone & regions[label])

    def _roots(self, label: int, c: int) -> None:
        """A root is in its patch, and the first node of it; a patch of one node has a root."""
        x, r = int(self.at[label, c]), int(self.half + self.at[label, c])
        self.add({r: 1.0, x: -1.0}, -1.0, 0.0)
        near = [d for d in self.neighbours[c] if self.regions[label, d]]
        for d in near:
            if d < c:
                self.add({r: 1.0, int(self.at[label, d]): 1.0}, 0.0, 1.0)
        self.separate(label, {c}, [c], np.ones(len(self.neighbours), dtype=bool))

    def add(self, row: Row, lower: float, upper: float) -> None:
        """One linear constraint."""
        self.rows.append(row)
        self.lower.append(lower)
        self.upper.append(upper)

    def separate(self, label: int, inside: set[int], heads: Iterable[int], met: Bools) -> None:
        """Constraints for the sets around a piece, one after another until the label is met again.

        Args:
            label: the label.
            inside: nodes of the piece.
            heads: members of it that get a constraint for each set.
            met: (n,) nodes that have the label.
        """
        around = set(inside)
        while True:
            border = {
                d for c in around for d in self.neighbours[c] if self.regions[label, d]
            } - around
            row: Row = {int(self.half + self.at[label, c]): 1.0 for c in around}
            row |= {int(self.at[label, d]): 1.0 for d in border}
            for head in heads:
                self.add({**row, int(self.at[label, head]): -1.0}, 0.0, np.inf)
            if not border or any(met[d] for d in border):
                return
            around |= border

    def cut(self, label: Ints, roots: Bools) -> int:
        """Add what the labels (n,) violate; returns the number of pieces without a root."""
        deviation = 0
        piece = pieces_of(label, self.links)
        for k in range(int(piece.max()) + 1):
            inside = np.flatnonzero(piece == k)
            own = int(label[inside[0]])
            if roots[own, inside].any():
                continue
            deviation += 1
            certain = inside[self.fixed[self.at[own, inside]] == 1.0]
            heads = certain[:1] if len(certain) else inside[:: 1 + len(inside) // MOST_CUTS]
            self.separate(own, set(inside.tolist()), heads.tolist(), label == own)
        return deviation


def fewest_labels(regions: Bools, pairs: Ints, known: Labels, deadline: float) -> Labels:
    """Label every cell with a region that holds it, so that the fewest connected patches arise.

    Args:
        regions: (L, N) True where region l holds cell c; every cell is in some region.
        pairs: (M, 2) cells that touch.
        known: labels to be improved on, with a lower bound.
        deadline: `time.monotonic()` at which to stop with the best so far.

    Returns:
        The best labels found; their number and the bound agree where the optimum is proved.
    """
    node, count = _nodes(regions, pairs)
    first = np.zeros(count, dtype=np.int64)
    first[node[::-1]] = np.arange(len(node))[::-1]
    programme = _Programme(regions[:, first], _links(node, count, pairs))
    best, pieces, bound = known.label, known.pieces, known.bound
    while pieces > bound and time.monotonic() < deadline:
        solved = _solve(programme, bound, pieces - 1, deadline - time.monotonic())
        bound = max(bound, min(pieces, solved.bound))
        if solved.label is None:
            break
        label = solved.label[node]
        if count_of(label, pairs) < pieces:
            best, pieces = label, count_of(label, pairs)
        if solved.stopped or programme.cut(solved.label, solved.roots) == 0:
            break
    return Labels(best, pieces, bound)


def _nodes(regions: Bools, pairs: Ints) -> tuple[Ints, int]:
    """(N,) node of each cell, those without a choice first; and the number of nodes."""
    alone = regions.sum(axis=0) == 1
    node = pieces_of(np.where(alone, np.argmax(regions, axis=0), -1), pairs)
    contracted = int(node.max(initial=-1)) + 1
    node[~alone] = contracted + np.arange(int((~alone).sum()))
    return node, contracted + int((~alone).sum())


def _links(node: Ints, count: int, pairs: Ints) -> Lists:
    """Neighbours of each node."""
    ends = node[pairs]
    ends = np.sort(ends[ends[:, 0] != ends[:, 1]], axis=1)
    return neighbours_of(count, np.unique(ends, axis=0))


@dataclass(frozen=True, eq=False, slots=True)
class _Solution:
    """A solution by HiGHS of the programme with the separators added so far."""

    label: Ints | None
    """(n,) label of each node; None where there is no solution, or none was found in time."""
    roots: Bools
    """(L, n) the roots."""
    bound: int
    """No labels make fewer patches."""
    stopped: bool
    """Was it stopped by the time limit?"""


def _solve(programme: _Programme, fewest: int, most: int, time_limit: float) -> _Solution:
    """Solve for `fewest` .. `most` patches; where there are none, the bound is `most` + 1."""
    from scipy.optimize import Bounds, LinearConstraint, milp
    from scipy.sparse import csr_array

    half, rows = programme.half, programme.rows
    columns = np.concatenate([list(row) for row in rows])
    values = np.concatenate([list(row.values()) for row in rows])
    starts = np.cumsum([0, *(len(row) for row in rows)])
    matrix = csr_array((values, columns, starts), shape=(len(rows), 2 * half))
    roots = np.repeat([0.0, 1.0], half)
    found = milp(
        roots,
        integrality=np.ones(2 * half),
        bounds=Bounds(programme.fixed, np.ones(2 * half)),
        constraints=[
            LinearConstraint(matrix, programme.lower, programme.upper),
            LinearConstraint(roots[None], fewest, most),
        ],
        options={"time_limit": max(time_limit, 0.01)},
    )
    none = np.zeros(programme.regions.shape, dtype=bool)
    if found.status == INFEASIBLE:
        return _Solution(None, none, most + 1, False)
    bound, stopped = lower_bound(found.mip_dual_bound), found.status != OPTIMAL
    if found.x is None:
        return _Solution(None, none, bound, True)
    chosen, rooted = none.copy(), none
    chosen[programme.regions] = found.x[:half] > 0.5
    rooted[programme.regions] = found.x[half:] > 0.5
    return _Solution(np.argmax(chosen, axis=0), rooted, bound, stopped)
