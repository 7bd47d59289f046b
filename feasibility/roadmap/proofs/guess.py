"""The guess of a tree: cuts between components, proved as they are found, down to leaves.

At a region: where all components inside it miss a common cell, there is a leaf. Otherwise the gaps
between components are tried as cuts, each by a few Newton tries first, and then by branch and
bound. The leaves come last, all of them in turns.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Mask
from feasibility.cut_tree import Cut, Leaf
from feasibility.roadmap.proofs.findings import CutFindings, ProvedCut, ProvedLeaf
from feasibility.roadmap.proofs.gaps import Component, JointGap, gaps
from feasibility.roadmap.proofs.regions import JointRegion
from feasibility.roadmap.proofs.ruling import Ruling
from feasibility.roadmap.proofs.statements import Budget, Statement

CANDIDATES = 8  # cuts proved in turns
REFINED = 3  # times that gaps are cut anew by the points found on them
DEEPEST = 12  # cuts above each other
CELLS = 4  # of a leaf that are examined
TURNS = (2000, 4000, 16_000, 64_000, 256_000, 1_000_000)  # boxes of one leaf in its turns

Split = tuple[int, float]
"""Joint j and value t of a cut q_j = t."""


class OpenGap(NamedTuple):
    """A gap between components through which no cut was proved."""

    joint: int
    low: float
    high: float
    """Between these values of the joint no component is known."""
    points: int
    """Points of the motion set found there."""


@dataclass(eq=False)
class _GuessedLeaf:
    """A region in which all known components miss the same cells."""

    region: JointRegion
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


class _Guess(NamedTuple):
    """A cut that is proved, above two guesses."""

    split: Split
    below: _Guess | _GuessedLeaf
    above: _Guess | _GuessedLeaf


@dataclass(eq=False)
class Guessing:
    """One guess at a tree."""

    findings: CutFindings
    budget: Budget
    joints: tuple[int, ...]
    """Those that cuts may go through."""
    opened: dict[int, float]
    open_gaps: list[OpenGap] = field(default_factory=list)
    leaves: list[_GuessedLeaf] = field(default_factory=list)
    boxes_left: float = np.inf
    """An estimate of what the proof still needs, where only boxes are missing."""

    def tree(self, region: JointRegion, components: list[Component]) -> Cut | Leaf | None:
        """The tree of a region, proved; None where none was found."""
        guess = self._node(region, components, DEEPEST)
        if guess is None:
            return None
        proved = _prove_leaves(self.findings, self.budget, self.leaves)
        self.boxes_left = sum(leaf.boxes_left for leaf in self.leaves)
        return _proved(guess) if proved else None

    def _node(
        self, region: JointRegion, components: list[Component], depth: int
    ) -> _Guess | _GuessedLeaf | None:
        """The cuts of a region, proved, above leaves that are not; None where there are none."""
        inside = [c for c in components if region.inside(c.q).any()]
        cover = np.zeros(len(self.findings.arrays.points), dtype=bool)
        for component in inside:
            cover |= component.cover
        if not cover.all():
            leaf = _guessed_leaf(self.findings, region, cover)
            self.leaves.append(leaf)
            return leaf if leaf.cell is not None or leaf.open else None
        split = self._cut(region, inside) if depth > 0 and len(inside) > 1 else None
        if split is None:
            return None
        one, other = (self._node(side, inside, depth - 1) for side in region.sides(*split))
        return None if one is None or other is None else _Guess(split, one, other)

    def _cut(self, region: JointRegion, inside: list[Component]) -> Split | None:
        """A cut between components inside the region."""
        known = self._known(region, inside)
        if known is not None:
            return known
        for _ in range(REFINED):
            before = len(self.findings.samples)
            split = self._through(region, gaps(self.joints, inside, self._samples(region)))
            if split is not None:
                self.findings.cuts.append(ProvedCut(region, *split))
                return split
            if len(self.findings.samples) == before or self.budget.left <= 0:
                break  # no point has made the gaps smaller: they would be the same
        self._note_open_gaps(region, inside)
        return None

    def _through(self, region: JointRegion, found: list[JointGap]) -> Split | None:
        """The first proved cut through the middles of some gaps."""
        candidates = ((gap.joint, gap.middle, region.on(gap.joint, gap.middle)) for gap in found)
        return first_proved(self.findings, self.budget, candidates)

    def _samples(self, region: JointRegion) -> Array:
        return self.findings.samples_in(region, self.opened)

    def _known(self, region: JointRegion, inside: list[Component]) -> Split | None:
        """A cut proved earlier that parts the components here."""
        for known in self.findings.cuts:
            if known.region.holds(region):
                below = [bool((c.q[:, known.joint] < known.value).any()) for c in inside]
                if any(below) and not all(below):
                    return known.joint, known.value
        return None

    def _note_open_gaps(self, region: JointRegion, inside: list[Component]) -> None:
        """Keep the gaps of a region through which no cut was proved."""
        samples = self._samples(region)
        seen = set()
        for gap in gaps(self.joints, inside, samples):
            along = samples[:, gap.joint]
            low, high = gap.between
            if (gap.joint, low) not in seen:
                points = int(((along > low) & (along < high)).sum())
                self.open_gaps.append(OpenGap(gap.joint, low, high, points))
            seen.add((gap.joint, low))


def first_proved(
    findings: CutFindings, budget: Budget, candidates: Iterable[tuple[int, float, JointRegion]]
) -> Split | None:
    """The first of some cuts on which the tool is proved to be nowhere.

    Branch and bound works on those without a known point of the motion set.

    Candidates are j, t, and the region where q_j = t.
    """
    statements: list[tuple[Split, Statement]] = []
    for joint, value, on in candidates:
        if not findings.on_cut(on):
            statements.append(((joint, value), findings.statement(on)))
        if len(statements) == CANDIDATES:
            break
    while True:
        proved = (split for split, s in statements if s.ruling is Ruling.PROVED)
        split = next(proved, None)
        if split is not None:
            return split
        settled = budget.settle_one([s for _, s in statements], budget.left)
        if settled is None:
            return None
        if settled.ruling is not Ruling.PROVED:
            findings.keep(settled.found[None])  # or nearly so, where the ruling is UNKNOWN


def _guessed_leaf(findings: CutFindings, region: JointRegion, cover: Mask) -> _GuessedLeaf:
    """The leaf of a region whose components cover `cover` (N,) and no more.

    Its cells are those that Newton does not reach either, the furthest from `cover` first.
    """
    leaf = _GuessedLeaf(region, cell=findings.known_leaf(region, ~cover))
    if leaf.cell is None:
        for cell in _furthest(findings.arrays.points, cover)[:CELLS]:
            if not findings.covers(region, cell):
                leaf.statements[cell] = findings.statement(region, cell)
    return leaf


def _prove_leaves(findings: CutFindings, budget: Budget, leaves: list[_GuessedLeaf]) -> bool:
    """Prove one cell of each leaf, in turns; False when one cannot be, or the budget is spent."""
    for most in TURNS:
        left = [leaf for leaf in leaves if leaf.cell is None]
        for leaf in left:
            _go_on(findings, budget, leaf, most)
            if leaf.cell is None and not leaf.open:
                return False
        if not left:
            return True
    return False


def _go_on(findings: CutFindings, budget: Budget, leaf: _GuessedLeaf, most: int) -> None:
    """Go on with the cells of one leaf; a configuration that refutes one is a seed."""
    statements, end = list(leaf.statements.values()), budget.spent + most
    while True:
        settled = budget.settle_one(statements, end - budget.spent)
        if settled is None:
            return
        cell = next(cell for cell, s in leaf.statements.items() if s is settled)
        if settled.ruling is Ruling.PROVED:
            leaf.cell = cell
            findings.leaves.append(ProvedLeaf(leaf.region, cell))
            return
        findings.keep(settled.found[None], cell)  # or nearly so, where the ruling is UNKNOWN


def _furthest(points: Array, cover: Mask) -> list[int]:
    """Cells beyond `cover` (N,), the furthest from what it holds first."""
    missed = np.flatnonzero(~cover)
    kept = points[cover] if cover.any() else points.mean(axis=0)[None]
    away = np.linalg.norm(points[missed, None] - kept[None], axis=2).min(axis=1)
    return [int(cell) for cell in missed[np.argsort(-away, kind="stable")]]


def _proved(guess: _Guess | _GuessedLeaf) -> Cut | Leaf:
    """A guess as a tree; every leaf of it is proved."""
    if isinstance(guess, _GuessedLeaf):
        return Leaf(-1 if guess.cell is None else guess.cell)
    return Cut(*guess.split, _proved(guess.below), _proved(guess.above))
