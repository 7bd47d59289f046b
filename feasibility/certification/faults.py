"""Why a motion is refused: where, and in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class MotionFault:
    """One reason why a motion is refused, and where it is met."""

    row: int
    """Index of the row, or of the row before; -1 where the whole motion is meant."""
    share: float
    """How far the motion has come from there to the next row, 0..1."""
    text: str

    def __str__(self) -> str:
        """Place and fault; rows are counted from 1."""
        if self.row < 0:
            return self.text
        if self.share == 0.0:
            return f"row {self.row + 1}: {self.text}"
        way = f"row {self.row + 1} to {self.row + 2}, {self.share:.3g} of the way"
        return f"{way}: {self.text}"


class Judged:
    """What a replay found: the motion is accepted unless there are faults."""

    __slots__ = ()

    faults: Sequence[MotionFault]

    @property
    def accepted(self) -> bool:
        """True when every constraint that was judged holds along the whole motion."""
        return not self.faults

    @property
    def refusal(self) -> str:
        """All faults in words; empty when the motion is accepted."""
        return "; ".join(map(str, self.faults))
