"""Imports run one way: rooms in their order, each entered by its door."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("coverable_meshes", "robots", "surfaces", "feasibility")
MOST_MODULES = 20  # of one folder

# A line a room, two for a room split round its subrooms: each may import from its own line and from
# those above it. Arms and surfaces never meet, see below.
ORDER = """
coverable_arrays
coverable_errors
coverable_files
coverable_inner_kernels
coverable_kernel_files
coverable_kernels
coverable_processes
coverable_meshes
robots: errors
robots.mounting
robots.urdf: xml packages mesh_folders
robots.urdf.expansion
robots.urdf: axes geometry link_shapes joints tree srdf checked_urdf files
robots: arguments joint_checks chain chain_rows reach robot kinematics joint_selection pinocchio_model library
robots.shapes
surfaces: parts surface at_home part_growth cells adjacency cell_curves curve_fitting arguments
surfaces.patches
surfaces.patches.nurbs
surfaces.fitted
surfaces.piecewise
surfaces.toolpaths
surfaces.meshes: triangle_mesh normals closest_point face_tree places_on_faces facets mesh_parts
surfaces.meshes.repair
surfaces.meshes: mesh_surface selection sources
surfaces.meshes.cells
surfaces.meshes: smoothing
surfaces.step_files
surfaces: sheet tiles triangle_kernel cell_triangles
surfaces.places
surfaces.passes
surfaces.cell_tiles
feasibility: cell_graph clock compiled cone cut_tree cut_words interrupts notices roll safe_files search version
feasibility.collisions
feasibility.collisions.kernels
feasibility: task
feasibility.targets
feasibility: found problem verdict
feasibility.treated
feasibility.certification: faults rows jacobians lever_bounds
feasibility.certification.collisions
feasibility.certification.tool_alone
feasibility.certification.joint_boxes
feasibility.certification.rolls
feasibility.certification.cut_proofs
feasibility.certification: cells_reached followed motion_replay order refusals stretches surface_replay
feasibility.certification.areas
feasibility.paper
feasibility.cases
feasibility.roadmap.motions
feasibility.roadmap: graph
feasibility.roadmap.branch_and_bound
feasibility.roadmap.tool_alone
feasibility.roadmap.joint_boxes
feasibility.roadmap.cuts
feasibility.roadmap: bridging expansion exploration proving search seeding
feasibility.roadmap.causes
feasibility.roadmap: walk
feasibility.roadmap.forward
feasibility.roadmap: complete graph_g outcome refinement warmup
feasibility.certification.rates
feasibility: demands
feasibility.area.kernels
feasibility.area
feasibility.paths
feasibility.speed
feasibility: attempts checking
feasibility.timing
feasibility.programs
feasibility.division
feasibility.entry
feasibility.runs
feasibility.sensitivity
feasibility.results
feasibility: verifying
feasibility.studies
feasibility.placement
feasibility.viewer: threejs html_page meshes robot playback
feasibility.viewer.frames
feasibility.viewer: cell_meshes cut_sides scene
feasibility.viewer.areas
feasibility.viewer: figures live_server nearest obstacles painter path_and_division placements poses readout stage view_figures viewer
feasibility.viewer.passes
feasibility.viewer.faces
feasibility.reports
feasibility.live
feasibility.cli: case_commands command console listing main passes path place programs study_compare verify warm_up
coverable_command
feasibility.cli: __main__
coverable
"""  # noqa: E501

# `surface.cells(...)` makes the cells, which know their surface: the one import upwards of each.
FACTORIES = {
    ("surfaces.patches.patch", "surfaces.patches.grid_cells"),
    ("surfaces.piecewise.piecewise_surface", "surfaces.piecewise.cells"),
    ("surfaces.meshes.mesh_surface", "surfaces.meshes.cells.mesh_cells"),
}

HEAVY = {"OCP", "matplotlib", "meshcat", "rich", "trimesh", "yourdfpy"}


class Import(NamedTuple):
    """A name that a file imports."""

    module: str
    name: str
    """Empty for `import module`."""
    deferred: bool
    """Inside a function, or for type checkers alone: not needed to load the file."""


def imports(tree: ast.Module) -> Iterator[Import]:
    """All imports of a file, also those inside functions and for type checkers alone."""

    def visit(node: ast.AST, deferred: bool) -> Iterator[Import]:
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.Import):
                yield from (Import(name.name, "", deferred) for name in child.names)
            elif isinstance(child, ast.ImportFrom):
                assert child.level == 0, "imports are absolute"
                yield from (Import(str(child.module), n.name, deferred) for n in child.names)
            later = isinstance(child, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda))
            types = isinstance(child, ast.If) and ast.unparse(child.test) == "TYPE_CHECKING"
            yield from visit(child, deferred or later or types)

    yield from visit(tree, False)


def _files() -> dict[str, Path]:
    """Every module of the product that is not just the door of a room."""
    paths = [*ROOT.glob("coverable*.py")]
    for package in PACKAGES:
        paths += sorted((ROOT / package).rglob("*.py"))
    names = {".".join(path.relative_to(ROOT).with_suffix("").parts): path for path in paths}
    return {name: path for name, path in names.items() if not name.endswith("__init__")}


FILES = _files()


@cache
def tree_of(name: str) -> ast.Module:
    """A module's syntax; each file is read when it is first asked for."""
    return ast.parse(FILES[name].read_text("utf-8"))


@cache
def imports_of(name: str) -> frozenset[Import]:
    """All imports of a module."""
    return frozenset(imports(tree_of(name)))


@cache
def door(room: str) -> dict[str, str]:
    """What a room hands on: each public name, and the module that defines it."""
    stub = ROOT.joinpath(*room.split("."), "__init__.pyi")
    handed: dict[str, str] = {}
    for node in ast.walk(ast.parse(stub.read_text("utf-8"))):
        if isinstance(node, ast.ImportFrom):
            module = f"{room}.{node.module}" if node.module else room
            for name in node.names:
                assert name.asname == name.name, f"{stub}: {name.name} is handed on by that name"
                inner = f"{module}.{name.name}"
                handed[name.name] = home(module, name.name) if inner not in FILES else inner
    return handed


@cache
def is_room(module: str) -> bool:
    """Is this a folder with a door?"""
    return ROOT.joinpath(*module.split("."), "__init__.pyi").exists()


def home(module: str, name: str) -> str:
    """The module that defines what `from module import name` imports."""
    if not is_room(module):
        return module
    inner = f"{module}.{name}"
    return inner if inner in FILES else door(module)[name]


@cache
def homes(name: str, now_only: bool = False) -> set[str]:
    """The project's modules that a module imports from."""
    found: set[str] = set()
    for i in imports_of(name):
        if (now_only and i.deferred) or not (
            i.module.split(".")[0] in PACKAGES or i.module in FILES
        ):
            continue
        whole = is_room(i.module) and not i.name  # `import room` may use all that it hands on
        found |= set(door(i.module).values()) if whole else {home(i.module, i.name)}
    return found


def room_of(module: str) -> str:
    """The folder that a module lies in; empty for the top level."""
    return module.rpartition(".")[0]


def _places() -> dict[str, int]:
    """The line of `ORDER` that each module stands on."""
    lines = ORDER.split("\n")[1:-1]
    place: dict[str, int] = {}
    split = {line.split(":")[0] for line in lines if ":" in line}
    for number, line in enumerate(lines):
        room, _, modules = line.partition(": ")
        named = [f"{room}.{module}" for module in modules.split()]
        if not modules:
            named = [room] if room in FILES else [m for m in FILES if room_of(m) == room]
        assert named, f"{line}: no such room"
        assert (room in split) == bool(modules)
        place |= dict.fromkeys(named, number)
    return place


def loaded_with(module: str) -> set[str]:
    """The project's modules that loading one of them loads."""
    seen: set[str] = set()
    waiting = [module]
    while waiting:
        name = waiting.pop()
        if name not in seen:
            seen.add(name)
            waiting += homes(name, now_only=True)
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
        from robots import Chain
"""
    assert list(imports(ast.parse(source))) == [
        Import("typing", "TYPE_CHECKING", False),
        Import("numpy.linalg", "", False),
        Import("feasibility", "task", False),
        Import("feasibility", "check", False),
        Import("networkx", "", True),
        Import("robots", "Chain", True),
    ]
    assert home("feasibility", "task") == "feasibility.task"
    assert home("feasibility", "check") == "feasibility.checking"
    assert home("robots", "Chain") == "robots.chain"
    assert home("surfaces", "bspline") == "surfaces.patches.nurbs.bspline"


def test_every_module_has_its_line() -> None:
    assert set(_places()) == set(FILES)


def test_imports_follow_the_order_of_rooms() -> None:
    place = _places()
    upward = [
        f"{name} imports {used}"
        for name in FILES
        for used in homes(name)
        if place[used] > place[name] and (name, used) not in FACTORIES
    ]
    assert upward == []


def test_table_of_rooms_is_in_order() -> None:
    """CONTRIBUTING names every room and module of the top level, each below what it imports.

    A room and those within it import each other's modules both ways, which `ORDER` has in detail.
    """
    table = (ROOT / "CONTRIBUTING.md").read_text("utf-8").split("## The rooms")[1].split("\n## ")[0]
    first = [row.split("|")[1] for row in table.splitlines() if row.startswith("| `")]
    named = [name.removesuffix(".py") for row in first for name in re.findall(r"`([\w/.]+)`", row)]
    place = {name.rstrip("/").replace("/", "."): number for number, name in enumerate(named)}
    rooms = {name: room_of(name) or name for name in FILES}
    assert set(place) == set(rooms.values())
    for name in set(FILES) - {"feasibility.cli.__main__"}:
        for room, used in ((rooms[name], rooms[other]) for other in homes(name)):
            nested = f"{room}.".startswith(f"{used}.") or f"{used}.".startswith(f"{room}.")
            assert nested or place[used] < place[room], f"{name} imports from {used}"


def test_rooms_are_entered_by_their_door() -> None:
    """A module may be named only inside its room, and in the rooms within it."""
    past = [
        f"{name} imports {i.module}"
        for name in FILES
        for i in imports_of(name)
        if i.module in FILES and room_of(i.module)
        and not f"{room_of(name)}.".startswith(f"{room_of(i.module)}.")
        and i.module not in door(room_of(i.module)).values()  # handed on as a module
    ]  # fmt: skip
    assert past == []


def test_what_rooms_hand_on_has_one_meaning_a_name() -> None:
    """No two rooms hand on different things by one name; of the search's kernels two still do."""
    meanings: dict[str, set[str]] = {}
    for room in filter(is_room, {room_of(name) for name in FILES}):
        for name, module in door(room).items():
            meanings.setdefault(name, set()).add(module)
    assert {name for name, found in meanings.items() if len(found) > 1} <= {"Places", "place"}


def test_what_a_room_hands_on_is_no_module_of_its_own() -> None:
    """Lazy loading would give the module. Kinds of surfaces have their own file, and a guard."""
    for room in {room_of(name) for name in FILES} - {"", "surfaces.patches", "surfaces"}:
        own = {name.rpartition(".")[2] for name in FILES if room_of(name) == room}
        names = {n for n, module in door(room).items() if module != f"{room}.{n}"}
        assert not names & own, room


def test_no_folder_holds_more_than_twenty_modules() -> None:
    for folder in {path.parent for path in FILES.values()}:
        modules = [path for path in folder.glob("*.py") if path.stem != "__init__"]
        assert len(modules) <= MOST_MODULES, folder


@pytest.mark.parametrize("package", ["robots", "surfaces"])
def test_arms_and_surfaces_know_only_themselves(package: str) -> None:
    for name in (name for name in FILES if name.split(".")[0] == package):
        reached = {used.split(".")[0] for used in homes(name)} - {package}
        assert all(re.fullmatch(r"coverable_\w+", other) for other in reached), name


def test_no_cycles() -> None:
    """Imports for type checkers alone count, and those inside functions."""
    graph = {
        name: {used for used in homes(name) if (name, used) not in FACTORIES} - {name}
        for name in FILES
    }
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(" -> ".join(error.args[1]))


def test_the_certificate_shares_nothing_with_the_search() -> None:
    ours = loaded_with("feasibility.certification.motion_replay")
    feasibility = {name for name in ours if name.startswith("feasibility.")}
    words = {f"feasibility.{word}" for word in ("cone", "cut_tree", "roll", "task", "verdict")}
    values = (
        "asked_bodies",
        "bodies",
        "gathering",
        "outer_bodies",
        "pairs",
        "scene",
        "seats",
        "settings",
        "shapes",
        "standing",
        "triangles",
        "words",
    )  # of collisions: no bound, no kernel
    words |= {f"feasibility.collisions.{word}" for word in values}
    rooms = {
        "feasibility.certification",
        "feasibility.certification.collisions",
        "feasibility.certification.rolls",
        "feasibility.targets",
    }
    assert {n for n in feasibility if room_of(n) not in rooms} <= words
    assert "robots.chain" not in ours
    judged = feasibility - {f"feasibility.collisions.{word}" for word in values}
    assert not any(i.deferred and i.module in FILES for name in judged for i in imports_of(name))


def test_surfaces_know_neither_pinocchio_nor_networkx() -> None:
    for name in (name for name in FILES if name.startswith("surfaces")):
        now = {i.module.split(".")[0] for i in imports_of(name) if not i.deferred}
        assert not now & {"pinocchio", "networkx"}, name


def test_heavy_libraries_are_imported_where_they_are_used() -> None:
    """figures.py is matplotlib's own file; it is loaded when a plot is asked for."""
    for name in FILES:
        now = {i.module.split(".")[0] for i in imports_of(name) if not i.deferred}
        allowed = {"matplotlib"} if name == "feasibility.viewer.figures" else set()
        assert not now & HEAVY - allowed, name


def test_no_function_has_more_than_seventy_lines() -> None:
    for name in FILES:
        for node in ast.walk(tree_of(name)):
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
                length = int(node.end_lineno or 0) - node.lineno + 1
                assert length <= 70, f"{name}: {node.name} has {length} lines"
