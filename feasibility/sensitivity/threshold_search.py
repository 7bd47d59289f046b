"""The search for a threshold: at which value of one quantity the verdict changes.

From a value with a covering motion towards one without: the motion's configurations are projected
again, value by value (`WarmStart`), which shows how far this motion can go and which cell is the
first to fail. A short search at that value confirms it. Past it a proof is attempted for that cell;
what it finds instead is a configuration of another branch, which may go further.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from coverable_arrays import Array
from feasibility.roadmap import Ruling
from feasibility.sensitivity.limited_search import NO_CELL, LimitedAttempt, held
from feasibility.sensitivity.probes import Prober
from feasibility.sensitivity.quantities import Kind, Quantity
from feasibility.sensitivity.thresholds import Finding, Span, Threshold
from feasibility.sensitivity.warm_start import Reached, WarmStart, last_true
from feasibility.verdict import Answer, Evidence

PROOF_BOXES = 3000  # for one cell
HINT_BOXES = 1500  # for one cell, where a configuration is as welcome as a proof
BEYOND = (5, 2, 1)  # steps past the last feasible value at which a proof is attempted
PROOFS = 3  # cells for which a proof is attempted before a search is made
SCAN = 20  # values tried on the way to the end of a quantity that is not monotone
SEARCHES = 2  # short of one that failed, even when none should be begun any more
MORE_SEARCHES = 4  # the same where none has found anything
BACKS = (0.1, 0.3)  # [1] where the search fails at the end: the next ones are that much nearer
ALONE = 3.0  # verdicts' worth of evaluations that a search may take without any seeds
SHORT = 0.8  # verdicts' worth of evaluations that a search from known configurations may take


class Probe(NamedTuple):
    """A number of steps, and what a search found there."""

    k: int
    attempt: LimitedAttempt


class Bracket(NamedTuple):
    """Between which steps the threshold is, after warm starts and short searches."""

    good: Probe
    bad: int
    """Steps at which no motion was found, the nearest to `good`; or the far end."""
    failed: int
    """The cell that does not project there; `NO_CELL` where a search failed."""
    other: Finding | None
    """What the search found at `bad`; None without one."""


@dataclass
class ThresholdSearch:
    """The search for one threshold."""

    prober: Prober
    quantity: Quantity
    verdict_cost: int
    """Evaluations that one verdict of the case takes."""
    stop: int
    """Evaluations (of the prober) at which no further search is begun, except to end with one."""
    motions: Sequence[LimitedAttempt] = ()
    """Covering motions of the case as given, the one of its verdict first."""
    rivals: list[Probe] = field(default_factory=list)
    """The same, as far as each goes unchanged, the furthest first; none that was tried."""
    good: Probe | None = None
    """The last feasible probe that was found."""

    # -- a case that is feasible as given -------------------------------------------------------

    def tighten(self) -> Threshold:
        """How far the quantity can go before the case is no longer feasible."""
        end = self.quantity.last + 1
        # The cone is no matter of posture, and replaying each motion for its angle is expensive.
        motions = self.motions[: 1 if self.quantity.kind is Kind.CONE else None]
        probes = [self._extended(Probe(0, attempt), end) for attempt in motions]
        self.rivals = sorted(probes, key=lambda probe: -probe.k)
        good, other = self._outwards(self.rivals.pop(0))
        reported = self.reported(good)
        if not reported.feasible:  # the replay refuses what the search found
            return Threshold(self.quantity, self.reported(Probe(0, self.motions[0])), reported)
        self.good = good
        return Threshold(self.quantity, reported, other)

    def tighter(self, found: Threshold) -> Threshold:
        """The same threshold, its sides brought nearer to each other if that succeeds."""
        good, other = self.good, found.other
        if good is None or other is None:
            return found
        good, beyond = self.narrow(good, self.quantity.steps_to(other.value), other)
        reported = self.reported(good)
        if not reported.feasible:
            return found
        self.good = good
        return Threshold(self.quantity, reported, beyond)

    def alone(self, found: Threshold, stop: float) -> Threshold:
        """The same threshold; its feasible side says whether a search without seeds finds it.

        Args:
            found: what this search found.
            stop: evaluations (of the prober) at which that is left open.
        """
        most = min(ALONE * self.verdict_cost, stop - self.prober.spent)
        if found.feasible is None or self.good is None or self.good.k == 0 or most <= 0.0:
            return found
        arrays = self.prober.arrays_at(self.quantity, self.good.k)
        nothing = np.full_like(self.good.attempt.q, np.nan)
        attempt = self.prober.attempt(arrays, nothing, most, deep=True)
        attempt = held(self.prober.given, attempt, (self.quantity, self.good.k), False)
        late = self.prober.clock.out_of_time
        cut_short = late or most < ALONE * self.verdict_cost
        unaided = None if cut_short and not attempt.found else attempt.found
        return replace(found, feasible=replace(found.feasible, unaided=unaided))

    def _outwards(self, here: Probe) -> tuple[Probe, Finding | None]:
        """The last feasible probe on the way to the end, what was found past it, if anything."""
        end = self.quantity.last
        if self.quantity.monotone:
            cell, q = self.prober.follow(self.prober.arrays_at(self.quantity, end), here.attempt.q)
            if cell == NO_CELL:
                attempt = self._search(end, q)
                if attempt.found:
                    return Probe(end, attempt), None
                return self.narrow(here, end, self._finding(end, attempt))
        return self.narrow(here, end + 1)

    # -- a case that is not ----------------------------------------------------------------------

    def widen(self, here: Finding, seeds: Array) -> Threshold:
        """How far the quantity has to go for the case to become feasible.

        Args:
            here: the verdict of the case as given.
            seeds: (N, n) configurations of its best component; NaN where it has none.
        """
        last = self.quantity.last
        count = 1 if self.quantity.monotone else min(SCAN, last)
        values = [max(1, round(last * (i + 1) / count)) for i in range(count)]
        known, before, looked, proved = here, 0, 0, 0
        for k in values:
            if looked and self.prober.spent >= self.stop:
                break
            looked += 1
            found = self._look(k, seeds)
            if isinstance(found, Finding):
                known, before = found, k
                proved += found.evidence is Evidence.PROOF
                continue
            entry = Probe(k, found)
            good, other = self.narrow(entry, before)
            reported = self.reported(good)
            if not reported.feasible:
                return Threshold(self.quantity, None, reported)
            self.good = good
            return Threshold(self.quantity, reported, other or known, self._span(entry))
        if self.quantity.monotone:
            return Threshold(self.quantity, None, known)
        tried = f"{looked} of {count} values tried, {proved} of them proved infeasible"
        return Threshold(self.quantity, None, known, None, tried, each_proved=proved == count)

    def _span(self, entry: Probe) -> Span | None:
        """How far on a standoff stays feasible; None for other quantities."""
        if self.quantity.kind is not Kind.STANDOFF:
            return None
        good, other = self._outwards(entry)
        reported = self.reported(good)
        return Span(reported, other) if reported.feasible else Span(self.reported(entry), reported)

    def _look(self, k: int, seeds: Array) -> LimitedAttempt | Finding:
        """Is it feasible at k steps? An attempt if so, or what speaks against it."""
        arrays = self.prober.arrays_at(self.quantity, k)
        missed = np.flatnonzero(~np.isfinite(seeds).all(axis=1))
        spread = missed[np.linspace(0, len(missed) - 1, min(PROOFS, len(missed))).astype(int)]
        hard = [cell for cell in self.prober.suspects if cell in missed]
        far = self.prober.beyond_reach(arrays)
        if far.any():
            return self._proof(k, int(far.argmax()))
        seeds = seeds.copy()
        for cell in list(dict.fromkeys([*hard, *spread.tolist()]))[:PROOFS]:
            ruling, q = self.prober.rule(arrays, cell, HINT_BOXES, (self.quantity, k))
            if ruling is Ruling.PROVED:
                return self._proof(k, cell)
            if q is None:
                break  # neither a proof nor a configuration: the next cell would add nothing
            seeds[cell] = q
        nowhere = not np.isfinite(seeds).any()
        attempt = self._search(k, seeds, deep=self.quantity.monotone or nowhere)
        return attempt if attempt.found else self._finding(k, attempt)

    # -- between the two -------------------------------------------------------------------------

    def narrow(
        self, good: Probe, far: int, there: Finding | None = None
    ) -> tuple[Probe, Finding | None]:
        """From a feasible value towards one that is not, until they are neighbours or nearly so.

        Args:
            good: a feasible probe.
            far: steps where it is not feasible, or one past the end.
            there: what a search found at `far`, although the motion can be followed to it.

        Returns:
            The last feasible probe, and what was found on the other side, `there` if that is `far`.
        """
        while True:
            bracket = self._follow(good, far, there)
            if bracket.bad == far and abs(far - bracket.good.k) == 1:
                return bracket.good, there
            beyond = self._beyond(bracket, far)
            if isinstance(beyond, Finding):
                return bracket.good, beyond
            good = beyond
            if abs(far - good.k) == 1:
                return good, there

    def _follow(self, good: Probe, far: int, there: Finding | None) -> Bracket:
        """As far as a motion's configurations project, and a short search agrees."""
        good = self._extended(good, far)
        begun, bad, other, searches, backs = good.k, far, there, 0, list(BACKS)
        if there is None:
            reached = self._furthest(good, far)
        else:
            reached = self._short_of(good, far, good.attempt.q, 0.5)
        while reached.k != good.k:
            attempt = self._search(reached.k, reached.q)
            if attempt.found:
                good = self._extended(Probe(reached.k, attempt), bad)
                if other is None:
                    reached = self._reach(good, bad)
                    continue
                backs = []
            else:
                bad, other = reached.k, self._finding(reached.k, attempt)
            searches += 1
            enough = SEARCHES if good.k != begun else MORE_SEARCHES
            if searches > enough and self.prober.spent >= self.stop:
                break
            reached = self._short_of(good, bad, reached.q, backs.pop(0) if backs else 0.5)
        if other is not None:
            return Bracket(good, bad, NO_CELL, other)
        return Bracket(good, good.k + (1 if far > good.k else -1), reached.cell, None)

    def _reach(self, good: Probe, bad: int) -> Reached:
        """How far the configurations of a motion project."""
        return WarmStart(self.prober, self.quantity, good.k, good.attempt.q).reach(bad)

    def _furthest(self, good: Probe, far: int) -> Reached:
        """The same, of this motion and those of the case as given, whichever goes furthest."""
        sign = 1 if far > good.k else -1
        best = self._reach(good, far)
        while self.rivals:
            k, attempt = self.rivals.pop(0)
            beyond = best.k + sign
            if beyond == far:
                return best
            warm = WarmStart(self.prober, self.quantity, k, attempt.q)
            if k * sign > best.k * sign or warm.reaches(beyond):
                reached = warm.reach(far)
                if reached.k * sign > best.k * sign:
                    best = reached
        return best

    def _short_of(self, good: Probe, bad: int, q: Array, share: float) -> Reached:
        """Short of a failed search by a share of the way to it, with its configurations."""
        back = max(round(share * abs(bad - good.k)), 1)
        return Reached(bad - back if bad > good.k else bad + back, q, NO_CELL)

    def _extended(self, good: Probe, bad: int) -> Probe:
        """As far as the unchanged motion keeps to the limit or to the cone."""
        walk, joint, value = good.attempt.walk, self.quantity.joint, self.quantity.value
        if walk is None or self.quantity.kind not in (Kind.CONE, Kind.LOWER, Kind.UPPER):
            return good
        if self.quantity.kind is Kind.CONE:
            variant = self.quantity.applied(self.prober.given, good.k)
            attempt = self.prober.confirmed(variant, good.attempt)
            if attempt.angle is None:
                return good
            angle, good = attempt.angle, Probe(good.k, attempt)
            k = last_true(lambda k: value(k) > angle, good.k, bad)
        else:
            sign = 1.0 if self.quantity.kind is Kind.LOWER else -1.0
            least = float((sign * walk.q[:, joint]).min())
            k = last_true(lambda k: sign * value(k) <= least, good.k, bad)
        return Probe(min(k, self.quantity.last), good.attempt)

    def _beyond(self, bracket: Bracket, far: int) -> Probe | Finding:
        """Past the last feasible value: a proof, or a motion after all, or nothing found."""
        k, seeds = bracket.bad, np.full_like(bracket.good.attempt.q, np.nan)
        if bracket.failed != NO_CELL:
            proof, q = self._proof_beyond(bracket, far)
            if proof is not None:
                return proof
            k = bracket.good.k + (1 if far > bracket.good.k else -1)
            if q is not None:
                seeds[bracket.failed] = q
        elif bracket.other is not None and abs(bracket.bad - bracket.good.k) > 1:
            return bracket.other  # the limit of evaluations ended the bisection
        # This motion goes no further. Another one may, so the search begins afresh.
        hard = [bracket.failed, *self.prober.suspects][bracket.failed == NO_CELL :][:1]
        attempt = self._search(k, seeds, deep=True, hard=hard[0] if hard else NO_CELL)
        return Probe(k, attempt) if attempt.found else self._finding(k, attempt)

    def _proof_beyond(self, bracket: Bracket, far: int) -> tuple[Finding | None, Array | None]:
        """A proof of the cell that failed, as near as one is found; or what covers that cell."""
        sign = 1 if far > bracket.good.k else -1
        proof, q = None, None
        for steps in (s for s in BEYOND if (far - bracket.good.k) * sign > s):
            k = bracket.good.k + sign * steps
            arrays = self.prober.arrays_at(self.quantity, k)
            ruling, q = self.prober.rule(arrays, bracket.failed, PROOF_BOXES, (self.quantity, k))
            if ruling is not Ruling.PROVED:
                break
            proof = self._proof(k, bracket.failed)
        return proof, q

    def _search(
        self, k: int, seeds: Array, deep: bool = False, hard: int = NO_CELL
    ) -> LimitedAttempt:
        """Search at k steps: from the seeds alone, or deeper, with half of what is left."""
        left = self.stop - self.prober.spent
        most = max(left, self.verdict_cost) // 2 if deep else SHORT * self.verdict_cost
        arrays = self.prober.arrays_at(self.quantity, k)
        attempt = self.prober.attempt(arrays, seeds, most, deep, hard=hard)
        return held(self.prober.given, attempt, (self.quantity, k), False)

    def reported(self, probe: Probe) -> Finding:
        """A feasible probe as a finding, once its motion is replayed."""
        variant = self.quantity.applied(self.prober.given, probe.k)
        return self._finding(probe.k, self.prober.confirmed(variant, probe.attempt))

    def _finding(self, k: int, found: LimitedAttempt) -> Finding:
        """What was found at k steps."""
        value = self.quantity.value(k)
        return Finding(value, found.answer, found.evidence, found.detail, witness=found.walk)

    def _proof(self, k: int, cell: int) -> Finding:
        """A cell that is proved uncoverable at k steps."""
        value, name = self.quantity.value(k), list(self.prober.given.cells.unravel(cell))
        detail = f"cell {name} is proved uncoverable"
        return Finding(value, Answer.INFEASIBLE, Evidence.PROOF, detail, cell)
