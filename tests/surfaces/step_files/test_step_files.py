"""Faces of STEP files become surfaces in metres, and files that are none become sentences."""

import base64
import gzip
import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from coverable_processes import Ended, Limits, folder_of, run_apart
from feasibility.cases import Case, CaseError
from feasibility.cli.main import main
from surfaces import SurfaceError, step, step_faces
from surfaces.step_files import step_process, step_surface
from surfaces.step_files.step_process import CAPS, CHILD, Caps, read_step

SIZE = (0.2, 0.1, 0.05)  # m
ROUND = 0.01  # [m], radius of the one edge that is round
WHOLE = "ISO-10303-21;\n{}\nEND-ISO-10303-21;\n"
CORNER = ROUND**2 * (1.0 - np.pi / 4.0)  # m^2, what the round edge takes off top and bottom
AREAS = [
    (SIZE[1] - ROUND) * SIZE[2],
    SIZE[0] * SIZE[1] - CORNER,
    np.pi / 2.0 * ROUND * SIZE[2],
    SIZE[0] * SIZE[2],
    SIZE[0] * SIZE[1] - CORNER,
    (SIZE[0] - ROUND) * SIZE[2],
    SIZE[1] * SIZE[2],
]
CASE = """
[robot]
name = "ur5"
[surface]
kind = "step"
file = "part.step"
side = "outside"
{}
[task]
standoff = 0.02
cone_deg = 30
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The part, and an assembly of two of it in inches."""
    folder = tmp_path_factory.mktemp("parts")
    script = [sys.executable, Path(__file__).with_name("step_parts.py")]
    subprocess.run([*script, folder, *map(str, (*SIZE, ROUND))], check=True, capture_output=True)
    return folder


@pytest.fixture(scope="module")
def read(folder):
    """All that the process says about the part, its faces 3, 2 and 6 as triangles."""
    job = {"numbers": [3, 2, 6], "colour": "", "deviation": 1e-5, "angle": 0.5}
    return read_step(folder / "part.step", job)


@pytest.fixture(scope="module")
def pair(folder):
    """All that it says about the assembly, what is red as triangles."""
    job = {"numbers": [], "colour": "#ff0000", "deviation": 1e-4, "angle": 0.2}
    return read_step(folder / "pair.step", job)


@pytest.fixture
def known(monkeypatch, read):
    """The part without asking a process again."""
    monkeypatch.setattr(step_surface, "read_step", lambda *arguments: read)


def test_faces_have_numbers_kinds_areas_and_colours(folder, monkeypatch, pair):
    monkeypatch.setattr(step_surface, "read_step", lambda *arguments: pair)
    faces = step_faces(folder / "pair.step")
    assert [face.number for face in faces] == list(range(1, 15))
    np.testing.assert_allclose([face.area for face in faces], 2 * AREAS, rtol=1e-9)
    round_ones = [face.number for face in faces if face.kind == "cylinder"]
    assert round_ones == [face.number for face in faces if face.colour == "#ff0000"] == [3, 10]
    assert {face.colour for face in faces if face.kind == "plane"} == {"#808080"}
    # The part, its round edge along z at the origin; and the same, turned about z and 1 m up.
    size = np.array(SIZE)
    turn, up = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]), np.array([0, 0, 1])
    for own, other in zip(faces[:7], faces[7:], strict=True):
        centre, normal = np.array(own.centre), np.array(own.normal)
        if own.kind == "cylinder":
            outwards = [*(centre[:2] - ROUND) / ROUND, 0.0]
            assert centre[2] == pytest.approx(SIZE[2] / 2)
        else:
            axis = int(np.abs(normal).argmax())
            outwards = np.eye(3)[axis] * (1.0 if centre[axis] > size[axis] / 2 else -1.0)
            assert centre[axis] == pytest.approx(size[axis] if outwards[axis] > 0 else 0.0)
            assert (np.abs(centre - size / 2)[np.arange(3) != axis] <= ROUND).all()
        np.testing.assert_allclose(normal, outwards, atol=1e-9)
        np.testing.assert_allclose(other.centre, turn @ centre + up, atol=1e-9)
        np.testing.assert_allclose(other.normal, turn @ normal, atol=1e-9)


def test_the_deviation_is_right_at_the_poles_of_a_sphere(folder):
    surface = step(folder / "ball.step", faces="all")
    said = float(re.search(r"at most (\S+) mm off", surface.notes[0])[1]) * 1e-3
    corners = surface.mesh.vertices[surface.mesh.faces]
    np.testing.assert_allclose(np.linalg.norm(corners, axis=2), 0.3, atol=1e-9)
    shares = np.random.default_rng(1).dirichlet((1, 1, 1), 20)
    off = 0.3 - np.linalg.norm(np.einsum("sk,fki->fsi", shares, corners), axis=2)
    assert 0.9 * said <= off.max() <= 1.01 * said
    assert said < 1e-4


def test_triangles_are_in_metres_and_as_near_as_is_said(known, folder, read):
    surface = step(folder / "part.step", faces=[3, 2, 6])
    assert surface.notes[0] == (
        f"{len(read.triangles)} triangles stand for 3 faces (3, 2, 6), at most "
        f"{read.deviation * 1e3:.2g} mm off"
    )
    assert not surface.mesh.pieces.any()  # edges that faces share are one
    corners, chosen = surface.mesh.vertices, AREAS[2] + AREAS[1] + AREAS[5]
    np.testing.assert_allclose(corners.max(axis=0), SIZE, atol=1e-12)
    assert abs(surface.mesh.face_areas.sum() - chosen) < 1e-5 * chosen + 4e-5 * ROUND
    angle = np.linspace(np.pi, 1.5 * np.pi, 400)
    arc = ROUND * (1.0 + np.column_stack([np.cos(angle), np.sin(angle)]))
    points = np.column_stack([arc, np.full(400, 0.02)])
    away = surface.closest(points).height
    assert (away >= -1e-12).all()
    np.testing.assert_allclose(away.max(), read.deviation, rtol=1e-2)
    assert read.deviation <= 1e-5


def test_faces_look_out_of_the_solid(known, folder):
    mesh = step(folder / "part.step", faces=[3, 2, 6]).mesh
    middles = mesh.vertices[mesh.faces].mean(axis=1)
    outwards = middles - np.array(SIZE) / 2.0
    assert (np.einsum("fi,fi->f", mesh.face_normals, outwards) > 0.0).all()


def test_parts_of_an_assembly_stand_where_it_has_them(folder, monkeypatch, pair):
    monkeypatch.setattr(step_surface, "read_step", lambda *arguments: pair)
    one = step(folder / "pair.step", colour="#FF0000", position=(0.0, 0.0, 0.5))
    assert "2 faces (3, 10)" in one.notes[0]
    lower = one.mesh.vertices[one.mesh.vertices[:, 2] < 0.5]
    np.testing.assert_allclose(lower.min(axis=0), [0.0, 0.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(lower.max(axis=0), [ROUND, ROUND, SIZE[2]], atol=1e-9)
    upper = one.mesh.vertices[one.mesh.vertices[:, 2] > 0.5]
    np.testing.assert_allclose(upper.min(axis=0), [-ROUND, 0.0, 1.0], atol=1e-9)
    np.testing.assert_allclose(upper.max(axis=0), [0.0, ROUND, 1.0 + SIZE[2]], atol=1e-9)


@pytest.mark.parametrize(
    ("choice", "words"),
    [
        ({}, ["faces = [3, 7]", "7 faces", "3: cylinder, 0.000785 m^2, #ff0000, at 0.0029, 0.00"]),
        ({"faces": "al"}, ['array of numbers of faces, from 1, or "all"']),
        ({"faces": [3, 8]}, ["faces[1]", "face 8", "1 .. 7", "7: plane"]),
        ({"faces": [0]}, ["faces[0]", "1 .. "]),
        ({"faces": []}, ["array of numbers"]),
        ({"faces": "37"}, ["array of numbers"]),
        ({"colour": "red"}, ['"#rrggbb"']),
        ({"faces": [3], "colour": "#ff0000"}, ["contradicts faces"]),
        ({"faces": [3], "deviation": 0.0}, ["deviation", "1e-06"]),
    ],
)
def test_a_choice_that_makes_no_sense_is_refused(known, folder, choice, words):
    with pytest.raises(SurfaceError) as raised:
        step(folder / "part.step", **choice)
    for word in words:
        assert word in str(raised.value)


def test_a_colour_that_no_face_has_names_those_there_are(monkeypatch, read, folder):
    monkeypatch.setattr(step_surface, "read_step", lambda *arguments: read._replace(taken=[]))
    with pytest.raises(SurfaceError, match=r"'#00ff00', which no face has; .*#808080, #ff0000"):
        step(folder / "part.step", colour="#00ff00")
    plain = [face | {"colour": ""} for face in read.faces]
    bare = read._replace(taken=[], faces=plain)
    monkeypatch.setattr(step_surface, "read_step", lambda *arguments: bare)
    with pytest.raises(SurfaceError, match=r"none of its 7 faces has one; choose by faces"):
        step(folder / "part.step", colour="#00ff00")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "is empty"),
        (b" \n", "is empty"),
        (b"solid part\nendsolid", 'starts with "ISO-10303-21;"'),
        (b"ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\n#1=CARTESIAN_POI", "cut short"),
        (None, "larger than 200 MB"),
    ],
)
def test_files_that_are_none_are_not_given_to_anyone(tmp_path, monkeypatch, content, words):
    monkeypatch.setattr(step_process, "run_apart", None)
    path = tmp_path / "part.step"
    with path.open("wb") as file:
        file.truncate(2**30) if content is None else file.write(content)
    with pytest.raises(SurfaceError, match=words) as raised:
        step(path, faces=[1])
    assert str(raised.value).startswith("'part.step': ")


def test_a_file_that_only_looks_like_one_is_refused(tmp_path):
    path = tmp_path / "part.step"
    path.write_text(WHOLE.format("HEADER;\nENDSEC;\nDATA;\n#1=NONSENSE(*,$,#1);\nENDSEC;"))
    with pytest.raises(SurfaceError, match="export"):
        step(path, faces=[1])


@pytest.mark.parametrize(
    ("caps", "words"),
    [
        (Caps(memory=2**27), "more than 0.125 GB of memory"),
        (Caps(waiting=0.01), "could not be read within 0.01 s"),
    ],
)
def test_caps_hold(folder, caps, words):
    with pytest.raises(SurfaceError, match=words):
        step_surface.step_triangles(folder / "part.step", [1, 2, 3], caps=caps)


def test_processor_time_has_a_cap(folder, monkeypatch, tmp_path):
    endless = tmp_path / "endless.py"
    endless.write_text("while True: pass\n")
    monkeypatch.setattr(step_process, "CHILD", endless)
    with pytest.raises(SurfaceError, match="takes more than 1 s of processor time"):
        step_surface.step_triangles(folder / "part.step", [1], caps=Caps(seconds=1))


def _answered(said, arrays=b""):
    return json.dumps(said).encode() + b"\n" + arrays


@pytest.mark.parametrize(
    "written",
    [
        b"",
        b"\xff\n",
        b"[]\n",
        _answered({"faces": [{"kind": "plane"}]}),
        _answered({"faces": [], "vertices": 1, "triangles": 1}, b"0" * 35),
        _answered({"faces": [], "vertices": -1, "triangles": 2}),
        _answered({"faces": 3}),
        _answered(
            {"faces": [], "taken": [1], "counts": [2], "vertices": 0, "triangles": 1}, b"0" * 12
        ),
    ],
)
def test_what_the_process_writes_is_not_believed(folder, monkeypatch, written):
    monkeypatch.setattr(step_process, "run_apart", lambda *given: Ended(written))
    with pytest.raises(SurfaceError, match="Open CASCADE broke off over it"):
        step(folder / "part.step", faces=[1])


def test_facing_takes_a_part_of_all_faces(folder):
    keys = "facing = { direction = [0, 0, 1], within_deg = 30 }\ncells = 12"
    for more in ("", '\nfaces = "all"'):
        case = Case.from_toml(CASE.format(keys + more), folder)
        assert Case.from_toml(case.to_toml()) == case
        surface = case.build().cells.surface
        assert surface.mesh.face_areas.sum() == pytest.approx(AREAS[1], abs=1e-6)
        np.testing.assert_allclose(surface.mesh.vertices[:, 2], SIZE[2], atol=1e-12)


def test_show_lists_the_faces_and_draws_them_with_their_numbers(folder, tmp_path, capsys):
    page = tmp_path / "faces.html"
    assert main(["show", str(folder / "part.step"), "--html", str(page)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.partition(":")[0] for line in lines] == [str(k) for k in range(1, 8)]
    assert lines[2].startswith("3: cylinder, 0.000785 m^2, #ff0000, at 0.0029, 0.0029, 0.025 m")
    text = page.read_text()
    packed = re.search(r'<script[^>]*id="commands"[^>]*>(.*?)</script>', text, re.DOTALL)[1]
    drawn = gzip.decompress(base64.b64decode(packed))
    for k in range(1, 8):
        assert f'data-path="/faces/{k}"' in text
        assert f"/faces/{k}".encode() in drawn
        assert f"/numbers/{k}".encode() in drawn
    assert main(["show", str(tmp_path / "none.STP")]) == 2
    assert "none.STP" in capsys.readouterr().err


def test_there_is_a_most_of_triangles(folder, monkeypatch):
    many = _answered({"faces": [], "vertices": 0, "triangles": 11})
    monkeypatch.setattr(step_process, "run_apart", lambda *given: Ended(many))
    with pytest.raises(SurfaceError, match="more than 10; take fewer faces"):
        step_surface.step_triangles(folder / "part.step", [1], caps=Caps(triangles=10))


@pytest.mark.parametrize(
    ("corners", "words"), [([0, 1, 7], "vertices that do not exist"), ([0, 1, -2], "do not exist")]
)
def test_triangles_of_no_vertices_are_refused(folder, monkeypatch, corners, words):
    arrays = np.eye(3).tobytes() + np.array(corners, dtype="<i4").tobytes()
    place = {"centre": [0, 0, 0], "normal": [0, 0, 1]}
    face = {"kind": "plane", "area": 1.0, "colour": "", **place}
    said = {"faces": [face], "taken": [1], "vertices": 3, "triangles": 1, "deviation": 0.0}
    said["counts"] = [1]
    monkeypatch.setattr(step_process, "run_apart", lambda *given: Ended(_answered(said, arrays)))
    with pytest.raises(SurfaceError, match=words):
        step(folder / "part.step", faces=[1])


def test_the_message_names_the_extra(folder, monkeypatch):
    monkeypatch.setattr(step_process, "folder_of", lambda name: None)
    with pytest.raises(SurfaceError, match=r"pip install 'coverable\[step\]'"):
        step_faces(folder / "part.step")


def test_the_process_opens_nothing_once_it_sees_the_file(tmp_path):
    """What stands before `answer` in the child closes the door: tried with a child that tries."""
    text = CHILD.read_text()
    tries = text.replace(
        "        reply = answer(job, data)",
        "        try:\n            open('/dev/null')\n            reply = b'opened'\n"
        "        except OSError as error:\n            reply = str(error.errno).encode()",
    )
    assert tries != text
    script = tmp_path / "tries.py"
    script.write_text(tries)
    job = {"library": [folder_of("OCP"), folder_of("numpy")]}
    limits = Limits(CAPS.memory, 60, 1000)
    ended = run_apart(script, json.dumps(job).encode() + b"\n", 300.0, limits)
    assert ended.written == b"24"  # too many open files


def test_a_case_says_which_faces(folder, known):
    case = Case.from_toml(CASE.format("faces = [3, 2, 6]\ncells = 12"), folder)
    assert Case.from_toml(case.to_toml()) == case
    assert case.surface.label == "part.step"
    problem = case.build()
    assert len(problem.cells) == 12
    assert "triangles stand for 3 faces (3, 2, 6)" in problem.cells.surface.notes[0]
    part = Case.from_toml(
        CASE.format("faces = [3]\ncell_size = 0.02\nbox = [[0, 0, 0], [1, 1, 0.02]]"), folder
    )
    assert part.build().cells.surface.mesh.vertices[:, 2].max() == pytest.approx(0.02)


@pytest.mark.parametrize(
    ("keys", "fault"),
    [
        ("faces = [9]\ncells = 12", "part.step: names face 9; the file has 7"),
        ("cells = 12", "part.step: choose by faces = [3, 7]"),
        ("faces = [3]\ncolour = '#ff0000'\ncells = 12", "surface.colour: contradicts faces"),
        ("scale = 0.001\nfaces = [3]\ncells = 12", "surface.scale: belongs to a mesh, not to STEP"),
    ],
)
def test_a_case_with_a_wrong_choice_says_so(folder, known, monkeypatch, keys, fault):
    monkeypatch.chdir(folder)
    with pytest.raises(CaseError) as raised:
        Case.from_toml(CASE.format(keys), ".").build()
    assert str(raised.value).startswith("case: surface.")
    assert fault in str(raised.value)
