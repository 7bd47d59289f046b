"""Thresholds along quantities of a case, and all that is found about one case.

A threshold lies between two values of one quantity at which the verdicts differ; each side is given
with its evidence.
"""

import math
from dataclasses import dataclass

from coverable.arrays import Ints, Protected
from feasibility.demands.fast_motions import RateFigures
from feasibility.sensitivity.quantities import Kind, Quantity
from feasibility.verdict import Answer, Evidence, Verdict, Walk

ACROSS = math.radians(90.0)  # [rad] from the normal: beyond, the tool points away


@dataclass(frozen=True, slots=True)
class Finding:
    """The verdict at one value of a quantity."""

    value: float
    """rad or m."""
    answer: Answer
    evidence: Evidence
    """What the answer rests on; an undecided one with `BUDGET` means that nothing was found with
    the effort allowed."""
    detail: str
    """What was found, proved or tried, in one sentence."""
    cell: int | None = None
    """The cell that a proof is about; None without a proof."""
    witness: Walk | None = None
    """The covering motion, with which as its `seeds` `check` says so; None unless feasible."""


@dataclass(frozen=True, slots=True)
class Threshold:
    """Where the verdict changes along one quantity, with the verdict on both sides.

    The quantity goes from the value given towards `quantity.end`. Where the case as given is not
    feasible, that is towards more freedom, and `feasible` is the first value found to be
    feasible; None when no value helps. Where it is feasible, that is towards less freedom, and
    `feasible` is the last value found to be feasible; `other` is None when all of them are.
    """

    quantity: Quantity
    feasible: Finding | None
    """The value nearest to the threshold at which the case is feasible."""
    other: Finding | None
    """The value nearest to the threshold at which it is not: proved, exhausted, or not found.
    Without a feasible value: what is known at the far end."""
    tried: str = ""
    """What was tried, where no value helps or not every value was tried."""
    each_proved: bool = False
    """Of a quantity that is not monotone: is each value on its way to the end proved infeasible?
    Values between those that were tried remain open."""

    @property
    def resolution(self) -> float | None:
        """Distance (rad or m) of the two values; None where there is one side only."""
        if self.feasible is None or self.other is None:
            return None
        return abs(self.feasible.value - self.other.value)

    @property
    def margin(self) -> float:
        """How far (rad or m, >= 0) the feasible value is from the one given; -1 without one."""
        return -1.0 if self.feasible is None else abs(self.feasible.value - self.quantity.given)

    @property
    def effort(self) -> float:
        """The share of its range that a change needs, or that a margin leaves, 0..1."""
        span = abs(self.quantity.end - self.quantity.given)
        return self.margin / span if self.feasible is not None and span > 0.0 else 1.0

    @property
    def turns_away(self) -> bool:
        """Is it a cone in which the tool may point away from the surface, where it may not now?"""
        cone, found = self.quantity.kind is Kind.CONE, self.feasible
        return cone and found is not None and self.quantity.given <= ACROSS < found.value

    @property
    def ruled_out(self) -> bool:
        """Is it proved that no value up to the end helps?"""
        end = self.other is not None and self.other.value == self.quantity.end
        proved = self.other is not None and self.other.evidence is Evidence.PROOF
        return self.feasible is None and self.quantity.monotone and end and proved


@dataclass(frozen=True, slots=True)
class Change:
    """One quantity, and a value of it other than the one given."""

    quantity: Quantity
    value: float
    """rad or m."""


@dataclass(frozen=True, eq=False, slots=True)
class ChangePair:
    """Two changes that make a case feasible together, where none of them does alone."""

    changes: tuple[Change, ...]
    witness: Walk
    """The covering motion, which the replay accepted."""


@dataclass(frozen=True, eq=False, slots=True)
class Dropped(Protected):
    """The cells without which one motion covers the rest."""

    cells: Ints
    """(k,) flat indices."""
    area: float
    """m^2."""
    share: float
    """Of the whole area, 0..1."""
    witness: Walk | None
    """The motion that covers all others, which the replay accepted; None where there is none."""


@dataclass(frozen=True, eq=False, slots=True)
class Explanation:
    """The thresholds of a case; see `explain`."""

    verdict: Verdict
    thresholds: tuple[Threshold, ...]
    """One for each quantity that was tried, in the order of `quantities`."""
    left_out: tuple[str, ...]
    """Names of the quantities for which no time was left."""
    dropped: Dropped | None
    """None for a feasible case."""
    evaluations: int
    """Evaluations of the arm that the thresholds took."""
    seconds: float
    """Time that they took."""
    pair: ChangePair | None = None
    """Two changes together, where no single one helps; None where none was found either."""
    alone: Verdict | None = None
    """What `check` says with the seed given and no motion known, where `verdict` owes its motion to
    the witness of a threshold; None where `verdict` is that."""
    rates: RateFigures | None = None
    """Largest speed and smallest singular value of a feasible case; None of another."""
