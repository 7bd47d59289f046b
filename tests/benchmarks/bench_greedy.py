"""The paper's search on its twelve cases, beside one call of Pinocchio's forward kinematics."""

from __future__ import annotations

from fk_unit import pinocchio_fk_us
from paper_cases import PAPER_CASES

from feasibility import Search, greedy_check


def rows(repeats: int = 3) -> tuple[str, list[dict[str, object]]]:
    """One row for each case and mode, the best time of some repeats."""
    table: list[dict[str, object]] = []
    for moves, step_deg in (("single", 0.01), ("all", 0.5)):
        search = Search(method="greedy", moves=moves, step_deg=step_deg)  # type: ignore[arg-type]
        for name, case in PAPER_CASES.items():
            robot, cells, task = case.robot(), case.cells(), case.task()
            verdicts = [greedy_check(robot, cells, task, search) for _ in range(repeats)]
            verdict = min(verdicts, key=lambda v: v.timing["search_s"])
            counts = verdict.statistics
            table.append(
                {
                    "case": name,
                    "moves": f"{moves} {step_deg:g}°",
                    "paper": "connected" if case.connected else "not connected",
                    "verdict": str(verdict.answer),
                    "cells": f"{verdict.n_covered} of {len(cells)}",
                    "edges": verdict.n_edges,
                    "starts": counts["starts"],
                    "calls": counts["calls"],
                    "capped": counts["capped"],
                    "J-cells": counts["checked"],
                    "FK": counts["fk"],
                    "search ms": 1e3 * verdict.timing["search_s"],
                    "replay ms": 1e3 * verdict.timing["certify_s"],
                }
            )
    fk = pinocchio_fk_us()
    ratio = 1e3 * float(str(table[0]["search ms"])) / fk
    title = (
        f"Greedy search, kernels loaded, best of {repeats}. One Pinocchio FK call from Python: "
        f"{fk:.2f} us; 4a with single moves takes {ratio:,.0f} of them (target: 400,000)."
    )
    return title, table
