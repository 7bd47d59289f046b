"""How to search: the method and its settings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from coverable.errors import Checks

Progress = Callable[[int, int | None, str], None]
"""Called with how much is done, of how much (None: unknown), and what is being done."""


METHODS: tuple[Literal["complete", "greedy"], ...] = ("complete", "greedy")
MOVES: tuple[Literal["single", "all"], ...] = ("single", "all")


@dataclass(frozen=True, slots=True)
class Search:
    """Settings of a search; `Search()` is what `feasibility.check` does when nothing is said.

    Raises:
        ArgumentError: settings are out of their range; all of them are named.
    """

    method: Literal["complete", "greedy"] = "complete"
    """'greedy' is the paper's Algorithms 1 and 2, 'complete' decides the question."""
    seed: int = 0
    """Seed of every random choice; the same seed gives the same verdict and the same motion."""
    time_limit: float | None = None
    """Seconds after which the verdict is "undecided"."""
    evaluations: int | None = None
    """Complete: evaluations of the arm after which the verdict is "undecided": an effort that is
    the same on every machine. A box of a proof counts as one."""
    early: bool = False
    """Complete: end where the answer is known: no further cells are looked for where one is proved
    uncoverable, nor motions between neighbouring cells, besides those that the answer needs."""
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
        """Refuse settings that describe no search; keep them as plain numbers."""
        checks = Checks("search")
        checks.choice("method", self.method, METHODS)
        kept: dict[str, Any] = {"seed": checks.whole("seed", self.seed, 0)}
        if self.time_limit is not None:
            kept["time_limit"] = checks.positive("time_limit", self.time_limit, "seconds")
        if self.evaluations is not None:
            kept["evaluations"] = checks.whole("evaluations", self.evaluations, 1)
        if not isinstance(self.early, bool):
            checks.wrong("early", self.early, "must be True or False")
        kept["step_deg"] = checks.number(
            "step_deg", self.step_deg, "must lie in 0.0001 .. 30 (degrees)", 1e-4, 30.0
        )
        checks.choice("moves", self.moves, MOVES)
        if self.starts != "all":
            kept["starts"] = checks.whole("starts", self.starts, 1, or_word="'all'")
        if self.cap is not None:
            kept["cap"] = checks.whole("cap", self.cap, 1)
        checks.done()
        for name, value in kept.items():
            object.__setattr__(self, name, value)
