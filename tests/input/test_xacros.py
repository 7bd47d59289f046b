"""xacro files become the robots that they describe, and do nothing else."""

import os
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from coverable import RobotError, load_case, load_robot
from coverable.errors import CoverableError
from robots.shapes.links import link_shapes
from robots.urdf import xacro_child, xacro_files
from robots.urdf.checked_urdf import check_urdf
from robots.urdf.elements import UrdfError
from robots.urdf.srdf import read_srdf
from robots.urdf.xacro_files import expanded

GOOD = Path(__file__).with_name("good")
HEAD = '<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">'
PACKAGE = {
    "urdf/arm.urdf.xacro": "arm.urdf.xacro", "urdf/case.toml": "xacro.toml",
    "macros/segment.xacro": "segment.xacro", "meshes/body.obj": "body.obj",
}  # fmt: skip


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    """A ROS package in a folder of another name, with an arm whose files lie in several."""
    for inner in ("urdf", "macros", "meshes", "config"):
        (tmp_path / "clone-main" / inner).mkdir(parents=True)
    for name, file in PACKAGE.items():
        (tmp_path / "clone-main" / name).write_text((GOOD / file).read_text())
    (tmp_path / "clone-main" / "config" / "limits.yaml").write_text("turn: 90")
    (tmp_path / "clone-main" / "package.xml").write_text("<package><name>pkg</name></package>")
    return tmp_path / "clone-main" / "urdf" / "arm.urdf.xacro"


def one_file(folder: Path, inside: str, name: str = "one.xacro") -> str:
    (folder / name).write_text(f"{HEAD}{inside}</robot>")
    return str(folder / name)


def test_an_arm_is_read_with_its_includes_its_yaml_and_its_arguments(arm: Path) -> None:
    robot = load_robot(arm, xacro_args={"reach": 0.5, "prefix": "a_", "capped": True})
    assert (robot.name, robot.tool_frame) == ("arm", "cap")
    assert robot.joint_names == ("a_j1", "a_j2")
    np.testing.assert_allclose(robot.upper, np.radians([90, 90]), rtol=1e-15)
    lengths = [placement.translation[2] for placement in robot.model.jointPlacements.tolist()[1:]]
    assert lengths == [0.5, 1.0]
    assert load_robot(arm).tool_frame == "l2"
    # Read a second time: with other arguments the links would have other names.
    again = pickle.loads(pickle.dumps(robot))
    assert {solid.owner for solid in link_shapes(again).solids} == {"a_l1", "a_l2"}
    # Either way of naming a mesh leads to it.
    shapes = check_urdf(arm).collisions
    found = {shape.geometry.path for shape in shapes.shapes}
    assert not shapes.faults
    assert found == {str((arm.parents[1] / "meshes" / "body.obj").resolve())}


def test_packages_are_found_in_package_dirs(arm: Path, tmp_path: Path) -> None:
    (arm.parents[1] / "config" / "links.xacro").write_text(f'{HEAD}<link name="l"/></robot>')
    (elsewhere := tmp_path / "else" / "where").mkdir(parents=True)
    path = one_file(elsewhere, '<xacro:include filename="$(find pkg)/config/links.xacro"/>')
    for folder in (tmp_path, arm.parents[1]):
        assert check_urdf(path, [folder]).links == ("l",)
    with pytest.raises(UrdfError, match="package 'pkg', which is not found; add the folder above"):
        check_urdf(path)


def test_a_case_names_a_xacro_file_and_its_arguments(arm: Path) -> None:
    case = load_case(arm.parent / "case.toml")
    robot = case.robot.build()
    assert robot.joint_names == ("b_j1", "b_j2")
    assert robot.model.jointPlacements[1].translation[2] == 1.0
    assert dict(robot.xacro_args) == {"reach": 1, "prefix": "b_"}
    assert type(case).from_toml(case.to_toml()) == case
    for setting, words in (
        ("robot.xacro_args={ reach = [1] }", "xacro_args.reach: must be a text, a number, true or"),
        ("robot.xacro_args='prefix'", "robot.xacro_args: must be names and values"),
        ("robot.xacro_args={ raech = 1 }", "no argument 'raech' of xacro_args; its arguments: cap"),
        ("robot.urdf=arm.urdf", "robot.xacro_args: is for a .xacro file"),
    ):
        with pytest.raises(CoverableError) as caught:
            case.with_overrides([setting]).robot.build()
        assert words in str(caught.value)
    with pytest.raises(RobotError, match=r"is no \.xacro file, so it has no xacro_args"):
        load_robot("puma560", xacro_args={"a": 1})


def test_an_srdf_is_expanded_too(tmp_path: Path) -> None:
    inside = (
        '<xacro:macro name="pair" params="k">'
        '<disable_collisions link1="a" link2="b${k}" reason="Adjacent"/></xacro:macro>'
        '<xacro:pair k="1"/><xacro:pair k="2"/>'
    )
    pairs = read_srdf(one_file(tmp_path, inside, "arm.srdf.xacro"))
    assert pairs.taken == (("a", "b1"), ("a", "b2"))


def test_without_the_extra_it_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(xacro_files, "folder_of", lambda package: None)
    with pytest.raises(UrdfError, match=r"one\.xacro: needs the extra: pip install 'cov"):
        check_urdf(one_file(tmp_path, ""))
    with pytest.raises(UrdfError, match="there is no such file"):
        check_urdf(tmp_path / "gone.xacro")


def test_external_entities_and_the_environment_are_not_read(tmp_path, monkeypatch):
    (tmp_path / "secret").write_text("secret")
    path = tmp_path / "one.xacro"
    path.write_text(
        '<!DOCTYPE robot [<!ENTITY x SYSTEM "secret">]><robot name="r"><link name="a"/>&x;</robot>'
    )
    assert b"secret</" not in expanded(str(path)).text
    with pytest.raises(UrdfError, match="DOCTYPE"):
        check_urdf(path)
    monkeypatch.setenv("SECRET", "secret")
    assert b'"none"' in expanded(one_file(tmp_path, '<link name="$(optenv SECRET none)"/>')).text


ESCAPES = (
    "[x.__class__ for x in [1]]", "(lambda: (lambda: 1).__globals__)()", "(lambda __x: __x)(1)",
    "a.f_back", "(x for x in [1]).gi_frame", "(lambda: 1).f_globals", "str.mro()",
    "__import__('os')", "a.cr_code", "a.ag_frame", "a.f_locals", "a.f_builtins", "a.f_code",
)  # fmt: skip


def test_an_expression_has_no_built_in_names_and_no_way_to_them() -> None:
    assert xacro_child.evaluate(" max(a, 2) ** 2 ", {"max": max, "a": 3}) == 9
    for name in ("open", "exec", "getattr", "print"):
        with pytest.raises(NameError):
            xacro_child.evaluate(name, {})
    for expression in ESCAPES:
        with pytest.raises(xacro_child.Refused):
            xacro_child.evaluate(expression, {"a": 1, "str": str})


def test_the_gate_holds_without_the_other_fences(tmp_path: Path) -> None:
    """Python that is free to run still cannot do anything but read."""
    (tmp_path / "inside").write_text("inside")
    (tmp_path / "large").write_text("x" * 200)
    inside = str(tmp_path / "inside")
    attempts = [
        "open('/etc/passwd')", "os.open('/etc/passwd', os.O_RDONLY)", f"open({inside!r}, 'w')",
        f"open({inside!r}, 'r+')", f"open({inside + '2'!r}, 'x')",
        f"open({str(tmp_path / 'large')!r})", f"open({str(tmp_path) + '/../outside'!r})",
        f"open({str(tmp_path) + '-beside'!r})", "open(0)", "os.listdir('/')", "os.scandir(b'/')",
        "os.system('true')", "os.fork()", "os.kill(0, 0)", "os.execv('/bin/true', ['true'])",
        f"os.remove({inside!r})", f"os.rename({inside!r}, 'x')", f"os.mkdir({inside + 'd'!r})",
        "subprocess.Popen(['true'])", "socket.socket()", "__import__('wave')", "gc.get_objects()",
        "sys._getframe()", "(lambda: 1).__code__", "sys.addaudithook(print)",
    ]  # fmt: skip
    program = f"""
import gc, os, socket, subprocess, sys
sys.path.insert(0, {str(Path(xacro_child.__file__).parent)!r})
from xacro_child import Gate, Refused
sys.addaudithook(Gate([{os.path.join(os.path.realpath(tmp_path), "")!r}], 100))
for attempt in {attempts!r}:
    try:
        eval(attempt)
    except Refused:
        continue
    print(attempt)
print(open({inside!r}).read())
sys.stdout.flush()
os._exit(0)
"""
    done = subprocess.run([sys.executable, "-S", "-c", program], capture_output=True, check=False)
    assert (done.stdout.decode(), done.stderr.decode()) == ("inside\n", "")
    assert sorted(os.listdir(tmp_path)) == ["inside", "large"]


def test_a_file_is_expanded_again_only_where_it_or_what_it_looked_at_has_changed(arm: Path) -> None:
    include = '<xacro:include filename="more.xacro" optional="true"/></robot>'
    arm.write_text(arm.read_text().replace("</robot>", include))
    first = expanded(str(arm))
    names = ("urdf/arm.urdf.xacro", "urdf/more.xacro", "config/limits.yaml", "macros/segment.xacro")
    assert set(first.files) == {str(arm.parents[1] / name) for name in names}
    assert expanded(str(arm)) is first
    one_file(arm.parent, '<link name="extra"/>', "more.xacro")
    assert b'"extra"' in expanded(str(arm)).text
    (arm.parents[1] / "config" / "limits.yaml").write_text("turn: 180")
    assert b"3.14159" in expanded(str(arm)).text
