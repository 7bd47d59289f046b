"""Verdicts over many cases of known truth, counted."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import numpy as np

from feasibility import Verdict, check
from feasibility.cases.case import Setup
from feasibility.verdict import Answer


@dataclass(slots=True)
class Tally:
    """What was answered."""

    rows: list[tuple[str, str, str, int]] = field(default_factory=list)
    """Case, answer, evidence, evaluations of the kinematics."""

    def add(self, name: str, verdict: Verdict) -> None:
        """Count one verdict."""
        work = int(verdict.statistics.get("fk", 0))
        self.rows.append((name, str(verdict.answer), str(verdict.evidence), work))

    def named(self, answer: Answer) -> list[str]:
        """Cases that were answered so."""
        return [f"{name} ({evidence})" for name, said, evidence, _ in self.rows if said == answer]

    def table(self) -> str:
        """Counts by answer and evidence, with the median and the largest number of evaluations."""
        lines = []
        for kind in sorted({(said, evidence) for _, said, evidence, _ in self.rows}):
            work = [fk for _, *rest, fk in self.rows if tuple(rest) == kind]
            lines.append(
                f"{kind[0]:>12} {kind[1]:>10} {len(work):5d} of {len(self.rows):5d}"
                f"   evaluations: median {np.median(work):9.0f}, most {max(work):9d}"
            )
        return "\n".join(lines)


def tally(cases: Iterable[tuple[str, Callable[[], Setup]]]) -> Tally:
    """Decide every case."""
    found = Tally()
    for name, setup in cases:
        found.add(name, check(*setup()))
    return found


def assert_all_feasible(found: Tally, undecided: float = 0.05) -> None:
    """All cases are feasible: none is called infeasible, and few are undecided."""
    print(found.table())
    open_ones = found.named(Answer.UNDECIDED)
    print("undecided:", open_ones)
    assert found.rows
    assert found.named(Answer.INFEASIBLE) == []
    assert len(open_ones) <= undecided * len(found.rows)
