"""Thresholds: between which two values of one quantity the verdict turns, and what says so."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from feasibility.sensitivity.parameters import Quantity
from feasibility.verdict import Answer, Evidence


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

    @property
    def feasible(self) -> bool:
        """True when a covering motion is known that the replay accepted."""
        return self.answer is Answer.FEASIBLE


@dataclass(frozen=True, slots=True)
class Span:
    """Where a range of feasible values that begins at a threshold ends."""

    feasible: Finding
    """The last value found to be feasible."""
    other: Finding | None
    """The value nearest to it at which the case is not; None where the range goes on to the cap."""


@dataclass(frozen=True, slots=True)
class Threshold:
    """Where the verdict turns along one quantity, with the verdict on both sides.

    The quantity goes from the value given towards `quantity.end`. Where the case as given is not
    feasible, that is the way of more freedom, and `feasible` is the first value found to be
    feasible; None when no value helps. Where it is feasible, that is the way of less freedom, and
    `feasible` is the last value found to be feasible; `other` is None when all of them are.
    """

    quantity: Quantity
    feasible: Finding | None
    """The value nearest to the turn at which the case is feasible."""
    other: Finding | None
    """The value nearest to the turn at which it is not: proved, exhausted, or not found. Without a
    feasible value: what is known at the far end."""
    span: Span | None = None
    """The far end of the feasible range, for the standoff of a case that is not feasible."""
    tried: str = ""
    """What was tried, where no value helps or not every value was looked at."""

    @property
    def resolution(self) -> float | None:
        """Distance (rad or m) of the two values; None where there is one side only."""
        if self.feasible is None or self.other is None:
            return None
        return abs(self.feasible.value - self.other.value)

    @property
    def steps_apart(self) -> int:
        """How many of the quantity's steps lie between the two sides; 0 with one side only."""
        apart = self.resolution or 0.0
        return round(
            (math.degrees(apart) if self.quantity.unit == "rad" else apart) / self.quantity.step
        )

    @property
    def margin(self) -> float:
        """How far (rad or m, >= 0) the feasible value is from the one given; -1 without one."""
        return -1.0 if self.feasible is None else abs(self.feasible.value - self.quantity.given)

    @property
    def ruled_out(self) -> bool:
        """Is it proved that no value up to the end helps?"""
        end = self.other is not None and self.other.value == self.quantity.end
        proved = self.other is not None and self.other.evidence is Evidence.PROOF
        return self.feasible is None and self.quantity.monotone and end and proved


def last_true(holds: Callable[[int], bool], good: int, bad: int, gallop: bool = False) -> int:
    """The last whole number before `bad`, seen from `good`, for which `holds` is true.

    Args:
        holds: asked for numbers strictly between the two ends, at most about log2 of their
            distance times, twice that when galloping.
        good: where it is known to be true.
        bad: where it is known, or taken, to be false; above or below `good`.
        gallop: go out from `good` in steps that double until `holds` fails, so that the number
            found belongs to the stretch around `good` even where `holds` comes true again further
            on, unless a gap fits between two steps.

    Returns:
        A number k with holds(k) true (or k = good), whose neighbour towards `bad` is false (or is
        `bad` itself).

    Example:
        >>> last_true(lambda k: k <= 37, 0, 100)
        37
        >>> last_true(lambda k: k >= -5, 10, -90, gallop=True)
        -5
    """
    way = 1 if bad > good else -1
    step = 1
    while gallop and good + way * step != bad and (bad - good) * way > step:
        if not holds(good + way * step):
            bad = good + way * step
            break
        good += way * step
        step *= 2
    while abs(bad - good) > 1:
        middle = (good + bad) // 2
        if holds(middle):
            good = middle
        else:
            bad = middle
    return good
