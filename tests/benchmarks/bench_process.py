"""Whole processes: the command from its kernels on disk, and a first check, which compiles."""

import os
import resource
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

CHECK = ["-m", "coverable", "check"]


def children_s() -> float:
    """Processor time of the processes that were started and have ended [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


@pytest.fixture
def processes(benchmark: Any) -> Any:
    """pytest-benchmark, by the processor time of processes that were started."""
    benchmark._timer = children_s
    return benchmark


def ask(*arguments: str, **more: str) -> None:
    environment = {**os.environ, **more}
    subprocess.run([sys.executable, *arguments], env=environment, check=True, capture_output=True)


@pytest.mark.parametrize("arguments", [["-c", "import numba"], [*CHECK, "--help"],
                                       [*CHECK, "paper/4a"]], ids=lambda a: a[-1])  # fmt: skip
def bench_command(arguments: list[str], processes: Any) -> None:
    """Goal of `coverable check paper/4a`, all of it: 0.7 s, of which numba alone takes 0.55."""
    processes.pedantic(lambda: ask(*arguments), rounds=5, warmup_rounds=1)


@pytest.mark.parametrize("more", ["", "collision.clearance=0.005", "search.method=greedy"])
def bench_first_check(more: str, tmp_path: Path, processes: Any) -> None:
    """Nothing is compiled; goals: 22 s, 15 s more with collisions, 6 s for the paper's search."""
    settings, compiled = (["--set", more] if more else []), {"NUMBA_CACHE_DIR": str(tmp_path)}
    processes.pedantic(lambda: ask(*CHECK, "paper/4a", *settings, **compiled), rounds=1)
