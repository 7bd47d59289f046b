"""What is held of the code as a whole: what is loaded when, and sizes. Layers: pyproject.toml."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("coverable", "robots", "surfaces", "feasibility")
FILES = [path for package in PACKAGES for path in (ROOT / package).rglob("*.py")]
HEAVY = {"OCP", "collada", "distributed", "matplotlib", "meshcat", "rich", "trimesh", "yourdfpy"}

AT_ONCE = "import os; os._exit(0)"  # tidying up takes a third of the time


def loaded(code: str) -> set[str]:
    said = f"{code}\nimport sys\nprint(*sys.modules, flush=True)\n{AT_ONCE}"
    done = subprocess.run(
        [sys.executable, "-c", said], cwd=ROOT, capture_output=True, text=True, check=True
    )
    return set(done.stdout.splitlines()[-1].split())


COMMAND = "from feasibility.cli.main import main; main({})"


@pytest.mark.parametrize(("code", "needed", "late"), [
    ("import coverable", set(), {"numpy", "numba", "pinocchio", "scipy"}),
    (COMMAND.format(["check", "--hlep"]), {"feasibility"},
     {"numpy", "numba", "pinocchio", "coal", "scipy", "networkx", "robots"}),
], ids=["import", "refused"])  # fmt: skip
def test_libraries_are_loaded_where_they_are_used(code: str, needed: set[str], late: set[str]):
    found = loaded(code)
    assert needed <= found
    assert not found & (HEAVY | late)


def test_loading_the_judge_loads_nothing_of_the_search() -> None:
    found = loaded("from coverable import replay; replay.__module__")
    ours = {name for name in found if name.startswith("feasibility.")}
    search = ("roadmap", "paper", "checking", "attempts", "collisions.kernels")
    assert "feasibility.certification.motion_replay" in ours
    assert not [name for name in ours if name.startswith(tuple(f"feasibility.{s}" for s in search))]
    assert "robots.chain" not in found


def test_forty_folders_hold_twenty_modules_each_at_most() -> None:
    assert len({path.parent for path in FILES}) <= 40
    folders = {path.parent for path in [*FILES, *(ROOT / "tests").rglob("*.py")]}
    for folder in folders:
        assert len([p for p in folder.glob("*.py") if p.stem != "__init__"]) <= 20, folder


def test_no_function_has_more_than_seventy_lines() -> None:
    for path in FILES:
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
                assert (node.end_lineno or 0) - node.lineno < 70, f"{path}: {node.name}"


def test_kernels_are_made_by_our_decorators_alone() -> None:
    """Numba's own would keep a kernel by its own file, and not by what it calls."""
    for path in FILES:
        text = path.read_text("utf-8")
        ours = path == ROOT / "coverable" / "kernels.py"
        assert ours or not re.search("njit|jitable|cfunc", text), path


def test_contributing_names_every_room() -> None:
    table = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    for folder in {path.parent.relative_to(ROOT) for path in FILES} - {Path()}:
        assert f"`{folder}/`" in table, folder
