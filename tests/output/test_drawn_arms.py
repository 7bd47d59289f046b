"""The drawn arm: every link, in the right place, whatever its files are like."""

import json
import sys
from pathlib import Path

import arm_urdfs
import hostile_visuals as hostile
import numpy as np
import pinocchio as pin
import pytest
import trimesh
from hostile_visuals import urdf, visual, write
from mesh_writers import stl
from page_outline import faces_of, points_of
from samples import sampled, spread

from coverable import load_robot
from coverable.meshes import collada, robot_files
from coverable.meshes.collada import read_collada
from coverable.meshes.raw_mesh import MeshError
from coverable.meshes.robot_files import MeshFiles
from coverable.processes import Ended, run_apart
from feasibility.viewer.robot_visuals import TRIANGLES, draw, joint_paths
from feasibility.viewer.threejs import safe_name
from robots.urdf.checked_urdf import check_urdf

SHAPE = '<visual><origin xyz="0 0 0.1"/><geometry>{}</geometry></visual>'


def drawn(robot):
    """Path -> (vertices, number of faces) of every mesh of the drawing."""
    found = {}
    for command in draw(robot).commands:
        points, faces = points_of(command), faces_of(command)
        assert faces.max() < len(points)
        found[command["path"]] = (points, len(faces))
    return found


def two_links(folder, base="", arm=""):
    turn = arm_urdfs.joint(1, xyz=(0, 0, 1), limits=(-1, 1))
    text = arm_urdfs.arm([turn, arm_urdfs.joint(2, "fixed", (0.5, 0, 0))])
    for link, shape in (("l0", base), ("l1", arm)):
        text = text.replace(f'<link name="{link}"/>', f'<link name="{link}">{shape}</link>')
    return arm_urdfs.load_text(folder, text)


@sampled("name", spread(["puma560", "ur5", "panda", "baxter_left", "xarm7"], 2))
def test_every_link_with_visuals_is_drawn_whole_and_within_its_own_shape(name):
    robot = load_robot(name)
    checked = check_urdf(robot.urdf, package_dirs=robot.package_dirs)
    assert not [warning for warning in checked.warnings if warning.startswith("not drawn")]
    parts = drawn(robot)
    paths = joint_paths(robot)
    for link in {one.link for one in checked.visuals}:
        frame = robot.model.frames[robot.model.getFrameId(link, pin.FrameType.BODY)]
        start = f"{paths[frame.parentJoint]}/link {safe_name(link)}/part "
        points = np.concatenate([p for path, (p, _) in parts.items() if path.startswith(start)])
        local = (points - frame.placement.translation) @ frame.placement.rotation
        bounds = np.array([extent(one) for one in checked.visuals if one.link == link])
        low, high = bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0)
        assert np.allclose([local.min(axis=0), local.max(axis=0)], [low, high], atol=0.02), link
    assert sum(count for _, count in parts.values()) <= TRIANGLES


def extent(visual):
    """Lowest and highest corner of a visual in its link's frame, read another way."""
    shape = visual.geometry
    if hasattr(shape, "path"):
        body = trimesh.load(shape.path, force="mesh", process=False)
        body.apply_scale(shape.scale)
    elif hasattr(shape, "size"):
        body = trimesh.creation.box(shape.size)
    elif hasattr(shape, "length"):
        body = trimesh.creation.cylinder(radius=shape.radius, height=shape.length, sections=96)
    else:
        body = trimesh.creation.icosphere(subdivisions=4, radius=shape.radius)
    return body.apply_transform(visual.origin).bounds


def test_a_mesh_is_scaled_and_placed(tmp_path):
    trimesh.creation.box((1, 2, 3)).export(tmp_path / "box.stl")
    mesh = '<mesh filename="box.stl" scale="0.1 0.1 -0.1"/>'
    ((points, faces),) = drawn(two_links(tmp_path, base=SHAPE.format(mesh))).values()
    assert faces == 12
    assert np.allclose(points.min(axis=0), [-0.05, -0.1, -0.05], atol=1e-4)
    assert np.allclose(points.max(axis=0), [0.05, 0.1, 0.25], atol=1e-4)


@pytest.mark.parametrize("content", [None, b"\0" * 84, stl([[np.nan] * 3], [[0, 0, 0]])])
def test_a_mesh_that_cannot_be_had_becomes_a_capsule_and_a_note(tmp_path, content):
    if content is not None:
        (tmp_path / "lost.stl").write_bytes(content)
    shapes = '<box size="0.1 0.1 0.1"/>', '<mesh filename="lost.stl"/>'
    robot = two_links(tmp_path, *map(SHAPE.format, shapes))
    (note,) = draw(robot).notes
    assert "lost.stl" in note
    parts = drawn(robot)
    assert set(parts) == {"/robot/link l0/part 0", "/robot/joint j1/link capsule/part 1"}
    points, _ = parts["/robot/joint j1/link capsule/part 1"]
    assert points[:, 0].min() < 0 < 0.49 < points[:, 0].max(), "from the joint to the tool"


def test_an_arm_without_pictures_is_a_chain_of_capsules(tmp_path):
    bare, late = two_links(tmp_path), two_links(tmp_path)
    assert len(drawn(bare)) == 2
    (tmp_path / "test_arm.urdf").unlink()
    assert draw(bare).notes == ()  # files are read once for each robot
    assert len(drawn(late)) == 2
    (note,) = draw(late).notes
    assert "test_arm.urdf" in note


opened: list[str] = []
sys.addaudithook(lambda event, facts: opened.append(str(facts[0])) if event == "open" else None)


def test_a_mesh_that_is_used_often_is_read_once(tmp_path):
    names = [write(tmp_path, f"{k}.stl", hostile.stl(k + 1)) for k in range(3)]
    broken = write(tmp_path, "broken.stl", b"")
    shapes = "".join(visual(name) for name in (*names, broken) * 300)
    robot = load_robot(tmp_path / write(tmp_path, "arm.urdf", urdf(shapes)))
    opened.clear()
    (note,) = draw(robot).notes
    own = [Path(name).name for name in opened if name.endswith(".stl")]
    assert sorted(set(own)) == ["0.stl", "1.stl", "2.stl", "broken.stl"]
    assert len(own) <= 2 * 4
    assert note.startswith("not drawn: a shape of link base and 299 more: broken.stl: is empty")


def test_the_triangles_of_all_shapes_together_are_capped(tmp_path, monkeypatch):
    """Copies of one mesh count, and so do spheres; what came before is drawn."""
    assert robot_files.MOST_TRIANGLES == 1_500_000
    monkeypatch.setattr(robot_files, "MOST_TRIANGLES", 60_000)
    mesh = visual(write(tmp_path, "large.stl", hostile.stl(4_000)))
    ball = '<visual><geometry><sphere radius="0.1"/></geometry></visual>'
    drawing = draw(load_robot(tmp_path / write(tmp_path, "arm.urdf", urdf(mesh * 18 + ball))))
    (note,) = drawing.notes
    assert "link base and 3 more: the robot's shapes have more than 60,000" in note
    assert 0 < sum(len(faces_of(command)) for command in drawing.commands) <= 4 * 4 * TRIANGLES


def test_no_other_file_is_opened_after_the_time_is_up(tmp_path):
    now = [0.0]
    files = MeshFiles(clock=lambda: now[0])
    paths = [str(tmp_path / write(tmp_path, f"{k}.stl", hostile.stl(1))) for k in range(2)]
    assert len(files.parts(paths[0])) == 1
    now[0] = 8.1
    assert len(files.parts(paths[0])) == 1, "it was read before"
    with pytest.raises(MeshError, match=r"reading took more than 8 s; thin the robot's meshes"):
        files.parts(paths[1])


TRIANGLE = np.eye(3).tobytes()


def written(parts, *arrays):
    return json.dumps({"parts": parts}).encode() + b"\n" + b"".join(arrays)


@pytest.mark.parametrize("one", [  # in the place of what is said of the second file
    b"", b"[]\n", b'{"parts": 3}\n', written([[3, 1]]), written([[3, 1, None]], TRIANGLE),
    written([[-1, 1, None]], TRIANGLE), written([[3, 0, [2.0, 0, 0, 1]]], TRIANGLE),
    written([[3, 1, None]], TRIANGLE, np.array([[0, 1, 3]]).tobytes()),
    written([[3, 1, None]], TRIANGLE, np.array([[0, -1, 2]]).tobytes()),
])  # fmt: skip
def test_what_the_process_of_dae_files_writes_is_not_believed(one):
    good = written([[3, 1, [1, 0, 0, 1]]], TRIANGLE, np.array([[0, 1, 2]]).tobytes())
    files = [hostile.zipped(), b"", b"", b""]
    packed, before, found, after = read_collada(files, lambda *_: Ended(good + one))
    assert "is a zip archive" in str(packed)
    assert (len(before), before[0].rgba) == (1, (1, 0, 0, 1))
    assert isinstance(found, MeshError)
    assert isinstance(after, MeshError)


def test_that_process_opens_nothing_once_it_sees_a_file(tmp_path):
    """Tried with one that tries."""
    text = collada.CHILD.read_text()
    tries = text.replace("given.read(size)", "open('/dev/null', 'rb').read()")
    assert tries != text
    (tmp_path / "tries.py").write_text(tries)
    files = [hostile.GOOD.encode()]
    assert len(read_collada(files)[0]) == 1
    seen = []

    def run(_, *rest):
        seen.append(run_apart(tmp_path / "tries.py", *rest))
        return seen[0]

    assert isinstance(read_collada(files, run)[0], MeshError)
    assert seen[0].written == b""
