"""What is known of one placement: how far it was looked into, what is covered, what is left."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from feasibility.placement.region import Pose
from feasibility.verdict import Answer, Evidence


class Stage(StrEnum):
    """How far a placement was looked into."""

    BOUND = "bound"
    """A target is proved out of reach: no search was run."""
    PROBE = "probe"
    """Newton's method failed at some of a few cells: no search was run."""
    SEARCH = "search"
    """A short search was run."""
    CHECK = "check"
    """The full search was run, and its motion replayed."""
    FAILED = "failed"
    """No evaluator finished it; the message says why."""


@dataclass(frozen=True, slots=True)
class Margins:
    """What the motion over a placement leaves, as shares 0..1; see `placement.margins`."""

    limits: float
    cone: float
    reach: float

    @property
    def least(self) -> float:
        """The measure of a placement."""
        return min(self.limits, self.cone, self.reach)


@dataclass(frozen=True, eq=False, slots=True)
class Trial:
    """What is known of one placement."""

    pose: Pose
    stage: Stage
    in_reach: float
    """Share of the area that the reach bound leaves open."""
    probed: float = 0.0
    """Share of the probed cells over which Newton's method found a configuration."""
    share: float = 0.0
    """Share of the area that the best single motion found covers; 0 where none was looked for."""
    margins: Margins | None = None
    """None unless that motion covers every cell."""
    covers: NDArray[np.bool_] = field(default_factory=lambda: np.zeros((0, 0), dtype=bool))
    """(K, N) cells of the largest components found, none inside another, the best first."""
    answer: Answer | None = None
    """What `feasibility.check` says; None where it was not asked."""
    evidence: Evidence | None = None
    message: str = ""
    """Its sentences."""
    causes: Mapping[str, int] = field(default_factory=dict)
    """Missed cells by cause, the most frequent first; only where it was asked for."""
    early: bool = False
    """Whether probes came before its search, and could end it."""
    fk: int = 0
    """Evaluations of the arm."""

    @property
    def feasible(self) -> bool:
        """Has `feasibility.check` found and replayed a covering motion?"""
        return self.answer is Answer.FEASIBLE

    @property
    def margin(self) -> float:
        """The measure; 0 where not every cell is covered."""
        return 0.0 if self.margins is None else self.margins.least

    @property
    def complete(self) -> bool:
        """Does one motion found cover every cell?"""
        return bool(len(self.covers) and self.covers[0].all())

    @property
    def rank(self) -> tuple[float, ...]:
        """Larger is better: covered share, then margin, then what was seen before a search."""
        return (round(self.share, 9), self.margin, self.probed, self.in_reach)
