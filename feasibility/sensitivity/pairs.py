"""Two changes that make a case feasible together, where no single one does.

Wider limits, a wider cone and smaller clearances only ever help. So they are all opened at once; if
that is feasible, they are put back one after another as long as it stays feasible, and what cannot
be put back is needed. A shift of the surface, which may do harm too, is tried in a few sizes, alone
with the others opened, and with a second shift.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from coverable_arrays import Array
from feasibility.clock import Clock
from feasibility.roadmap import Ruling
from feasibility.sensitivity.limited_search import LimitedAttempt
from feasibility.sensitivity.probes import Prober
from feasibility.sensitivity.quantities import Kind, Quantity, Variant
from feasibility.sensitivity.threshold_search import HINT_BOXES, ThresholdSearch
from feasibility.sensitivity.thresholds import Change, ChangePair, Finding
from feasibility.verdict import Verdict

Step = tuple[Quantity, int]
SHIFTS = (0.2, 0.5, 1.0)  # [1] of the largest shift: sizes that are tried
NARROWING = 3  # verdicts' worth of evaluations for each side of a pair
LAST_PUT_BACK = (Kind.ROLL, Kind.CONE, Kind.CLEARANCE, Kind.TOOL_CLEARANCE)
RULED = 3  # cells for which a proof is attempted before a search


@dataclass
class PairSearch:
    """The search for two changes that do together what none does alone."""

    given: Variant
    verdict: Verdict
    seeds: Array
    """(N, n) configurations of the best component; NaN where it has none."""
    cost: int
    """Evaluations that one verdict of the case takes."""
    most: int
    """Evaluations after which no further search is begun."""
    clock: Clock
    tick: Callable[[], None]
    spent: int = 0

    def find(self, varied: Sequence[Quantity]) -> ChangePair | None:
        """The pair, each change as small as it was found to do; None where none was found."""
        for steps in self._sets(varied):
            if len(steps) == 2 and (pair := self._narrowed(steps)) is not None:
                return pair
        return None

    def _sets(self, varied: Sequence[Quantity]) -> Iterator[list[Step]]:
        """Sets of changes that were found to be feasible, no member of which can be left out."""
        shifts = [q for q in varied if q.kind is Kind.SHIFT]
        # The cone is put back last: of two pairs the one with it needs fewer new joint limits.
        helpers = [q for q in varied if q.kind in (Kind.LOWER, Kind.UPPER)]
        helpers += [q for q in varied if q.kind in LAST_PUT_BACK]
        opened = [(quantity, quantity.last) for quantity in helpers]
        if self._feasible(opened) is not None:
            yield self._needed(opened, ())
        for share in SHIFTS:
            for shift in shifts:
                moved = [(shift, max(1, round(share * shift.last)))]
                if self._feasible([*moved, *opened]) is not None:
                    yield self._needed([*moved, *opened], moved)
            for pair in itertools.combinations(shifts, 2):
                if pair[0].axis != tuple(-x for x in pair[1].axis):
                    both = [(shift, max(1, round(share * shift.last))) for shift in pair]
                    if self._feasible(both) is not None:
                        yield both

    def _needed(self, steps: list[Step], kept: Sequence[Step]) -> list[Step]:
        """Those of some changes that are feasible together which cannot be left out."""
        needed = list(steps)
        for step in steps:
            rest = [other for other in needed if other is not step]
            if step not in kept and len(needed) > 1 and self._feasible(rest) is not None:
                needed = rest
        return needed

    def _feasible(self, steps: Sequence[Step]) -> LimitedAttempt | None:
        """A covering motion of the case with some changes; None where none is found."""
        if self.spent > self.most or self.clock.out_of_time:
            return None
        prober = self._prober(steps)
        attempt = self._searched(prober)
        self.spent += prober.spent
        return attempt

    def _searched(self, prober: Prober) -> LimitedAttempt | None:
        """See `_feasible`: what bounds rule out at once is not searched."""
        if prober.beyond_reach(prober.arrays).any():
            return None
        missed = np.flatnonzero(~np.isfinite(self.seeds).all(axis=1))
        seeds = self.seeds.copy()
        for k in np.unique(np.linspace(0, len(missed) - 1, min(RULED, len(missed))).astype(int)):
            ruling, q = prober.rule(prober.arrays, int(missed[k]), HINT_BOXES)
            if ruling is Ruling.PROVED:
                return None
            if q is not None:
                seeds[missed[k]] = q
        attempt = prober.attempt(prober.arrays, seeds, self.cost, deep=True)
        attempt = prober.confirmed(prober.given, attempt)
        return attempt if attempt.found else None

    def _prober(self, steps: Sequence[Step]) -> Prober:
        """What searches the case with some changes."""
        variant = self.given
        for quantity, k in steps:
            variant = quantity.applied(variant, k)
        return Prober(variant, self.verdict.seed, self.clock, self.tick)

    def _narrowed(self, steps: list[Step]) -> ChangePair | None:
        """Both changes made as small as they were found to do, one after the other."""
        attempt = self._feasible(steps)
        if attempt is None:
            return None
        walk, steps = attempt.walk, list(steps)
        for index in (0, 1):
            quantity = steps[index][0]
            prober = self._prober([steps[1 - index]])
            search = ThresholdSearch(prober, quantity, self.cost, NARROWING * self.cost)
            verdict = self.verdict
            start = Finding(quantity.given, verdict.answer, verdict.evidence, verdict.message)
            threshold = search.widen(start, self.seeds)
            self.spent += prober.spent
            if threshold.feasible is not None and search.good is not None:
                walk = threshold.feasible.witness
                steps[index] = quantity, search.good.k
        changes = tuple(Change(quantity, quantity.value(k)) for quantity, k in steps)
        return None if walk is None else ChangePair(changes, walk)
