"""The command line on surfaces from files: the same statuses, outputs and messages as on others."""

import csv
import json
import math

import numpy as np
import pytest
from bad_cases import write
from schema import CHECK, conforms
from small_cases import small_verdict
from surface_files import cube, mesh_case, net_case, sheet, write_stl

from feasibility.results import load_result
from surfaces import plane


@pytest.fixture(scope="module", autouse=True)
def kernels():
    """Have the kernels compiled before anything is said on stderr."""
    assert small_verdict("plate").feasible


def test_a_mesh_end_to_end(ask, tmp_path):
    case = mesh_case(tmp_path)
    walk, saved, page = (tmp_path / name for name in ("walk.csv", "a.result", "view.html"))
    outputs = ("--witness", walk, "--save", saved, "--html", page)
    status, out, err = ask("check", case, "--json", *outputs)
    found = json.loads(out)
    conforms(found, CHECK)
    assert status == 0
    assert (found["verdict"], found["evidence"]) == ("feasible", "witness")
    assert (found["cells"], found["covered"], found["uncovered"]) == (12, 12, [])
    assert found["certificate"]["max_position_error_m"] <= 1e-3
    assert [line.split(":")[0] for line in err.splitlines()] == ["result", "view", "witness"]

    verdict = load_result(saved).verdict
    header, *rows = csv.reader(walk.read_text().splitlines())
    assert header == ["cell", *verdict.robot.joint_names]
    assert [[float(value) for value in row[1:]] for row in rows] == verdict.witness.q.tolist()
    assert {row[0] for row in rows} - {""} == {str(cell) for cell in range(12)}
    assert page.read_text().lstrip().lower().startswith("<!doctype html>")
    # Where the tool is in a row of a cell, by Pinocchio: the standoff over the sheet at z = 0.3.
    from robots import Kinematics

    kinematics = Kinematics(verdict.robot)
    for cell, *q in rows:
        point, axis = kinematics.tool(np.array(q, float))
        assert abs(point[2] - 0.32) <= 1.001e-3
        assert axis[2] <= -math.cos(math.radians(30.001))
        if cell:
            target = verdict.cells.centres[int(cell)] + [0, 0, 0.02]
            assert np.linalg.norm(point - target) <= 1.001e-3

    status, out, err = ask("show", saved, "--html", tmp_path / "again.html")
    assert (status, out.count("feasible (witness)")) == (0, 1)
    assert (tmp_path / "again.html").read_bytes() == page.read_bytes()


def test_a_cell_of_a_mesh_is_one_index(ask, tmp_path):
    case = mesh_case(tmp_path, more="rpy_deg = [0, 0, 0]\n")
    status, out, err = ask("check", case, "--json", "--set", "surface.position=[5, 0, 0]")
    found = json.loads(out)
    conforms(found, CHECK)
    assert (status, err) == (1, "")
    assert (found["verdict"], found["evidence"]) == ("infeasible", "proof")
    assert sorted(entry["cell"] for entry in found["uncovered"]) == [[k] for k in range(12)]
    assert {entry["cause"] for entry in found["uncovered"]} == {"out_of_reach"}
    status, out, _ = ask("check", case, "--set", "surface.position=[5, 0, 0]")
    assert (status, "    [0] " in out, "[0, 0]" in out) == (1, True, False)


def test_a_mesh_may_stay_undecided_or_be_misread(ask, tmp_path):
    case = mesh_case(tmp_path)
    assert ask("check", case, "--set", "search.time_limit=1e-9")[0] == 3
    status, out, err = ask("check", case, "--set", "surface.cells=[3, 4]")
    assert (status, out, "a whole number in 1 .. 20,000" in err) == (2, "", True)


def test_settings_cut_a_mesh_anew(ask, tmp_path):
    case = mesh_case(tmp_path)
    for settings, cells in (
        (["surface.cells=20"], 20),
        (["surface.cells=", "surface.cell_size=0.05"], 16),
        (["surface.box=[[0, 0, -1], [0.1, 0.1, 1]]", "surface.cells=4"], 4),
        (["surface.facing.direction=[0, 0, 1]", "surface.facing.within_deg=5"], 12),
    ):
        flags = [word for setting in settings for word in ("--set", setting)]
        status, out, _ = ask("check", case, "--json", *flags)
        assert (status, json.loads(out)["cells"]) == (0, cells)


def test_millimetres_are_noticed(ask, tmp_path):
    case = mesh_case(tmp_path, 1000 * sheet())
    status, out, err = ask("check", case)
    assert (status, out) == (2, "")
    assert err.count("\n") == 1
    assert err.startswith(f"coverable: {case}: surface.file: {tmp_path / 'part.stl'}: the part is")
    assert "200 m wide; if the file is in millimetres give scale = 0.001 (0.2 m)" in err
    assert ask("check", case, "--set", "surface.scale=0.001")[0] == 0


def test_what_was_repaired_is_noted(ask, tmp_path):
    triangles = sheet()
    triangles[3] = triangles[3, ::-1]
    case = mesh_case(tmp_path, np.concatenate([triangles, triangles[7:8]]))
    status, out, err = ask("check", case, "--json")
    conforms(json.loads(out), CHECK)
    assert status == 0
    notes = err.splitlines()
    assert all(note.startswith("note: part.stl: ") for note in notes)
    assert any("1 face turned over" in note for note in notes)
    assert any("repeated" in note or "twice" in note for note in notes)


def test_cells_over_a_crease_are_noted(ask, tmp_path):
    _, _, err = ask("check", mesh_case(tmp_path, cube()), "--json")
    assert "note: part.stl: " in err
    assert "cells (" in err
    assert "folded over a crease of up to 90 degrees" in err


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "is empty"),
        (b"PK\x03\x04" + bytes(200), "a zip archive; unpack it first"),
        (b"solid part\nfacet normal", "part.stl"),
        (bytes(84), "part.stl"),
        (b"x" * 80 + b"\xff\xff\xff\x7f" + bytes(50), "part.stl"),
        (b"<html>", "XML or a web page"),
    ],
)
def test_a_file_that_is_no_mesh_is_status_2(ask, tmp_path, content, words):
    case = mesh_case(tmp_path)
    (tmp_path / "part.stl").write_bytes(content)
    status, out, err = ask("check", case)
    assert (status, out) == (2, "")
    assert "surface.file: " in err
    assert words in err
    assert "bug" not in err


def test_a_result_of_a_changed_mesh_is_refused(ask, tmp_path):
    case, saved = mesh_case(tmp_path), tmp_path / "a.result"
    assert ask("check", case, "--save", saved)[0] == 0
    write_stl(tmp_path / "part.stl", sheet(0.21))
    status, out, err = ask("show", saved, "--html", tmp_path / "view.html")
    assert (status, out) == (2, "")
    assert "another surface than the one that is loaded now: part.stl" in err
    assert not (tmp_path / "view.html").exists()


def test_nets_and_pieces_end_to_end(ask, tmp_path):
    case = net_case(tmp_path)
    status, out, err = ask("check", case, "--json", "--html", tmp_path / "view.html")
    found = json.loads(out)
    conforms(found, CHECK)
    assert (status, found["covered"], err.count("\n")) == (0, 12, 1)
    far = ask("check", case, "--json", "--set", "surface.position=[5, 0, 0]")
    assert far[0] == 1
    assert [0, 3] in [entry["cell"] for entry in json.loads(far[1])["uncovered"]]

    flat = [[[0.1 * i, 0.1 * j, 0.0] for j in range(3)] for i in range(3)]
    net_case(tmp_path, flat)
    pieces = """
        robot = { name = "ur5" }
        task = { standoff = 0.02, cone_deg = 30 }
        [surface]
        kind = "piecewise"
        side = "outside"
        position = [0.4, -0.1, 0.3]
        [[surface.pieces]]
        kind = "bspline"
        file = "net.json"
        cells = [2, 2]
        [[surface.pieces]]
        kind = "plane"
        u = [-0.2, 0.0]
        v = [0.0, 0.2]
        cells = [2, 2]
    """
    path, saved = write(tmp_path, pieces, "pieces.toml"), tmp_path / "p.result"
    status, out, _ = ask("check", path, "--json", "--save", saved)
    found = json.loads(out)
    conforms(found, CHECK)
    assert (status, found["cells"], found["covered"]) == (0, 8, 8)
    # The same as one sheet of 4 x 2 cells.
    verdict = load_result(saved).verdict
    assert verdict.n_edges == len(plane((-0.2, 0.2), (0.0, 0.2)).cells(4, 2).pairs)
