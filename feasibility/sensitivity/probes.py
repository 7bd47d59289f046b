"""Where the verdict changes along one quantity: searches with a limited effort, by halving.

Each begins from the motion found at the nearest feasible value. What is said in the end, `check`
says: of the feasible side, from that motion; of the other side with none known, with the same
effort, unless it is proved.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import NamedTuple

from coverable.errors import counted
from feasibility.checking import check
from feasibility.clock import Clock, OutOfTime
from feasibility.cut_tree import CutTree
from feasibility.problem import Problem
from feasibility.roadmap.complete import complete_search
from feasibility.search_settings import Search
from feasibility.sensitivity.quantities import Kind, Quantity, Variant
from feasibility.sensitivity.thresholds import Finding, Threshold
from feasibility.verdict import Answer, Certificate, Evidence, Verdict, Walk

# [1] of the way to its end, values of what is not monotone: doubling from a feasible one, so that
# what is found is the stretch around it, or more of them all along.
NEARBY = (1 / 8, 1 / 4, 1 / 2, 1)
ALL_ALONG = (1 / 32, 1 / 16, 1 / 8, 3 / 16, 1 / 4, 3 / 8, 1 / 2, 5 / 8, 3 / 4, 7 / 8, 1)
MARGINS, REMEDIES = 16, 256  # parts of a stretch that a threshold is found to, of both kinds
SUSPECTS = 3  # cells that a search looks at first
SEEDED = 0.5  # [1] of the effort of a search without a known motion

Steps = tuple[tuple[Quantity, int], ...]
"""Quantities, and how many steps each is from the value given."""


def last_true(holds: Callable[[int], bool], good: int, bad: int, least: int = 1) -> tuple[int, int]:
    """The last whole number before `bad`, seen from `good`, for which `holds` is true.

    It is asked strictly between the two ends; `bad` may be above or below `good`, where it is known
    to be true.

    Returns:
        Two numbers, at most `least` apart: where it holds, and where it does not.

    Example:
        >>> last_true(lambda k: k <= 37, 0, 100)
        (37, 38)
        >>> last_true(lambda k: k >= -5, 10, -90, least=13)
        (-3, -15)
    """
    while abs(bad - good) > least:
        middle = (good + bad) // 2
        good, bad = (middle, bad) if holds(middle) else (good, middle)
    return good, bad


class Look(NamedTuple):
    """What was found of a changed case, by a search alone or by `check`."""

    evidence: Evidence
    walk: Walk | None
    """A covering motion, where one was found."""
    proof: CutTree | None
    covered: int
    """Cells of the best motion."""
    evaluations: int
    certificate: Certificate | None = None
    """Of the motion, where `check` accepted it; a search alone does not ask."""

    @property
    def accepted(self) -> bool:
        """Is it said by `check` that the case is feasible?"""
        return self.certificate is not None


def _look_of_verdict(found: Verdict) -> Look:
    """What `check` says."""
    return Look(
        found.evidence, found.witness, found.proof, found.n_covered, int(found.statistics["fk"]),
        found.certificate,
    )  # fmt: skip


@dataclass
class Prober:
    """What is found of a case with some of its numbers changed.

    Searches lead the way, each from the nearest motion that is known; `check` is asked for what is
    said in the end, unless that is a proof.
    """

    given: Variant
    verdict: Verdict
    """Of the case as given."""
    search: Search
    """Its evaluations are those that one search may take."""
    clock: Clock
    tick: Callable[[], None]
    """Called before each search, and while it goes on."""
    spent: int = 0
    """Evaluations of the arm so far."""
    looks: dict[Steps, Look] = field(default_factory=dict)
    """The latest at each value."""
    suspects: list[int] = field(default_factory=list)
    """Cells that were proved uncoverable with some number changed, the latest first."""

    def __post_init__(self) -> None:
        """Begin with what is known of the case as given."""
        self.looks[()] = _look_of_verdict(self.verdict)
        self._suspect(self.looks[()])

    def at(self, steps: Steps, seeds: Walk | None = None, *, judged: bool = False) -> Look:
        """What is found of a changed case, from a known motion (`seeds`) if there is one.

        Where it is to be `judged`, `check` is asked, unless a proof is known, or that it accepts a
        motion; else a search will do.

        Raises:
            OutOfTime: the deadline passed before it was decided.
        """
        steps = tuple((quantity, k) for quantity, k in steps if k)
        known = self.looks.get(steps)
        final = known and (not judged or not steps or known.accepted or known.proof is not None)
        if known is None or not final:
            variant = self.given
            for quantity, k in steps:
                variant = quantity.applied(variant, k)
            self.looks[steps] = known = self._looked(variant, seeds, judged)
        return known

    def _looked(self, variant: Variant, seeds: Walk | None, judged: bool) -> Look:
        """What `check` says, or a search without the judges; `check` where shapes are in its way.

        Raises:
            OutOfTime: the deadline passed before it was decided.
        """
        self.tick()
        if self.clock.out_of_time:
            raise OutOfTime
        evaluations = int((SEEDED if seeds else 1.0) * (self.search.evaluations or 1))
        search = replace(self.search, evaluations=evaluations)
        clock, hindered = self.clock.part(1.0, lambda *_: self.tick()), False
        if judged:
            look = _look_of_verdict(check(*variant, search, seeds=seeds, clock=clock))
        else:
            problem, clock = Problem.of(*variant), clock.allow(evaluations)
            found = complete_search(problem, search, clock, seeds, self.suspects, judging=False)
            undecided = Evidence.BUDGET if found.unfinished or found.motion else Evidence.EXHAUSTED
            evidence = Evidence.PROOF if found.proof is not None else undecided
            covered, spent = int(found.covered.sum()), int(found.counts["fk"])
            look = Look(evidence, found.motion, found.proof, covered, spent)
            hindered = found.hindered and look.walk is None and look.proof is None
        self.spent += look.evaluations
        self._suspect(look)
        if self.clock.out_of_time and look.walk is None:
            raise OutOfTime
        return self._looked(variant, None, True) if hindered and seeds is None else look

    def _suspect(self, look: Look) -> None:
        """Look first at a cell that was proved uncoverable, from now on."""
        leaves = [] if look.proof is None else list(look.proof.leaves())
        if len(leaves) == 1:
            kept = [cell for cell in self.suspects if cell != leaves[0].cell]
            self.suspects = [leaves[0].cell, *kept][:SUSPECTS]

    def threshold(self, quantity: Quantity) -> Threshold:
        """Where the verdict changes on the way from the value given to the end."""
        feasible, before = self.verdict.feasible, 0
        shares = (1,) if quantity.monotone else NEARBY if feasible else ALL_ALONG
        stops = sorted({max(1, round(quantity.last * share)) for share in shares})
        for k in stops:
            holds = self._holds(quantity, k)
            if holds and (not feasible or k == stops[-1]):
                holds = self._accepted(quantity, k)
            if holds != feasible:
                good, bad = self._between(quantity, *((before, k) if feasible else (k, before)))
                other = None if bad is None else self.finding(quantity, bad)
                return Threshold(quantity, self.finding(quantity, good), other)
            before = k
        if feasible:
            return Threshold(quantity, self.finding(quantity, before), None)
        proofs = sum(self.at(((quantity, k),)).proof is not None for k in stops)
        self.at(((quantity, before),), judged=True)
        tried = f"{counted(len(stops), 'value')} tried, {proofs} of them proved infeasible"
        each, tried = proofs == len(stops), "" if quantity.monotone else tried
        end = self.finding(quantity, before)
        return Threshold(quantity, None, end, tried, each and not quantity.monotone)

    def finding(self, quantity: Quantity, k: int) -> Finding:
        """What was found at a value."""
        look, cells, cell = self.at(((quantity, k),)), self.given.cells, None
        best = f"the best motion covers {look.covered} of {counted(len(cells), 'cell')}"
        answer = Answer.INFEASIBLE
        if look.certificate is not None and look.walk is not None:
            answer, detail = Answer.FEASIBLE, f"one motion of {len(look.walk.q)} waypoints"
        elif look.evidence is Evidence.BUDGET:
            answer = Answer.UNDECIDED
            detail = f"`check` finds no motion with {look.evaluations} evaluations; {best}"
        elif look.proof is None:
            detail = f"the search ended without a covering motion; {best}"
        elif len(leaves := list(look.proof.leaves())) > 1:
            detail = "no single motion covers every cell, which is proved"
        else:
            cell = leaves[0].cell
            detail = f"cell {list(cells.unravel(cell))} is proved uncoverable"
        value = quantity.value(k) if k else quantity.given
        witness = look.walk if answer is Answer.FEASIBLE else None
        return Finding(value, answer, look.evidence, detail, cell, witness)

    def _holds(self, quantity: Quantity, k: int) -> bool:
        """Is there a motion, as far as a search from the nearest one leads?"""
        known = {
            sum(j for _, j in steps): look.walk
            for steps, look in self.looks.items()
            if all(one is quantity for one, _ in steps) and look.walk is not None
        }
        nearest = min(known, key=lambda j: abs(j - k), default=0)
        return self.at(((quantity, k),), known.get(nearest)).walk is not None

    def _accepted(self, quantity: Quantity, k: int) -> bool:
        """Does `check` accept the motion that was found there?"""
        steps = ((quantity, k),)
        return self.at(steps, self.at(steps).walk, judged=True).accepted

    def _alone(self, quantity: Quantity, k: int) -> bool:
        """Does `check` find a motion there with none known?"""
        return self.at(((quantity, k),), judged=True).accepted

    def _between(self, quantity: Quantity, good: int, bad: int) -> tuple[int, int | None]:
        """Where it is feasible, and where it is not; None where it is all the way.

        Between `good`, which `check` says is feasible, and `bad`, where no motion was found; or
        further on, where `check` goes further.
        """
        stop, sure = bad, good
        while True:
            good = self._as_far(quantity, good, bad)
            good, bad = self._narrowed(quantity, good, bad)
            good = self._as_far(quantity, good, bad)
            if self._accepted(quantity, good):
                break
            good, bad = sure, good
        further = self._as_far(quantity, good, bad)  # now that its cone was measured
        good = further if self._accepted(quantity, further) else good
        if not self._alone(quantity, bad):
            return good, bad
        # `check` alone finds more than searches from the motions known, so it leads from here on.
        for k in dict.fromkeys((stop, quantity.last if self.verdict.feasible else 0)):
            if not self._alone(quantity, k):
                return last_true(partial(self._alone, quantity), bad, k, self._least(k - bad))
            bad = k
        return bad, None

    def _narrowed(self, quantity: Quantity, good: int, bad: int) -> tuple[int, int]:
        """The two ends nearer to each other, as far as searches from the nearest motions lead.

        Of a margin `good` is where a motion was found to end, mostly near the threshold: from there
        on steps begin small, and double.
        """
        least = self._least(bad - good)
        step = least if bad > good else -least
        while self.verdict.feasible and abs(bad - good) > abs(step):
            if not self._holds(quantity, good + step):
                bad = good + step
                break
            good, step = good + step, 2 * step
        return last_true(partial(self._holds, quantity), good, bad, least)

    def _least(self, stretch: int) -> int:
        """Steps, how near to a threshold on a stretch both sides are to be."""
        return math.ceil(abs(stretch) / (MARGINS if self.verdict.feasible else REMEDIES))

    def _as_far(self, quantity: Quantity, good: int, bad: int) -> int:
        """The value nearest to `bad` for which the motion found at `good` does as it is."""
        found = self.at(((quantity, good),))
        if quantity.kind is Kind.CONE and found.certificate is not None:
            used = found.certificate.max_angle
        elif quantity.kind is Kind.LOWER and found.walk is not None:
            used = float(found.walk.q[:, quantity.joint].min())
        elif quantity.kind is Kind.UPPER and found.walk is not None:
            used = float(found.walk.q[:, quantity.joint].max())
        else:
            return good
        k = (math.floor if bad > good else math.ceil)(quantity.steps(used))
        if not min(good, bad) < k < max(good, bad):
            return good
        look = self.looks.setdefault(((quantity, k),), found._replace(certificate=None))
        return good if look.walk is None else k
