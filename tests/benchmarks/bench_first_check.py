"""What a first check costs, which compiles the search kernels: without collisions, and with."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FIRST = """
import sys
sys.path[:0] = sys.argv[2:]
from paper_cases import PAPER_CASES
from feasibility import check
from feasibility.collisions import Collision
case = PAPER_CASES["4a"]
collision = Collision(surface=False, clearance=0.005) if sys.argv[1] == "with" else None
check(case.robot(), case.cells(), case.task(), collision=collision)
"""


def _first_s(which: str) -> float:
    """Processor time of a first check, which compiles; 'with' or 'without' collisions."""
    with tempfile.TemporaryDirectory() as folder:
        before = os.times()
        subprocess.run(
            [sys.executable, "-W", "ignore", "-c", FIRST, which, *sys.path],
            env={**os.environ, "NUMBA_CACHE_DIR": folder, "PYTHONPATH": str(ROOT)},
            stderr=subprocess.DEVNULL,
            check=True,
        )
        after = os.times()
    return (
        after.children_user + after.children_system - before.children_user - before.children_system
    )


def rows() -> tuple[str, list[dict[str, object]]]:
    """One row without and one with collisions."""
    taken = {which: _first_s(which) for which in ("without", "with")}
    title = "First check, which compiles: processor time; collisions may take 15 s more"
    return title, [{"collisions": which, "first check s": s} for which, s in taken.items()]
