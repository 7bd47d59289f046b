"""Kernels that are kept on disk are compiled anew when what they were made of has changed."""

from __future__ import annotations

import importlib
import os
import pkgutil
import shutil
import subprocess
import sys
import types
from collections import namedtuple
from pathlib import Path

import numba
import numpy as np
import pytest
from numba.core.registry import cpu_target

import feasibility
import robots
import surfaces
from coverable_kernels import KeptKernels, stamp

ROOT = Path(__file__).parents[1]
INNER = """
from coverable_kernels import njit
import numpy as np
from enum import Enum
from typing import NamedTuple
SCALE, TABLE = 2.0, np.array([0.5, 0.0])
UNUSED = 1.0

class Kind(Enum):
    BIG = 5

class Pair(NamedTuple):
    first: float
    second: float

@njit(error_model="numpy", cache=True)
def innermost(x):
    "What it does."
    return x + 1.0

@njit(cache=True)
def inner(x, more=0.0):
    pair = Pair(x, Kind.BIG.value)
    return innermost(pair.first) * SCALE + more + TABLE[0]

def made(factor):
    @njit()
    def closed(x):
        return factor * x
    return closed

closed = made(3.0)
"""
OUTER = """
from coverable_kernels import cfunc, njit
from numba import float64
from robots.inner import closed, inner

@njit(cache=True)
def outer(x):
    return inner(x) + closed(x)

@cfunc(float64(float64), cache=True)
def called(x):
    return inner(x) + closed(x)
"""


def stamp_of(inner: str) -> str:
    """The stamp of the outer kernel, with that text of the module of the inner one."""
    module = types.ModuleType("robots.inner")
    exec(inner.replace("cache=True", "cache=False"), module.__dict__)
    outer = types.ModuleType("robots.outer")
    before = sys.modules.get("robots.inner")
    sys.modules["robots.inner"] = module
    try:
        exec(OUTER[: OUTER.index("@cfunc")].replace("cache=True", "cache=False"), outer.__dict__)
    finally:
        del sys.modules["robots.inner"]
        if before is not None:
            sys.modules["robots.inner"] = before
    return stamp(outer.outer.py_func, {})


@pytest.fixture(scope="module")
def first() -> str:
    """The stamp before anything changes."""
    return stamp_of(INNER)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("x + 1.0", "x + 2.0"),
        ("x + 1.0", "x - 1.0"),
        ("SCALE, TABLE = 2.0", "SCALE, TABLE = 3.0"),
        ("SCALE, TABLE = 2.0", "SCALE, TABLE = 2"),
        ("[0.5, 0.0]", "[0.25, 0.0]"),
        ("[0.5, 0.0]", "[0.5, 0.0, 0.0]"),
        ("[0.5, 0.0]", "[[0.5, 0.0]]"),
        ("more=0.0", "more=1.0"),
        ("BIG = 5", "BIG = 6"),
        ("first: float\n    second", "second: float\n    first"),
        ('error_model="numpy"', 'error_model="python"'),
        ("made(3.0)", "made(4.0)"),
    ],
)
def test_what_a_kernel_is_made_of_is_in_its_stamp(first: str, old: str, new: str) -> None:
    assert INNER.count(old) == 1
    assert stamp_of(INNER.replace(old, new)) != first


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("UNUSED = 1.0", "UNUSED = 2.0"),
        ("What it does.", "It adds one."),
        ("\nclosed =", "\n@njit()\ndef unrelated(x):\n    return x\n\nclosed ="),
        ("\nclass Kind", "\n\n# A comment.\nclass Kind"),
    ],
)
def test_nothing_else_is_in_its_stamp(first: str, old: str, new: str) -> None:
    assert INNER.count(old) == 1
    assert stamp_of(INNER.replace(old, new)) == first


def test_a_value_that_cannot_be_compared_is_refused() -> None:
    with pytest.raises(TypeError, match="not known how to tell when that changes"):
        stamp_of(INNER.replace("SCALE, TABLE = 2.0", "SCALE, TABLE = object()"))


def test_every_kernel_of_ours_has_a_stamp() -> None:
    seen = 0
    for package in (robots, surfaces, feasibility):
        for found in pkgutil.walk_packages(package.__path__, package.__name__ + "."):
            if "__main__" in found.name:
                continue
            for value in vars(importlib.import_module(found.name)).values():
                if isinstance(getattr(value, "_cache", None), KeptKernels):
                    assert len(stamp(value.py_func, value.targetoptions)) == 64
                    seen += 1
    assert seen > 100


def key_of(*values: object) -> str:
    """What the name of a kept kernel says of its arguments."""

    def function(*pairs: object) -> object:
        return pairs

    codegen = cpu_target.target_context.codegen()
    return KeptKernels(function, {}).kernel(tuple(map(numba.typeof, values)), codegen).types


def test_names_of_fields_are_part_of_the_key() -> None:
    """To numba each of these is a pair of numbers, of a class of that name."""
    one, same, other = (namedtuple("Pair", names)(1.0, 2.0) for names in ("a b", "a b", "b a"))
    assert key_of(one) == key_of(same) != key_of(other)
    assert key_of((1, (one, 2.0))) == key_of((1, (same, 2.0))) != key_of((1, (other, 2.0)))
    elsewhere = type(one)._make((1.0, 2.0))
    type(one).__module__ = "elsewhere"
    assert key_of(elsewhere) != key_of(same)


def test_kinds_of_arrays_are_part_of_the_key() -> None:
    given = np.zeros((2, 2)), np.zeros(2), np.zeros((2, 2), order="F"), np.zeros((2, 2), np.int64)
    fixed = np.zeros((2, 2))
    fixed.flags.writeable = False
    keys = {key_of(array) for array in (*given, fixed)} | {
        key_of(given[0], 1),
        key_of(given[0], 1.0),
    }
    assert len(keys) == 7


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A checkout of kernels that call each other."""
    for path in ROOT.glob("coverable_*kernel*.py"):
        shutil.copy(path, tmp_path)
    for name, text in (("robots/inner.py", INNER), ("robots/outer.py", OUTER)):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    return tmp_path


def result(checkout: Path, **more: str) -> tuple[float, bool]:
    """What a new process gets from kernel and C function, and whether both came from disk."""
    code = (
        "from robots.outer import called, outer;"
        "print(outer(1.0), called.ctypes(1.0), sum(outer.stats.cache_hits.values()),"
        "called.cache_hits)"
    )
    environment = {**os.environ, "PYTHONPATH": str(checkout), "PYTHONDONTWRITEBYTECODE": "1"}
    environment.pop("NUMBA_CACHE_DIR", None)
    done = subprocess.run(
        [sys.executable, "-c", code], env={**environment, **more}, capture_output=True, text=True,
        check=True, cwd=checkout,
    )  # fmt: skip
    kernel, by_address, *hits = map(float, done.stdout.split())
    assert kernel == by_address
    assert hits[0] == hits[1]
    return kernel, hits[0] > 0


def test_a_kernel_is_compiled_anew_when_another_that_it_calls_has_changed(
    checkout: Path, tmp_path: Path
) -> None:
    assert result(checkout) == (7.5, False)
    copy = tmp_path / "elsewhere"
    shutil.copytree(checkout, copy, ignore=lambda *_: ["elsewhere"], copy_function=shutil.copyfile)
    (copy / "robots" / "inner.py").write_text(INNER + "\n@njit()\ndef unrelated():\n    return 3\n")
    assert result(copy) == (7.5, True)  # although every file is younger, and one another
    (copy / "robots" / "inner.py").write_text(INNER.replace("x + 1.0", "x + 2.0"))
    assert result(copy) == (9.5, False)  # numba alone would have said 7.5
    assert result(checkout) == (7.5, True)


def test_kernels_that_were_shipped(checkout: Path, tmp_path: Path) -> None:
    """They serve any processor, if they fit, and are whole; nothing has to be written."""
    kept, shipped = tmp_path / "kept", tmp_path / "coverable_shipped_kernels"
    any_cpu = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}
    assert result(checkout, NUMBA_CACHE_DIR=str(kept), **any_cpu) == (7.5, False)
    shipped.mkdir()
    for path in kept.glob("*/*.kernel"):
        path.rename(shipped / path.name)
    nowhere = {"NUMBA_CACHE_DIR": "/dev/null"}
    assert result(checkout, **nowhere) == (7.5, True)
    for path in shipped.iterdir():
        path.write_bytes(path.read_bytes()[:-1])
    assert result(checkout, **nowhere) == (7.5, False)


def test_no_kernel_of_ours_is_kept_by_its_own_file_alone() -> None:
    for package in ("robots", "surfaces", "feasibility", "coverable_meshes"):
        for path in (ROOT / package).rglob("*.py"):
            text = path.read_text("utf-8")
            assert "import njit" not in text.replace("from coverable_kernels import njit", ""), path
            assert "numba import cfunc" not in text, path
