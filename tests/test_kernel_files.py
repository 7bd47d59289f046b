"""Which files of compiled kernels are read, and where they are written."""

from __future__ import annotations

import os
import stat
from collections.abc import Callable
from pathlib import Path

import pytest
from numba.core import config

import coverable_kernel_files
from coverable_kernel_files import Kernel, Processor, is_safe, keep, load

HERE = Processor("x86_64-unknown-linux-gnu", "znver4", "+avx512f,+fma")
KERNEL = Kernel("robots.chain.frames", "a" * 64, "(array(float64, 1d, C),)", HERE)
ME, OTHER, ROOT, GROUP, USERS = 1000, 1001, 0, 100, 200


def status(user: int, group: int, mode: int) -> os.stat_result:
    """Of a folder."""
    return os.stat_result((stat.S_IFDIR | mode, 1, 1, 1, user, group, 0, 0, 0, 0))


@pytest.mark.parametrize(
    ("found", "code", "safe"),
    [
        ((ME, GROUP, 0o755), (ME, GROUP, 0o755), True),
        ((ME, GROUP, 0o700), (ROOT, ROOT, 0o755), True),  # in the home folder
        ((ROOT, ROOT, 0o755), (ROOT, ROOT, 0o755), True),  # in a shared installation
        ((OTHER, GROUP, 0o755), (OTHER, GROUP, 0o755), True),  # whose code runs anyway
        ((OTHER, GROUP, 0o755), (ME, GROUP, 0o755), False),
        ((OTHER, GROUP, 0o755), (ROOT, ROOT, 0o755), False),
        ((ME, GROUP, 0o777), (ME, GROUP, 0o755), False),
        ((ME, GROUP, 0o757), (ME, GROUP, 0o757), False),  # not even where the code can be changed
        ((ROOT, ROOT, 0o1777), (ME, GROUP, 0o755), False),  # the folder for temporary files
        ((ME, GROUP, 0o775), (ME, GROUP, 0o755), False),
        ((ME, GROUP, 0o775), (ME, GROUP, 0o775), True),  # the same people can change the code
        ((ME, USERS, 0o775), (ME, GROUP, 0o775), False),
    ],
)
def test_what_is_as_safe_as_the_code(
    found: tuple[int, int, int], code: tuple[int, int, int], safe: bool
) -> None:
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
        lambda kernel: kernel.for_any_processor(),
    ],
)
def test_all_that_a_kernel_depends_on_is_in_its_name(change: Callable[[Kernel], Kernel]) -> None:
    assert change(KERNEL).file() != KERNEL.file() == KERNEL._replace().file()


@pytest.mark.parametrize("library", ["numba", "llvmlite"])
def test_versions_are_in_its_name(library: str, monkeypatch: pytest.MonkeyPatch) -> None:
    before = KERNEL.file()
    monkeypatch.setattr(f"{library}.__version__", "0.0.1")
    assert KERNEL.file() != before
    monkeypatch.undo()
    monkeypatch.setattr("sys.implementation.cache_tag", "cpython-399")
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


def test_kernels_are_kept_beside_the_code(code: Path, tmp_path: Path) -> None:
    assert load(KERNEL, code) is None
    keep(KERNEL, code, pickled(5))
    assert load(KERNEL, code) == 5
    assert kept(tmp_path) == [code.parent / "__pycache__" / KERNEL.file()]
    assert load(KERNEL._replace(stamp="b" * 64), code) is None
    assert load(KERNEL.for_any_processor(), code) is None


def test_other_versions_make_room_and_other_types_stay(code: Path, tmp_path: Path) -> None:
    types = KERNEL._replace(types="(int64,)")
    neighbour = KERNEL._replace(function="robots.chain.frames_of")
    newer = KERNEL._replace(stamp="b" * 64)
    for number, kernel in enumerate((KERNEL, types, neighbour)):
        keep(kernel, code, pickled(number))
    assert [load(kernel, code) for kernel in (KERNEL, types, neighbour)] == [0, 1, 2]
    keep(newer, code, pickled(3))
    found = [load(kernel, code) for kernel in (KERNEL, types, neighbour, newer)]
    assert found == [None, None, 2, 3]
    assert {path.name for path in kept(tmp_path)} == {neighbour.file(), newer.file()}


def test_where_the_folder_of_the_code_cannot_be_written(code: Path, tmp_path: Path) -> None:
    (code.parent / "__pycache__").touch()  # a file, where even root can make no folder
    keep(KERNEL, code, pickled(5))
    assert load(KERNEL, code) == 5
    (path,) = kept(tmp_path)
    assert path.is_relative_to(tmp_path / "home")
    assert stat.S_IMODE(path.parent.stat().st_mode) == 0o700


def test_where_nothing_can_be_written(
    code: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(config, "CACHE_DIR", "/dev/null")
    keep(KERNEL, code, pickled(5))
    assert load(KERNEL, code) is None
    assert not kept(tmp_path)


def test_without_a_home_folder_nothing_is_written_where_one_happens_to_be(
    code: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (code.parent / "__pycache__").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", "~/.cache")  # as where nothing says what ~ is
    monkeypatch.setattr("os.path.expanduser", str)
    monkeypatch.chdir(tmp_path)
    keep(KERNEL, code, pickled(5))
    assert load(KERNEL, code) is None
    assert not kept(tmp_path)


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
    path.write_bytes(whole)
    assert load(KERNEL, code) == 5


def test_a_shipped_kernel_serves_every_processor_of_its_kind(
    code: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    keep(KERNEL.for_any_processor(), code, pickled(5))
    (path,) = kept(tmp_path)
    (tmp_path / "shipped").mkdir(mode=0o755)
    path.rename(tmp_path / "shipped" / path.name)
    for processor in (HERE, HERE._replace(name="pentium", features="")):
        assert load(KERNEL._replace(processor=processor), code) == 5
    assert load(KERNEL._replace(processor=HERE._replace(triple="arm64-apple")), code) is None
    assert load(KERNEL._replace(stamp="b" * 64), code) is None
    keep(KERNEL, code, pickled(6))
    assert load(KERNEL, code) == 6  # one that was compiled here is for this processor
    path = tmp_path / "shipped" / path.name
    path.parent.chmod(0o777)
    assert load(KERNEL._replace(processor=HERE._replace(name="pentium")), code) is None
