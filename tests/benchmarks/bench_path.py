"""Coverage paths of the feasible paper cases: lengths, revisits and times, for each order."""

from __future__ import annotations

import time

import numpy as np
from paper_cases import PAPER_CASES

from feasibility import check
from feasibility.paths import coverage_path
from feasibility.paths.order import ORDERS
from feasibility.timing import trajectory

SPEED = 0.1  # [m/s]


def rows() -> tuple[str, list[dict[str, object]]]:
    """One row for each case and order; the best order of a case by revisited share, then length."""
    table: list[dict[str, object]] = []
    for name, case in PAPER_CASES.items():
        verdict = check(case.robot(), case.cells(), case.task())
        if not verdict.feasible:
            continue
        found = []
        for order in ORDERS:
            began = time.process_time()
            path = coverage_path(verdict, order)
            planned = time.process_time()
            run = trajectory(path, SPEED)
            timed = time.process_time()
            figures = path.figures
            row: dict[str, object] = {
                "case": name,
                "order": order,
                "best": "",
                "length m": figures.length,
                "revisited %": 100.0 * figures.revisited_share,
                "over bound": figures.ratio,
                "joint travel deg": float(np.degrees(figures.travel.sum())),
                "duration s": run.duration,
                "tool at full speed %": 100.0 * run.tool_way / (SPEED * run.duration),
                "path ms": 1e3 * (planned - began),
                "timing ms": 1e3 * (timed - planned),
            }
            found.append((figures.revisited_share, figures.length, row))
        best = min(found, key=lambda item: item[:2])[2]
        best["best"] = "*"
        table += [row for _, _, row in found]
    title = (
        f"Coverage paths, tool at up to {SPEED} m/s. The bound is the smallest spanning tree of "
        "the centres; revisited is over covered length, target 15 % with the best order (*)."
    )
    return title, table
