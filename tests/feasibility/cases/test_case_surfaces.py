"""Every kind of surface in a case: built as its constructor does, its files read and checked."""

import json
import os
import zipfile

import numpy as np
import pytest
import surface_parts
from bad_cases import GOOD, SURFACES, surface, write
from hypothesis import given, settings
from hypothesis import strategies as st
from surface_files import MESH, NET, POINTS, cube, mesh_case, net_case, sheet, write_stl

import surfaces
from coverable_errors import Fault
from feasibility import check
from feasibility.cases import (
    OWN_KEYS,
    Case,
    as_read,
    load_case,
    read_surface,
)
from feasibility.cases.case import CaseError
from feasibility.cases.mesh_keys import MOST_MESH_CELLS
from feasibility.cases.surface_keys import PATCHES
from feasibility.cases.surface_pieces import MOST_PIECES
from feasibility.results import load_result, save_result
from feasibility.results.result_file import ResultError
from surfaces import (
    bspline,
    cone,
    cut_box,
    cut_plane,
    ellipsoid,
    faces_within_cone,
    mesh,
    piecewise,
    plane,
    revolution,
    take_faces,
    torus,
)
from surfaces.meshes import read_mesh

POSE = {"position": (0.1, -0.2, 0.3), "rpy_deg": (10.0, 20.0, -30.0)}
POSED = "position = [0.1, -0.2, 0.3]\nrpy_deg = [10, 20, -30]\n"
NET_POINTS = [
    [[0, 0, 0], [0, 1, 0], [0, 2, 0]],
    [[1, 0, 0.2], [1, 1, 0], [1, 2, 0]],
    [[2, 0, 0], [2, 1, 0], [2, 2, 0]],
]
MADE = {
    "cone": lambda **k: cone(0.2, -0.5, angle_deg=(0, 90), height=(0.0, 0.3), **k),
    "torus": lambda **k: torus(0.5, 0.125, u_deg=(0, 90), v_deg=(-180, 180), **k),
    "ellipsoid": lambda **k: ellipsoid(
        (1.0, 0.8, 0.5), polar_deg=(10, 90), azimuth_deg=(0, 360), **k
    ),
    "revolution": lambda **k: revolution(
        [(0.2, 0.0), (0.3, 0.2), (0.1, 0.5)], angle_deg=(0, 180), **k
    ),
    "bspline": lambda **k: bspline(NET_POINTS, degree=(2, 2), **k),
}


def same_cells(a, b):
    assert a.shape == b.shape
    for name in ("centres", "normals", "areas", "pairs"):
        assert np.array_equal(getattr(a, name), getattr(b, name)), name
    assert a.surface.side == b.surface.side
    assert type(a.surface) is type(b.surface)


def cells_of(text):
    return Case.from_toml(text).surface.cut()


# what is built


@pytest.mark.parametrize("kind", MADE)
def test_a_patch_is_what_its_constructor_makes(kind):
    for side in ("inside", "outside"):
        text = surface(f'{SURFACES[kind]}{POSED}side = "{side}"\n')
        same_cells(cells_of(text), MADE[kind](side=side, **POSE).cells(3, 4))
    plain = surface(SURFACES[kind])
    same_cells(cells_of(plain), MADE[kind](side="inside").cells(3, 4))


def test_the_kinds_are_those_that_are_tested():
    assert set(PATCHES) == {*MADE, "sphere", "cylinder", "hyperboloid", "plane", "grid"}
    assert set(OWN_KEYS) == {*PATCHES, "piecewise", "mesh", "step", "poses"}
    assert set(PATCHES) - {"grid"} == set(surface_parts.PATCHES)  # a grid is a file
    assert all(callable(getattr(surfaces, kind)) for kind in OWN_KEYS)


def test_caps_are_those_of_the_surfaces():
    from surfaces.meshes.cells.clustering import MOST_CELLS
    from surfaces.piecewise.piecewise_surface import MOST_PIECES as MOST

    assert (MOST_MESH_CELLS, MOST_PIECES) == (MOST_CELLS, MOST)


def test_a_rational_net_with_knots_and_a_range():
    extra = (
        "knots = [[0, 0, 0, 1, 1, 1], [0, 0, 0, 2, 2, 2]]\n"
        "weights = [[1, 2, 1], [1, 1, 1], [1, 0.5, 1]]\nu = [0.25, 1]\nv = [0, 1.5]\n"
    )
    made = bspline(
        NET_POINTS,
        degree=(2, 2),
        knots=([0, 0, 0, 1, 1, 1], [0, 0, 0, 2, 2, 2]),
        weights=[[1, 2, 1], [1, 1, 1], [1, 0.5, 1]],
        u=(0.25, 1),
        v=(0, 1.5),
    )
    same_cells(cells_of(surface(SURFACES["bspline"] + extra)), made.cells(3, 4))


def test_a_net_from_a_file(tmp_path):
    made = bspline(POINTS, degree=(2, 2), side="outside", position=(0.4, -0.1, 0.3))
    case = load_case(net_case(tmp_path))
    assert case.surface.values == {"file": str(tmp_path / "net.json")}
    assert case.surface.label == "net.json"
    same_cells(case.surface.cut(), made.cells(3, 4))
    # A CSV says no degree; the case does.
    rows = [(i, j, *POINTS[i][j]) for i in range(3) for j in range(3)]
    lines = "\n".join(",".join(map(str, row)) for row in rows)
    (tmp_path / "net.csv").write_text(f"row,column,x,y,z\n{lines}\n")
    case = load_case(write(tmp_path, NET.replace("json", "csv") + "degree = [2, 2]\n"))
    same_cells(case.surface.cut(), made.cells(3, 4))
    # What the case says replaces what the file says.
    bent = [[[x, y, abs(x - 0.1)] for x, y, _ in row] for row in POINTS]
    case = load_case(net_case(tmp_path, bent, more="degree = [1, 2]\nv = [0.5, 1]\n"))
    with pytest.raises(CaseError, match=r"net\.json: the patch must be smooth, but has a kink"):
        case.build()
    flat = [[[x, y, 0.0] for x, y, _ in row] for row in POINTS]
    made = bspline(flat, degree=(1, 2), v=(0.5, 1), side="outside", position=(0.4, -0.1, 0.3))
    case = load_case(net_case(tmp_path, flat, more="degree = [1, 2]\nv = [0.5, 1]\n"))
    same_cells(case.surface.cut(), made.cells(3, 4))


def test_a_mesh_is_what_its_constructor_makes(tmp_path):
    case = load_case(mesh_case(tmp_path, more="rpy_deg = [10, 20, -30]\n"))
    made = mesh(
        tmp_path / "part.stl", None, "outside", (0.4, -0.1, 0.3), rpy_deg=(10.0, 20.0, -30.0)
    )
    cells = case.surface.cut()
    same_cells(cells, made.cells(count=12))
    assert len(cells) == 12
    assert (case.surface.label, case.surface.counts) == ("part.stl", [12])
    for setting, wanted in (("surface.cells=7", {"count": 7}), ("surface.scale=0.5", None)):
        changed = case.with_overrides([setting]).surface.cut()
        if wanted is None:
            half = mesh(tmp_path / "part.stl", 0.5, "outside", (0.4, -0.1, 0.3), (10, 20, -30))
            same_cells(changed, half.cells(count=12))
            assert changed.areas.sum() == pytest.approx(0.01, rel=1e-6)
        else:
            same_cells(changed, made.cells(**wanted))
    sized = case.with_overrides(["surface.cells=", "surface.cell_size=0.05"])
    assert (sized.surface.cells, sized.surface.counts) == (None, [])
    same_cells(sized.surface.cut(), made.cells(size=0.05))
    assert len(sized.surface.cut()) == 16


BOX = (0.05, 0, -1), (0.5, 0.15, 0.1)
PARTS = {
    "box": ("box = [[0.05, 0, -1], [0.5, 0.15, 0.1]]", lambda m: cut_box(m, *BOX)),
    "cut": (
        "cut = { point = [0, 0, 0.05], normal = [0, 0, 2] }",
        lambda m: cut_plane(m, (0, 0, 0.05), (0, 0, 2)),
    ),
    "facing": (
        "facing = { direction = [0, 0, 1], within_deg = 45 }",
        lambda m: faces_within_cone(m, (0, 0, 1), 45),
    ),
    "faces": ("faces = [0, 1, 7]", lambda m: take_faces(m, [0, 1, 7])),
}


@pytest.mark.parametrize("key", PARTS)
def test_a_part_of_a_mesh(key, tmp_path):
    line, take = PARTS[key]
    path = mesh_case(tmp_path, cube(), more=f"{line}\n")
    whole = read_mesh(tmp_path / "part.stl")
    made = mesh(take(whole), side="outside", position=(0.4, -0.1, 0.3))
    found = load_case(path).surface.cut()
    same_cells(found, made.cells(count=12))
    assert found.areas.sum() < 0.99 * whole.area
    assert any("kept" in note or "chosen" in note for note in found.notes)


def test_parts_of_parts(tmp_path):
    """Faces are numbered in the whole mesh; the rest keeps what all of the keys keep."""
    area = 0.2 * 0.2
    # The upper half of the sides that look along y, by hand.
    box = "box = [[-1, -1, 0.1], [1, 1, 1]]\nfacing = { direction = [0, 1, 0], within_deg = 5 }\n"
    cells = load_case(mesh_case(tmp_path, cube(), more=box)).surface.cut()
    assert cells.areas.sum() == pytest.approx(area / 2, rel=1e-6)
    assert np.abs(cells.normals - [0, 1, 0]).max() < 1e-6
    # The same with the faces by their numbers in the whole mesh, in any order of the keys.
    whole = read_mesh(tmp_path / "part.stl")
    faces = np.flatnonzero(whole.face_normals @ [0, 1, 0] > 0.9).tolist()
    by_number = f"box = [[-1, -1, 0.1], [1, 1, 1]]\nfaces = {faces}\n"
    again = load_case(mesh_case(tmp_path, cube(), more=by_number)).surface.cut()
    assert again.areas.sum() == pytest.approx(area / 2, rel=1e-6)
    assert again.centres[:, 2].min() > 0.1 + 0.3
    assert np.abs(again.normals - [0, 1, 0]).max() < 1e-6


def test_pieces_are_what_the_constructor_makes(tmp_path):
    flat = [[[x, y, 0.0] for x, y, _ in row] for row in POINTS]
    net_case(tmp_path, flat)
    text = """
        kind = "piecewise"
        gap = 1e-5
        side = "outside"
        [[surface.pieces]]
        kind = "bspline"
        file = "net.json"
        cells = [3, 4]
        [[surface.pieces]]
        kind = "plane"
        u = [0, 0.2]
        v = [-0.1, 0.1]
        rpy_deg = [0, 0, 90]
        position = [0.3, 0, 0]
        cells = [2, 2]
    """
    case = load_case(write(tmp_path, surface(POSED + text)))
    made = piecewise(
        [
            bspline(flat, degree=(2, 2)),
            plane((0, 0.2), (-0.1, 0.1), position=(0.3, 0, 0), rpy_deg=(0, 0, 90)),
        ],
        side="outside",
        gap=1e-5,
        **POSE,
    )
    cells = case.surface.cut()
    same_cells(cells, made.cells([(3, 4), (2, 2)]))
    assert len(cells) == 16
    assert (case.surface.label, case.surface.counts) == ("piecewise", [])
    assert case.surface.values["pieces"][0].values == {"file": str(tmp_path / "net.json")}
    assert Case.from_toml(case.to_toml()) == case


# files


def test_reading_a_case_opens_no_file(tmp_path):
    for text in (MESH, NET):
        case = load_case(write(tmp_path, text))
        assert Case.from_toml(case.to_toml()) == case
        with pytest.raises(CaseError, match=r"surface\.file: .*no such file") as caught:
            case.build()
        assert str(tmp_path) in caught.value.faults[0].place


def test_paths_of_surfaces_are_relative_to_the_case_file(tmp_path, monkeypatch):
    case = load_case(mesh_case(tmp_path))
    assert case.surface.values["file"] == str(tmp_path / "part.stl")
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    assert Case.from_toml(case.to_toml()) == case
    moved = case.with_overrides(["surface.file=other.stl"])
    assert moved.surface.values["file"] == str(elsewhere / "other.stl")
    monkeypatch.setenv("HOME", str(elsewhere))
    home = load_case(write(tmp_path, MESH.replace("part.stl", "~/p.stl")))
    assert home.surface.values["file"] == str(elsewhere / "p.stl")


def test_faults_of_the_file_come_with_all_others(tmp_path):
    text = MESH.replace('"ur5"', '"ur55"').replace("cells = 12", "cells = 0")
    with pytest.raises(CaseError) as caught:
        load_case(write(tmp_path, text.replace("cone_deg = 30", "cone_deg = 300")))
    keys = [fault.key for fault in caught.value.faults]
    assert sorted(keys) == ["robot", "surface.cells", "surface.file", "task.cone_deg"]
    with pytest.raises(CaseError) as caught:
        load_case(write(tmp_path, MESH.replace('"ur5"', '"ur55"'))).build()
    assert sorted(fault.key for fault in caught.value.faults) == ["robot", "surface.file"]
    error = CaseError(Fault("surface.file", "is gone"))
    assert str(error) == "surface.file: is gone"


def sheets(number, step):
    """Separate sheets side by side."""
    return np.concatenate([sheet() + np.array([step * k, 0.0, 0.0]) for k in range(number)])


MESH_FAULTS = {
    "millimetres": (lambda: 1000 * sheet(), "", "file", ("200 m", "give scale = 0.001 (0.2 m)")),
    "NaN": (lambda: sheet() * np.nan, "", "file", ("part.stl", "vertex 0")),
    "nothing in the box": (sheet, "box = [[5, 5, 5], [6, 6, 6]]", "box", ("nothing lies in",)),
    "nothing beyond": (
        sheet,
        "cut = { point = [0, 0, 1], normal = [0, 0, 1] }",
        "cut",
        ("nothing lies beyond",),
    ),
    "nothing looks there": (
        sheet,
        "facing = { direction = [0, 0, -1], within_deg = 5 }",
        "facing",
        ("no face looks within 5 degrees", "180 degrees"),
    ),
    "no such face": (sheet, "faces = [50, 99]", "faces", ("the faces are 0 .. 49",)),
    "pieces": (lambda: sheets(13, 1.0), "", "cells", ("12 cells are too few for 13 separate",)),
    "fine cells": (sheet, "cell_size = 1e-4", "cell_size", ("1 to 20,000", "make about 200")),
}


@pytest.mark.parametrize("name", MESH_FAULTS)
def test_a_mesh_that_cannot_be_used(name, tmp_path):
    make, line, key, words = MESH_FAULTS[name]
    path = mesh_case(tmp_path, make(), more=f"{line}\n")
    settings = ["surface.cells="] if "cell_size" in line else []
    case = load_case(path, settings)
    with pytest.raises(CaseError) as caught:
        case.build()
    assert [fault.key for fault in caught.value.faults] == [f"surface.{key}"]
    for word in words:
        assert word in str(caught.value)
    assert "count = " not in str(caught.value)


def test_a_mesh_in_millimetres_is_taken_at_its_word(tmp_path):
    case = load_case(mesh_case(tmp_path, 1000 * sheet(), more="scale = 0.001\n"))
    assert case.surface.cut().areas.sum() == pytest.approx(0.04, rel=1e-6)


@pytest.mark.parametrize("kind", ["folder", "pipe", "device", "link"])
def test_only_regular_files_are_meshes_and_nets(kind, tmp_path):
    for text, name in ((MESH, "part.stl"), (NET, "net.json")):
        file = tmp_path / name
        if kind == "folder":
            file.mkdir()
        elif kind == "pipe":
            os.mkfifo(file)
        else:
            file.symlink_to("/dev/zero" if kind == "device" else tmp_path / "nowhere")
        with pytest.raises(CaseError, match=r"surface\.file: ") as caught:
            load_case(write(tmp_path, text)).build()
        assert str(file) in str(caught.value)


def test_either_search_takes_any_surface(tmp_path):
    for text in (surface(SURFACES["torus"]), MESH, GOOD):
        case = load_case(write(tmp_path, text), ["search.method=greedy"])
        assert case.search.method == "greedy"


scalars = (
    st.integers(-(2**70), 2**70)
    | st.floats()
    | st.booleans()
    | st.sampled_from(["inside", "outside", "part.stl", "/dev/null", "", "\0", "\ud800", *OWN_KEYS])
)
junk = st.recursive(
    scalars,
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=4), inner, max_size=3)
    ),
    max_leaves=12,
)
ALL_KEYS = sorted(
    {key for keys in OWN_KEYS.values() for key in keys} | {"cells", "side", "nonsense"}
)


@st.composite
def spoiled(draw):
    """A valid [surface] table with some keys replaced, added or removed."""
    table = {
        key: as_read(value)
        for key, value in draw(surface_parts.surfaces()).table().items()
        if value is not None
    }
    for key in draw(st.lists(st.sampled_from([*ALL_KEYS, *table]), min_size=1, max_size=3)):
        if draw(st.booleans()):
            table[key] = draw(junk)
        else:
            table.pop(key, None)
    if "pieces" in table and isinstance(table["pieces"], list) and draw(st.booleans()):
        table["pieces"] = [*table["pieces"], draw(junk)]
    return table


@given(spoiled())
@settings(max_examples=150)
def test_whatever_a_table_holds_it_is_read_or_refused_with_places(table):
    faults = []
    part = read_surface(table, faults)
    assert (part is None) == bool(faults)
    assert all(fault.key.split(".")[0] == "surface" for fault in faults)
    assert all(fault.message and fault.message.isprintable() for fault in faults)
    if part is not None:  # then it is written and read as itself
        again = {key: as_read(v) for key, v in part.table().items() if v is not None}
        assert read_surface(again, faults) == part
        assert faults == []


# results


@pytest.fixture(params=["mesh", "net"])
def solved(request, tmp_path):
    """A case from a file, its verdict, and the result file."""
    path = mesh_case(tmp_path) if request.param == "mesh" else net_case(tmp_path)
    case = load_case(path)
    verdict = check(*case.build())
    saved = save_result(verdict, case, tmp_path / "a.result")
    return case, verdict, saved


def test_a_result_of_a_file_comes_back(solved, tmp_path, monkeypatch):
    case, before, saved = solved
    assert before.feasible
    monkeypatch.chdir("/")
    loaded = load_result(saved)
    after = loaded.verdict
    assert loaded.case == case
    assert repr(after) == repr(before)
    same_cells(after.cells, before.cells)
    assert np.array_equal(after.witness.q, before.witness.q)
    assert save_result(after, loaded.case, tmp_path / "b").read_bytes() == saved.read_bytes()


def refused(saved, *words):
    with pytest.raises(ResultError, match=r"a\.result") as caught:
        load_result(saved)
    for word in words:
        assert word in str(caught.value)


def test_a_result_is_not_shown_on_another_surface(solved, tmp_path):
    case, _, saved = solved
    file = case.surface.values["file"]
    name = os.path.basename(file)
    if case.surface.kind == "mesh":
        write_stl(tmp_path / name, sheet() + 1e-4)
        refused(saved, name, "in other places now; run the check again")
        write_stl(tmp_path / name, sheet()[:, ::-1])  # the same, but it looks down
        refused(saved, name, "in other places now")
        write_stl(tmp_path / name, sheets(2, 9.0) * 1000)
        refused(saved, "its case cannot be used", "surface.file", "scale = 0.001")
    else:
        net_case(tmp_path, [[[x, y, z + 1e-4] for x, y, z in row] for row in POINTS])
        refused(saved, name, "in other places now; run the check again")
    os.unlink(file)
    refused(saved, "surface.file", file, "no such file")
    os.mkfifo(file)
    refused(saved, "surface.file", "not a regular file")


def repacked(saved, path, **changes):
    """The file with other entries in its JSON."""
    with zipfile.ZipFile(saved) as file:
        members = {name: file.read(name) for name in file.namelist()}
    meta = json.loads(members["meta.json"])
    case = {**meta["case"], **changes.pop("case", {})}
    members["meta.json"] = json.dumps({**meta, **changes, "case": case}).encode()
    with zipfile.ZipFile(path, "w") as file:
        for name, data in members.items():
            file.writestr(name, data)
    return path


def test_a_result_that_names_another_file_is_hostile(solved, tmp_path):
    case, _, saved = solved
    secret = tmp_path / "secret.json"
    secret.write_text('{"password": "tulip"}')
    for file in ("/dev/zero", "/etc/passwd", "/proc/self/environ", "", str(secret)):
        toml = case.to_toml().replace(case.surface.values["file"], file)
        bad = repacked(saved, tmp_path / "bad.a.result", case={"toml": toml})
        with pytest.raises(ResultError, match=r"surface\.file") as caught:
            load_result(bad)
        assert "tulip" not in str(caught.value)
        assert "root:" not in str(caught.value)


def test_labels_and_counts():
    assert load_case("paper/4a").surface.label == "sphere"
    assert load_case("paper/4a").surface.counts == [9, 10]
