"""Imports run one way: arms and surfaces never meet, the question asks both, the edge serves it."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("robots", "surfaces", "feasibility")

# Modules of `feasibility`, lowest first; a module may import from its own layer and those below.
# What is named nowhere belongs to the searches.
WORDS = "search target_courses task verdict version"
SEARCHES = ""
ASKING = "checking"
USING = "explain placement placement_map placer"
STORED = """archive case case_edits case_faults case_kinds case_mesh case_patches case_pieces
    case_robot case_surface case_task files result result_cells result_fields result_graph
    result_robot toml_text trajectory_files"""
STUDIES = """comparison placement_stations placement_study stations study study_axes study_dask
    study_dealing study_file study_frames study_outcome study_store study_workers"""
EDGE = """asking cell_shapes cli cli_jobs cli_studies commands comparison_report console
    division_report explain_report job_commands job_view listing meshcat_server meshes motion page
    path_report placement_commands placement_plot placement_report placement_view plots pose_layers
    pose_outline report robot_visuals scene
    skin study_commands study_page study_plot study_report threejs viewer"""
LAYERS = tuple(names.split() for names in (WORDS, SEARCHES, ASKING, USING, STORED, STUDIES, EDGE))

HEAVY = {"matplotlib", "meshcat", "rich", "trimesh", "yourdfpy"}


class Import(NamedTuple):
    module: str
    deferred: bool
    """Inside a function: not needed to load the file."""


def imports(source: str) -> Iterator[Import]:
    """The imports that can run; not those for type checkers alone."""

    def visit(node: ast.AST, deferred: bool) -> Iterator[Import]:
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.If) and ast.unparse(child.test) == "TYPE_CHECKING":
                for branch in child.orelse:
                    yield from visit(ast.Module([branch], []), deferred)
                continue
            if isinstance(child, ast.Import):
                yield from (Import(name.name, deferred) for name in child.names)
            elif isinstance(child, ast.ImportFrom):
                assert child.level == 0, "imports are absolute"
                module = str(child.module)
                for name in child.names:
                    inner = f"{module}.{name.name}"
                    yield Import(inner if inner in FILES else module, deferred)
            is_function = isinstance(child, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda))
            yield from visit(child, deferred or is_function)

    yield from visit(ast.parse(source), False)


def _files() -> dict[str, Path]:
    found = {}
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            parts = path.relative_to(ROOT).with_suffix("").parts
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


FILES = _files()
IMPORTS = {name: frozenset(imports(path.read_text("utf-8"))) for name, path in FILES.items()}


def layer(module: str) -> int:
    """Which layer of `feasibility` a module belongs to."""
    name = module.removeprefix("feasibility.")
    return next((k for k, names in enumerate(LAYERS) if name in names), LAYERS.index([]))


def loaded_with(module: str) -> set[str]:
    """Every module that loading one of them loads, ours and the libraries'."""
    seen: set[str] = set()
    waiting = [module]
    while waiting:
        name = waiting.pop()
        if name not in seen:
            seen.add(name)
            waiting += [i.module for i in IMPORTS.get(name, ()) if not i.deferred]
    return seen


def test_the_walk_sees_what_it_should() -> None:
    source = """
from typing import TYPE_CHECKING
import numpy.linalg
from feasibility import task, check
if TYPE_CHECKING:
    import networkx
class A:
    def f(self):
        from robots.chain import Chain
"""
    assert list(imports(source)) == [
        Import("typing", False),
        Import("numpy.linalg", False),
        Import("feasibility.task", False),
        Import("feasibility", False),
        Import("robots.chain", True),
    ]
    assert {"robots.chain", "surfaces.cells", "feasibility.checking"} <= set(FILES)


def test_every_layer_names_real_modules() -> None:
    named = [f"feasibility.{name}" for names in LAYERS for name in names]
    assert sorted(set(named)) == sorted(named)
    assert set(named) <= set(FILES)


@pytest.mark.parametrize("package", ["robots", "surfaces"])
def test_arms_and_surfaces_know_only_themselves(package: str) -> None:
    others = set(PACKAGES) - {package}
    for name in (name for name in FILES if name.split(".")[0] == package):
        reached = {i.module.split(".")[0] for i in IMPORTS[name]}
        assert not reached & others, f"{name} imports {reached & others}"


def test_feasibility_imports_downwards() -> None:
    upward = [
        f"{name} imports {i.module}"
        for name in FILES
        if name.startswith("feasibility.")
        for i in IMPORTS[name]
        if i.module.startswith("feasibility.") and layer(i.module) > layer(name)
    ]
    assert upward == []


def test_no_cycles() -> None:
    graph = {name: {i.module for i in IMPORTS[name] if not i.deferred} for name in FILES}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(" -> ".join(error.args[1]))


def test_the_certificate_shares_nothing_with_the_search() -> None:
    ours = {name for name in loaded_with("feasibility.certificate") if name in FILES}
    feasibility = {name for name in ours if name.startswith("feasibility.")}
    words = {"certificate", "following", "target_courses", "task", "verdict"}
    assert feasibility <= {f"feasibility.{name}" for name in words}
    assert "robots.chain" not in ours
    deferred = {i.module for name in feasibility for i in IMPORTS[name] if i.deferred}
    assert not {name for name in deferred if name in FILES}


def test_surfaces_know_neither_pinocchio_nor_networkx() -> None:
    for name in (name for name in FILES if name.startswith("surfaces")):
        now = {i.module.split(".")[0] for i in IMPORTS[name] if not i.deferred}
        assert not now & {"pinocchio", "networkx"}, name


def test_heavy_libraries_are_imported_where_they_are_used() -> None:
    """plots.py is matplotlib's own file, and nothing loads it before a plot is asked for."""
    for name in FILES:
        now = {i.module.split(".")[0] for i in IMPORTS[name] if not i.deferred}
        allowed = {"matplotlib"} if name == "feasibility.plots" else set()
        assert not now & HEAVY - allowed, name
    assert not any(
        "feasibility.plots" in {i.module for i in IMPORTS[name]} for name in FILES
    )  # fmt: skip
