"""Compiled kernels: kept while no code changes, read only where nobody else can write."""

import ast
import os
import re
import shutil
import stat
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest
from jobs import said_without_ours
from numba import njit

from coverable.kernels import CODE, ROOT, is_safe

PACKAGES = ("robots", "surfaces", "feasibility")

ME, OTHER, SYSTEM, GROUP, USERS = 1000, 1001, 0, 100, 200


@pytest.mark.parametrize(("found", "code", "safe"), [
    ((ME, GROUP, 0o755), (ME, GROUP, 0o755), True),
    ((ME, GROUP, 0o700), (SYSTEM, SYSTEM, 0o755), True),  # in the home folder
    ((SYSTEM, SYSTEM, 0o755), (SYSTEM, SYSTEM, 0o755), True),  # in a shared installation
    ((OTHER, GROUP, 0o755), (OTHER, GROUP, 0o755), True),  # whose code runs anyway
    ((OTHER, GROUP, 0o755), (ME, GROUP, 0o755), False),
    ((OTHER, GROUP, 0o755), (SYSTEM, SYSTEM, 0o755), False),
    ((ME, GROUP, 0o777), (ME, GROUP, 0o755), False),
    ((ME, GROUP, 0o757), (ME, GROUP, 0o757), False),  # not even where the code can be changed
    ((SYSTEM, SYSTEM, 0o1777), (ME, GROUP, 0o755), True),  # the folder for temporary files
    ((OTHER, GROUP, 0o1777), (ME, GROUP, 0o755), False),
    ((ME, GROUP, 0o775), (ME, GROUP, 0o755), False),
    ((ME, GROUP, 0o775), (ME, GROUP, 0o775), True),  # the same people can change the code
    ((ME, USERS, 0o775), (ME, GROUP, 0o775), False),
])  # fmt: skip
def test_what_is_as_safe_as_the_code(found, code, safe):
    def status(user: int, group: int, mode: int) -> os.stat_result:
        return os.stat_result((stat.S_IFDIR | mode, 1, 1, 1, user, group, 0, 0, 0, 0))

    assert is_safe(status(*found), status(*code), ME) == safe


# A project of two kernels, and what new processes make of it.

INNER = """
from coverable.kernels import kernel
SCALE = 2.0
@kernel
def inner(x):
    return (x + 1.0) * SCALE
"""
OUTER = """
from coverable.kernels import entry
from surfaces.triangle_kernel import inner
@entry
def outer(x):
    return inner(x) / 0.0 if x < 0.0 else inner(x)
"""
RELOAD = "import sys, numba; sys.dont_write_bytecode = True; numba.config.reload_config()\n"
ASK = """
from robots.chain import outer; import coverable.kernels, numba
print(outer(1.0), sum(outer.stats.cache_hits.values()), int(coverable.kernels.FOLDER is None),
      outer(-3.0), repr(numba.config.CACHE_LOCATOR_CLASSES))
"""
BESIDE = "coverable/__pycache__/coverable-kernels"  # for each stamp of the code, a folder
LOADED, COMPILED, NOWHERE = (1, 0), (0, 0), (0, 1)


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """Its folder; the cache of the home folder lies beside it."""
    folder = tmp_path / "project"
    for path, text in (("robots/chain.py", OUTER), ("surfaces/triangle_kernel.py", INNER)):
        (folder / path).parent.mkdir(parents=True, mode=0o755)
        (folder / path).write_text(text)
        (folder / path).with_name("__init__.py").touch()
    (folder / "coverable").mkdir(mode=0o755)
    (folder / "coverable/__init__.py").touch()
    shutil.copy(ROOT / "coverable/kernels.py", folder / "coverable")
    return folder


@pytest.fixture(scope="module", autouse=True)
def compiled() -> None:
    """This process has compiled with numba, which takes the most time, before it is forked."""
    njit("f8(f8)")(lambda x: x + 1.0)


def asked(folder: Path, value: float = 4.0, ask: str = ASK, **more: str) -> tuple[int, int]:
    """Is the kernel loaded, and can it be kept nowhere? Its value is as expected."""
    home = {"HOME": f"{folder.parent}/home", "XDG_CACHE_HOME": f"{folder.parent}/home/cache"}
    said = said_without_ours(RELOAD + ask, folder, home | {"NUMBA_CACHE_DIR": ""} | more)
    assert "Traceback" not in said, said
    result, hits, nowhere, endless, classes = said.split()
    assert (float(result), endless) == (value, "-inf")
    assert eval(classes) == ""
    return int(hits), int(nowhere)


def kept(folder: Path) -> set[Path]:
    """Where kernels lie, but for the name of the code's stamp."""
    lie = {path.parent for path in folder.parent.rglob("*.nbc")}
    return {path.parent.with_name(path.name) for path in lie}


def test_kernels_are_kept_until_something_that_they_name_changes(project: Path) -> None:
    assert [asked(project), asked(project)] == [COMPILED, LOADED]
    assert kept(project) == {project / BESIDE / "robots"}
    copy, inner = project.with_name("copy"), "surfaces/triangle_kernel.py"
    shutil.copytree(project, copy, copy_function=shutil.copyfile)
    (copy / "robots/beside.py").write_text("SCALE = 7.0")
    assert asked(copy) == LOADED  # although every file is younger
    (copy / inner).write_text(INNER.replace("SCALE = 2.0", "SCALE = 3.0"))
    assert [asked(copy, 6.0), asked(copy, 6.0)] == [COMPILED, LOADED]
    assert asked(project) == LOADED


GIVEN = (
    OUTER.replace("outer(x)", "outer_of(p)").replace("x", "p.x")
    + """
from surfaces.given import Point
def outer(x):
    return outer_of(Point(x))
outer.stats = outer_of.stats
"""
)


def test_a_class_of_kernels_may_move_to_another_module(project: Path) -> None:
    """numba would read its name from the disk before it looks whether the code is the same."""
    point = "from typing import NamedTuple\nclass Point(NamedTuple):\n    x: float\n"
    for module in ("given", "moved"):
        (project / "surfaces/given.py").unlink(missing_ok=True)
        (project / f"surfaces/{module}.py").write_text(point)
        text = GIVEN.replace("surfaces.given", f"surfaces.{module}")
        (project / "robots/chain.py").write_text(text)
        assert [asked(project), asked(project)] == [COMPILED, LOADED]
        assert len(kept(project)) == len(list((project / BESIDE).iterdir())) == 1


def test_what_others_can_change_is_neither_read_nor_written(project: Path) -> None:
    asked(project)
    beside, home = project / BESIDE, project.parent / "home/cache/coverable-kernels"
    before = next(beside.rglob("*.nbc")).read_bytes()
    # Others may write there; may look in; may put another folder in its place.
    for k, (path, mode) in enumerate(((beside, 0o770), (beside, 0o701), (beside.parent, 0o777))):
        usual = stat.S_IMODE(path.stat().st_mode)
        path.chmod(mode)
        assert asked(project) == (LOADED if k else COMPILED)
        assert kept(project) == {beside / "robots", home / "robots"}
        assert stat.S_IMODE(home.stat().st_mode) == 0o700
        path.chmod(usual)
    assert next(beside.rglob("*.nbc")).read_bytes() == before
    beside.parent.chmod(0o777)
    home.parent.parent.chmod(0o777)
    assert asked(project) == NOWHERE
    chosen = project.parent / "open/chosen"
    chosen.mkdir(parents=True)
    assert asked(project, NUMBA_CACHE_DIR=str(chosen)) == COMPILED
    assert asked(project, NUMBA_CACHE_DIR=str(chosen)) == LOADED
    chosen.parent.chmod(0o777)
    (project.parent / "link").symlink_to(chosen)
    for place in (chosen, project.parent / "link"):
        assert asked(project, NUMBA_CACHE_DIR=str(place)) == NOWHERE


def test_where_nothing_can_be_written_it_is_compiled_all_the_same(project: Path) -> None:
    (project / "coverable/__pycache__").touch()  # a file, where even root can make no folder
    assert asked(project, HOME="/dev/null", XDG_CACHE_HOME="/dev/null") == NOWHERE
    assert asked(project, XDG_CACHE_HOME="relative") == NOWHERE
    assert kept(project) == set()
    assert [asked(project), asked(project)] == [COMPILED, LOADED]


LOSE = """
import shutil; from coverable.kernels import FOLDER
shutil.rmtree(FOLDER, ignore_errors=True); FOLDER.mkdir()
(FOLDER / "robots").symlink_to("/nowhere")
"""


@pytest.mark.parametrize("late", [False, True])
def test_a_folder_that_cannot_be_written_any_more_ends_nothing(project: Path, late: bool) -> None:
    """As on a disk that is full: before kernels are made, or before they are kept."""
    imports, rest = ASK.split(";", 1)
    lost = f"{imports}{LOSE}{rest.strip()}" if late else LOSE + ASK
    assert asked(project, ask=lost) == COMPILED
    assert kept(project) == set()
    next((project / BESIDE).iterdir()).joinpath("robots").unlink()
    assert [asked(project), asked(project)] == [COMPILED, LOADED]


FILES = [path for folder in PACKAGES for path in (ROOT / folder).rglob("*.py")]
STAMPED = {path for pattern in CODE for path in ROOT.glob(pattern)}


def made_by(node: ast.AST) -> str:
    """Which of our decorators a function has; empty without one."""
    names = {ast.unparse(decorator) for decorator in getattr(node, "decorator_list", [])}
    ours = {"kernel", "inlined", "spliced", "allocating", "entry", "allocating_entry"}
    return next(iter(names & ours), "")


@cache
def tree_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text("utf-8"))


@cache
def kernels() -> dict[tuple[Path, str], str]:
    decorated = re.compile(r"@\s*(kernel|inlined|spliced|allocating|entry)")
    files = [path for path in FILES if decorated.search(path.read_text("utf-8"))]
    return {(p, n.name): made_by(n) for p in files for n in tree_of(p).body if made_by(n)}


def origin(module: str, name: str) -> Path:
    """The file that a name comes from."""
    path = ROOT / module.replace(".", "/")
    inner = path / f"{name}.py"
    return inner if inner.exists() else path.with_suffix(".py")


def named(path: Path, compiled: bool) -> Iterator[tuple[Path, str]]:
    """What the kernels of a file name of our other files, or else what its plain code names."""
    tree, known = tree_of(path), {name: (p, name) for p, name in kernels() if p == path}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and f"{node.module}".startswith(PACKAGES):
            for a in node.names:
                known[a.asname or a.name] = origin(str(node.module), a.name), a.name
    for part in tree.body:
        if bool(made_by(part)) == compiled:
            nodes = list(ast.walk(part))
            made = [n for n in nodes if isinstance(n, ast.Call) and isinstance(n.func, ast.Call)]
            called_back = [a for c in made if "callback(" in ast.unparse(c.func) for a in c.args]
            for node in nodes:
                if isinstance(node, ast.Name) and node.id in known and node not in called_back:
                    yield known[node.id]


def test_all_that_is_compiled_into_kernels_is_in_the_stamp() -> None:
    assert all(any(ROOT.glob(pattern)) for pattern in CODE)
    assert {path for path, _ in kernels()} <= STAMPED
    for path in {path for path, _ in kernels()}:
        assert {file for file, _ in named(path, True)} <= STAMPED, path


def test_python_calls_no_kernel_that_is_none_of_the_entries() -> None:
    """It would run as plain Python, hundreds of times slower."""
    own = {path for path, _ in kernels()}
    modules = [".".join(path.relative_to(ROOT).with_suffix("").parts) for path in own]
    for path in FILES:
        text = path.read_text("utf-8")
        if path not in own and not any(module in text for module in modules):
            continue  # it can name none
        called = [one for one in named(path, False) if "entry" not in kernels().get(one, "entry")]
        assert called == [], path
