"""The bodies of links: where they are, what stands in for what, and what is read from files."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
import trimesh
from arm_urdfs import placement, random_q
from hulls_of_arms import assert_held

from coverable_meshes import robot_files
from robots import Kinematics, RobotError, load_robot
from robots.shapes import link_shapes
from robots.urdf import Box, check_urdf

LINKS = (
    '<robot name="three"><link name="base">{base}</link><link name="arm" {mark}>{arm}</link>'
    '<link name="hand">{hand}</link><link name="tip"/>'
    '<joint name="turn" type="revolute"><parent link="base"/><child link="arm"/>'
    '<origin xyz="0 0 1"/><axis xyz="0 0 1"/>'
    '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
    '<joint name="bend" type="revolute"><parent link="arm"/><child link="hand"/>'
    '<origin xyz="0.5 0 0"/><axis xyz="0 1 0"/>'
    '<limit lower="-2" upper="2" effort="1" velocity="1"/></joint>'
    '<joint name="end" type="fixed"><parent link="hand"/><child link="tip"/>'
    '<origin xyz="0.5 0 0"/></joint></robot>'
)
BOX = '<{0}><origin xyz="0 0 0.1"/><geometry><box size="0.1 0.1 0.1"/></geometry></{0}>'
MESH = '<{0}><geometry><mesh filename="{1}"/></geometry></{0}>'
COLLISION, VISUAL = BOX.format("collision"), BOX.format("visual")


def three(folder, base=COLLISION, arm=COLLISION, hand=COLLISION, mark=""):
    """An arm of two joints."""
    file = folder / "three.urdf"
    file.write_text(LINKS.format(base=base, arm=arm, hand=hand, mark=mark))
    return load_robot(str(file))


@pytest.mark.parametrize("name", ["puma560", "ur5", "panda", "talos_arm"])
def test_bodies_are_where_the_urdf_has_them_and_hulls_hold_them(name):
    """Placements by joints of the URDF, locked ones and fixed links included, without Pinocchio."""
    robot = load_robot(name)
    shapes = link_shapes(robot)
    checked = check_urdf(robot.urdf, robot.package_dirs)
    sources = {
        link: [s.origin for s in (*checked.collisions.shapes, *checked.visuals) if s.link == link]
        for link in checked.links
    }
    q = random_q(robot, np.random.default_rng(0))
    values = {**robot.locked, **dict(zip(robot.joint_names, q, strict=True))}
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, Kinematics(robot).configuration(q))
    seen = dict.fromkeys(sources, 0)
    for solid in shapes.solids:
        here = data.oMi[solid.joint].homogeneous @ solid.placement
        origin = sources[solid.owner][seen[solid.owner]]
        seen[solid.owner] += 1
        there = placement(checked.path_to(solid.owner), values) @ origin
        np.testing.assert_allclose(here, there, rtol=0, atol=1e-9)
    assert_held(shapes)


def test_the_same_content_is_read_once(tmp_path, monkeypatch):
    read = []
    real = robot_files.read_parts_of
    monkeypatch.setattr(robot_files, "read_parts_of", lambda f: read.append(f.name) or real(f))
    for name, size in (("a.stl", 1.0), ("copy.stl", 1.0), ("b.stl", 1.5)):
        trimesh.creation.box((size, 0.37, 0.41)).export(tmp_path / name)
    names = ("a.stl", "a.stl", "copy.stl", "b.stl")
    robot = three(tmp_path, base="".join(MESH.format("collision", name) for name in names))
    first = link_shapes(robot)
    assert read == ["a.stl", "b.stl"]
    again = link_shapes(robot)
    assert read == ["a.stl", "b.stl"]
    pairs = zip(first.solids[:4], again.solids[:4], strict=True)
    assert all(old.geometry is new.geometry for old, new in pairs)
    trimesh.creation.box((2.5, 0.37, 0.41)).export(tmp_path / "a.stl")
    assert np.ptp(link_shapes(robot).solids[0].geometry.vertices[:, 0]) == 2.5
    assert read[2:] == ["a.stl"]


def test_a_mesh_is_scaled_mirrored_and_closed(tmp_path):
    trimesh.creation.box((1, 2, 3)).export(tmp_path / "box.stl")
    mesh = (
        '<collision><geometry><mesh filename="box.stl" scale="1 -0.1 0.2"/></geometry></collision>'
    )
    body = link_shapes(three(tmp_path, base=mesh)).solids[0].geometry
    assert body.closed
    assert (len(body.vertices), len(body.faces)) == (8, 12)
    assert np.allclose(np.ptp(body.vertices, axis=0), [1, 0.2, 0.6])


def test_visuals_stand_in_for_collision_shapes_that_are_missing_or_broken(tmp_path):
    (tmp_path / "broken.stl").write_bytes(b"solid nothing")
    robot = three(
        tmp_path, base=VISUAL, arm=MESH.format("collision", "broken.stl") + VISUAL, hand=COLLISION
    )
    shapes = link_shapes(robot)
    assert [solid.owner for solid in shapes.solids] == ["base", "arm", "hand"]
    assert shapes.unchecked == ()
    broken, missing = shapes.notes
    assert broken.startswith("a collision shape of link arm cannot be used, so visuals stand in: ")
    assert "broken.stl" in broken
    assert missing == "no collision shapes, so visuals stand in: link base"


@pytest.mark.parametrize("name", ["lost.stl", "../outside.stl", "/etc/passwd", "a.step"])
def test_what_cannot_be_read_at_all_is_unchecked(tmp_path, name):
    both = MESH.format("collision", name) + MESH.format("visual", "worse.stl")
    shapes = link_shapes(three(tmp_path, arm=both))
    assert shapes.unchecked == ("arm",)
    (note,) = shapes.notes
    assert note.startswith("a shape of link arm cannot be used, so it is not checked: line 1")
    assert [solid.owner for solid in shapes.solids] == ["base", "hand"]


def test_what_can_be_read_beside_a_broken_shape_is_kept(tmp_path):
    shapes = link_shapes(three(tmp_path, arm=MESH.format("collision", "lost.stl") + COLLISION))
    assert shapes.unchecked == ("arm",)
    assert [solid.owner for solid in shapes.solids] == ["base", "arm", "hand"]


def test_a_link_can_be_left_without_collision_shapes_on_purpose(tmp_path):
    shapes = link_shapes(three(tmp_path, arm=VISUAL, mark='collision="none"'))
    assert shapes.unchecked == ("arm",)
    assert shapes.notes == ("left without collision shapes by the URDF, so not checked: link arm",)
    odd = three(tmp_path, arm=VISUAL, mark='collision="no"')
    assert any('the one value is "none"' in note for note in odd.notes)
    assert link_shapes(odd).unchecked == ()
    both = three(tmp_path, arm=COLLISION, mark='collision="none"')
    assert any("it has collision shapes" in note for note in both.notes)
    assert link_shapes(both).unchecked == ()


def test_frames_are_no_gaps_but_a_link_between_joints_is(tmp_path):
    assert link_shapes(three(tmp_path)).unchecked == ()  # tip is a frame
    assert link_shapes(three(tmp_path, base="")).unchecked == ()
    assert link_shapes(three(tmp_path, arm="")).unchecked == ("arm",)


def test_an_arm_without_shapes_is_refused(tmp_path):
    with pytest.raises(RobotError, match=r"no link has a shape .* neither collision shapes nor"):
        link_shapes(three(tmp_path, base="", arm="", hand=""))
    lost = MESH.format("collision", "lost.stl")
    with pytest.raises(RobotError, match=r"no link has a shape .*lost\.stl"):
        link_shapes(three(tmp_path, base=lost, arm="", hand=""))
    robot = three(tmp_path)
    (tmp_path / "three.urdf").unlink()
    with pytest.raises(RobotError, match="there is no such file"):
        link_shapes(robot)
    with pytest.raises(RobotError, match="has no URDF file"):
        link_shapes(replace(robot, urdf=None))


def test_pieces_are_more_and_smaller_and_hold_the_same(tmp_path):
    robot = load_robot("ur5")
    pieces = link_shapes(robot, "pieces")
    assert_held(pieces)
    assert len(pieces.polytopes) > len(link_shapes(robot).polytopes)
    assert all(len(body.vertices) <= 64 for body in pieces.polytopes)
    assert [s.geometry for s in pieces.solids] == [s.geometry for s in link_shapes(robot).solids]
    boxes = link_shapes(three(tmp_path), "pieces")
    assert len(boxes.polytopes) == 3
    assert boxes.solids[0].geometry == Box((0.1, 0.1, 0.1))
