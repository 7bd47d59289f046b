"""Faces of STEP files become surfaces in metres, and files that are none become sentences."""

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from approved import refused
from page_outline import Page

from coverable import Case, SurfaceError, mesh, step, step_faces
from coverable.processes import Ended, Limits, run_apart
from feasibility.cli.main import main
from surfaces.meshes import step_process, step_surface
from surfaces.meshes.step_process import CAPS, Caps
from surfaces.meshes.step_surface import step_parts, step_triangles

SIZE = (0.2, 0.1, 0.05)  # m
ROUND = 0.01  # [m], radius of the one edge that is round
CORNER = ROUND**2 * (1.0 - np.pi / 4.0)  # m^2, what the round edge takes off top and bottom
TOP = SIZE[0] * SIZE[1] - CORNER
AREAS = [(SIZE[1] - ROUND) * SIZE[2], TOP, np.pi / 2.0 * ROUND * SIZE[2], SIZE[0] * SIZE[2],
         TOP, (SIZE[0] - ROUND) * SIZE[2], SIZE[1] * SIZE[2]]  # fmt: skip
PARTS = Path(__file__).parents[1] / "shared" / "files" / "step_parts.py"
CASE = """
robot.name = "ur5"
task = {{ standoff = 0.02, cone_deg = 30 }}
[surface]
kind = "step"
file = "part.step"
side = "outside"
{}
"""


FORKS = """import os, runpy, sys
child, reply = runpy.run_path(sys.argv[1]), os.fdopen(os.dup(1), "w")
os.dup2(2, 1)
child["_load_all"]()
sys.argv = sys.argv[2:]
runpy.run_path(sys.argv[0], run_name="__main__")
print("made", file=reply, flush=True)
for name in map(str.rstrip, sys.stdin):
    if not os.fork():
        sys.stdin = open(name)
        os.dup2(os.open(name + ".out", os.O_WRONLY | os.O_CREAT | os.O_TRUNC), 1)
        child["main"]()
    print(os.wait(), file=reply, flush=True)
"""


@pytest.fixture(scope="module", autouse=True)
def folder(tmp_path_factory):
    """A part, two of it in inches, and a ball; without caps forks of one process are asked."""
    folder, read = tmp_path_factory.mktemp("parts"), step_surface.read_step
    name = tmp_path_factory.mktemp("asked") / "question"
    command = [sys.executable, "-c", FORKS, step_process.CHILD, PARTS, folder]
    command += map(str, (*SIZE, ROUND))
    pipe, patched = subprocess.PIPE, pytest.MonkeyPatch.context()
    with subprocess.Popen(command, 0, stdin=pipe, stdout=pipe) as forks, patched as patch:

        def run(script, given, *limits):
            name.write_bytes(given)
            forks.stdin.write(b"%s\n" % bytes(name))
            forks.stdout.readline()
            return Ended(name.with_suffix(".out").read_bytes())

        def asked(file, job, caps):
            return read(file, job, Caps(run=run) if caps is CAPS else caps)

        patch.setattr(step_surface, "read_step", asked)
        assert forks.stdout.readline() == b"made\n"
        yield folder


@pytest.fixture(scope="module")
def chosen(folder):
    """The round face and two beside it."""
    return step_triangles(folder / "part.step", [3, 2, 6], deviation=1e-5)


def test_faces_have_numbers_kinds_areas_and_colours(folder):
    faces = step_faces(folder / "pair.step")
    assert [face.number for face in faces] == list(range(1, 15))
    np.testing.assert_allclose([face.area for face in faces], 2 * AREAS, rtol=1e-9)
    round_ones = [face.number for face in faces if face.kind == "cylinder"]
    assert round_ones == [face.number for face in faces if face.colour == "#ff0000"] == [3, 10]
    assert {face.colour for face in faces if face.kind == "plane"} == {"#808080"}
    # The part, its round edge along z at the origin; and the same, turned about z and 1 m up.
    size, up = np.array(SIZE), np.array([0, 0, 1])
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
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


def test_all_triangles_look_out_of_the_solid_as_they_come(folder):
    parts = step_parts(folder / "part.step")
    assert sorted(set(parts.owner.tolist())) == list(range(1, 8))
    a, b, c = parts.vertices[parts.triangles].swapaxes(0, 1)
    outwards = (a + b + c) / 3.0 - np.array(SIZE) / 2.0
    assert (np.einsum("fi,fi->f", np.cross(b - a, c - a), outwards) > 0.0).all()


def said_deviation(surface):
    """m, out of the first note."""
    return float(re.search(r"at most (\S+) mm off", surface.notes[0])[1]) * 1e-3


def test_the_deviation_is_right_at_the_poles_of_a_sphere(folder):
    surface = mesh(step_triangles(folder / "ball.step", "all", deviation=1e-3, caps=Caps()))
    corners = surface.mesh.vertices[surface.mesh.faces]
    np.testing.assert_allclose(np.linalg.norm(corners, axis=2), 0.3, atol=1e-9)
    shares = np.random.default_rng(1).dirichlet((1, 1, 1), 20)
    off = 0.3 - np.linalg.norm(np.einsum("sk,fki->fsi", shares, corners), axis=2)
    assert 0.9 * said_deviation(surface) <= off.max() <= 1.04 * said_deviation(surface) < 3e-3


def test_triangles_are_in_metres_as_near_as_is_said_and_look_out_of_the_solid(chosen):
    surface = mesh(chosen)
    assert re.match(r"\d+ triangles stand for 3 faces \(3, 2, 6\), at most", surface.notes[0])
    assert not chosen.pieces.any()  # edges that faces share are one
    np.testing.assert_allclose(chosen.vertices.max(axis=0), SIZE, atol=1e-12)
    assert abs(chosen.area - AREAS[2] - AREAS[1] - AREAS[5]) < 1e-6
    angle = np.linspace(np.pi, 1.5 * np.pi, 400)
    arc = ROUND * (1.0 + np.column_stack([np.cos(angle), np.sin(angle)]))
    away = surface.closest(np.column_stack([arc, np.full(400, 0.02)])).height
    assert (away >= -1e-12).all()
    assert away.max() == pytest.approx(said_deviation(surface), rel=6e-2)  # of two digits
    assert said_deviation(surface) <= 1e-5
    outwards = chosen.vertices[chosen.faces].mean(axis=1) - np.array(SIZE) / 2.0
    assert (np.einsum("fi,fi->f", chosen.face_normals, outwards) > 0.0).all()


def test_parts_of_an_assembly_stand_where_it_has_them(folder):
    made = step_triangles(folder / "pair.step", colour="#FF0000")
    assert "2 faces (3, 10)" in mesh(made).notes[0]
    low = made.vertices[:, 2] < 0.5
    expected = [[0, 0, 0], [ROUND, ROUND, SIZE[2]], [-ROUND, 0, 1], [0, ROUND, 1 + SIZE[2]]]
    for own, ends in ((made.vertices[low], expected[:2]), (made.vertices[~low], expected[2:])):
        np.testing.assert_allclose([own.min(axis=0), own.max(axis=0)], ends, atol=1e-9)


CHOICES = [
    {}, {"faces": "al"}, {"faces": [3, 8]}, {"faces": [0]}, {"faces": []}, {"faces": "37"},
    {"colour": "red"}, {"faces": [3], "colour": "#ff0000"}, {"faces": [3], "deviation": 0.0},
    {"colour": "#00ff00"},
]  # fmt: skip
CONTENTS = (
    b"", b" \n", b"solid part\nendsolid", b"ISO-10303-21;\nHEADER;\nDATA;\n#1=CARTESIAN_POI", None
)  # fmt: skip


def test_choices_that_make_no_sense_and_files_that_are_none_are_refused(folder, tmp_path, approved):
    asked = [("part.step", choice) for choice in CHOICES]
    asked.append(("ball.step", {"colour": "#00ff00"}))  # without any
    said = [refused(step_triangles, folder / a, **choice) for a, choice in asked]
    path = tmp_path / "part.step"
    for content in CONTENTS:
        with path.open("wb") as file:
            file.truncate(2**30) if content is None else file.write(content)
        said.append(refused(step_triangles, path, [1], caps=Caps(run=None)))  # given to nobody
    nonsense = "HEADER;\nENDSEC;\nDATA;\n#1=NONSENSE(*,$,#1);\nENDSEC;"
    path.write_text(f"ISO-10303-21;\n{nonsense}\nEND-ISO-10303-21;\n")
    approved("STEP files refused", "\n".join([*said, refused(step, path, faces=[1])]))


def test_caps_hold(folder, tmp_path):
    endless = tmp_path / "endless.py"
    endless.write_text("while True: pass\n")
    for caps, words in (
        (Caps(memory=2**27), "more than 0.125 GB of memory"),
        (Caps(waiting=0.01), "could not be read within 0.01 s"),
        (Caps(seconds=1, run=lambda script, *rest: run_apart(endless, *rest)),
         "takes more than 1 s of processor time"),
    ):  # fmt: skip
        with pytest.raises(SurfaceError, match=words):
            step_triangles(folder / "part.step", [1, 2, 3], caps=caps)


FACE = {"kind": "plane", "area": 1.0, "colour": "", "centre": [0, 0, 0], "normal": [0, 0, 1]}
WHOLE = {"faces": [FACE], "taken": [1], "counts": [1], "vertices": 3, "triangles": 1}
BROKEN, EYE = "Open CASCADE broke off over it", np.eye(3).tobytes()


def answered(arrays=b"", **said):
    return json.dumps({"faces": [], **said}).encode() + b"\n" + arrays


@pytest.mark.parametrize(("written", "words"), [
    *((each, BROKEN) for each in (b"", b"\xff\n", b"[]\n")),
    (answered(faces=[{"kind": "plane"}]), BROKEN),
    (answered(b"0" * 35, vertices=1, triangles=1), BROKEN),
    (answered(vertices=-1, triangles=2), BROKEN), (answered(faces=3), BROKEN),
    (answered(b"0" * 12, taken=[1], counts=[2], vertices=0, triangles=1), BROKEN),
    (answered(b"0" * 12, taken=[1, 2], counts=[1], vertices=0, triangles=1), BROKEN),
    (answered(EYE + np.array([0, 1, 2, 2, 1, 0], "<i4").tobytes(), **WHOLE), BROKEN),
    (answered(vertices=0, triangles=11), "more than 10; take fewer faces"),
    (answered(EYE + np.array([0, 1, 7], "<i4").tobytes(), **WHOLE), "do not exist"),
    (answered(EYE + np.array([0, 1, -2], "<i4").tobytes(), **WHOLE), "do not exist"),
])  # fmt: skip
def test_what_the_process_writes_is_not_believed(folder, written, words):
    caps = Caps(triangles=10, run=lambda *given: Ended(written))
    with pytest.raises(SurfaceError, match=words):
        step_triangles(folder / "part.step", [1], caps=caps)


def test_the_message_names_the_extra(folder, monkeypatch):
    monkeypatch.setattr(step_process, "folder_of", lambda name: None)
    with pytest.raises(SurfaceError, match=r"pip install 'coverable\[step\]'"):
        step_faces(folder / "part.step")


def test_the_process_opens_nothing_once_it_sees_the_file(tmp_path):
    """What stands before `answer` in the child closes the door: tried with a child that tries."""
    text = Path(step_process.CHILD).read_text().replace("    _load_all()\n", "")
    tries = text.replace(
        "        reply = answer(job, data)",
        "        try:\n            open('/dev/null')\n            reply = b'opened'\n"
        "        except OSError as error:\n            reply = str(error.errno).encode()",
    )
    assert tries != text
    script = tmp_path / "tries.py"
    script.write_text(tries)
    ended = run_apart(script, b'{"library": []}\n', 300.0, Limits(6 * 2**30, 60, 1000))
    assert ended.written == b"24"  # too many open files


KEYS = {
    "faces = [3]\ncell_size = 0.02\nbox = [[0, 0, 0], [1, 1, 0.02]]": (0.4 * AREAS[2], 0.02),
    "facing = { direction = [0, 0, 1], within_deg = 30 }\ncells = 12": (AREAS[1], SIZE[2]),
}


@pytest.mark.parametrize("keys", KEYS)
def test_a_case_says_which_faces(folder, keys):
    area, top = KEYS[keys]
    case = Case.from_toml(CASE.format(keys), folder)
    assert Case.from_toml(case.to_toml()) == case
    assert case.surface.label == "part.step"
    surface = case.build().cells.surface
    assert surface.mesh.area == pytest.approx(area, rel=1e-3)
    assert surface.mesh.vertices[:, 2].max() == pytest.approx(top)


def test_a_case_with_a_wrong_choice_says_so(folder, monkeypatch, approved):
    monkeypatch.chdir(folder)
    wrong = ("faces = [9]", "", "faces = [3]\ncolour = '#ff0000'", "scale = 0.001\nfaces = [3]")
    said = [refused(lambda k=k: Case.from_toml(CASE.format(f"{k}\ncells = 12"), ".").build())
            for k in wrong]  # fmt: skip
    approved("STEP cases refused", "\n".join(said).replace(str(folder), "FOLDER"))


def test_show_lists_the_faces_and_draws_them_with_their_numbers(folder, tmp_path, capsys):
    page = tmp_path / "faces.html"
    assert main(["show", str(folder / "part.step"), "--html", str(page)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.partition(":")[0] for line in lines] == [str(k) for k in range(1, 8)]
    assert lines[2].startswith("3: cylinder, 0.000785 m^2, #ff0000, at 0.0029, 0.0029, 0.025 m")
    text = page.read_text()
    drawn = Page(text).block("commands")
    for k in range(1, 8):
        assert f'data-path="/faces/{k}"' in text
        assert f"/faces/{k}".encode() in drawn
        assert f"/numbers/{k}".encode() in drawn
    assert main(["show", str(tmp_path / "none.STP")]) == 2
    assert "none.STP" in capsys.readouterr().err
