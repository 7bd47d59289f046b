"""URDFs and SRDFs that are read: the robot that they describe, and meshes from allowed folders."""

import os
from importlib.metadata import distribution
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
import pytest
from bad_input import bad, changed, goods, slug
from readers import link_placements, of_bad, sound_urdf
from samples import sampled, spread
from yourdfpy import URDF

from coverable.errors import CoverableError
from robots.pinocchio_model import chain_model
from robots.urdf.checked_urdf import CheckedUrdf, check_urdf
from robots.urdf.elements import MAX_BYTES, UrdfError, parse_xml
from robots.urdf.link_shapes import MeshFile
from robots.urdf.srdf import read_srdf

SHARE = next(
    Path(str(file.locate())).parents[1]
    for file in distribution("example-robot-data").files or ()
    if file.name == "package.xml"
)
# One file of each robot: its others differ in limits or in parts that are left off.
ROBOTS = sorted(
    max(folder.glob("*/*.urdf"), key=lambda path: path.stat().st_size)
    for folder in (SHARE / "example-robot-data/robots").iterdir()
    if any(folder.glob("*/*.urdf"))
)
READ = [
    name
    for name in bad("urdf")
    if "It is read"
    in (Path(__file__).parent / f"approved/urdf/{slug(name)}.txt").read_text("utf-8")
]


def saved(folder: Path, content: str | bytes) -> CheckedUrdf:
    path = folder / "robot.urdf"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return check_urdf(path)


def same_as_others_read(checked: CheckedUrdf, path: Path, *, yourdfpy: bool = False) -> None:
    """Every link where Pinocchio and yourdfpy have it, at random angles."""
    original = pin.buildModelFromUrdf(str(path))
    ours = chain_model(checked, [info.name for info in checked.joints if info.moves], {})
    rng = np.random.default_rng(0)
    for _ in range(2):
        values = {info.name: rng.uniform(-3.0, 3.0) for info in checked.joints if info.moves}
        expected, found = (link_placements(model, values) for model in (original, ours))
        if yourdfpy:
            read = URDF.load(str(path), load_meshes=False, build_scene_graph=True)
            for joint in read.robot.joints:
                joint.mimic = None
            read = URDF(read.robot, load_meshes=False)
            read.update_cfg(values)
            again = {link: read.get_transform(link, checked.root) for link in read.link_map}
            np.testing.assert_allclose(
                [again[link] for link in found], [*found.values()], rtol=0, atol=1e-9
            )
        assert set(found) == set(expected)
        scale = max(1.0, max(np.abs(matrix).max() for matrix in expected.values()))
        for name, matrix in expected.items():
            assert np.abs(found[name] - matrix).max() < 1e-12 * scale, name


@pytest.mark.parametrize("name", READ)
def test_an_odd_file_gives_the_robot_it_describes(name: str, tmp_path: Path) -> None:
    checked = saved(tmp_path, of_bad("urdf", name))
    sound_urdf(checked, tmp_path)
    if any(joint.fault for joint in checked.joints):
        return
    path = tmp_path / "robot.urdf"
    path.write_bytes(of_bad("urdf", name))
    try:
        path.read_bytes().decode()  # Pinocchio ignores the encoding that a file declares
        pin.buildModelFromUrdf(str(path))
    except ValueError:  # which it refuses, as it does limits that are no numbers
        return
    same_as_others_read(checked, path)


@sampled("path", spread(ROBOTS, 9), ids=lambda path: path.stem)
def test_robots_of_example_robot_data_pass_unchanged(path: Path) -> None:
    checked = check_urdf(path, [SHARE])
    sound_urdf(checked, path)
    same_as_others_read(checked, path, yourdfpy=True)
    drawable = [visual for visual in checked.visuals if isinstance(visual.geometry, MeshFile)]
    assert all(Path(visual.geometry.path).is_relative_to(SHARE.resolve()) for visual in drawable)
    if "romeo_laas" not in path.name:  # its meshes are of another machine
        assert len(checked.visuals) == len(ElementTree.parse(path).findall("link/visual"))
        assert not any("not drawn" in warning for warning in checked.warnings)


def test_what_is_read_of_joints(tmp_path: Path) -> None:
    """Parents first, whatever the order in the file."""
    text = changed(goods("urdf")["joint"], '<origin xyz="1 2 3" rpy="0.1 0.2 0.3"/>'
                   '<axis xyz="0 3 4"/><limit lower="-0.5" upper="0.25" effort="9" velocity="9"/>'
                   '<mimic joint="wrist" multiplier="-2" offset="0.5"/>')  # fmt: skip
    text = text.replace("revolute", "prismatic", 1)
    head, *rows, end = text.splitlines()
    checked = saved(tmp_path, "\n".join([head, *reversed(rows), end]))
    elbow, wrist = checked.joints
    ends = elbow.name, elbow.kind, elbow.parent, elbow.child
    assert ends == ("elbow", "prismatic", "base", "arm")
    assert (elbow.xyz, elbow.rpy, elbow.axis) == ((1, 2, 3), (0.1, 0.2, 0.3), (0, 0.6, 0.8))
    assert (elbow.lower, elbow.upper, elbow.fault, elbow.line) == (-0.5, 0.25, None, 3)
    assert (elbow.max_velocity, wrist.mimic) == (9, None)
    mimic = elbow.mimic
    assert mimic is not None
    assert (mimic.joint, mimic.multiplier, mimic.offset) == ("wrist", -2, 0.5)
    assert (checked.name, checked.root, checked.leaves) == ("test", "base", ("hand",))
    assert checked.links == ("base", "arm", "hand")
    assert (checked.path_to("hand"), checked.path_to("base")) == ((elbow, wrist), ())
    with pytest.raises(UrdfError, match="no link 'claw'; its leaves are: hand"):
        checked.path_to("claw")
    with pytest.raises(UrdfError, match="larger than 8 MB"):
        parse_xml(b" " * (MAX_BYTES + 1), "expanded")
    for velocity in ('velocity="0"', 'velocity="-2"', 'velocity="fast"', ""):
        joint = f'lower="-0.5" upper="0.25" {velocity}'
        elbow = saved(tmp_path, changed(goods("urdf")["limit"], joint)).joints[0]
        assert (elbow.max_velocity, elbow.fault) == (None, None)


NAMED = '<robot name="mine"><link name="base"><collision><geometry><mesh filename="{}"/></geometry>\
</collision></link></robot>'
BODY = Path(__file__).with_name("good").joinpath("body.obj").read_text()


def package(folder: Path, name: str = "") -> Path:
    """A ROS package with a mesh; its package.xml may have a name."""
    for inner in ("urdf", "meshes"):
        (folder / inner).mkdir(parents=True)
    (folder / "meshes" / "a.obj").write_text(BODY)
    if name:
        (folder / "package.xml").write_text(
            f'<?xml version="1.0"?><package><!-- <name>no</name> --><name> {name} </name></package>'
        )
    return folder


def mesh_of(path: Path, name: str, *folders: Path) -> str:
    """The mesh that a URDF means by a name, or why there is none."""
    path.write_text(NAMED.format(name))
    try:
        found = check_urdf(path, folders).collisions
    except CoverableError as error:
        return str(error)
    return found.faults[0].why if found.faults else found.shapes[0].geometry.path


def test_meshes_are_found_and_none_from_outside(tmp_path: Path) -> None:
    arm = package(tmp_path / "ws" / "my_arm")
    space, urdf, found = arm.parent, arm / "urdf" / "a.urdf", str((arm / "meshes/a.obj").resolve())
    inside = ("package://my_arm/meshes/a.obj", "../meshes/a.obj")
    everywhere = (*inside, "package:///my_arm/meshes/a.obj", f"file://{found}", found)
    assert not {mesh_of(urdf, name) for name in inside} & {found}
    for folder in (space, arm):
        assert {mesh_of(urdf, name, folder) for name in everywhere} == {found}
    (arm / "package.xml").write_text("<package/>")
    assert {mesh_of(urdf, name) for name in inside} == {found}
    secret = tmp_path / "secret.obj"
    secret.write_text(BODY)
    (arm / "meshes" / "link.obj").symlink_to(secret)
    (arm / "meshes" / "away").symlink_to(tmp_path)
    os.mkfifo(arm / "meshes" / "pipe.obj")
    (arm / "meshes" / "folder.obj").mkdir()
    for name in (
        str(secret), f"file://{secret}", "../../../secret.obj", "../meshes/link.obj",
        "../meshes/away/secret.obj", "package://my_arm/meshes/link.obj",
        "package://my_arm/meshes/away/secret.obj", "package://my_arm/../../secret.obj",
        "package://../secret.obj",
    ):  # fmt: skip
        assert "lies outside the folders" in mesh_of(urdf, name, space)
    for name in ("../meshes/pipe.obj", "../meshes/folder.obj"):
        assert "is not a regular file" in mesh_of(urdf, name, space)
    assert "is not a folder" in mesh_of(urdf, found, tmp_path / "gone")


def test_packages_are_found_by_the_name_in_their_package_xml(tmp_path: Path) -> None:
    """In the own one, beside it, and below package_dirs; no name leads out of one."""
    name = "package://ur_description/meshes/a.obj"
    clone = package(tmp_path / "src" / "clone-main", "ur_description")
    found = str((clone / "meshes" / "a.obj").resolve())
    own = package(tmp_path / "src" / "cell", "cell")
    far = package(tmp_path / "other" / "cell", "cell")
    assert mesh_of(clone / "urdf" / "a.urdf", name) == found
    assert mesh_of(own / "urdf" / "a.urdf", name) == found
    assert mesh_of(tmp_path / "src" / "mine.urdf", name) == found
    said = mesh_of(far / "urdf" / "a.urdf", name)
    assert "is not found" in said
    assert "(packages seen: cell)" in said
    assert mesh_of(far / "urdf" / "a.urdf", name, tmp_path) == found
    away = package(tmp_path / "away" / "linked", "linked")
    (clone / "meshes" / "link.obj").symlink_to(away / "meshes" / "a.obj")
    (clone / "urdf" / "linked").symlink_to(away)
    urdf = clone / "urdf" / "a.urdf"
    assert "lies outside" in mesh_of(urdf, "package://ur_description/meshes/link.obj")
    assert "lies outside" in mesh_of(urdf, "package://linked/meshes/a.obj")


@pytest.mark.parametrize("text", [
    '<!DOCTYPE p [<!ENTITY n "ur_description">]><package><name>&n;</name></package>',
    "<package><name>ur_description</name>" + " " * 2**16 + "</package>",
    "<robot><name>ur_description</name></robot>",
    "<package><name>../ur_description</name></package>", "not XML",
], ids=["entity", "large", "other", "path", "text"])  # fmt: skip
def test_a_package_xml_that_is_none_names_nothing(text: str, tmp_path: Path) -> None:
    clone = package(tmp_path / "clone", "ur_description")
    (clone / "package.xml").write_text(text)
    said = mesh_of(clone / "urdf" / "a.urdf", "package://ur_description/meshes/a.obj")
    assert "is not found" in said


def test_an_srdf_gives_pairs_with_a_stated_reason_alone(tmp_path: Path) -> None:
    reasons = ("Adjacent", "Default", "Always", "User", "Never", "never", "", "Because")
    pair = '<disable_collisions link1="a" link2="b{}" reason="{}"/>'
    lines = [pair.format(k, reason) for k, reason in enumerate(reasons)]
    more = '<disable_collisions link1="c" link2="d"/><group name="g"><joint name="j"/></group>'
    path = tmp_path / "arm.srdf"
    path.write_text(f'<robot name="r">{"".join([*lines, more, lines[0]])}</robot>')
    pairs = read_srdf(path)
    assert pairs.taken == (("a", "b0"), ("a", "b1"), ("a", "b2"), ("a", "b3"))
    assert dict(pairs.ignored) == {"Never": 1, "never": 1, "": 2, "Because": 1}
    assert pairs.named == {"a", "c", "d", *(f"b{k}" for k in range(8))}
    path.write_text('<robot name="r"/>')
    empty = read_srdf(path)
    assert (empty.taken, empty.ignored, empty.named) == ((), (), frozenset())
