"""Surfaces and scenes of cases: built as their constructors build them, from their files alone."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bad_input
import numpy as np
import pytest
from bad_input import changed, goods, lay_out, stl

import surfaces
from feasibility.cases import OWN_KEYS, Case, CaseError, load_case
from feasibility.collisions import HalfSpace
from feasibility.problem import Problem
from robots.urdf import Box, Capsule
from surfaces import cut_box, cut_plane, faces_within_cone, mesh, take_faces
from surfaces.meshes import read_mesh

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
# The good text, more keys, and what makes the same surface.
MADE: dict[str, tuple[str, list[str], Callable[..., Any]]] = {
    "cone": ("cone", [], lambda **k: surfaces.cone(0.2, -0.5, (0, 90), (0.0, 0.3), **k)),
    "torus": (
        "torus", [],
        lambda **k: surfaces.torus(0.5, 0.125, u_deg=(0, 90), v_deg=(-180, 180), **k),
    ),
    "ellipsoid": (
        "ellipsoid", [], lambda **k: surfaces.ellipsoid((1.0, 0.8, 0.5), (10, 90), (0, 360), **k),
    ),
    "revolution": (
        "revolution", [],
        lambda **k: surfaces.revolution(
            [(0.2, 0.0), (0.3, 0.2), (0.1, 0.5)], angle_deg=(0, 180), **k
        ),
    ),
    "bspline": ("bspline", [], lambda **k: surfaces.bspline(NET_POINTS, degree=(2, 2), **k)),
    "rational net": (
        "bspline", RATIONAL,
        lambda **k: surfaces.bspline(
            NET_POINTS, degree=(2, 2), knots=([0, 0, 0, 1, 1, 1], [0, 0, 0, 2, 2, 2]),
            weights=[[1, 2, 1], [1, 1, 1], [1, 0.5, 1]], u=(0.25, 1), v=(0, 1.5), **k,
        ),
    ),
}  # fmt: skip


def same_cells(a: Any, b: Any) -> None:
    assert a.shape == b.shape
    for name in ("centres", "normals", "areas", "pairs"):
        assert np.array_equal(getattr(a, name), getattr(b, name)), name
    assert a.surface.side == b.surface.side
    assert type(a.surface) is type(b.surface)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Where the files of surfaces lie, with a control net as JSON and as CSV."""
    lay_out(tmp_path)
    points = bad_input.NET_POINTS
    net = {"points": points, "degree": [2, 2]}
    (tmp_path / "net.json").write_text(json.dumps(net))
    rows = [f"{i},{j},{','.join(map(repr, points[i][j]))}" for i in range(3) for j in range(3)]
    (tmp_path / "net.csv").write_text("\n".join(["row,column,x,y,z", *rows]))
    return tmp_path


def case_of(folder: Path, good: str, *changes: str) -> Case:
    text = changed(goods("case")[good], list(changes)) if changes else goods("case")[good]
    (folder / "case.toml").write_text(text)
    case = load_case(folder / "case.toml")
    assert Case.from_toml(case.to_toml()) == case
    return case


@pytest.mark.parametrize("side", ["inside", "outside"])
@pytest.mark.parametrize("name", MADE)
def test_a_patch_is_what_its_constructor_makes(name: str, side: str, tmp_path: Path) -> None:
    good, more, make = MADE[name]
    case = case_of(tmp_path, good, *POSED, *more, f'surface.side = "{side}"')
    same_cells(case.surface.cut(), make(side=side, **POSE).cells(3, 4))


def test_every_kind_has_a_constructor() -> None:
    assert all(callable(getattr(surfaces, kind)) for kind in OWN_KEYS)
    assert load_case("paper/4a").surface.label == "sphere"
    assert load_case("paper/4a").surface.counts == [9, 10]


def test_a_net_from_a_file(folder: Path) -> None:
    """What a case says replaces what the file says; a CSV says no degree, and the case does."""
    points, no_points = bad_input.NET_POINTS, ["surface.points", "surface.degree", *POSED]
    made = surfaces.bspline(points, degree=(2, 2), side="inside", **POSE)
    case = case_of(folder, "bspline", *no_points, 'surface.file = "net.json"')
    assert case.surface.values == {"file": str(folder / "net.json")}
    assert case.surface.label == "net.json"
    same_cells(case.surface.cut(), made.cells(3, 4))
    of_csv = ['surface.file = "net.csv"', "surface.degree = [2, 2]"]
    same_cells(case_of(folder, "bspline", *no_points, *of_csv).surface.cut(), made.cells(3, 4))
    flat = ["surface.degree = [1, 2]", "surface.v = [0.5, 1]", 'surface.file = "net.csv"']
    made = surfaces.bspline(points, degree=(1, 2), v=(0.5, 1), side="inside", **POSE)
    same_cells(case_of(folder, "bspline", *no_points, *flat).surface.cut(), made.cells(3, 4))
    kinked = [[[x, y, abs(x - 0.1)] for x, y, _ in row] for row in points]
    (folder / "net.json").write_text(json.dumps({"points": kinked, "degree": [1, 2]}))
    with pytest.raises(CaseError, match=r"net\.json: the patch must be smooth, but has a kink"):
        case.build()


def test_pieces_are_what_the_constructor_makes(folder: Path) -> None:
    pieces = (
        'surface.pieces = [{ kind = "bspline", file = "net.json", cells = [3, 4] }, '
        '{ kind = "plane", u = [0, 0.2], v = [-0.1, 0.1], rpy_deg = [0, 0, 90], '
        "position = [0.5, 0, 0], cells = [2, 2] }, "
        '{ kind = "grid", file = "points.npy", units = "mm", cells = [2, 3] }]'
    )
    case = case_of(folder, "piecewise", pieces, "surface.gap = 1e-5", *POSED)
    x, y = np.meshgrid([0.4, 0.5, 0.6], [-0.1, 0.0, 0.1, 0.2], indexing="ij")
    made = surfaces.piecewise(
        [
            surfaces.bspline(bad_input.NET_POINTS, degree=(2, 2)),
            surfaces.plane((0, 0.2), (-0.1, 0.1), position=(0.5, 0, 0), rpy_deg=(0, 0, 90)),
            surfaces.grid(np.stack([x, y, 0.3 + 0 * x], axis=2)),
        ],
        side="inside", gap=1e-5, **POSE,
    )  # fmt: skip
    cells = case.surface.cut()
    assert len(cells) == 12 + 4 + 6
    made_cells = made.cells([(3, 4), (2, 2), (2, 3)])
    np.testing.assert_allclose(cells.centres, made_cells.centres, rtol=0, atol=1e-12)
    np.testing.assert_allclose(cells.normals, made_cells.normals, rtol=0, atol=1e-12)
    assert (case.surface.label, case.surface.counts) == ("piecewise", [])
    assert case.surface.values["pieces"][0].values == {"file": str(folder / "net.json")}


def test_grids_and_poses_are_their_points(folder: Path) -> None:
    grid = case_of(folder, "grid", "surface.cells = [2, 3]", "surface.position = [0.1, 0, 0]")
    cells = grid.surface.cut()
    assert cells.shape == (2, 3)
    np.testing.assert_allclose(cells.centres[0], [0.55, -0.05, 0.3], atol=1e-12)
    assert grid.surface.label == "points.npy"
    case = case_of(folder, "poses", "surface.position = [0.1, 0, 0]")
    cells = case.surface.cut()
    np.testing.assert_allclose(cells.centres[2], [0.5, 0.15, 0.3], atol=1e-15)
    assert cells.in_order
    near = case_of(folder, "poses", "surface.neighbours = 0.07")
    assert near.surface.cut().pairs.tolist() == [[1, 2]]
    assert near.surface.build().kind == "poses"


def cube(size: float = 0.2) -> np.ndarray:
    """Triangles of a cube from the origin on, that look outwards."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * size
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return corners[[[q[0], *q[k : k + 2]] for q in quads for k in (1, 2)]]


def test_a_mesh_is_what_its_constructor_makes(folder: Path) -> None:
    case = case_of(folder, "mesh", *POSED)
    made = mesh(folder / "part.stl", None, "outside", **POSE)
    assert (case.surface.label, case.surface.counts) == ("part.stl", [12])
    same_cells(case.surface.cut(), made.cells(count=12))
    same_cells(case.with_overrides(["surface.cells=7"]).surface.cut(), made.cells(count=7))
    half = mesh(folder / "part.stl", 0.5, "outside", **POSE)
    same_cells(case.with_overrides(["surface.scale=0.5"]).surface.cut(), half.cells(count=12))
    sized = case.with_overrides(["surface.cells=", "surface.cell_size=0.05"])
    assert (sized.surface.cells, sized.surface.counts) == (None, [])
    same_cells(sized.surface.cut(), made.cells(size=0.05))
    assert len(sized.surface.cut()) == 16
    big = ["surface.file=millimetres.stl", "surface.scale=0.001"]
    found = load_case(folder / "case.toml", [f"{big[0][:13]}{folder}/{big[0][13:]}", big[1]])
    assert found.surface.cut().areas.sum() == pytest.approx(0.04, rel=1e-6)


BOX = (0.05, 0, -1), (0.5, 0.15, 0.1)
SOME = {
    "box = [[0.05, 0, -1], [0.5, 0.15, 0.1]]": lambda m: cut_box(m, *BOX),
    "cut = { point = [0, 0, 0.05], normal = [0, 0, 2] }": lambda m: cut_plane(
        m, (0, 0, 0.05), (0, 0, 2)
    ),
    "facing = { direction = [0, 0, 1], within_deg = 45 }": lambda m: faces_within_cone(
        m, (0, 0, 1), 45
    ),
    "faces = [0, 1, 7]": lambda m: take_faces(m, [0, 1, 7]),
}


@pytest.mark.parametrize("key", SOME)
def test_a_part_of_a_mesh(key: str, folder: Path) -> None:
    (folder / "part.stl").write_bytes(stl(cube()))
    whole = read_mesh(folder / "part.stl")
    found = case_of(folder, "mesh", f"surface.{key}").surface.cut()
    same_cells(found, mesh(SOME[key](whole), side="outside").cells(count=12))
    assert found.areas.sum() < 0.99 * whole.area
    assert any("kept" in note or "chosen" in note for note in found.notes)


def test_parts_of_parts(folder: Path) -> None:
    """The upper half of the sides along y, by hand; faces count in the whole mesh."""
    (folder / "part.stl").write_bytes(stl(cube()))
    faces = np.flatnonzero(read_mesh(folder / "part.stl").face_normals @ [0, 1, 0] > 0.9).tolist()
    upper = "surface.box = [[-1, -1, 0.1], [1, 1, 1]]"
    facing = "surface.facing = { direction = [0, 1, 0], within_deg = 5 }"
    for key in (facing, f"surface.faces = {faces}"):
        cells = case_of(folder, "mesh", upper, key).surface.cut()
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


def test_the_search_keeps_to_a_little_less_of_a_range_of_rolls(tmp_path: Path) -> None:
    case = load_case("paper/4a", ["task.roll_deg=[10, 30]", "surface.cells=[2, 2]"])
    problem = Problem.of(*case.build()[:3])
    assert problem.narrowed.searched.roll_deg == pytest.approx((11, 29))
    assert "at a roll of 10 to 30 deg" in problem.within
