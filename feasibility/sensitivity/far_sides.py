"""The far sides of thresholds that short searches leave undecided, as `check` itself decides them.

Short searches follow the motion that went furthest; one in another posture may go further. So
`check` is asked at the far side, with the same seed and no motion known. Where it finds a motion,
the search for the threshold goes on from there, and `check` is asked again at the new far side.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from coverable_errors import counted
from feasibility.checking import check
from feasibility.search import Search
from feasibility.sensitivity.limited_search import attempt_of
from feasibility.sensitivity.probes import Prober
from feasibility.sensitivity.threshold_search import Probe, ThresholdSearch
from feasibility.sensitivity.thresholds import Finding, Span, Threshold
from feasibility.verdict import Answer, Evidence, Verdict

ASKED, LEAST_ASKED = 6, 150_000  # verdicts' worth, and evaluations, for `check` at a far side ...
ROUNDS = ((1, 30), (4, 16))  # ... as many times that, one after the other, up to so many in all
GIVEN = 0  # steps from the value given


class Beyond(NamedTuple):
    """What `check` has led to past the feasible side of a threshold."""

    good: Probe | None
    """The last feasible probe; None where `check` found no motion."""
    feasible: Finding | None
    """The same as a finding."""
    other: Finding | None
    """The nearest value at which no motion was found; None where the end was reached."""


def settle(
    prober: Prober,
    verdict: Verdict,
    cost: int,
    searches: Sequence[ThresholdSearch],
    found: list[Threshold],
) -> int:
    """Ask `check` about far sides that are undecided, in place.

    Args:
        prober: of the searches.
        verdict: of the case as given.
        cost: evaluations that one verdict is taken to cost.
        searches: for each threshold.
        found: the thresholds.

    Returns:
        The evaluations spent.
    """
    effort, before = max(ASKED * cost, LEAST_ASKED), prober.spent
    for times, in_all in ROUNDS:
        for k, made in enumerate(searches):  # what one leaves over is for the next
            stop = before + in_all * effort * (k + 1) / len(searches)
            found[k] = FarSides(verdict, times * effort, stop).settled(made, found[k])
    return prober.spent - before


@dataclass(frozen=True, slots=True)
class FarSides:
    """Asks `check` about the far sides of a threshold."""

    verdict: Verdict
    """Of the case as given."""
    most: int
    """Evaluations of the arm that one answer may take."""
    stop: float
    """Evaluations of the prober after which nothing is asked any more."""

    def settled(self, made: ThresholdSearch, found: Threshold) -> Threshold:
        """The same threshold, further on where `check` finds a motion at its far side."""
        past = made.quantity.last + 1
        far = past if self.verdict.feasible else GIVEN
        beyond = self._beyond(made, found.other, far)
        found = replace(found, other=beyond.other)
        if beyond.good is not None:
            made.good = beyond.good
            found = replace(found, feasible=beyond.feasible, tried="")
        if found.span is not None:
            beyond = self._beyond(made, found.span.other, past)
            found = replace(found, span=Span(beyond.feasible or found.span.feasible, beyond.other))
        return found

    def _beyond(self, made: ThresholdSearch, other: Finding | None, far: int) -> Beyond:
        """What is past a far side on the way to `far` steps, as long as `check` finds motions."""
        good, feasible = None, None
        while other is not None and other.answer is Answer.UNDECIDED:
            k = made.quantity.steps_to(other.value)
            late = made.prober.spent > self.stop or made.prober.clock.out_of_time
            if late or k == GIVEN:
                break
            verdict = self._asked(made, k)
            if not verdict.feasible:
                return Beyond(good, feasible, finding_of(other.value, verdict))
            probe = Probe(k, attempt_of(verdict))
            good, other = made.narrow(probe, far)
            feasible = made.reported(good)
            if not feasible.feasible:  # the replay refuses what the search found
                good, feasible, other = probe, made.reported(probe), feasible
            if other is None and far == GIVEN:
                other = finding_of(made.quantity.given, self.verdict)
        return Beyond(good, feasible, other)

    def _asked(self, made: ThresholdSearch, k: int) -> Verdict:
        """What `check` says after k steps, with a limited effort."""
        prober = made.prober
        clock = prober.clock.part(1.0, lambda *_: prober.tick())
        case = made.quantity.applied(prober.given, k)
        verdict = check(*case, Search(seed=prober.seed, evaluations=self.most), clock=clock)
        prober.spent_before += int(verdict.statistics["fk"])
        return verdict


def finding_of(value: float, verdict: Verdict) -> Finding:
    """What `check` found at a value, without a motion."""
    cells, proof = verdict.cells, verdict.proof
    best = f"the best motion covers {verdict.n_covered} of {counted(len(cells), 'cell')}"
    detail = f"`check` finds no motion with {verdict.statistics['fk']} evaluations; {best}"
    if proof is not None:
        leaves = list(proof.leaves())
        cell = leaves[0].cell if len(leaves) == 1 else None
        detail = "no single motion covers every cell, which is proved"
        if cell is not None:
            detail = f"cell {list(cells.unravel(cell))} is proved uncoverable"
        return Finding(value, verdict.answer, Evidence.PROOF, detail, cell)
    if verdict.evidence is Evidence.EXHAUSTED:
        detail = f"the search ended without a covering motion; {best}"
    return Finding(value, verdict.answer, verdict.evidence, detail)
