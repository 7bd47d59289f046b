"""What all benchmarks share: processor time, counts beside it, times in calls of Pinocchio's FK.

`make bench` runs them with pytest-benchmark, `make bench-compare OLD=a.json` compares two runs.
Times of different machines and days compare as `in FK calls`; counts (evaluations, edges) are the
same in every run.
"""

import time
from collections.abc import Callable
from typing import Any, TypeVar

import pinocchio as pin
import pytest

from coverable import Verdict, load_robot

T = TypeVar("T")


@pytest.fixture(scope="session")
def fk_us() -> float:
    """One FK call of Pinocchio with the tool frame from Python [us]: least of short blocks."""
    model = load_robot("puma560").model
    data, q, frame = model.createData(), pin.neutral(model), model.nframes - 1
    taken = []
    for _ in range(50):
        began = time.perf_counter()
        for _ in range(2_000):
            pin.forwardKinematics(model, data, q)
            pin.updateFramePlacement(model, data, frame)
        taken.append(time.perf_counter() - began)
    return 1e6 * min(taken) / 2_000


def of_verdict(verdict: Verdict) -> dict[str, object]:
    cells = f"{verdict.n_covered} of {len(verdict.cells)}"
    return {"verdict": str(verdict.answer), "cells": cells, "edges": verdict.n_edges,
            "FK": int(verdict.statistics["fk"])}  # fmt: skip


@pytest.fixture
def measured(benchmark: Any, fk_us: float) -> Callable[..., Any]:
    """measured(ask, rounds, **counts): the least processor time, and what `ask` returned."""

    def measure(ask: Callable[[], T], rounds: int = 5, **counts: Callable[[T], object]) -> T:
        ask()
        time.sleep(0.5)  # threads of OpenBLAS spin for a while, which counts as processor time
        found = benchmark.pedantic(ask, rounds=rounds)
        benchmark.extra_info |= of_verdict(found) if isinstance(found, Verdict) else {}
        benchmark.extra_info |= {name: count(found) for name, count in counts.items()}
        if benchmark.stats:
            benchmark.extra_info["in FK calls"] = round(1e6 * benchmark.stats.stats.min / fk_us)
        return found

    return measure


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config):
    """The counts, below the table of times."""
    session = getattr(config, "_benchmarksession", None)
    for bench in session.benchmarks if session else ():
        counts = ", ".join(f"{name} {value}" for name, value in bench.extra_info.items())
        terminalreporter.write_line(f"{bench.name}: {counts}")
