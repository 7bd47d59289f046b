"""Attempts at a cut proof between the rounds of a search, and the seeds that they find.

An attempt costs little beside rounds that gain nothing. What refutes its guesses are configurations
that the search did not know: they go back into it as seeds. Where points of the motion set were
found on every cut between two components, the two may well be joined by a motion that was not
found: the verdict says so, and such a search does not count as exhausted.
"""

from dataclasses import dataclass, field

import numpy as np

from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.proofs.gaps import components_of
from feasibility.roadmap.proofs.guess import OpenGap
from feasibility.roadmap.proofs.prover import Prover
from feasibility.roadmap.proofs.target_places import places_on
from feasibility.roadmap.refinement import COARSE, FINE, refine
from feasibility.roadmap.rounds import restart
from feasibility.roadmap.seeds import wound
from feasibility.targets.blocked import blocked_curves
from feasibility.task import Task
from surfaces.surface import SurfaceError

FIRST, SECOND, THIRD, LAST = 1, 4, 8, 16  # rounds without gain
FEW_CUT_BOXES, MORE_CUT_BOXES = 20_000, 200_000
MOST_BOXES = 1_000_000  # of one attempt
ATTEMPTS = 6  # in a row, as long as each finds seeds that gain something


@dataclass
class Proving:
    """Proofs that no single motion covers every cell, from what one search knows."""

    exploration: Exploration
    """Its `cut_tree` is set once there is a proof."""
    task: Task
    open_gaps: tuple[OpenGap, ...] = ()
    """Of the last attempt, see `ProofAttempt.open_gaps`."""
    starved: bool = False
    """Did the last attempt run out of boxes? Otherwise it had nothing left to prove."""
    boxes: int = 0
    attempts: int = 0
    unable: str = ""
    """Why nothing can be proved about this surface; empty where it can."""
    _left: float = field(default=np.inf, init=False)
    """Boxes that the last attempt estimated to be missing."""
    _prover: Prover | None = field(default=None, init=False)

    @property
    def alarmed(self) -> bool:
        """Do points of the motion set keep every gap open, so that there may well be a motion?"""
        return bool(self.open_gaps) and all(gap.points > 0 for gap in self.open_gaps)

    def attempt(self, budget: int) -> bool:
        """Try a proof, and again as long as the seeds found gain something.

        A budget of boxes may be examined, up to `MOST_BOXES` if it looks as if they would do. True
        when there is a proof, or a gain.
        """
        gained = False
        for _ in range(ATTEMPTS):
            seeded = self._attempt(budget)
            gained |= seeded
            if self.exploration.cut_tree is not None:
                return True
            if self.exploration.complete or not (seeded or self._left < MOST_BOXES):
                break
            budget = max(budget, int(min(2.0 * self._left, MOST_BOXES)) if not seeded else 0)
        return gained

    def _attempt(self, budget: int) -> bool:
        """One attempt; True when its seeds made the search grow."""
        exploration = self.exploration
        prover = self._ready()
        if prover is None:
            return False
        work, told = prover.findings.work, int(prover.findings.work.counts[0])

        def tick() -> None:
            nonlocal told
            more, told = int(work.counts[0]) - told, int(work.counts[0])
            exploration.tick("proving that no motion joins the parts", more)

        made = prover.attempt(components_of(exploration.roadmap), budget, tick)
        self.attempts += 1
        self.boxes += made.boxes
        exploration.cut_tree, self.open_gaps = made.tree, made.open_gaps
        self._left = made.boxes_left
        self.starved = made.boxes >= budget
        before = exploration.sizes()
        for cell, q in made.seeds:
            exploration.add_seeds(cell, wound(exploration.arrays, q)[None])
        return exploration.sizes() != before

    def _ready(self) -> Prover | None:
        """The prover, made when it is first needed; None where there is to be none.

        Over a sharp seam between pieces the targets jump. A tool may well go round in an arc, which
        is not certified, nor ruled out: that nothing is on the surface in between proves nothing.
        """
        if self._prover is None and not self.unable:
            self.unable = blocked_curves(self.exploration.cells, self.task)
            if self.unable:
                return None
            try:
                places = places_on(self.exploration.cells.surface, self.task)
            except SurfaceError as error:
                self.unable = str(error)
                return None
            # Random numbers of its own: whether it is tried does not change the search.
            rng = np.random.default_rng([self.exploration.seed, 1])
            self._prover = Prover(self.exploration.arrays, places, rng)
        return self._prover


def between_rounds(proving: Proving, searched: Task, idle: int) -> None:
    """What is tried after rounds that gained nothing; rounds go on where it gains something.

    In this order, because each costs more than the one before: a cut proof with few boxes; with
    more boxes, and then the surface in finer cells; new starts all over the surface; the finest
    cells and the last proof.

    The search keeps to the task `searched`; `idle` rounds in a row have gained nothing.
    """
    exploration = proving.exploration

    def proved(budget: int) -> bool:
        # Where a cell is proved uncoverable already, only more cells can be gained.
        return not exploration.proved and proving.attempt(budget)

    if not exploration.apart:
        return
    if idle == FIRST:
        proved(FEW_CUT_BOXES)
    elif idle == SECOND and not proved(MORE_CUT_BOXES):
        refine(exploration, searched, COARSE)
    elif idle == THIRD:
        before = exploration.sizes()
        restart(exploration)
        if exploration.sizes() == before:
            proved(MORE_CUT_BOXES)
    elif idle == LAST and not refine(exploration, searched, FINE):
        proved(MORE_CUT_BOXES)
