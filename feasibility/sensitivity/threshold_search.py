"""Where the verdict turns along one quantity: few dear questions, led by many cheap ones.

From a value with a covering motion towards one without: the motion's configurations are put back
onto the fibres, value by value (`Prober.follow`), which tells how far this motion can go and which
cell is the first to fail. A short search at that value confirms it. Past it that cell is asked for
a proof; what the proof finds instead is a configuration of another branch, which may go further.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from feasibility.roadmap import Ruling
from feasibility.sensitivity.limited_search import Trial
from feasibility.sensitivity.parameters import Kind, Quantity
from feasibility.sensitivity.probes import Prober
from feasibility.sensitivity.thresholds import Finding, Span, Threshold, last_true
from feasibility.sensitivity.warm_start import NO_CELL, Carrying, Reached
from feasibility.verdict import Answer, Evidence

PROOF_BOXES = 3000  # for one cell
HINT_BOXES = 1500  # for one cell, where a configuration is as welcome as a proof
BEYOND = (5, 2, 1)  # steps past the last feasible value at which a proof is looked for
LOOKED_AT = 3  # cells asked for a proof before a search is made
SCAN = 20  # values looked at on the way to the end of a quantity that is not monotone
SEARCHES = 2  # short of one that failed, even when none should be begun any more
MORE_SEARCHES = 4  # the same where none has found anything
BACKS = (0.1, 0.3)  # [1] where the search fails at the end: the next ones are that much nearer
SHORT = 0.8  # verdicts' worth of evaluations that a search from known configurations may take


class Side(NamedTuple):
    """A number of steps, and what was found there."""

    k: int
    trial: Trial


class Edge(NamedTuple):
    """Where carrying a motion's configurations, and short searches, have led."""

    good: Side
    bad: int
    """Steps at which no motion was found, the nearest to `good`; or the far end."""
    failed: int
    """The cell that could not be carried to there; `NO_CELL` where a search failed."""
    other: Finding | None
    """What the search found there; None without one."""


@dataclass
class Turning:
    """The search for one threshold."""

    prober: Prober
    quantity: Quantity
    verdict_cost: int
    """Evaluations that one verdict of the case takes."""
    stop: int
    """Evaluations (of the prober) at which no further search is begun, except to end with one."""
    motions: Sequence[Trial] = ()
    """Covering motions of the case as it stands, the one of its verdict first."""
    rivals: list[Side] = field(default_factory=list)
    """The same, as far as each goes as it is, the furthest first; none that was looked at."""
    good: Side | None = None
    """The last feasible side of a margin that was found."""

    # -- a case that is feasible as it stands ----------------------------------------------------

    def tighten(self) -> Threshold:
        """How far the quantity can go before the case is no longer feasible."""
        end = self.quantity.last + 1
        # The cone is no matter of posture, and asking each motion for its angle is dear.
        motions = self.motions[: 1 if self.quantity.kind is Kind.CONE else None]
        sides = [self._slid(Side(0, trial), end) for trial in motions]
        self.rivals = sorted(sides, key=lambda side: -side.k)
        good, other = self._outwards(self.rivals.pop(0))
        told = self._told(good)
        if not told.feasible:  # the replay refuses what the search found
            return Threshold(self.quantity, self._told(Side(0, self.motions[0])), told)
        self.good = good
        return Threshold(self.quantity, told, other)

    def tighter(self, found: Threshold) -> Threshold:
        """The same threshold, its sides brought nearer to each other if that succeeds."""
        good, other, apart = self.good, found.other, found.steps_apart
        if good is None or other is None:
            return found
        near = (good.k + apart + k for k in (0, 1, -1))
        bad = next((k for k in near if self.quantity.value(k) == other.value), None)
        if bad is None:
            return found
        good, beyond = self._narrow(good, bad, other)
        told = self._told(good)
        return Threshold(self.quantity, told, beyond) if told.feasible else found

    def _outwards(self, here: Side) -> tuple[Side, Finding | None]:
        """The last feasible side on the way to the end; and what was found past it, if anything."""
        end = self.quantity.last
        if self.quantity.monotone:
            cell, q = self.prober.follow(self.prober.problem_at(self.quantity, end), here.trial.q)
            if cell == NO_CELL:
                trial = self._search(end, q)
                if trial.found:
                    return Side(end, trial), None
                return self._narrow(here, end, self._finding(Side(end, trial)))
        return self._narrow(here, end + 1)

    # -- a case that is not ----------------------------------------------------------------------

    def widen(self, here: Finding, seeds: NDArray[np.float64]) -> Threshold:
        """How far the quantity has to go for the case to become feasible.

        Args:
            here: the verdict as the case stands.
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
            entry = Side(k, found)
            good, other = self._narrow(entry, before)
            told = self._told(good)
            if not told.feasible:
                return Threshold(self.quantity, None, told)
            return Threshold(self.quantity, told, other or known, self._span(entry))
        tried = ""
        if not self.quantity.monotone:
            tried = f"{looked} of {count} values tried, {proved} of them proved infeasible"
        return Threshold(self.quantity, None, known, None, tried)

    def _span(self, entry: Side) -> Span | None:
        """How far on a standoff stays feasible; None for other quantities."""
        if self.quantity.kind is not Kind.STANDOFF:
            return None
        good, other = self._outwards(entry)
        told = self._told(good)
        return Span(told, other) if told.feasible else Span(self._told(entry), told)

    def _look(self, k: int, seeds: NDArray[np.float64]) -> Trial | Finding:
        """Is it feasible at k steps? A trial if so, or what speaks against it."""
        problem = self.prober.problem_at(self.quantity, k)
        missed = np.flatnonzero(~np.isfinite(seeds).all(axis=1))
        spread = missed[np.linspace(0, len(missed) - 1, min(LOOKED_AT, len(missed))).astype(int)]
        hard = [cell for cell in self.prober.suspects if cell in missed]
        far = self.prober.beyond_reach(problem)
        if far.any():
            return self._proof(k, int(far.argmax()))
        seeds = seeds.copy()
        for cell in list(dict.fromkeys([*hard, *spread.tolist()]))[:LOOKED_AT]:
            ruling, q = self.prober.rule(problem, cell, HINT_BOXES)
            if ruling is Ruling.PROVED:
                return self._proof(k, cell)
            if q is None:
                break  # neither a proof nor a configuration: the next cell would tell no more
            seeds[cell] = q
        nowhere = not np.isfinite(seeds).any()
        trial = self._search(k, seeds, deep=self.quantity.monotone or nowhere)
        return trial if trial.found else self._finding(Side(k, trial))

    # -- between the two -------------------------------------------------------------------------

    def _narrow(
        self, good: Side, far: int, there: Finding | None = None
    ) -> tuple[Side, Finding | None]:
        """From a feasible value towards one that is not, until they are neighbours or nearly so.

        Args:
            good: a feasible side.
            far: steps where it is not feasible, or one past the end.
            there: what a search found at `far`, although the motion can be followed to it.

        Returns:
            The last feasible side, and what was found on the other one, `there` if that is `far`.
        """
        while True:
            edge = self._follow(good, far, there)
            if edge.bad == far and abs(far - edge.good.k) == 1:
                return edge.good, there
            beyond = self._beyond(edge, far)
            if isinstance(beyond, Finding):
                return edge.good, beyond
            good = beyond
            if abs(far - good.k) == 1:
                return good, there

    def _follow(self, good: Side, far: int, there: Finding | None) -> Edge:
        """As far as a motion's configurations can be carried, and a short search agrees."""
        good = self._slid(good, far)
        begun, bad, other, searches, backs = good.k, far, there, 0, list(BACKS)
        if there is None:
            reached = self._furthest(good, far)
        else:
            reached = self._short_of(good, far, good.trial.q, 0.5)
        while reached.k != good.k:
            trial = self._search(reached.k, reached.q)
            if trial.found:
                good = self._slid(Side(reached.k, trial), bad)
                if other is None:
                    reached = self._reach(good, bad)
                    continue
                backs = []
            else:
                bad, other = reached.k, self._finding(Side(reached.k, trial))
            searches += 1
            enough = SEARCHES if good.k != begun else MORE_SEARCHES
            if searches > enough and self.prober.spent >= self.stop:
                break
            reached = self._short_of(good, bad, reached.q, backs.pop(0) if backs else 0.5)
        if other is not None:
            return Edge(good, bad, NO_CELL, other)
        return Edge(good, good.k + (1 if far > good.k else -1), reached.cell, None)

    def _reach(self, good: Side, bad: int) -> Reached:
        """How far the configurations of a motion can be carried."""
        return Carrying(self.prober, self.quantity, good.k, good.trial.q).reach(bad)

    def _furthest(self, good: Side, far: int) -> Reached:
        """The same, of this motion and those of the case as it stands, whichever go furthest."""
        way = 1 if far > good.k else -1
        best = self._reach(good, far)
        while self.rivals:
            k, trial = self.rivals.pop(0)
            beyond = best.k + way
            if beyond == far:
                return best
            carrying = Carrying(self.prober, self.quantity, k, trial.q)
            if k * way > best.k * way or carrying.goes_to(beyond):
                reached = carrying.reach(far)
                if reached.k * way > best.k * way:
                    best = reached
        return best

    def _short_of(self, good: Side, bad: int, q: NDArray[np.float64], share: float) -> Reached:
        """Short of a failed search by a share of the way to it, with its configurations."""
        back = max(round(share * abs(bad - good.k)), 1)
        return Reached(bad - back if bad > good.k else bad + back, q, NO_CELL)

    def _slid(self, good: Side, bad: int) -> Side:
        """As far as the motion itself, as it is, keeps to the limit or to the cone."""
        walk, joint, value = good.trial.walk, self.quantity.joint, self.quantity.value
        if walk is None or not self.quantity.monotone:
            return good
        if self.quantity.kind is Kind.CONE:
            setup = self.quantity.applied(self.prober.setup, good.k)
            trial = self.prober.confirmed(setup, good.trial)
            if trial.angle is None:
                return good
            angle, good = trial.angle, Side(good.k, trial)
            k = last_true(lambda k: value(k) > angle, good.k, bad)
        elif self.quantity.kind is Kind.LOWER:
            least = float(walk.q[:, joint].min())
            k = last_true(lambda k: value(k) <= least, good.k, bad)
        else:
            most = float(walk.q[:, joint].max())
            k = last_true(lambda k: value(k) >= most, good.k, bad)
        return Side(min(k, self.quantity.last), good.trial)

    def _beyond(self, edge: Edge, far: int) -> Side | Finding:
        """Past the last feasible value: a proof, or a motion after all, or nothing found."""
        k, seeds = edge.bad, np.full_like(edge.good.trial.q, np.nan)
        if edge.failed != NO_CELL:
            proof, q = self._proof_beyond(edge, far)
            if proof is not None:
                return proof
            k = edge.good.k + (1 if far > edge.good.k else -1)
            if q is not None:
                seeds[edge.failed] = q
        elif edge.other is not None and abs(edge.bad - edge.good.k) > 1:
            return edge.other  # the ration ended the halving
        # This motion goes no further. Another one may, so the search begins afresh.
        hard = [edge.failed, *self.prober.suspects][edge.failed == NO_CELL :][:1]
        trial = self._search(k, seeds, deep=True, hard=hard[0] if hard else NO_CELL)
        return Side(k, trial) if trial.found else self._finding(Side(k, trial))

    def _proof_beyond(
        self, edge: Edge, far: int
    ) -> tuple[Finding | None, NDArray[np.float64] | None]:
        """A proof of the cell that failed, as near as one is found; or what covers that cell."""
        way = 1 if far > edge.good.k else -1
        proof, q = None, None
        for steps in (s for s in BEYOND if (far - edge.good.k) * way > s):
            k = edge.good.k + way * steps
            problem = self.prober.problem_at(self.quantity, k)
            ruling, q = self.prober.rule(problem, edge.failed, PROOF_BOXES)
            if ruling is not Ruling.PROVED:
                break
            proof = self._proof(k, edge.failed)
        return proof, q

    def _search(
        self, k: int, seeds: NDArray[np.float64], deep: bool = False, hard: int = NO_CELL
    ) -> Trial:
        """Search at k steps: from the seeds alone, or deeper, with half of what is left."""
        left = self.stop - self.prober.spent
        most = max(left, self.verdict_cost) // 2 if deep else SHORT * self.verdict_cost
        problem = self.prober.problem_at(self.quantity, k)
        return self.prober.attempt(problem, seeds, most, deep, hard=hard)

    def _told(self, side: Side) -> Finding:
        """A feasible side, once the replay has seen its motion."""
        setup = self.quantity.applied(self.prober.setup, side.k)
        return self._finding(Side(side.k, self.prober.confirmed(setup, side.trial)))

    def _finding(self, side: Side) -> Finding:
        """A side, as it is told."""
        value, trial = self.quantity.value(side.k), side.trial
        return Finding(value, trial.answer, trial.evidence, trial.detail)

    def _proof(self, k: int, cell: int) -> Finding:
        """A cell that is proved uncoverable at k steps."""
        value, name = self.quantity.value(k), list(self.prober.setup.cells.unravel(cell))
        detail = f"cell {name} is proved uncoverable"
        return Finding(value, Answer.INFEASIBLE, Evidence.PROOF, detail, cell)
