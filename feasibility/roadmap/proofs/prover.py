"""The prover: attempts to prove that no single motion covers every cell.

Each attempt guesses a cut tree from what a search knows, and proves each of its statements. What
refutes a guess are configurations that the search did not know: they are handed back as seeds. What
was proved is kept for the next attempt, and so is every proof that was not finished.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from coverable.arrays import Array
from feasibility.cut_tree import Cut, CutTree, Leaf
from feasibility.roadmap.motions.search_arrays import SearchArrays
from feasibility.roadmap.proofs.branching import PlaceParts
from feasibility.roadmap.proofs.findings import CutFindings
from feasibility.roadmap.proofs.gaps import Component, openings
from feasibility.roadmap.proofs.guess import Guessing, OpenGap, first_proved
from feasibility.roadmap.proofs.regions import (
    JointRegion,
    folded,
    limits_of,
    turn_from,
    wide_joints,
)
from feasibility.roadmap.proofs.statements import Budget

MOST_SEEDS = 12  # handed back by an attempt


@dataclass(frozen=True, eq=False, slots=True)
class ProofAttempt:
    """What came of an attempt."""

    tree: CutTree | None
    """The proof, if there is one."""
    boxes: int
    """Boxes examined."""
    seeds: tuple[tuple[int, Array], ...]
    """(cell, (n,) configuration) that no component of the search explains; the cell is the nearest
    one where it is not covered. Joints of more than a turn may be at another winding."""
    open_gaps: tuple[OpenGap, ...]
    """What prevented it, where there is no proof: gaps in which there are points of the motion
    set, or not enough boxes were left."""
    boxes_left: float
    """An estimate of the boxes that the proof still needs, where its cuts are found and none of its
    leaves is refuted; inf where that is not so, 0 where there is a proof."""


@dataclass(eq=False)
class Prover:
    """Proofs about one search: the motion set of `arrays` over a target surface."""

    arrays: SearchArrays
    places: PlaceParts
    rng: np.random.Generator
    newton: bool = True
    """Whether guesses are tried by Newton before branch and bound."""
    findings: CutFindings = field(init=False)
    opened: dict[int, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Nothing is known yet."""
        self.findings = CutFindings(self.arrays, self.places, self.rng, self.newton)

    def attempt(
        self, components: list[Component], boxes: int, tick: Callable[[], None]
    ) -> ProofAttempt:
        """Try to prove that no motion covers every cell.

        Args:
            components: what the search knows, each with samples of its motions and its cells.
            boxes: how many may be examined.
            tick: called between batches of boxes; may raise, and then the next attempt goes on
                with what is proved so far.
        """
        budget = Budget(self.arrays, self.findings.work, boxes, tick)
        limits = limits_of(self.arrays, self.places)
        self.findings.forget_seeds()
        open_gaps: list[OpenGap] = []
        boxes_left = np.inf
        if limits.over_one_turn().is_finite:
            self.findings.look_around(limits)
            for opened, joints in self._plans(budget, limits, components):
                guess = Guessing(self.findings, budget, joints, opened)
                root = self._root(guess, limits, components)
                if root is not None:
                    return ProofAttempt(
                        CutTree(root, tuple(opened.items())), budget.spent, (), (), 0.0
                    )
                open_gaps += guess.open_gaps
                boxes_left = min(boxes_left, guess.boxes_left)
                if self.findings.uncovered:
                    break  # what is known of the components is wrong
        seeds = (*self.findings.uncovered, *self.findings.on_cuts)[:MOST_SEEDS]
        return ProofAttempt(None, budget.spent, seeds, tuple(open_gaps), float(boxes_left))

    def _root(
        self, guess: Guessing, limits: JointRegion, components: list[Component]
    ) -> Cut | Leaf | None:
        """The root of a tree, with one turn of each joint that is opened."""
        region = limits
        for joint, t in guess.opened.items():
            region = turn_from(region, joint, t)
        return guess.tree(region, [c._replace(q=folded(c.q, guess.opened)) for c in components])

    def _plans(
        self, budget: Budget, limits: JointRegion, components: list[Component]
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
        saved = budget.left // 2
        budget.left -= saved
        yield {}, narrow
        budget.left += saved
        self._open(budget, limits, components, wide)
        if self.opened:
            yield dict(self.opened), (*narrow, *self.opened)
        bounded = [j for j in wide if np.isfinite(limits.high[j] - limits.low[j])]
        if bounded:
            free = {j: t for j, t in self.opened.items() if j not in bounded}
            yield free, (*narrow, *bounded, *free)

    def _open(
        self, budget: Budget, limits: JointRegion, components: list[Component], wide: list[int]
    ) -> None:
        """Open wide joints where that is possible."""
        for joint in wide:
            if joint in self.opened:
                continue
            split = first_proved(
                self.findings,
                budget,
                (
                    (joint, t, turn_from(limits, joint, t).on(joint, t))
                    for t in openings(joint, components, self.findings.samples)
                ),
            )
            if split is not None:
                self.opened[joint] = split[1]
