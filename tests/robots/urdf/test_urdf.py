"""The URDF check: each bad file is one clear error, each accepted one the robot it describes."""

from __future__ import annotations

import os
import pickle
import re
import subprocess
import sys
from importlib.metadata import distribution
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
import pytest
from guards import GUARD_S
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from urdf_corpus import ACCEPTED, FAULTY, LIMIT, REFUSED, arm, drawn, joint, link, mesh, urdf
from urdf_texts import check_urdf_text

from robots.urdf import (
    Box,
    Capsule,
    CheckedUrdf,
    Cylinder,
    MeshFile,
    Sphere,
    UrdfError,
    check_urdf,
)

ROOT = Path(__file__).parents[3]
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


def saved(folder: Path, content: str | bytes) -> Path:
    path = folder / "robot.urdf"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def link_placements(model: pin.Model, values: dict[str, float]) -> dict[str, np.ndarray]:
    """(4, 4) of every link in the root frame, with each joint at its value by name."""
    q = pin.neutral(model)
    for name, entry in zip(list(model.names)[1:], list(model.joints)[1:], strict=True):
        value = values[name]
        q[entry.idx_q : entry.idx_q + entry.nq] = (
            [value] if entry.nq == 1 else [np.cos(value), np.sin(value)]
        )
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    return {
        frame.name: data.oMf[i].homogeneous
        for i, frame in enumerate(model.frames)
        if frame.type == pin.FrameType.BODY
    }


def expect_sound(checked: CheckedUrdf, original: pin.Model | None) -> None:
    """The text holds the robot that `checked` describes, and the one of the original file."""
    model = pin.buildModelFromXML(checked.text)
    moving = [info for info in checked.joints if info.moves]
    assert set(model.names) == {"universe", *(info.name for info in moving)}
    for info in moving:
        entry = model.joints[model.getJointId(info.name)]
        assert entry.nv == 1
        if entry.nq == 1 and info.lower is not None and info.upper is not None:
            assert model.lowerPositionLimit[entry.idx_q] == info.lower
            assert model.upperPositionLimit[entry.idx_q] == info.upper
        if info.fault is None:
            assert info.lower is not None
            assert info.upper is not None
            assert info.lower < info.upper
        assert np.isclose(np.linalg.norm(info.axis), 1.0, rtol=0, atol=1e-14)
    rng = np.random.default_rng(0)
    for _ in range(3):
        values = {info.name: rng.uniform(-3.0, 3.0) for info in moving}
        placements = link_placements(model, values)
        assert set(placements) == set(checked.links)
        for placement in placements.values():
            rotation = placement[:3, :3]
            assert np.abs(rotation.T @ rotation - np.eye(3)).max() < 1e-12
            assert np.linalg.det(rotation) > 0
        if original is not None:
            expected = link_placements(original, values)
            assert set(placements) == set(expected)
            scale = max(1.0, max(np.abs(matrix).max() for matrix in expected.values()))
            for name, matrix in expected.items():
                assert np.abs(placements[name] - matrix).max() < 1e-12 * scale, name


def native(path: Path) -> pin.Model | None:
    """What Pinocchio makes of the file itself; None when it refuses it or reads other names."""
    try:
        path.read_bytes().decode()  # Pinocchio ignores the encoding that a file declares
        return pin.buildModelFromUrdf(str(path))
    except ValueError:
        return None


@pytest.mark.parametrize("name", REFUSED)
def test_a_bad_file_is_one_clear_error(name: str, tmp_path: Path) -> None:
    content, fragments = REFUSED[name]
    path = saved(tmp_path, content)
    with pytest.raises(UrdfError) as caught:
        check_urdf(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert [fragment for fragment in fragments if fragment not in message] == []
    assert caught.value.source == str(path)
    assert caught.value.faults
    assert all(len(fault.fault) < 1000 and "\n" not in fault.fault for fault in caught.value.faults)
    if isinstance(content, str):
        with pytest.raises(UrdfError) as of_text:
            check_urdf_text(content)
        assert of_text.value.faults == caught.value.faults


@pytest.mark.parametrize("name", ACCEPTED)
def test_an_odd_file_gives_the_robot_it_describes(name: str, tmp_path: Path) -> None:
    content, fragments = ACCEPTED[name]
    path = saved(tmp_path, content)
    checked = check_urdf(path)
    assert [info.fault for info in checked.joints if info.fault] == []
    warnings = "\n".join(checked.warnings)
    assert [fragment for fragment in fragments if fragment not in warnings] == []
    assert bool(fragments) == bool(checked.warnings)
    assert all(len(warning) < 1000 for warning in checked.warnings)
    expect_sound(checked, native(path))
    assert check_urdf_text(checked.text).text == checked.text


@pytest.mark.parametrize("name", FAULTY)
def test_a_joint_that_cannot_be_used_says_why(name: str, tmp_path: Path) -> None:
    text, fragments = FAULTY[name]
    checked = check_urdf(saved(tmp_path, text))
    elbow = next(info for info in checked.joints if info.name == "elbow")
    assert elbow.fault is not None
    assert elbow.fault.startswith("line 5: joint 'elbow' ")
    assert [fragment for fragment in fragments if fragment not in elbow.fault] == []
    assert "mimic" in name or (elbow.lower, elbow.upper) == (None, None)
    expect_sound(checked, None)
    model = pin.buildModelFromXML(checked.text)
    assert (model.upperPositionLimit - model.lowerPositionLimit > 1.0).all()


@pytest.mark.parametrize("path", ROBOTS, ids=lambda path: path.stem)
def test_every_robot_of_example_robot_data_passes_unchanged(path: Path) -> None:
    checked = check_urdf(path, [SHARE])
    original = native(path)
    assert original is not None
    expect_sound(checked, original)
    drawable = [visual for visual in checked.visuals if isinstance(visual.geometry, MeshFile)]
    assert all(Path(visual.geometry.path).is_relative_to(SHARE.resolve()) for visual in drawable)
    if "romeo_laas" not in path.name:  # its meshes are of another machine
        assert len(checked.visuals) == len(ElementTree.parse(path).findall("link/visual"))
        assert not any("not drawn" in warning for warning in checked.warnings)


def test_all_faults_of_a_file_are_reported_together() -> None:
    text = urdf(
        link("base"),
        link("arm"),
        link("arm"),
        joint('<origin xyz="nan 0 0"/><axis xyz="0 0 0"/>' + LIMIT),
        joint(name="wrist", kind="planar", child="nowhere"),
    )
    with pytest.raises(UrdfError) as caught:
        check_urdf_text(text, name="many.urdf")
    faults = caught.value.faults
    assert len(faults) == 4
    assert [fault.place for fault in faults] == ["line 4", "line 5", "line 5", "line 6"]
    assert str(caught.value).startswith("many.urdf: 4 faults:\n")
    again = pickle.loads(pickle.dumps(caught.value))
    assert (again.source, again.faults, str(again)) == ("many.urdf", faults, str(caught.value))


def test_a_thousand_faults_make_a_message_of_one_screen() -> None:
    bad = [joint('<axis xyz="0 0 0"/>', name=f"j{i}") for i in range(900)]
    with pytest.raises(UrdfError, match="and 880 more") as caught:
        check_urdf_text(urdf(link("base"), link("arm"), *bad))
    assert len(caught.value.faults) == 900
    assert str(caught.value).count("\n") == 21


def test_files_that_are_no_files(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.urdf")
    with (tmp_path / "huge.urdf").open("wb") as stream:
        stream.truncate(200_000_000)
    (tmp_path / "dangling.urdf").symlink_to(tmp_path / "gone")
    (tmp_path / "loop.urdf").symlink_to(tmp_path / "loop.urdf")
    cases = {
        tmp_path: "folder",
        tmp_path / "pipe.urdf": "pipe",
        Path("/dev/zero"): "device",
        tmp_path / "huge.urdf": "larger than 8 MB",
        tmp_path / "missing.urdf": "no such file",
        tmp_path / "dangling.urdf": "no such file",
        tmp_path / "loop.urdf": "cannot be opened",
        tmp_path / ("x" * 5000): "cannot be opened",
        tmp_path / "missing.urdf" / "below": "no such file",
    }
    for path, fragment in cases.items():
        with pytest.raises(UrdfError, match=fragment):
            check_urdf(path)
    with pytest.raises(UrdfError, match=r"cannot be opened: .*null"):
        check_urdf("a\0b")


def test_a_file_without_permission(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = saved(tmp_path, arm())

    def refuse(*_: object) -> int:
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr(os, "open", refuse)  # the superuser may read anything
    with pytest.raises(UrdfError, match="cannot be opened: permission denied"):
        check_urdf(path)


def test_what_is_read_of_a_joint() -> None:
    text = arm(
        '<origin xyz="1 2 3" rpy="0.1 0.2 0.3"/><axis xyz="0 3 4"/>'
        '<limit lower="-0.5" upper="0.25" effort="9" velocity="9"/>'
        '<mimic joint="wrist" multiplier="-2" offset="0.5"/>',
        kind="prismatic",
    )
    checked = check_urdf_text(text)
    elbow, wrist = checked.joints
    assert (elbow.name, elbow.kind, elbow.parent, elbow.child) == (
        "elbow", "prismatic", "base", "arm",
    )  # fmt: skip
    assert (elbow.xyz, elbow.rpy, elbow.axis) == ((1, 2, 3), (0.1, 0.2, 0.3), (0, 0.6, 0.8))
    assert (elbow.lower, elbow.upper, elbow.fault, elbow.line) == (-0.5, 0.25, None, 5)
    assert elbow.max_velocity == 9
    assert elbow.mimic is not None
    assert (elbow.mimic.joint, elbow.mimic.multiplier, elbow.mimic.offset) == ("wrist", -2, 0.5)
    assert wrist.mimic is None
    assert (checked.name, checked.root, checked.links, checked.leaves) == (
        "test", "base", ("base", "arm", "hand"), ("hand",),
    )  # fmt: skip
    assert checked.path_to("hand") == (elbow, wrist)
    assert checked.path_to("base") == ()
    with pytest.raises(UrdfError, match="no link 'claw'; its leaves are: hand"):
        checked.path_to("claw")


@pytest.mark.parametrize("text", ['velocity="0"', 'velocity="-2"', 'velocity="fast"', ""])
def test_a_velocity_limit_that_makes_no_sense_counts_as_missing(text: str) -> None:
    limit = f'<limit lower="-0.5" upper="0.25" {text}/>'
    elbow = check_urdf_text(arm(limit)).joints[0]
    assert (elbow.max_velocity, elbow.fault) == (None, None)


def test_joints_come_parents_first_whatever_the_order_in_the_file() -> None:
    names = ["base", "a", "b", "c", "d"]
    joints = [joint(name=f"j{i}", parent=names[i], child=names[i + 1]) for i in range(4)]
    checked = check_urdf_text(urdf(*map(link, reversed(names)), *reversed(joints)))
    assert checked.links == tuple(names)
    assert [info.name for info in checked.joints] == ["j0", "j1", "j2", "j3"]


def test_nothing_else_of_the_file_reaches_the_native_parser() -> None:
    secret = "sentinel"
    text = urdf(
        link("base", f'<visual><geometry><mesh filename="{secret}.stl"/></geometry></visual>'),
        link("arm", f'<collision name="{secret}"/><inertial name="{secret}"/>'),
        joint(LIMIT + f'<dynamics damping="{secret}"/>'),
        f'<gazebo plugin="{secret}"/><!-- {secret} -->{secret}',
    )
    assert secret not in check_urdf_text(text).text


def test_shapes_for_the_viewer() -> None:
    shapes = {
        '<box size="1 2 3"/>': Box((1, 2, 3)),
        '<cylinder radius="0.5" length="2"/>': Cylinder(0.5, 2),
        '<capsule radius="0.5" length="2"/>': Capsule(0.5, 2),
        '<sphere radius="0.25"/>': Sphere(0.25),
    }
    for xml, expected in shapes.items():
        text = drawn(
            f'<origin xyz="1 2 3" rpy="0.4 -0.5 0.6"/><geometry>{xml}</geometry>'
            '<material name="m"><color rgba="0.1 0.2 0.3 2"/></material>'
        )
        (visual,) = check_urdf_text(text).visuals
        assert (visual.link, visual.geometry) == ("base", expected)
        assert visual.rgba == (0.1, 0.2, 0.3, 1.0)
        placement = pin.SE3(pin.rpy.rpyToMatrix(0.4, -0.5, 0.6), np.array([1.0, 2.0, 3.0]))
        assert np.abs(visual.origin - placement.homogeneous).max() < 1e-15
        assert not visual.origin.flags.writeable


def test_colours_by_name() -> None:
    ball = '<geometry><sphere radius="1"/></geometry><material name="{}"/>'
    text = urdf(
        '<material name="red"><color rgba="1 0 0 1"/></material>',
        link("base", f"<visual>{ball.format('red')}</visual>"),
        link("arm", f"<visual>{ball.format('blue')}</visual>"),
        joint(),
    )
    assert [visual.rgba for visual in check_urdf_text(text).visuals] == [(1, 0, 0, 1), None]


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A ROS package with a URDF folder, a mesh, and a secret beside it."""
    root = tmp_path / "ws" / "my_arm"
    for folder in ("urdf", "meshes"):
        (root / folder).mkdir(parents=True)
    (root / "meshes" / "a.stl").write_bytes(b"solid a")
    (tmp_path / "secret.stl").write_bytes(b"solid secret")
    return root


def only_mesh(package: Path, name: str, package_dirs: tuple[Path, ...] = ()) -> str | None:
    path = package / "urdf" / "robot.urdf"
    path.write_text(mesh(name))
    checked = check_urdf(path, package_dirs)
    assert len(checked.visuals) + len(checked.warnings) == 1
    if not checked.visuals:
        return None
    geometry = checked.visuals[0].geometry
    assert isinstance(geometry, MeshFile)
    return geometry.path


def test_meshes_are_found(package: Path) -> None:
    found = str((package / "meshes" / "a.stl").resolve())
    space = package.parent
    assert only_mesh(package, "package://my_arm/meshes/a.stl") is None
    assert only_mesh(package, "package://my_arm/meshes/a.stl", (space,)) == found
    assert only_mesh(package, "package:///my_arm/meshes/a.stl", (space,)) == found
    assert only_mesh(package, "package://my_arm/meshes/a.stl", (package,)) == found
    assert only_mesh(package, "../meshes/a.stl") is None
    assert only_mesh(package, "../meshes/a.stl", (package,)) == found
    assert only_mesh(package, f"file://{found}", (space,)) == found
    assert only_mesh(package, found, (space,)) == found
    (package / "package.xml").write_text("<package/>")
    assert only_mesh(package, "package://my_arm/meshes/a.stl") == found
    assert only_mesh(package, "../meshes/a.stl") == found


def test_no_mesh_comes_from_outside(package: Path) -> None:
    space = package.parent
    secret = space.parent / "secret.stl"
    (package / "meshes" / "link.stl").symlink_to(secret)
    (package / "meshes" / "away").symlink_to(space.parent)
    os.mkfifo(package / "meshes" / "pipe.stl")
    (package / "meshes" / "folder.stl").mkdir()
    names = [
        str(secret), f"file://{secret}", "../../../secret.stl", "../meshes/link.stl",
        "../meshes/away/secret.stl", "package://my_arm/meshes/link.stl",
        "package://my_arm/meshes/away/secret.stl", "../meshes/pipe.stl", "../meshes/folder.stl",
    ]  # fmt: skip
    for name in names:
        assert only_mesh(package, name, (space,)) is None, name
    for name in (
        "package://my_arm/../../secret.stl",
        "package://../secret.stl",
        "model://../a.stl",
    ):
        with pytest.raises(UrdfError, match="climbs out of its package"):
            only_mesh(package, name, (space,))


def test_package_dirs_must_be_folders(tmp_path: Path) -> None:
    with pytest.raises(UrdfError, match=r"package_dirs: .*gone' is not a folder"):
        check_urdf(saved(tmp_path, arm()), [tmp_path / "gone"])


def test_the_whole_corpus_in_a_process_of_its_own() -> None:
    """No crash, no hang, no bomb: memory and time are capped by the system."""
    script = """
import resource, sys
resource.setrlimit(resource.RLIMIT_CPU, (60, 60))
resource.setrlimit(resource.RLIMIT_AS, (2 * 2**30, 2 * 2**30))
from urdf_corpus import ACCEPTED, FAULTY, REFUSED
from robots.urdf.xml import UrdfError, parse_xml
from robots.urdf import check_urdf
import tempfile, os
counts = {"refused": 0, "accepted": 0}
with tempfile.TemporaryDirectory() as folder:
    for group in (REFUSED, ACCEPTED, FAULTY):
        for content, _ in group.values():
            path = os.path.join(folder, "r.urdf")
            with open(path, "wb") as stream:
                stream.write(content.encode() if isinstance(content, str) else content)
            try:
                check_urdf(path)
                counts["accepted"] += 1
            except UrdfError:
                counts["refused"] += 1
assert "pinocchio" not in sys.modules
print(counts["refused"], counts["accepted"])
"""
    paths = os.pathsep.join([str(ROOT), str(Path(__file__).parent)])
    done = subprocess.run(
        [sys.executable, "-c", script],
        env={**os.environ, "PYTHONPATH": paths},
        capture_output=True,
        text=True,
        timeout=GUARD_S,
        check=False,
    )
    assert done.stderr == ""
    assert done.returncode == 0
    assert done.stdout.split() == [str(len(REFUSED)), str(len(ACCEPTED) + len(FAULTY))]


SEEDS = [
    (ROOT / "robots/puma560/puma560.urdf").read_bytes(),
    (SHARE / "example-robot-data/robots/ur_description/urdf/ur5_robot.urdf").read_bytes(),
]
TOKENS = [
    b"nan", b"0 0 0", b"0 0 2", b"1e308", b"-1e16", b"inf", b"0", b"-3.5", b"1 2", b"1,5", b"&lt;",
    b"&x;", b"\xff", b"", b" ", b"9" * 400, b"fixed", b"revolute", b"continuous", b"prismatic",
    b"floating", b"base_link", b"universe", b"a&#10;b", b"package://../../x.stl", b"${x}",
]  # fmt: skip
PIECES = [
    b"<origin/>", b"<axis/>", b"<limit/>", b'<axis xyz="1 1 1"/>', b'<origin rpy="1 1 1"/>',
    b'<mimic joint="x"/>', b"<!DOCTYPE a>", b"<", b">", b'"', b"&", b"/>", b"]]>", b"\0", b"-->",
    b"<!--", b"</joint>", b"</robot>",
]  # fmt: skip


@st.composite
def mutated(draw: st.DrawFn) -> bytes:
    """A sound URDF with some values, lines or bytes changed."""
    data = draw(st.sampled_from(SEEDS))
    for _ in range(draw(st.integers(1, 3))):
        what = draw(st.sampled_from(["value", "value", "value", "line", "bytes"]))
        if what == "value":
            spans = [found.span(1) for found in re.finditer(rb'="([^"]*)"', data)]
            values = [data[start:end] for start, end in spans]
            if not spans:
                continue
            start, end = draw(st.sampled_from(spans))
            piece = draw(st.one_of(st.sampled_from(TOKENS), st.sampled_from(values)))
        elif what == "line":
            lines = [found.span() for found in re.finditer(rb"[^\n]+\n", data)]
            if not lines:
                continue
            start, end = draw(st.sampled_from(lines))
            other = draw(st.sampled_from(lines))
            piece = draw(st.sampled_from([b"", data[start:end] * 2, data[slice(*other)]]))
        else:
            start = draw(st.integers(0, len(data)))
            end = min(len(data), start + draw(st.integers(0, 50)))
            piece = draw(st.one_of(st.sampled_from(PIECES), st.binary(max_size=3)))
        data = data[:start] + piece + data[end:]
    return data


@settings(
    max_examples=150,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
@given(data=mutated())
def test_mutations_are_refused_or_sound(data: bytes, tmp_path: Path) -> None:
    path = saved(tmp_path, data)
    try:
        checked = check_urdf(path)
    except UrdfError:
        return
    expect_sound(checked, native(path))
