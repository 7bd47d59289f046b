"""The complete search: the paper's cases, fine grids, parted cases, a timed path, the process.

All times are processor times: those of a machine that is not quiet too. Goals are in FK calls where
the search is asked alone, because these compare on all machines.
"""

from __future__ import annotations

import json
import os
import resource
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from fk_unit import pinocchio_fk_us
from oracle_build import built
from oracle_cases import Problem
from paper_cases import PAPER_CASES

from feasibility import Answer, Evidence, Task, Verdict, check
from feasibility.paths import coverage_path
from feasibility.timing import trajectory
from robots import Axis, load_robot
from surfaces import plane

ROOT = Path(__file__).resolve().parents[2]
PATH_SPEED = 0.1  # [m/s]
DISCONNECTED = ROOT / "tests" / "questions" / "puma560_disconnected.json"
GRID = """
import json, resource, sys, time
sys.path[:0] = sys.argv[3:]
from paper_cases import PAPER_CASES
from feasibility import check
case = PAPER_CASES["4a"]
robot, task, surface = case.robot(), case.task(), case.cells().surface
check(robot, case.cells(), task)
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
began = time.process_time()
verdict = check(robot, surface.cells(int(sys.argv[1]), int(sys.argv[2])), task)
taken = time.process_time() - began
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
print(json.dumps([taken, str(verdict.answer), verdict.n_covered, verdict.n_edges,
                  verdict.statistics["fk"], peak]))
"""


def least_ms(ask: Callable[[], Any], repeats: int) -> tuple[float, Any]:
    """Least processor time of a call, and what the last one returned; the first is not counted."""
    answer = ask()
    times = []
    for _ in range(repeats):
        began = time.process_time()
        answer = ask()
        times.append(1e3 * (time.process_time() - began))
    return min(times), answer


def row(what: str, ms: float, fk_us: float, target: str, **more: object) -> dict[str, object]:
    """One row of the table."""
    return {
        "what": what,
        "verdict": more.get("verdict", ""),
        "cells": more.get("cells", ""),
        "edges": more.get("edges", ""),
        "FK": more.get("fk", ""),
        "least ms": ms,
        "in Pinocchio FK": round(1e3 * ms / fk_us),
        "causes ms": more.get("causes", ""),
        "an edge us": more.get("per_edge", ""),
        "peak MB": more.get("peak", ""),
        "target": target,
    }


def of_verdict(verdict: Verdict) -> dict[str, object]:
    """The columns that a verdict fills."""
    return {
        "verdict": f"{verdict.answer} ({verdict.evidence})",
        "cells": f"{verdict.n_covered} of {len(verdict.cells)}",
        "edges": verdict.n_edges,
        "fk": verdict.statistics["fk"],
    }


def causes_ms(verdict: Verdict) -> float:
    """Time to find the causes, which are made when they are first read."""
    began = time.process_time()
    _ = verdict.causes
    return 1e3 * (time.process_time() - began)


def paper_rows(fk_us: float, repeats: int) -> list[dict[str, object]]:
    """The twelve published cases."""
    table = []
    for name, case in PAPER_CASES.items():
        setup = case.robot(), case.cells(), case.task()
        ms, verdict = least_ms(lambda setup=setup: check(*setup), repeats)
        goal = {"4a": 20_000, "5c": 60_000}.get(name, 30_000)
        target = f"{goal:,} FK" if verdict.feasible else ""
        causes = causes_ms(verdict) if verdict.evidence is Evidence.PROOF else ""
        table.append(row(name, ms, fk_us, target, **of_verdict(verdict), causes=causes))
    return table


def parted_rows(fk_us: float, wanted: int = 5) -> list[dict[str, object]]:
    """Stored problems cut into 90 cells: every cell is reached, by no single component."""
    arm, table = load_robot("puma560"), []
    for stored in json.loads(DISCONNECTED.read_text()):
        plain = {key: stored[key] for key in Problem.__dataclass_fields__}
        setup = built(replace(Problem.read(plain), cells=(9, 10)), arm)
        first = check(*setup)
        if first.answer is not Answer.INFEASIBLE or not _all_reached(first):
            continue
        ms, verdict = least_ms(lambda setup=setup: check(*setup), 3)
        what = f"parted {len(table) + 1}: {verdict.cells.surface.kind}"
        table.append(row(what, ms, fk_us, "", **of_verdict(verdict), causes=causes_ms(verdict)))
        if len(table) == wanted:
            break
    if table:
        middle = statistics.median(float(str(r["least ms"])) for r in table)
        table.append(row("parted, median of these", middle, fk_us, "1000 ms"))
    return table


def _all_reached(verdict: Verdict) -> bool:
    """Does every cell lie in some component?"""
    reached = np.concatenate([np.zeros(0, dtype=np.int64), *verdict.components])
    return len(np.unique(reached)) == len(verdict.cells)


def grid_rows(fk_us: float) -> list[dict[str, object]]:
    """The sphere of 4a in finer and finer cells, each in a process of its own."""
    table = []
    for nu, nv, target in ((9, 10, ""), (45, 50, "250 ms"), (300, 300, "2 s, 300 MB")):
        folders = [str(ROOT), str(ROOT / "tests" / "paper")]
        done = subprocess.run(
            [sys.executable, "-c", GRID, str(nu), str(nv), *folders],
            capture_output=True, text=True, check=True,
        )  # fmt: skip
        taken, answer, covered, edges, fk, peak = json.loads(done.stdout)
        table.append(
            row(
                f"sphere {nu} x {nv}", 1e3 * taken, fk_us, target, verdict=answer,
                cells=f"{covered} of {nu * nv}", edges=edges, fk=fk,
                per_edge=1e6 * taken / edges, peak=peak / 1024,
            )
        )  # fmt: skip
    return table


def process_row(fk_us: float, repeats: int) -> dict[str, object]:
    """`coverable check paper/4a` as a whole process, from its kernels on disk."""
    command = [sys.executable, "-m", "feasibility.cli", "check", "paper/4a"]

    def ask() -> float:
        before = _children_s()
        subprocess.run(command, cwd=ROOT, env={**os.environ}, check=True, capture_output=True)
        return _children_s() - before

    ask()
    ms = 1e3 * min(ask() for _ in range(repeats))
    return row("process: check paper/4a", ms, fk_us, "700 ms")


def _children_s() -> float:
    """Processor time of the processes that were started and have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def path_row(fk_us: float, repeats: int) -> dict[str, object]:
    """The path over paper/4a, timed and judged; the verdict is there."""
    case = PAPER_CASES["4a"]
    verdict = check(case.robot(), case.cells(), case.task())
    ms, run = least_ms(lambda: trajectory(coverage_path(verdict), PATH_SPEED), repeats)
    return row("4a: path, timed", ms, fk_us, "300 ms", cells=f"{len(run)} samples")


def composed_rows(fk_us: float, repeats: int) -> list[dict[str, object]]:
    """An arm alone over a plate, and the same arm on a rail beside a turntable that carries it."""
    where, grid = (0.55, 0.0, 0.1), (9, 10)
    rail = Axis("rail", "prismatic", (0, 1, 0), limits=(-0.5, 0.5))
    table = Axis("table", "revolute", limits_deg=(-180, 180), position=where, carries="surface")
    plate, task = ((-0.15, 0.15), (-0.25, 0.25)), Task(0.005, 20)
    setups = {
        "ur5 over a plate": (load_robot("ur5"), plane(*plate, position=where).cells(*grid), task),
        "ur5 on a rail, plate on a table": (
            load_robot("ur5", axes=[rail, table]), plane(*plate).cells(*grid), task,
        ),
    }  # fmt: skip
    table_rows, alone = [], ""
    for what, setup in setups.items():
        ms, verdict = least_ms(lambda setup=setup: check(*setup), repeats)
        table_rows.append(row(what, ms, fk_us, alone, **of_verdict(verdict)))
        alone = f"{3.0 * ms:.0f} ms"
    return table_rows


def rows(repeats: int = 9) -> tuple[str, list[dict[str, object]]]:
    """One row for each thing that a target is set for."""
    fk_us = pinocchio_fk_us()
    table = [
        *paper_rows(fk_us, repeats),
        *parted_rows(fk_us),
        path_row(fk_us, 3),
        *grid_rows(fk_us),
        *composed_rows(fk_us, repeats),
        process_row(fk_us, 5),
    ]
    title = (
        f"Complete search, kernels loaded, least of {repeats} with the witness replayed. One "
        f"Pinocchio FK call from Python: {fk_us:.2f} us."
    )
    return title, table
