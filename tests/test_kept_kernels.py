"""Kernels that are kept on disk are compiled anew when what they call has changed elsewhere."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
CALLS = "from coverable_kernels import njit\nfrom robots.inner import inner\n"
OUTER = "\n\n@njit(cache=True)\ndef outer():\n    return inner()\n"
INNER = "from coverable_kernels import njit\n\n\n@njit(cache=True)\ndef inner():\n    return {}\n"


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A checkout of two kernels, one of which calls the other."""
    shutil.copy(ROOT / "coverable_kernels.py", tmp_path)
    for room in ("robots", "surfaces", "feasibility"):
        (tmp_path / room / "inside").mkdir(parents=True)
    (tmp_path / "robots" / "outer.py").write_text(CALLS + OUTER)
    (tmp_path / "robots" / "inner.py").write_text(INNER.format(1))
    return tmp_path


def result(checkout: Path) -> tuple[int, bool]:
    """What a new process gets from the kernel, and whether it came from disk."""
    code = "from robots.outer import outer; print(outer(), sum(outer.stats.cache_hits.values()))"
    environment = {**os.environ, "PYTHONPATH": str(checkout), "PYTHONDONTWRITEBYTECODE": "1"}
    environment.pop("NUMBA_CACHE_DIR", None)
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True,
        cwd=checkout,
    )  # fmt: skip
    value, hits = map(int, done.stdout.split())
    return value, hits > 0


def test_a_kernel_is_compiled_anew_when_another_that_it_calls_has_changed(checkout: Path) -> None:
    assert result(checkout) == (1, False)
    # What holds no kernels changes nothing.
    (checkout / "surfaces" / "inside" / "plain.py").write_text("NUMBER = 3\n")
    (checkout / "robots" / "plain.py").write_text("NUMBER = 3\n")
    assert result(checkout) == (1, True)
    (checkout / "robots" / "inner.py").write_text(INNER.format(2))
    assert result(checkout) == (2, False)  # numba alone would have said 1


def test_what_was_compiled_holds_in_a_copy(checkout: Path, tmp_path: Path) -> None:
    assert result(checkout) == (1, False)
    copy = tmp_path / "elsewhere"
    shutil.copytree(checkout, copy, ignore=lambda *_: ["elsewhere"], copy_function=shutil.copyfile)
    assert result(copy) == (1, True)  # although every file is younger
    (copy / "robots" / "inner.py").write_text(INNER.format(3))
    assert result(copy) == (3, False)
    assert result(checkout) == (1, True)


def test_no_kernel_of_ours_is_kept_by_its_own_file_alone() -> None:
    for package in ("robots", "surfaces", "feasibility", "coverable_meshes"):
        for path in (ROOT / package).rglob("*.py"):
            text = path.read_text("utf-8")
            assert "import njit" not in text.replace("from coverable_kernels import njit", ""), path
            assert "numba import cfunc" not in text, path
