"""The paper's search on its twelve cases, beside one call of Pinocchio's forward kinematics."""

from __future__ import annotations

import time

import numpy as np
import pinocchio as pin
from paper_cases import PAPER_CASES

from feasibility import Search, greedy_check


def pinocchio_fk_us(calls: int = 20_000) -> float:
    """Microseconds of one call of Pinocchio's FK with the tool frame, from Python; best of 5."""
    model = PAPER_CASES["4a"].robot().model
    data, q = model.createData(), pin.neutral(model)
    frame = model.nframes - 1
    best = np.inf
    for _ in range(5):
        began = time.perf_counter()
        for _ in range(calls):
            pin.forwardKinematics(model, data, q)
            pin.updateFramePlacement(model, data, frame)
        best = min(best, (time.perf_counter() - began) / calls)
    return 1e6 * best


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
                    "paper": "connected" if case.connected else "not connected",
                    "moves": f"{moves} {step_deg:g}°",
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
