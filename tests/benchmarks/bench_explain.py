"""What an explanation costs beside a verdict, and what it finds."""

from __future__ import annotations

import math
import statistics
import time

from paper_cases import PAPER_CASES

from feasibility import check
from feasibility.explain import explain
from feasibility.explain_report import shown
from feasibility.verdict import Evidence

NAMES = ("4a", "4d", "4f", "5e")


def rows(repeats: int = 5) -> tuple[str, list[dict[str, object]]]:
    """One row for each case: work and time of both, and how its thresholds ended."""
    table = []
    for name in NAMES:
        case = PAPER_CASES[name]
        setup = case.robot(), case.cells(), case.task()
        explain(*setup)
        verdict_s, explain_s = [], []
        for _ in range(repeats):
            began = time.perf_counter()
            verdict = check(*setup)
            between = time.perf_counter()
            explanation = explain(*setup)
            verdict_s.append(between - began)
            explain_s.append(time.perf_counter() - between)
        cost = verdict.statistics["fk"]
        found = [t for t in explanation.thresholds if t.feasible is not None]
        sides = [t.other for t in explanation.thresholds if t.other is not None]
        proofs = [side for side in sides if side.evidence is Evidence.PROOF]
        wide = [t.resolution / t.quantity.step for t in found if t.resolution is not None
                and t.quantity.unit == "m"]  # fmt: skip
        wide += [math.degrees(t.resolution) / t.quantity.step for t in found
                 if t.resolution is not None and t.quantity.unit == "rad"]  # fmt: skip
        joint1 = next(t for t in explanation.thresholds if t.quantity.name == "joint1 upper limit")
        value = joint1.feasible
        table.append(
            {
                "case": name,
                "verdict": f"{verdict.answer} ({verdict.evidence})",
                "verdict FK": cost,
                "explain FK": explanation.evaluations + cost,
                "ratio (target 40)": (explanation.evaluations + cost) / cost,
                "verdict ms": 1e3 * statistics.median(verdict_s),
                "explain ms": 1e3 * statistics.median(explain_s),
                "ratio of times": statistics.median(explain_s) / statistics.median(verdict_s),
                "feasible sides": f"{len(found)} of {len(explanation.thresholds)}",
                "other sides proved": f"{len(proofs)} of {len(sides)}",
                "steps between sides, worst": max(wide, default=0.0),
                "joint1 upper": "-" if value is None else shown(joint1.quantity, value.value),
            }
        )
    return f"Explanations: what would make a case feasible; median of {repeats}.", table
