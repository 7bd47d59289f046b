"""The prover: attempts to prove that no single motion covers every cell.

Each attempt guesses a cut tree from what a search knows, and proves each of its statements. What
refutes a guess are configurations that the search did not know: they are handed back as seeds. What
was proved is kept for the next attempt, and so is every proof that was not finished.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from feasibility.cut_tree import Cut, CutTree, Leaf
from feasibility.roadmap.branch_and_bound import Places
from feasibility.roadmap.cuts.counting import Counted
from feasibility.roadmap.cuts.findings import Findings
from feasibility.roadmap.cuts.gaps import Component
from feasibility.roadmap.cuts.guess import Blocked, Guessing, first_proved
from feasibility.roadmap.cuts.opening import openings
from feasibility.roadmap.cuts.regions import Region, folded, limits_of, turn_from, wide_joints
from feasibility.roadmap.motions import SearchArrays

MOST_SEEDS = 12  # handed back by an attempt


@dataclass(frozen=True, eq=False, slots=True)
class Attempt:
    """What came of an attempt."""

    tree: CutTree | None
    """The proof, if there is one."""
    boxes: int
    """Boxes examined."""
    seeds: tuple[tuple[int, NDArray[np.float64]], ...]
    """(cell, (n,) configuration) that no component of the search explains; the cell is the nearest
    one where it is not covered. Joints of more than a turn may be at another winding."""
    blocked: tuple[Blocked, ...]
    """What kept it, where there is no proof: the gaps of the region that stayed open."""
    boxes_left: float
    """An estimate of the boxes that the proof still needs, where its cuts are found and none of its
    leaves is refuted; inf where that is not so, 0 where there is a proof."""


@dataclass(eq=False)
class Prover:
    """Proofs about one search: the motion set of `arrays` over a target surface."""

    arrays: SearchArrays
    places: Places
    rng: np.random.Generator
    newton: bool = True
    """Whether guesses are tried by Newton before branch and bound."""
    findings: Findings = field(init=False)
    opened: dict[int, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Nothing is known yet."""
        self.findings = Findings(self.arrays, self.places, self.rng, self.newton)

    def attempt(
        self, components: list[Component], budget: int, tick: Callable[[], None]
    ) -> Attempt:
        """Try to prove that no motion covers every cell.

        Args:
            components: what the search knows, each with samples of its motions and its cells.
            budget: boxes that may be examined.
            tick: called between batches of boxes; may raise, and then the next attempt goes on
                with what is proved so far.
        """
        counted = Counted(self.arrays, self.findings.work, budget, tick)
        limits = limits_of(self.arrays, self.places)
        self.findings.forget_seeds()
        blocked: list[Blocked] = []
        boxes_left = np.inf
        if limits.over_one_turn().is_finite:
            self.findings.look_around(limits)
            for opened, joints in self._plans(counted, limits, components):
                guess = Guessing(self.findings, counted, joints, opened)
                root = self._root(guess, limits, components)
                if root is not None:
                    return Attempt(CutTree(root, tuple(opened.items())), counted.spent, (), (), 0.0)
                blocked += guess.blocked
                boxes_left = min(boxes_left, guess.boxes_left)
                if self.findings.uncovered:
                    break  # what is known of the components is wrong
        seeds = (*self.findings.uncovered, *self.findings.on_cuts)[:MOST_SEEDS]
        return Attempt(None, counted.spent, seeds, tuple(blocked), float(boxes_left))

    def _root(
        self, guess: Guessing, limits: Region, components: list[Component]
    ) -> Cut | Leaf | None:
        """The root of a tree, with one turn of each joint that is opened."""
        region = limits
        for joint, t in guess.opened.items():
            region = turn_from(region, joint, t)
        return guess.tree(region, [c._replace(q=folded(c.q, guess.opened)) for c in components])

    def _plans(
        self, counted: Counted, limits: Region, components: list[Component]
    ) -> Iterator[tuple[dict[int, float], tuple[int, ...]]]:
        """Which joints to open, at which t, and which ones cuts may go through.

        First none through wide joints, whose windings then do not matter; then through those that
        can be opened; then through all that have limits, with all their windings.
        """
        wide = wide_joints(self.arrays)
        narrow = tuple(j for j in range(len(limits.low)) if j not in wide)
        if not wide:
            yield {}, narrow
            return
        saved = counted.left // 2
        counted.left -= saved
        yield {}, narrow
        counted.left += saved
        self._open(counted, limits, components, wide)
        if self.opened:
            yield dict(self.opened), (*narrow, *self.opened)
        bounded = [j for j in wide if np.isfinite(limits.high[j] - limits.low[j])]
        if bounded:
            free = {j: t for j, t in self.opened.items() if j not in bounded}
            yield free, (*narrow, *bounded, *free)

    def _open(
        self, counted: Counted, limits: Region, components: list[Component], wide: list[int]
    ) -> None:
        """Open wide joints where that is possible."""
        for joint in wide:
            if joint in self.opened:
                continue
            weights = np.eye(len(limits.low))[joint]
            line = first_proved(
                self.findings,
                counted,
                (
                    (weights, t, turn_from(limits, joint, t).on(weights, t))
                    for t in openings(joint, components, self.findings.samples)
                ),
            )
            if line is not None:
                self.opened[joint] = line[1]
