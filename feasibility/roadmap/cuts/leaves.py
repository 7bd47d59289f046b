"""The leaves of a guessed tree: in each region one of some cells is to be proved uncoverable."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from feasibility.roadmap.branch_and_bound import Ruling
from feasibility.roadmap.cuts.counting import Counted, Statement
from feasibility.roadmap.cuts.findings import Findings, ProvedLeaf
from feasibility.roadmap.cuts.regions import Region

CELLS = 4  # of a leaf that are examined
TURNS = (2000, 4000, 16_000, 64_000, 256_000, 1_000_000)  # boxes of one leaf in its turns


@dataclass(eq=False)
class GuessedLeaf:
    """A region in which all known components miss the same cells."""

    region: Region
    statements: dict[int, Statement] = field(default_factory=dict)
    """By cell."""
    cell: int | None = None
    """The one that is proved."""

    @property
    def open(self) -> bool:
        """Can it still be proved?"""
        return any(s.ruling is Ruling.OPEN for s in self.statements.values())

    @property
    def boxes_left(self) -> float:
        """An estimate of the boxes that its proof still needs; inf where it has none."""
        left = (s.boxes_left for s in self.statements.values() if s.ruling is Ruling.OPEN)
        return min(left, default=np.inf) if self.cell is None else 0.0


def guessed_leaf(findings: Findings, region: Region, cover: NDArray[np.bool_]) -> GuessedLeaf:
    """The leaf of a region whose components cover `cover` (N,) and no more.

    Its cells are those that Newton does not reach either, the furthest from `cover` first.
    """
    leaf = GuessedLeaf(region, cell=findings.known_leaf(region, ~cover))
    if leaf.cell is None:
        for cell in _furthest(findings.arrays.points, cover)[:CELLS]:
            if not findings.covers(region, cell):
                leaf.statements[cell] = findings.statement(region, cell)
    return leaf


def prove_leaves(findings: Findings, counted: Counted, leaves: list[GuessedLeaf]) -> bool:
    """Prove one cell of each leaf, in turns; False when one cannot be, or the budget is spent."""
    for most in TURNS:
        left = [leaf for leaf in leaves if leaf.cell is None]
        for leaf in left:
            _go_on(findings, counted, leaf, most)
            if leaf.cell is None and not leaf.open:
                return False
        if not left:
            return True
    return False


def _go_on(findings: Findings, counted: Counted, leaf: GuessedLeaf, most: int) -> None:
    """Go on with the cells of one leaf; a configuration that refutes one is a seed."""
    statements, end = list(leaf.statements.values()), counted.spent + most
    while True:
        settled = counted.settle_one(statements, end - counted.spent)
        if settled is None:
            return
        cell = next(cell for cell, s in leaf.statements.items() if s is settled)
        if settled.ruling is Ruling.PROVED:
            leaf.cell = cell
            findings.leaves.append(ProvedLeaf(leaf.region, cell))
            return
        findings.keep(settled.found[None], cell)  # or nearly so, where the ruling is UNKNOWN


def _furthest(points: NDArray[np.float64], cover: NDArray[np.bool_]) -> list[int]:
    """Cells beyond `cover` (N,), the furthest from what it holds first."""
    missed = np.flatnonzero(~cover)
    kept = points[cover] if cover.any() else points.mean(axis=0)[None]
    away = np.linalg.norm(points[missed, None] - kept[None], axis=2).min(axis=1)
    return [int(cell) for cell in missed[np.argsort(-away, kind="stable")]]
