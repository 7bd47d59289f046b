"""Surfaces and scenes of cases: built as their constructors build them, from their files alone."""

import json
import tomllib
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import bad_input
import mesh_writers
import numpy as np
import pytest
from bad_input import changed, goods, lay_out

import coverable
from coverable import Case, cut_box, cut_plane, faces_within_cone, load_case, mesh, take_faces
from robots.shapes.bodies import HalfSpace
from robots.urdf.link_shapes import Box, Capsule
from surfaces.meshes.sources import read_mesh

POSE = {"position": (0.1, -0.2, 0.3), "rpy_deg": (10.0, 20.0, -30.0)}
POSED = ["surface.position = [0.1, -0.2, 0.3]", "surface.rpy_deg = [10, 20, -30]"]
NET_POINTS = [
    [[0, 0, 0], [0, 1, 0], [0, 2, 0]],
    [[1, 0, 0.2], [1, 1, 0], [1, 2, 0]],
    [[2, 0, 0], [2, 1, 0], [2, 2, 0]],
]
RATIONAL = [
    "surface.knots = [[0, 0, 0, 1, 1, 1], [0, 0, 0, 2, 2, 2]]",
    "surface.weights = [[1, 2, 1], [1, 1, 1], [1, 0.5, 1]]",
    "surface.u = [0.25, 1]",
    "surface.v = [0, 1.5]",
]
GRID = {"grid": (3, 4)}
CUBE = 'surface.file = "cube.stl"'
NET_FILE = ["surface.points", "surface.degree", 'surface.file = "{}"']
METRES = ['surface.file = "millimetres.stl"', "surface.scale = 0.001"]
SIZED = ["surface.cells", "surface.cell_size = 0.05"]
BOX = (0.05, 0, -1), (0.5, 0.15, 0.1)
PIECES = (
    'surface.pieces = [{ kind = "bspline", file = "net.json", cells = [3, 4] }, '
    '{ kind = "plane", u = [0, 0.2], v = [-0.1, 0.1], rpy_deg = [0, 0, 90], '
    "position = [0.5, 0, 0], cells = [2, 2] }, "
    '{ kind = "grid", file = "points.npy", units = "mm", cells = [2, 3] }]'
)


def net(**more: Any) -> Any:
    return coverable.bspline(bad_input.NET_POINTS, **{"degree": (2, 2), **more})


def grid(**more: Any) -> Any:
    return coverable.grid(1e-3 * np.load("points.npy"), **more)


def made_of(kind: str, **more: Any) -> Any:
    """What the constructor makes of the values of a good case, in their order."""
    table = tomllib.loads(goods("case")[kind])["surface"]
    values = [value for key, value in table.items() if key not in ("kind", "side", "cells")]
    return getattr(coverable, kind)(*values, **more)


def part(take: Callable[[Any], Any]) -> Callable[..., Any]:
    return lambda **k: mesh(take(read_mesh("cube.stl")), **k)


# Of a case the good text and its changes, what makes the same surface, and how that is cut.
MADE: dict[str, tuple[str, list[str], Callable[..., Any], dict[str, Any]]] = {
    **{kind: (kind, [], partial(made_of, kind), GRID)
       for kind in ("cone", "torus", "ellipsoid", "revolution", "bspline")},
    "rational net": (
        "bspline", RATIONAL,
        lambda **k: coverable.bspline(
            NET_POINTS, degree=(2, 2), knots=([0, 0, 0, 1, 1, 1], [0, 0, 0, 2, 2, 2]),
            weights=[[1, 2, 1], [1, 1, 1], [1, 0.5, 1]], u=(0.25, 1), v=(0, 1.5), **k,
        ), GRID,
    ),
    "net in JSON": ("bspline", [*NET_FILE[:2], NET_FILE[2].format("net.json")], net, GRID),
    "net in CSV": (  # which says no degree; the case does
        "bspline", [*NET_FILE[:1], NET_FILE[2].format("net.csv")], net, GRID,
    ),
    "net in other ways": (  # what the case says replaces what the file says
        "bspline",
        [NET_FILE[0], "surface.degree = [1, 2]", "surface.v = [0.5, 1]",
         NET_FILE[2].format("net.json")],
        lambda **k: net(degree=(1, 2), v=(0.5, 1), **k), GRID,
    ),
    "grid": ("grid", [], grid, GRID),
    "mesh": ("mesh", [], lambda **k: mesh("part.stl", **k), {"count": 12}),
    "millimetres": (
        "mesh", METRES, lambda **k: mesh("millimetres.stl", 0.001, **k), {"count": 12},
    ),
    "cells of a size": ("mesh", SIZED, lambda **k: mesh("part.stl", **k), {"size": 0.05}),
    "box": (
        "mesh", ["surface.box = [[0.05, 0, -1], [0.5, 0.15, 0.1]]", CUBE],
        part(lambda m: cut_box(m, *BOX)), {"count": 12},
    ),
    "cut": (
        "mesh", ["surface.cut = { point = [0, 0, 0.05], normal = [0, 0, 2] }", CUBE],
        part(lambda m: cut_plane(m, (0, 0, 0.05), (0, 0, 2))), {"count": 12},
    ),
    "facing": (
        "mesh", ["surface.facing = { direction = [0, 0, 1], within_deg = 45 }", CUBE],
        part(lambda m: faces_within_cone(m, (0, 0, 1), 45)), {"count": 12},
    ),
    "faces": (
        "mesh", ["surface.faces = [0, 1, 7]", CUBE], part(lambda m: take_faces(m, [0, 1, 7])),
        {"count": 12},
    ),
    "pieces": (
        "piecewise", [PIECES, "surface.gap = 1e-5"],
        lambda **k: coverable.piecewise(
            [net(), coverable.plane((0, 0.2), (-0.1, 0.1), position=(0.5, 0, 0),
                                    rpy_deg=(0, 0, 90)), grid()], gap=1e-5, **k,
        ), {"counts": [(3, 4), (2, 2), (2, 3)]},
    ),
}  # fmt: skip


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where the files of surfaces lie, with a control net as JSON and as CSV, and a cube."""
    lay_out(tmp_path)
    net = {"points": bad_input.NET_POINTS, "degree": [2, 2]}
    (tmp_path / "net.json").write_text(json.dumps(net))
    (tmp_path / "net.csv").write_bytes(bad_input.net_csv())
    (tmp_path / "cube.stl").write_bytes(mesh_writers.stl(*mesh_writers.cube()))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def case_of(folder: Path, good: str, *changes: str) -> Case:
    text = changed(goods("case")[good], list(changes)) if changes else goods("case")[good]
    (folder / "case.toml").write_text(text)
    case = load_case(folder / "case.toml")
    assert Case.from_toml(case.to_toml()) == case
    return case


@pytest.mark.parametrize("name", MADE)
def test_a_surface_is_what_its_constructor_makes(name: str, folder: Path) -> None:
    side = ("inside", "outside")[[*MADE].index(name) % 2]
    good, changes, make, cut = MADE[name]
    case = case_of(folder, good, *POSED, *changes, f'surface.side = "{side}"')
    found, made = case.surface.cut(), make(side=side, **POSE)
    grid = cut.get("grid") or ([cut["counts"]] if "counts" in cut else [])
    expected = made.cells(*grid) if grid else made.cells(**cut)
    assert found.shape == expected.shape
    for key in ("centres", "normals", "areas", "pairs"):
        np.testing.assert_allclose(
            getattr(found, key), getattr(expected, key), rtol=0, atol=1e-12, err_msg=key
        )
    assert (found.surface.side, type(found.surface)) == (side, type(made))
    if CUBE in changes:
        assert found.areas.sum() < 0.99 * 6 * 0.04
        assert any("kept" in note or "chosen" in note for note in found.notes)


def test_poses_are_cells_in_order_or_within_a_radius(folder: Path) -> None:
    cells = case_of(folder, "poses", "surface.position = [0.1, 0, 0]").surface.cut()
    np.testing.assert_allclose(cells.centres[2], [0.5, 0.15, 0.3], atol=1e-15)
    assert cells.in_order
    near = case_of(folder, "poses", "surface.neighbours = 0.07")
    assert near.surface.cut().pairs.tolist() == [[1, 2]]


def test_parts_of_parts(folder: Path) -> None:
    """The upper half of the sides along y, by hand; faces count in the whole mesh."""
    faces = np.flatnonzero(read_mesh("cube.stl").face_normals @ [0, 1, 0] > 0.9).tolist()
    upper = "surface.box = [[-1, -1, 0.1], [1, 1, 1]]"
    facing = "surface.facing = { direction = [0, 1, 0], within_deg = 5 }"
    for key in (facing, f"surface.faces = {faces}"):
        cells = case_of(folder, "mesh", upper, key, CUBE).surface.cut()
        assert cells.areas.sum() == pytest.approx(0.2 * 0.2 / 2, rel=1e-6)
        assert cells.centres[:, 2].min() > 0.1
        assert np.abs(cells.normals - [0, 1, 0]).max() < 1e-6


SCENE = [
    "collision.surface = false", "collision.clearance = 0.005", "collision.tool_clearance = 0.001",
    'collision.tool_links = ["tool0"]', 'collision.shapes = "pieces"',
    'collision.allow = [["wrist_1_link", "wrist_3_link"], ["forearm_link", "shelf"]]',
    'collision.clearances = [{ pair = ["tool", "shelf"], value = 0.02 }]',
    'collision.srdf = "arm.srdf"', "collision.thickness = 0.002",
    'collision.scene = [{ name = "shelf", kind = "box", size = [0.5, 0.6, 0.02], '
    "position = [0.55, 0, 0.5], rpy_deg = [0, 0, 90], clearance = 0.01 }, "
    '{ name = "floor", kind = "halfspace" }, '
    '{ name = "fixture", kind = "mesh", file = "millimetres.stl", scale = 0.001 }]',
    'collision.tool = [{ kind = "capsule", radius = 0.02, length = 0.1, position = [0, 0, 0.05] }]',
]  # fmt: skip


def test_everything_of_a_scene_arrives(folder: Path) -> None:
    (folder / "arm.srdf").write_text('<robot name="ur5"/>')
    case = case_of(folder, "scene", *SCENE)
    assert case.collision is not None
    assert case.collision.srdf == str(folder / "arm.srdf")
    setup = case.build()
    found = setup.task.collision
    assert found is not None
    assert found.checked == case.collision.checked == ("self", "scene")
    numbers = found.clearance, found.tool_clearance, found.thickness, found.shapes
    assert numbers == (0.005, 0.001, 0.002, "pieces")
    assert found.allow == (("wrist_1_link", "wrist_3_link"), ("forearm_link", "shelf"))
    assert found.clearances == (("tool", "shelf", 0.02),)
    assert found.tool_links == ("tool0",)
    shelf, floor, fixture = found.scene
    assert (shelf.name, shelf.geometry, shelf.clearance) == ("shelf", Box((0.5, 0.6, 0.02)), 0.01)
    assert np.allclose(shelf.placement[:3, 0], [0, 1, 0])
    assert floor.geometry == HalfSpace()
    assert np.ptp(fixture.geometry.vertices, axis=0) == pytest.approx([0.2, 0.2, 0.0])
    (tool,) = found.tool
    assert tool.geometry == Capsule(0.02, 0.1)
    assert tool.placement[2, 3] == 0.05
    assert case.task.collision is None
    assert setup.task.standoff == case.task.standoff
    assert "collision" not in case.with_overrides(["collision="]).to_tables()
    bare = Case.from_toml(goods("case")["scene"])
    assert bare.collision is not None
    assert bare.collision.checked == ("self", "surface")
    fewer = case.with_overrides(["collision.clearance=0.01", "collision.scene="]).collision
    assert fewer is not None
    assert (fewer.clearance, fewer.scene) == (0.01, ())
