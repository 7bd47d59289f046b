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
from numpy.typing import NDArray

from feasibility.cut_tree import Cut, Leaf
from feasibility.roadmap.branch_and_bound import Ruling
from feasibility.roadmap.cuts.counting import Counted, Statement
from feasibility.roadmap.cuts.findings import Findings, ProvedCut
from feasibility.roadmap.cuts.gaps import Component, Gap, gaps, slanted_gaps
from feasibility.roadmap.cuts.leaves import GuessedLeaf, guessed_leaf, prove_leaves
from feasibility.roadmap.cuts.regions import Region

CANDIDATES = 8  # cuts proved in turns
REFINED = 3  # times that gaps are cut anew by the points found on them
DEEPEST = 12  # cuts above each other

Line = tuple[NDArray[np.float64], float]
"""Weights w (n,) and value t of a cut w . q = t."""


class Blocked(NamedTuple):
    """A gap between components that points of the motion set keep open."""

    weights: NDArray[np.float64]
    """(n,) w"""
    low: float
    high: float
    """Between w . q = low and high no component is known."""
    points: int
    """Points of the motion set found there."""


class _Guess(NamedTuple):
    """A cut that is proved, above two guesses."""

    line: Line
    below: _Guess | GuessedLeaf
    above: _Guess | GuessedLeaf


@dataclass(eq=False)
class Guessing:
    """One guess at a tree."""

    findings: Findings
    counted: Counted
    joints: tuple[int, ...]
    """Those that cuts may go through."""
    opened: dict[int, float]
    blocked: list[Blocked] = field(default_factory=list)
    leaves: list[GuessedLeaf] = field(default_factory=list)
    boxes_left: float = np.inf
    """An estimate of what the proof still needs, where only boxes are missing."""

    def tree(self, region: Region, components: list[Component]) -> Cut | Leaf | None:
        """The tree of a region, proved; None where none was found."""
        guess = self._node(region, components, DEEPEST)
        if guess is None:
            return None
        proved = prove_leaves(self.findings, self.counted, self.leaves)
        self.boxes_left = sum(leaf.boxes_left for leaf in self.leaves)
        return _proved(guess) if proved else None

    def _node(
        self, region: Region, components: list[Component], depth: int
    ) -> _Guess | GuessedLeaf | None:
        """The cuts of a region, proved, above leaves that are not; None where there are none."""
        inside = [c for c in components if region.inside(c.q).any()]
        cover = np.zeros(len(self.findings.arrays.points), dtype=bool)
        for component in inside:
            cover |= component.cover
        if not cover.all():
            leaf = guessed_leaf(self.findings, region, cover)
            self.leaves.append(leaf)
            return leaf if leaf.cell is not None or leaf.open else None
        line = self._cut(region, inside) if depth > 0 and len(inside) > 1 else None
        if line is None:
            return None
        one, other = (self._node(side, inside, depth - 1) for side in region.sides(*line))
        return None if one is None or other is None else _Guess(line, one, other)

    def _cut(self, region: Region, inside: list[Component]) -> Line | None:
        """A cut between components inside the region."""
        known = self._known(region, inside)
        if known is not None:
            return known
        for kind in (gaps, slanted_gaps):
            for _ in range(REFINED):
                before = len(self.findings.samples)
                line = self._through(region, kind(self.joints, inside, self._samples(region)))
                if line is not None:
                    self.findings.cuts.append(ProvedCut(region, *line))
                    return line
                if len(self.findings.samples) == before or self.counted.left <= 0:
                    break  # no point has made the gaps smaller: they would be the same
        self._note_blocked(region, inside)
        return None

    def _through(self, region: Region, found: list[Gap]) -> Line | None:
        """The first proved cut through the middles of some gaps."""
        candidates = (
            (gap.weights, gap.middle, region.on(gap.weights, gap.middle)) for gap in found
        )
        return first_proved(self.findings, self.counted, candidates)

    def _samples(self, region: Region) -> NDArray[np.float64]:
        return self.findings.samples_in(region, self.opened)

    def _known(self, region: Region, inside: list[Component]) -> Line | None:
        """A cut proved earlier that parts the components here."""
        for known in self.findings.cuts:
            if known.region.holds(region):
                below = [bool((c.q @ known.weights < known.value).any()) for c in inside]
                if any(below) and not all(below):
                    return known.weights, known.value
        return None

    def _note_blocked(self, region: Region, inside: list[Component]) -> None:
        """Say which gaps of a region stayed open."""
        samples = self._samples(region)
        seen = set()
        for gap in gaps(self.joints, inside, samples):
            along = samples @ gap.weights
            low, high = gap.between
            key = (*gap.weights.tolist(), low)
            if key not in seen:
                points = int(((along > low) & (along < high)).sum())
                self.blocked.append(Blocked(gap.weights, low, high, points))
            seen.add(key)


def first_proved(
    findings: Findings,
    counted: Counted,
    candidates: Iterable[tuple[NDArray[np.float64], float, Region]],
) -> Line | None:
    """The first of some cuts on which the tool is proved to be nowhere.

    Branch and bound goes on with the likeliest of those without a known point of the motion set.

    Args:
        findings, counted: what is known, and may be spent.
        candidates: w, t, and the region where w . q = t.
    """
    statements: list[tuple[Line, Statement]] = []
    for weights, value, on in candidates:
        if not findings.on_cut(on):
            statements.append(((weights, value), findings.statement(on)))
        if len(statements) == CANDIDATES:
            break
    while True:
        proved = (line for line, s in statements if s.ruling is Ruling.PROVED)
        line = next(proved, None)
        if line is not None:
            return line
        settled = counted.settle_one([s for _, s in statements], counted.left)
        if settled is None:
            return None
        if settled.ruling is not Ruling.PROVED:
            findings.keep(settled.found[None])  # or nearly so, where the ruling is UNKNOWN


def _proved(guess: _Guess | GuessedLeaf) -> Cut | Leaf:
    """A guess as a tree; every leaf of it is proved."""
    if isinstance(guess, GuessedLeaf):
        return Leaf(-1 if guess.cell is None else guess.cell)
    weights, value = guess.line
    return Cut(tuple(weights.tolist()), value, _proved(guess.below), _proved(guess.above))
