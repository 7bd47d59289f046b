"""Labels of cells, and the fewest connected patches by an integer programme, proved optimal.

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

from coverable_arrays import Ints, Mask
from feasibility.division.set_covering import lower_bound
from surfaces import components

Lists = list[list[int]]
MOST_CUTS = 8  # nodes of one detached piece that get a constraint each
OPTIMAL, INFEASIBLE = 0, 2  # words of scipy.optimize.milp
Row = dict[int, float]


@dataclass(frozen=True, eq=False, slots=True)
class Labels:
    """A component for each cell."""

    label: Ints
    """(N,) row of the table for each cell; -1 where there is none."""
    pieces: int
    """Connected patches that this makes."""
    bound: int
    """No labels make fewer."""


def pieces_of(label: Ints, pairs: Ints) -> Ints:
    """(N,) the connected patch of each cell, from 0: cells of one label that hang together.

    A label (N,) of -1 is none, and in no patch: -1. Pairs (M, 2) are of cells that touch.
    """
    same = pairs[label[pairs[:, 0]] == label[pairs[:, 1]]]
    piece = components(same, len(label))
    result = np.full(len(label), -1, dtype=np.int64)
    inside = label >= 0
    result[inside] = np.unique(piece[inside], return_inverse=True)[1]
    return result


def count_of(label: Ints, pairs: Ints) -> int:
    """Number of connected patches."""
    return int(pieces_of(label, pairs).max(initial=-1)) + 1


def neighbours_of(n: int, pairs: Ints) -> Lists:
    """For each of n cells the cells that it touches."""
    result: Lists = [[] for _ in range(n)]
    for i, j in pairs.tolist():
        result[i].append(j)
        result[j].append(i)
    return result


class _Programme:
    """Variables and constraints over nodes; x[l, c] is column `at[l, c]`, r the one `half` on."""

    def __init__(self, regions: Mask, neighbours: Lists) -> None:
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
        for d in (d for d in self.neighbours[c] if d < c and self.regions[label, d]):
            self.add({r: 1.0, int(self.at[label, d]): 1.0}, 0.0, 1.0)
        self.separate(label, {c}, [c], np.ones(len(self.neighbours), dtype=bool))

    def add(self, row: Row, lower: float, upper: float) -> None:
        """One linear constraint."""
        self.rows.append(row)
        self.lower.append(lower)
        self.upper.append(upper)

    def separate(self, label: int, inside: set[int], heads: Iterable[int], met: Mask) -> None:
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

    def cut(self, label: Ints, roots: Mask) -> int:
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


def fewest_labels(regions: Mask, pairs: Ints, known: Labels, deadline: float) -> Labels:
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
    links = np.sort(node[pairs], axis=1)
    links = np.unique(links[links[:, 0] != links[:, 1]], axis=0)
    programme = _Programme(regions[:, first], neighbours_of(count, links))
    best, pieces, bound = known.label, known.pieces, known.bound
    while pieces > bound and time.monotonic() < deadline:
        left = deadline - time.monotonic()
        solved, roots, least, stopped = _solve(programme, bound, pieces - 1, left)
        bound = max(bound, min(pieces, least))
        if solved is None:
            break
        label = solved[node]
        if count_of(label, pairs) < pieces:
            best, pieces = label, count_of(label, pairs)
        if stopped or programme.cut(solved, roots) == 0:
            break
    return Labels(best, pieces, bound)


def _nodes(regions: Mask, pairs: Ints) -> tuple[Ints, int]:
    """(N,) node of each cell, those without a choice first; and the number of nodes."""
    alone = regions.sum(axis=0) == 1
    node = pieces_of(np.where(alone, np.argmax(regions, axis=0), -1), pairs)
    contracted = int(node.max(initial=-1)) + 1
    node[~alone] = contracted + np.arange(int((~alone).sum()))
    return node, contracted + int((~alone).sum())


def _solve(
    programme: _Programme, fewest: int, most: int, time_limit: float
) -> tuple[Ints | None, Mask, int, bool]:
    """Solve for `fewest` .. `most` patches by HiGHS, with the separators added so far.

    Returns:
        (n,) label of each node, None where there is no solution or none was found in time; (L, n)
        the roots; the number of patches below which no labels get, `most` + 1 where there is no
        solution; and whether the time limit ended it.
    """
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
        return None, none, most + 1, False
    bound, stopped = lower_bound(found.mip_dual_bound), found.status != OPTIMAL
    if found.x is None:
        return None, none, bound, True
    chosen, rooted = none.copy(), none
    chosen[programme.regions] = found.x[:half] > 0.5
    rooted[programme.regions] = found.x[half:] > 0.5
    return np.argmax(chosen, axis=0), rooted, bound, stopped
