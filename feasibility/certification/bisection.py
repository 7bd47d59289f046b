"""Stretches of a motion between exact configurations, halved until bounds decide them.

Judges bound something along stretches: along half of one, bounds fall to a quarter, or to a half,
and one more exact configuration is known. What one cannot know of that, is only asked for at ends.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Generic, Self, TypeVar

import numpy as np

from coverable.arrays import Array, Ints, Mask, Rows


def runs(some: Mask) -> list[Ints]:
    """The indices (k,) at which `some` (m,) holds, those in a row together.

    Example:
        >>> [run.tolist() for run in runs(np.array([True, True, False, True]))]
        [[0, 1], [3]]
    """
    turns = np.flatnonzero(np.diff(some)) + 1
    return [run for run in np.split(np.arange(len(some)), turns) if some[run].any()]


End = TypeVar("End", bound=Rows)
Some = TypeVar("Some", bound="Stretches[Any]")


@dataclass(frozen=True, eq=False, slots=True)
class Stretches(Rows, Generic[End]):
    """k stretches, each a part of a segment between two rows."""

    row: Ints
    """(k,) the row before, or which segment it is."""
    low: Array
    """(k,) where on the segment it begins, 0..1."""
    high: Array
    """(k,) where it ends."""
    start: End
    """What is known at the k configurations where they begin."""
    end: End

    @property
    def length(self) -> Array:
        """(k,) share of the segment."""
        return self.high - self.low

    @property
    def middle(self) -> Array:
        """(k,) where on the segment its middle is."""
        return 0.5 * (self.low + self.high)

    def halves(self, middle: End) -> Self:
        """Both halves of each, first all first halves; `middle` is known of their middles."""
        half = self.middle
        first = replace(self, high=half, end=middle)
        return first.join(first, replace(self, low=half, start=middle))


def bisected(
    stretches: Some,
    decided: Callable[[Some], Mask],
    halves: Callable[[Some], Some],
    levels: int,
    most: int,
) -> Some:
    """The stretches that are still open after so many halvings, or when so many were halved.

    Args:
        stretches: to begin with.
        decided: (k,) which of some stretches are; it takes note of what it knows of these.
        halves: of some stretches, or of those of them that are worth it.
        levels: so often a stretch is halved.
        most: so many stretches are, about.
    """
    seen = 0
    for level in range(levels + 1):
        stretches = stretches.of(~decided(stretches))
        seen += len(stretches.row)
        if not len(stretches.row) or level == levels or seen > most:
            break
        stretches = halves(stretches)
    return stretches
