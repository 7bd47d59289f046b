"""How to search: the method and its settings."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from numbers import Integral, Real
from typing import Literal

Progress = Callable[[int, int | None, str], None]
"""Called with how much is done, of how much (None: unknown), and what is being done."""


@dataclass(frozen=True, slots=True)
class Search:
    """Settings of a search; `Search()` is what `feasibility.check` does when nothing is said.

    Raises:
        ValueError: settings are out of their range; all of them are named.
    """

    method: Literal["complete", "greedy"] = "complete"
    """'greedy' is the paper's Algorithms 1 and 2, 'complete' decides the question."""
    seed: int = 0
    """Seed of every random choice; the same seed gives the same verdict and the same motion."""
    time_limit: float | None = None
    """Seconds after which the verdict is "undecided"."""
    step_deg: float = 0.01
    """Greedy: delta q of revolute joints, degrees. A prismatic joint steps by the length that the
    same angle sweeps at the arm's reach."""
    moves: Literal["single", "all"] = "single"
    """Greedy: change one joint a step (2 n neighbours), or any of them (3^n - 1)."""
    starts: int | Literal["all"] = "all"
    """Greedy: how many start configurations over the start cell to try, one per branch."""
    cap: int | None = None
    """Greedy: J-cells that one call of Algorithm 1 may check before it stops as "capped". None:
    20,000, and for steps finer than 0.01 degrees as many times more as they are finer."""

    def __post_init__(self) -> None:
        """Refuse settings that describe no search."""
        limit, faults = self.time_limit, list[str]()
        if self.method not in ("complete", "greedy"):
            faults.append(f"method must be 'complete' or 'greedy', got {self.method!r}")
        if not _is_whole(self.seed, 0):
            faults.append(f"seed must be a whole number >= 0, got {self.seed!r}")
        if limit is not None and not (_is_real(limit) and 0.0 < limit < math.inf):
            faults.append(f"time_limit must be a finite number > 0 (s), got {limit!r}")
        if not (_is_real(self.step_deg) and 1e-4 <= self.step_deg <= 30.0):
            faults.append(f"step_deg must lie in 0.0001 .. 30 (degrees), got {self.step_deg!r}")
        if self.moves not in ("single", "all"):
            faults.append(f"moves must be 'single' or 'all', got {self.moves!r}")
        if self.starts != "all" and not _is_whole(self.starts, 1):
            faults.append(f"starts must be 'all' or a whole number >= 1, got {self.starts!r}")
        if self.cap is not None and not _is_whole(self.cap, 1):
            faults.append(f"cap must be a whole number >= 1, got {self.cap!r}")
        if faults:
            raise ValueError("; ".join(faults))


def _is_real(value: object) -> bool:
    """Is it a number? No truth value is one."""
    return isinstance(value, Real) and not isinstance(value, bool)


def _is_whole(value: object, low: int) -> bool:
    """Is it a whole number, `low` or more?"""
    return isinstance(value, Integral) and _is_real(value) and int(value) >= low
