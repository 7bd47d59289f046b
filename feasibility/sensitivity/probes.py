"""Where the verdict changes along one quantity: `check` with a limited effort, by halving.

Each check begins from the motion found at the nearest feasible value. The far side of a threshold,
where that led to none, is what `check` says without any motion known, with the same effort.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial

from coverable.errors import counted
from feasibility.checking import check
from feasibility.clock import Clock, OutOfTime
from feasibility.search import Search
from feasibility.sensitivity.quantities import Kind, Quantity, Variant
from feasibility.sensitivity.thresholds import Finding, Threshold
from feasibility.verdict import Evidence, Verdict, Walk

NEARBY = (1 / 8, 1 / 4, 1 / 2, 1)  # [1] of the way to its end: values of what is not monotone
ALL_ALONG = (1 / 32, 1 / 16, 1 / 8, 3 / 16, 1 / 4, 3 / 8, 1 / 2, 5 / 8, 3 / 4, 7 / 8, 1)
MARGINS, REMEDIES = 4, 8  # halvings, at most, towards what is not feasible, or no longer is
SEEDED = 0.5  # [1] of the effort of a verdict without a known motion

Steps = tuple[tuple[Quantity, int], ...]
"""Quantities, and how many steps each is from the value given."""


def last_true(holds: Callable[[int], bool], good: int, bad: int, most: int = 64) -> tuple[int, int]:
    """The last whole number before `bad`, seen from `good`, for which `holds` is true.

    Args:
        holds: called for numbers strictly between the two ends.
        good: where it is known to be true.
        bad: where it is known to be false; above or below `good`.
        most: halvings of what is between them, after which it is left at that.

    Returns:
        Two neighbouring numbers, or as near as so many halvings bring them: where it holds, and
        where it does not.

    Example:
        >>> last_true(lambda k: k <= 37, 0, 100)
        (37, 38)
        >>> last_true(lambda k: k >= -5, 10, -90, most=3)
        (-3, -15)
    """
    for _ in range(most):
        if abs(bad - good) <= 1:
            break
        middle = (good + bad) // 2
        good, bad = (middle, bad) if holds(middle) else (good, middle)
    return good, bad


@dataclass
class Prober:
    """Verdicts of a case with some of its numbers changed, each made once."""

    given: Variant
    verdict: Verdict
    """Of the case as given."""
    search: Search
    """Its evaluations are those that one verdict may take."""
    clock: Clock
    tick: Callable[[], None]
    """Called before each verdict, and while it is made."""
    spent: int = 0
    """Evaluations of the arm so far."""
    known: dict[Steps, Verdict] = field(default_factory=dict)
    seeded: set[Steps] = field(default_factory=set)
    """Those that began from a motion and found none."""

    def at(self, steps: Steps, seeds: Walk | None = None) -> Verdict:
        """The verdict of a changed case, from a known motion if there is one.

        Raises:
            OutOfTime: the deadline passed before it was decided.
        """
        steps = tuple((quantity, k) for quantity, k in steps if k)
        if not steps:
            return self.verdict
        if steps not in self.known:
            variant = self.given
            for quantity, k in steps:
                variant = quantity.applied(variant, k)
            self.known[steps] = self.asked(variant, seeds)
            if seeds is not None and not self.known[steps].feasible:
                self.seeded.add(steps)
        return self.known[steps]

    def asked(self, variant: Variant, seeds: Walk | None = None, effort: float = 1.0) -> Verdict:
        """What `check` says, with so many times the usual effort.

        Raises:
            OutOfTime: the deadline passed before it was decided.
        """
        self.tick()
        if self.clock.out_of_time:
            raise OutOfTime
        effort = SEEDED if seeds is not None else effort
        search = replace(self.search, evaluations=int(effort * (self.search.evaluations or 1)))
        clock = self.clock.part(1.0, lambda *_: self.tick())
        found = check(*variant, search, seeds=seeds, clock=clock)
        self.spent += int(found.statistics["fk"])
        if self.clock.out_of_time and not found.feasible:
            raise OutOfTime
        return found

    def threshold(self, quantity: Quantity) -> Threshold:
        """Where the verdict changes on the way from the value given to the end."""
        feasible, before = self.verdict.feasible, 0
        stops = _stops(quantity, feasible)
        for k in stops:
            if self._holds(quantity, k) != feasible:
                return self._between(quantity, *((before, k) if feasible else (k, before)))
            before = k
        end = self.finding(quantity, before)
        if feasible:
            return Threshold(quantity, end, None)
        proofs = sum(self.finding(quantity, k).evidence is Evidence.PROOF for k in stops)
        tried = f"{counted(len(stops), 'value')} tried, {proofs} of them proved infeasible"
        each = proofs == len(stops) and not quantity.monotone
        return Threshold(quantity, None, end, "" if quantity.monotone else tried, each)

    def finding(self, quantity: Quantity, k: int) -> Finding:
        """The verdict at a value that was looked at."""
        return finding_of(quantity.value(k) if k else quantity.given, self.at(((quantity, k),)))

    def _holds(self, quantity: Quantity, k: int) -> bool:
        """Is the case feasible there, as far as the nearest motion leads?"""
        motions = {0: self.verdict.witness} | {
            steps[0][1]: found.witness
            for steps, found in self.known.items()
            if len(steps) == 1 and steps[0][0] is quantity and found.feasible
        }
        nearest = min(
            (j for j, walk in motions.items() if walk is not None),
            key=lambda j: abs(j - k),
            default=0,
        )
        return self.at(((quantity, k),), motions[nearest]).feasible

    def _between(self, quantity: Quantity, good: int, bad: int) -> Threshold:
        """The threshold between two values; further on where `check` alone goes further."""
        holds, most = partial(self._holds, quantity), MARGINS if self.verdict.feasible else REMEDIES
        while True:
            good = self._as_far(quantity, good, bad)
            good, bad = last_true(holds, good, bad, most)
            good = self._as_far(quantity, good, bad)
            if not self._holds_alone(quantity, bad):
                sides = self.finding(quantity, good), self.finding(quantity, bad)
                return Threshold(quantity, *sides)
            way = 1 if bad > good else -1
            failed = [0] if not self.verdict.feasible else []
            failed += [
                steps[0][1]
                for steps, found in self.known.items()
                if len(steps) == 1 and steps[0][0] is quantity and not found.feasible
            ]
            further = [k for k in failed if (k - bad) * way > 0]
            good, bad = bad, min(further, key=lambda k: abs(k - bad)) if further else quantity.last
            if good == bad or (not further and holds(bad)):
                return Threshold(quantity, self.finding(quantity, bad), None)

    def _as_far(self, quantity: Quantity, good: int, bad: int) -> int:
        """The value nearest to `bad` for which the motion found at `good` does as it is."""
        found = self.at(((quantity, good),))
        if found.witness is None or found.certificate is None:
            return good
        if quantity.kind is Kind.CONE:
            used = found.certificate.max_angle
        elif quantity.kind is Kind.LOWER:
            used = float(found.witness.q[:, quantity.joint].min())
        elif quantity.kind is Kind.UPPER:
            used = float(found.witness.q[:, quantity.joint].max())
        else:
            return good
        steps = (used - quantity.given) * (1.0 if quantity.end > quantity.given else -1.0)
        steps = (math.degrees(steps) if quantity.unit == "rad" else steps) / quantity.step
        k = math.floor(steps) if bad > good else math.ceil(steps)
        between = min(good, bad) < k < max(good, bad)
        return k if between and self._holds(quantity, k) else good

    def _holds_alone(self, quantity: Quantity, k: int) -> bool:
        """Does `check` find a motion there with none known, where a known one led to none?"""
        steps = ((quantity, k),)
        if steps in self.seeded and self.known[steps].evidence is not Evidence.PROOF:
            self.known[steps] = self.asked(quantity.applied(self.given, k))
            self.seeded.discard(steps)
            return self.known[steps].feasible
        return False


def _stops(quantity: Quantity, feasible: bool) -> list[int]:
    """Numbers of steps at which a verdict is made on the way to the end.

    The end alone where there can be one threshold at most. Otherwise values that double from a
    feasible one, so that what is found is the stretch around it, or more of them all along.
    """
    last = quantity.last
    if quantity.monotone:
        return [last]
    shares = NEARBY if feasible else ALL_ALONG
    return sorted({max(1, round(last * share)) for share in shares})


def finding_of(value: float, verdict: Verdict) -> Finding:
    """What `check` found at a value."""
    cells, proof = verdict.cells, verdict.proof
    if verdict.witness is not None:
        detail = f"one motion of {len(verdict.witness.q)} waypoints"
        return Finding(value, verdict.answer, verdict.evidence, detail, None, verdict.witness)
    best = f"the best motion covers {verdict.n_covered} of {counted(len(cells), 'cell')}"
    detail = f"`check` finds no motion with {verdict.statistics['fk']} evaluations; {best}"
    cell = None
    if proof is not None:
        leaves = list(proof.leaves())
        cell = leaves[0].cell if len(leaves) == 1 else None
        detail = "no single motion covers every cell, which is proved"
        if cell is not None:
            detail = f"cell {list(cells.unravel(cell))} is proved uncoverable"
    elif verdict.evidence is Evidence.EXHAUSTED:
        detail = f"the search ended without a covering motion; {best}"
    return Finding(value, verdict.answer, verdict.evidence, detail, cell)
