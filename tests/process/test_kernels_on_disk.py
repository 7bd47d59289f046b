"""Compiled kernels: right, compiled once, kept on disk, read only where nobody else can write."""

from __future__ import annotations

import os
import shutil
import stat
import subprocess
import sys
import types
from collections import Counter, namedtuple
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numba
import numpy as np
import pytest
from numba.core import config, event
from numba.core.registry import cpu_target

import coverable_kernel_files
from coverable_kernel_files import Kernel, Processor, is_safe, keep, load
from coverable_kernels import KeptKernels, njit, stamp

ROOT = Path(__file__).parents[2]


# Kernels that kernels call.


class Inner(NamedTuple):
    values: Any
    count: int


class Whole(NamedTuple):
    inner: Inner
    table: Any
    flag: bool


class Same(NamedTuple):
    first: float
    second: float


@njit()
def scaled(inner, factor=2.0):  # type: ignore[no-untyped-def]
    """Write to an array of the caller's."""
    for k in range(inner.count):
        inner.values[k] *= factor
    if inner.values[0] > 1e3:
        raise ValueError("too much")
    return inner.values[0]


@njit()
def summed(whole, same):  # type: ignore[no-untyped-def]
    """Hand on a part, and a named tuple that is made here, many times."""
    total = 0.0
    for k in range(3):
        made = Inner(whole.table[k], 2 - k % 2)
        total += scaled(whole.inner) + scaled(made, np.float64(1 + k)) + same.second - same.first
    return total if whole.flag else -total


@njit()
def both(whole, same):  # type: ignore[no-untyped-def]
    """Another caller; it returns a named tuple."""
    return Same(summed(whole, same), scaled(whole.inner, np.float64(1.0)))


def given() -> tuple[Whole, Same]:
    """Arguments."""
    return Whole(Inner(np.ones(4), 3), np.arange(1.0, 7.0).reshape(3, 2), False), Same(1.0, 4.0)


class Compilations(event.Listener):  # type: ignore[misc]
    """Counts them by function and types."""

    def __init__(self) -> None:
        """None yet."""
        self.seen: Counter[tuple[str, str]] = Counter()

    def on_start(self, about: Any) -> None:
        """One begins."""
        self.seen[about.data["dispatcher"].__name__, str(about.data["args"])] += 1

    def on_end(self, about: Any) -> None:
        """It ends."""


def test_kernels_compute_what_python_computes_and_are_each_translated_once() -> None:
    listener, compiled = Compilations(), given()
    with event.install_listener("numba:compile", listener):
        result, again = both(*compiled), summed(*given())
    names = ("scaled", "summed", "both")
    assert {n for (name, _), n in listener.seen.items() if name in names} == {1}
    plain, inner, middle, outer = given(), scaled.py_func, summed.py_func, both.py_func
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(globals(), "scaled", inner)
        patch.setitem(globals(), "summed", middle)
        assert result == outer(*plain)
        assert again == middle(*given())
    assert isinstance(result, Same)
    assert (compiled[0].inner.values == plain[0].inner.values).all()


def test_errors_of_inner_kernels_come_through() -> None:
    whole, same = given()
    whole.inner.values[0] = 1e3
    with pytest.raises(ValueError, match="too much"):
        summed(whole, same)


# What a kept kernel depends on.

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
from coverable_kernels import njit
from robots.inner import closed, inner

@njit(cache=True)
def outer(x):
    return inner(x) + closed(x)
"""


def stamp_of(inner: str) -> str:
    """The stamp of the outer kernel, over a module of the inner one."""
    module, outer = types.ModuleType("robots.inner"), types.ModuleType("robots.outer")
    exec(inner.replace("cache=True", "cache=False"), module.__dict__)
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sys.modules, "robots.inner", module)
        exec(OUTER.replace("cache=True", "cache=False"), outer.__dict__)
    return str(stamp(outer.outer.py_func, {}))


@pytest.mark.parametrize(
    ("old", "new", "changes"),
    [
        ("x + 1.0", "x + 2.0", True),
        ("SCALE, TABLE = 2.0", "SCALE, TABLE = 3.0", True),
        ("SCALE, TABLE = 2.0", "SCALE, TABLE = 2", True),
        ("[0.5, 0.0]", "[0.25, 0.0]", True),
        ("[0.5, 0.0]", "[0.5, 0.0, 0.0]", True),
        ("[0.5, 0.0]", "[[0.5, 0.0]]", True),
        ("more=0.0", "more=1.0", True),
        ("BIG = 5", "BIG = 6", True),
        ("first: float\n    second", "second: float\n    first", True),
        ('error_model="numpy"', 'error_model="python"', True),
        ("made(3.0)", "made(4.0)", True),
        ("UNUSED = 1.0", "UNUSED = 2.0", False),
        ("What it does.", "It adds one.", False),
        ("\nclosed =", "\n@njit()\ndef unrelated(x):\n    return x\n\nclosed =", False),
        ("\nclass Kind", "\n\n# A comment.\nclass Kind", False),
    ],
)
def test_what_a_kernel_is_made_of_is_in_its_stamp(old: str, new: str, changes: bool) -> None:
    assert INNER.count(old) == 1
    assert (stamp_of(INNER.replace(old, new)) != stamp_of(INNER)) == changes


def test_a_value_that_cannot_be_compared_is_refused() -> None:
    with pytest.raises(TypeError, match="not known how to tell when that changes"):
        stamp_of(INNER.replace("SCALE, TABLE = 2.0", "SCALE, TABLE = object()"))


def key_of(*values: object) -> str:
    """What the name of a kept kernel says of its arguments."""

    def function(*pairs: object) -> object:
        return pairs

    codegen = cpu_target.target_context.codegen()
    return str(KeptKernels(function, {}).kernel(tuple(map(numba.typeof, values)), codegen).types)


def test_fields_and_kinds_of_arrays_are_part_of_the_key() -> None:
    """To numba, named tuples of one name are of one type."""
    one, same, other = (namedtuple("Pair", names)(1.0, 2.0) for names in ("a b", "a b", "b a"))
    assert key_of((1, (one, 2.0))) == key_of((1, (same, 2.0))) != key_of((1, (other, 2.0)))
    fixed = np.zeros((2, 2))
    fixed.flags.writeable = False
    given = np.zeros((2, 2)), np.zeros(2), np.zeros((2, 2), order="F"), np.zeros((2, 2), np.int64)
    assert len({key_of(array) for array in (*given, fixed)} | {key_of(given[0], 1)}) == 6


def test_a_kernel_is_compiled_anew_when_another_that_it_calls_has_changed(tmp_path: Path) -> None:
    def result(folder: Path) -> tuple[float, bool]:
        """What a new process gets, and whether it came from disk."""
        code = (
            "from robots.outer import outer as f; print(f(1.0), sum(f.stats.cache_hits.values()))"
        )
        environment = {**os.environ, "PYTHONPATH": str(folder)}
        environment.pop("NUMBA_CACHE_DIR", None)
        done = subprocess.run([sys.executable, "-c", code], env=environment, cwd=folder,
                              capture_output=True, text=True, check=True)  # fmt: skip
        value, *hits = map(float, done.stdout.split())
        return value, sum(hits) > 0

    first, copy = tmp_path / "first", tmp_path / "copy"
    (first / "robots").mkdir(parents=True)
    for path in ROOT.glob("coverable_*kernel*.py"):
        shutil.copy(path, first)
    (first / "robots/inner.py").write_text(INNER)
    (first / "robots/outer.py").write_text(OUTER)
    assert result(first) == (7.5, False)
    shutil.copytree(first, copy, copy_function=shutil.copyfile)
    (copy / "robots/inner.py").write_text(INNER + "\n@njit()\ndef unrelated():\n    return 3\n")
    assert result(copy) == (7.5, True)  # although every file is younger, and one another
    (copy / "robots/inner.py").write_text(INNER.replace("x + 1.0", "x + 2.0"))
    assert result(copy) == (9.5, False)  # numba alone would have said 7.5
    assert result(first) == (7.5, True)


# Which files are read: a kernel is machine code, so only where nobody else can write.

HERE = Processor("x86_64-unknown-linux-gnu", "znver4", "+avx512f,+fma")
KERNEL = Kernel("robots.chain.frames", "a" * 64, "(array(float64, 1d, C),)", HERE)
ME, OTHER, SYSTEM, GROUP, USERS = 1000, 1001, 0, 100, 200


@pytest.mark.parametrize(
    ("found", "code", "safe"),
    [
        ((ME, GROUP, 0o755), (ME, GROUP, 0o755), True),
        ((ME, GROUP, 0o700), (SYSTEM, SYSTEM, 0o755), True),  # in the home folder
        ((SYSTEM, SYSTEM, 0o755), (SYSTEM, SYSTEM, 0o755), True),  # in a shared installation
        ((OTHER, GROUP, 0o755), (OTHER, GROUP, 0o755), True),  # whose code runs anyway
        ((OTHER, GROUP, 0o755), (ME, GROUP, 0o755), False),
        ((OTHER, GROUP, 0o755), (SYSTEM, SYSTEM, 0o755), False),
        ((ME, GROUP, 0o777), (ME, GROUP, 0o755), False),
        ((ME, GROUP, 0o757), (ME, GROUP, 0o757), False),  # not even where the code can be changed
        ((SYSTEM, SYSTEM, 0o1777), (ME, GROUP, 0o755), False),  # the folder for temporary files
        ((ME, GROUP, 0o775), (ME, GROUP, 0o755), False),
        ((ME, GROUP, 0o775), (ME, GROUP, 0o775), True),  # the same people can change the code
        ((ME, USERS, 0o775), (ME, GROUP, 0o775), False),
    ],
)
def test_what_is_as_safe_as_the_code(
    found: tuple[int, int, int], code: tuple[int, int, int], safe: bool
) -> None:
    def status(user: int, group: int, mode: int) -> os.stat_result:
        return os.stat_result((stat.S_IFDIR | mode, 1, 1, 1, user, group, 0, 0, 0, 0))

    assert is_safe(status(*found), status(*code), ME) == safe


@pytest.mark.parametrize(
    "change",
    [
        lambda kernel: kernel._replace(function="robots.chain.jacobian"),
        lambda kernel: kernel._replace(stamp="b" * 64),
        lambda kernel: kernel._replace(types="(array(float64, 2d, C),)"),
        lambda kernel: kernel._replace(processor=HERE._replace(triple="arm64-apple-darwin24")),
        lambda kernel: kernel._replace(processor=HERE._replace(name="skylake")),
        lambda kernel: kernel._replace(processor=HERE._replace(features="+fma")),
    ],
)
def test_all_that_a_kernel_depends_on_is_in_its_name(change: Callable[[Kernel], Kernel]) -> None:
    assert change(KERNEL).file() != KERNEL.file() == KERNEL._replace().file()


def test_versions_are_in_its_name() -> None:
    before = KERNEL.file()
    for what in ("numba.__version__", "llvmlite.__version__", "sys.implementation.cache_tag"):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(what, "cpython-399")
            assert KERNEL.file() != before


@pytest.fixture
def code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A file of code; kernels are kept beside it, or else in a home folder."""
    monkeypatch.setattr(config, "CACHE_DIR", "")
    monkeypatch.setattr(coverable_kernel_files, "SHIPPED", tmp_path / "shipped")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home" / "cache"))
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    source = tmp_path / "robots" / "chain.py"
    source.parent.mkdir(mode=0o755)
    source.touch()
    return source


def pickled(number: int) -> bytes:
    """A number, as a pickle would hold it."""
    return b"I%d\n." % number


def kept(tmp_path: Path) -> list[Path]:
    """All files of kernels."""
    return sorted(tmp_path.rglob("*.kernel*"))


def test_kernels_are_kept_beside_the_code_and_older_versions_make_room(
    code: Path, tmp_path: Path
) -> None:
    assert load(KERNEL, code) is None
    types = KERNEL._replace(types="(int64,)")
    neighbour = KERNEL._replace(function="robots.chain.frames_of")
    newer = KERNEL._replace(stamp="b" * 64)
    for number, kernel in enumerate((KERNEL, types, neighbour)):
        keep(kernel, code, pickled(number))
    assert [load(kernel, code) for kernel in (KERNEL, types, neighbour)] == [0, 1, 2]
    assert {path.parent for path in kept(tmp_path)} == {code.parent / "__pycache__"}
    assert load(newer, code) is None
    keep(newer, code, pickled(3))
    found = [load(kernel, code) for kernel in (KERNEL, types, neighbour, newer)]
    assert found == [None, None, 2, 3]
    assert {path.name for path in kept(tmp_path)} == {neighbour.file(), newer.file()}


@pytest.mark.parametrize("where", ["home", "nowhere", "no home"])
def test_where_the_folder_of_the_code_cannot_be_written(
    where: str, code: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (code.parent / "__pycache__").touch()  # a file, where even root can make no folder
    if where == "nowhere":
        monkeypatch.setattr(config, "CACHE_DIR", "/dev/null")
    elif where == "no home":
        monkeypatch.setenv("XDG_CACHE_HOME", "~/.cache")  # as where nothing says what ~ is
        monkeypatch.setattr("os.path.expanduser", str)
        monkeypatch.chdir(tmp_path)
    keep(KERNEL, code, pickled(5))
    assert load(KERNEL, code) == (5 if where == "home" else None)
    assert len(kept(tmp_path)) == (where == "home")
    for path in kept(tmp_path):
        assert path.is_relative_to(tmp_path / "home")
        assert stat.S_IMODE(path.parent.stat().st_mode) == 0o700


def test_what_others_can_change_is_neither_read_nor_written(code: Path, tmp_path: Path) -> None:
    keep(KERNEL, code, pickled(5))
    (path,) = kept(tmp_path)
    for changed, mode, before in ((path, 0o666, 0o644), (path.parent, 0o1777, 0o755)):
        changed.chmod(mode)
        assert load(KERNEL, code) is None
        changed.chmod(before)
        assert load(KERNEL, code) == 5
    path.unlink()
    path.parent.chmod(0o777)
    keep(KERNEL, code, pickled(6))
    assert load(KERNEL, code) == 6
    assert kept(tmp_path)[0].is_relative_to(tmp_path / "home")


def test_a_file_that_is_not_what_its_name_says_is_not_loaded(code: Path, tmp_path: Path) -> None:
    other = KERNEL._replace(types="(int64,)")
    keep(KERNEL, code, pickled(5))
    (path,) = kept(tmp_path)
    whole = path.read_bytes()
    for content in (b"", whole[:20], whole[:-1], whole + b"\n", whole.replace(b"5", b"6")):
        path.write_bytes(content)
        assert load(KERNEL, code) is None
    (path.parent / other.file()).write_bytes(whole)
    assert load(other, code) is None


def test_a_shipped_kernel_serves_every_processor_of_its_kind(code: Path, tmp_path: Path) -> None:
    keep(KERNEL.for_any_processor(), code, pickled(5))
    (path,) = kept(tmp_path)
    (tmp_path / "shipped").mkdir(mode=0o755)
    path.rename(tmp_path / "shipped" / path.name)
    for processor in (HERE, HERE._replace(name="pentium", features="")):
        assert load(KERNEL._replace(processor=processor), code) == 5
    assert load(KERNEL._replace(processor=HERE._replace(triple="arm64-apple")), code) is None
    keep(KERNEL, code, pickled(6))
    assert load(KERNEL, code) == 6  # one that was compiled here is for this processor
    (tmp_path / "shipped").chmod(0o777)
    assert load(KERNEL._replace(processor=HERE._replace(name="pentium")), code) is None
