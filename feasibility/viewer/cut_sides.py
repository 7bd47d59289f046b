"""The two sides of a proof's first cut: which cells are reached on which of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coverable.arrays import Ints
from feasibility.cut_tree import Cut, Leaf
from feasibility.cut_words import place_of
from feasibility.verdict import Verdict
from feasibility.viewer.threejs import Colour

BELOW, ABOVE, BOTH = range(3)
COLOURS: tuple[Colour, ...] = ((0.00, 0.45, 0.70), (0.90, 0.60, 0.00), (0.72, 0.75, 0.78))
LOST: Colour = (0.84, 0.12, 0.12)


@dataclass(frozen=True, eq=False, slots=True)
class Sides:
    """Where the cells are reached."""

    labels: Ints
    """(N,) `BELOW`, `ABOVE`, `BOTH`; -1 where no motion was found that reaches the cell."""
    lost: tuple[int, ...]
    """Cells that are proved uncoverable in one of the proof's regions each."""
    names: tuple[str, str, str]
    """What the labels mean, with the number of cells."""
    lost_name: str
    """The same for `lost`."""


def sides_of(verdict: Verdict) -> Sides | None:
    """The sides of the first cut of a verdict's proof; None without a cut or known motions.

    All of a motion is on one side. So each of the components found is, and the cells that it
    covers are reached there.
    """
    proof = verdict.proof
    if proof is None or not isinstance(proof.root, Cut) or verdict.postures is None:
        return None
    cut = proof.root
    reached = np.zeros((2, len(verdict.cells)), dtype=bool)
    for q, cells in zip(verdict.postures, verdict.components, strict=True):
        (_, above), *_ = proof.path_to(q)
        reached[int(above), cells] = True
    labels = np.full(len(verdict.cells), -1, dtype=np.int64)
    labels[reached[0]] = BELOW
    labels[reached[1]] = ABOVE
    labels[reached.all(axis=0)] = BOTH
    counts = [int((labels == k).sum()) for k in range(3)]
    place = place_of(cut, verdict.robot)
    # Empty entries are left out.
    upper = "above it only" if counts[BELOW] else f"above {place} only"
    words = (f"below {place} only", upper, "on both sides")
    named = [f"{word} ({count})" for word, count in zip(words, counts, strict=True)]
    lost = tuple(dict.fromkeys(leaf.cell for leaf in proof.leaves()))
    return Sides(labels, lost, (named[0], named[1], named[2]), _lost_name(verdict, cut, lost))


def _lost_name(verdict: Verdict, cut: Cut, lost: tuple[int, ...]) -> str:
    """Which cells are lost, and on which side where there are two sides only."""
    below, above = cut.below, cut.above
    if isinstance(below, Leaf) and isinstance(above, Leaf) and len(lost) == 2:
        cells = [list(verdict.cells.unravel(cell)) for cell in lost]
        return f"proved: {cells[0]} not below, {cells[1]} not above"
    return f"proved: lost in one region or another ({len(lost)})"
