"""Attempts at a cut proof between the rounds of a search, and what they teach it.

An attempt costs little beside rounds that gain nothing. What refutes its guesses are configurations
that the search did not know: they go back into it as seeds. Where points of the motion set were
found on every cut between two components, the two may well be joined by a motion that was not
found; that is told, and such a search does not count as exhausted.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from feasibility.cut_tree import CutTree
from feasibility.roadmap.cuts import Blocked, Prover, components_of, places_on
from feasibility.roadmap.exploration import Exploration, wound
from feasibility.task import Task
from surfaces import SurfaceError

FIRST_BOXES = 20_000  # of the first attempts
MORE_BOXES = 200_000  # of later ones
FIRST_AFTER, MORE_AFTER = 1, (4, 12)  # rounds without gain after which an attempt is made
ATTEMPTS = 6  # in a row, as long as each finds seeds that gain something


@dataclass
class Proving:
    """Proofs that no single motion covers every cell, from what one search knows."""

    exploration: Exploration
    task: Task
    tree: CutTree | None = None
    """The proof, once there is one."""
    blocked: tuple[Blocked, ...] = ()
    """What kept the last attempt, see `Attempt.blocked`."""
    boxes: int = 0
    attempts: int = 0
    unable: str = ""
    """Why nothing can be proved about this surface; empty where it can."""
    _prover: Prover | None = field(default=None, init=False)

    def after(self, dry: int) -> bool:
        """After so many rounds without gain: try a proof. True when there is one, or a gain."""
        if dry != FIRST_AFTER and dry not in MORE_AFTER:
            return False
        budget = FIRST_BOXES if dry == FIRST_AFTER else MORE_BOXES
        gained = False
        for _ in range(ATTEMPTS):
            seeded = self._attempt(budget)
            gained |= seeded
            if self.tree is not None or not seeded or self.exploration.complete:
                break
        return gained or self.tree is not None

    def _attempt(self, budget: int) -> bool:
        """One attempt; True when its seeds made the search grow."""
        exploration = self.exploration
        prover = self._ready()
        if prover is None:
            return False

        def tick() -> None:
            exploration.tick("proving that no motion joins the parts")

        made = prover.attempt(components_of(exploration.roadmap), budget, tick)
        self.attempts += 1
        self.boxes += made.boxes
        self.tree, self.blocked = made.tree, made.blocked
        before = exploration.sizes()
        for cell, q in made.seeds:
            exploration.add_seeds(cell, wound(exploration.arrays, q)[None])
        return exploration.sizes() != before

    def _ready(self) -> Prover | None:
        """The prover, made when it is first needed; None where the surface has no bounds."""
        if self._prover is None and not self.unable:
            try:
                places = places_on(self.exploration.cells.surface, self.task)
            except SurfaceError as error:
                self.unable = str(error)
                return None
            # Random numbers of its own: whether it is tried does not change the search.
            rng = np.random.default_rng([self.exploration.seed, 1])
            self._prover = Prover(self.exploration.arrays, places, rng)
        return self._prover
