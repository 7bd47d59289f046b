"""Pictures of robots that are traps: counted before they are made, and nothing beside them opened.

All of them, many times over and with limits on memory and time, are in
`tests/input/test_limits.py`.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

import hostile_visuals as hostile
import pytest
from hostile_visuals import Maker, urdf, visual, write

from coverable_meshes import MeshError, MeshFiles, robot_files
from coverable_meshes.robot_files import MOST_SECONDS, MOST_TRIANGLES
from feasibility.viewer.robot import TRIANGLES, draw
from robots import load_robot

LIGHT = [maker for maker in hostile.MAKERS if maker is not hostile.just_drawn]
opened: list[str] = []
sys.addaudithook(lambda event, facts: opened.append(str(facts[0])) if event == "open" else None)


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("maker", LIGHT, ids=lambda maker: maker.__name__)
def test_a_trap_is_a_note_or_is_left_alone(
    maker: Maker, seed: int, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path, words = hostile.make(maker, seed, tmp_path / "robot")
    robot = load_robot(path)
    opened.clear()
    drawing = draw(robot)
    mesh = re.search('filename="(.*?)"', Path(path).read_text())
    assert mesh is not None
    inside = {Path(name).name for name in opened if name.startswith(str(tmp_path))}
    assert inside <= {"arm.urdf", mesh[1]}, "nothing beside the mesh is opened"
    assert not [name for name in opened if name.startswith(("/dev", "/etc"))]
    assert capfd.readouterr() == ("", "")
    if words:
        (note,) = drawing.notes
        assert note.startswith("not drawn: ")
        assert re.search(words, note)
    else:
        assert drawing.notes == ()
        assert len(drawing.commands) == 1, "the triangle"


def test_a_mesh_that_is_used_often_is_read_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files: list[Path] = []
    real = robot_files.read_parts_of
    monkeypatch.setattr(robot_files, "read_parts_of", lambda f: files.append(f) or real(f))
    names = [write(tmp_path, f"{k}.stl", hostile.stl(k + 1)) for k in range(3)]
    broken = write(tmp_path, "broken.stl", b"")
    shapes = "".join(visual(name) for name in (*names, broken) * 300)
    notes = draw(load_robot(hostile_robot(tmp_path, shapes))).notes
    assert sorted(file.name for file in files) == ["0.stl", "1.stl", "2.stl", "broken.stl"]
    (note,) = notes
    assert note.startswith("not drawn: a shape of link base and 299 more: broken.stl: is empty")


def hostile_robot(folder: Path, visuals: str) -> str:
    """A URDF with these visuals."""
    return str(folder / write(folder, "arm.urdf", urdf(visuals)))


def test_the_triangles_of_all_shapes_together_are_capped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Copies of one mesh count, and so do spheres; what came before is drawn."""
    assert MOST_TRIANGLES == 1_500_000
    monkeypatch.setattr(robot_files, "MOST_TRIANGLES", 60_000)
    each = 4_000
    mesh = visual(write(tmp_path, "large.stl", hostile.stl(each)))
    ball = '<visual><geometry><sphere radius="0.1"/></geometry></visual>'
    drawing = draw(load_robot(hostile_robot(tmp_path, mesh * 18 + ball)))
    (note,) = drawing.notes
    left_out = 18 - 60_000 // each
    assert f"link base and {left_out} more: the robot's shapes have more than 60,000" in note
    counts = [
        len(command["object"]["geometries"][0]["data"]["index"]["array"].data)
        for command in drawing.commands
    ]
    assert 0 < sum(counts) <= 4 * 4 * 3 * TRIANGLES, "thinned, though it is 100 km long"


def test_no_other_file_is_opened_after_the_time_is_up(tmp_path: Path) -> None:
    now = [0.0]
    files = MeshFiles(clock=lambda: now[0])
    paths = [str(tmp_path / write(tmp_path, f"{k}.stl", hostile.stl(1))) for k in range(2)]
    assert len(files.parts(paths[0])) == 1
    now[0] = MOST_SECONDS + 0.1
    assert len(files.parts(paths[0])) == 1, "it was read before"
    with pytest.raises(MeshError, match=r"reading took more than 8 s; thin the robot's meshes"):
        files.parts(paths[1])
