"""xacro files become the robots that they describe, and do nothing else."""

import os
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from coverable_errors import CoverableError
from feasibility.cases import load_case
from robots import RobotError, load_robot
from robots.shapes import link_shapes
from robots.urdf import UrdfError, check_urdf
from robots.urdf.expansion import child, expanded, xacro_files

HEAD = '<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">'
ARM = f"""<?xml version="1.0"?>
{HEAD}
  <xacro:arg name="reach" default="0.4"/>
  <xacro:arg name="prefix" default=""/>
  <xacro:arg name="capped" default="false"/>
  <xacro:include filename="$(find pkg)/macros/segment.xacro"/>
  <xacro:property name="limits" value="${{xacro.load_yaml('../config/limits.yaml')}}"/>
  <link name="$(arg prefix)l0"/>
  <xacro:segment i="1" length="$(arg reach)"/>
  <xacro:segment i="2" length="${{2 * $(arg reach)}}"/>
  <xacro:if value="$(arg capped)"><link name="cap"/>
    <joint name="c" type="fixed"><parent link="$(arg prefix)l2"/><child link="cap"/></joint>
  </xacro:if>
</robot>"""
SEGMENT = f"""{HEAD}<xacro:macro name="segment" params="i length">
  <link name="$(arg prefix)l${{i}}"><collision><geometry>
    <mesh filename="${{'$(find pkg)' if i == 1 else 'package://pkg'}}/meshes/body.obj"/>
  </geometry></collision></link>
  <joint name="$(arg prefix)j${{i}}" type="revolute">
    <parent link="$(arg prefix)l${{i - 1}}"/><child link="$(arg prefix)l${{i}}"/>
    <origin xyz="0 0 ${{length}}" rpy="0 ${{pi / 2}} 0"/><axis xyz="0 1 0"/>
    <limit lower="${{-radians(limits['turn'])}}" upper="${{radians(limits.turn)}}"
           effort="1" velocity="1"/>
  </joint></xacro:macro></robot>"""
BODY = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


@pytest.fixture
def arm(tmp_path):
    """A ROS package with an arm whose files lie in several of its folders."""
    files = {
        "urdf/arm.urdf.xacro": ARM,
        "macros/segment.xacro": SEGMENT,
        "config/limits.yaml": "turn: 90",
        "meshes/body.obj": BODY,
        "package.xml": "<package/>",
    }
    for name, text in files.items():
        path = tmp_path / "pkg" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return tmp_path / "pkg" / "urdf" / "arm.urdf.xacro"


def one_file(folder, inside):
    """A xacro file with something in it."""
    path = folder / "one.xacro"
    path.write_text(f"{HEAD}{inside}</robot>")
    return str(path)


def test_an_arm_is_read_with_its_includes_its_yaml_and_its_arguments(arm):
    args = {"reach": 0.5, "prefix": "a_", "capped": True}
    robot = load_robot(arm, xacro_args=args)
    assert (robot.name, robot.tool_frame) == ("arm", "cap")
    assert robot.joint_names == ("a_j1", "a_j2")
    np.testing.assert_allclose(robot.upper, np.radians([90, 90]), rtol=1e-15)
    lengths = [placement.translation[2] for placement in robot.model.jointPlacements.tolist()[1:]]
    assert lengths == [0.5, 1.0]
    assert load_robot(arm).tool_frame == "l2"
    again = pickle.loads(pickle.dumps(robot))
    # Read a second time: with other arguments the links would have other names.
    assert {solid.owner for solid in link_shapes(again).solids} == {"a_l1", "a_l2"}


def test_every_way_of_naming_a_mesh_leads_to_it(arm):
    shapes = check_urdf(arm).collisions
    assert not shapes.faults
    found = {shape.geometry.path for shape in shapes.shapes}
    assert found == {str((arm.parents[1] / "meshes" / "body.obj").resolve())}


def test_packages_are_found_in_package_dirs(arm, tmp_path):
    text = '<xacro:include filename="$(find pkg)/config/links.xacro"/>'
    (tmp_path / "pkg" / "config" / "links.xacro").write_text(f'{HEAD}<link name="l"/></robot>')
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    path = one_file(elsewhere, text)
    for folder in (tmp_path, tmp_path / "pkg"):
        assert check_urdf(path, [folder]).links == ("l",)
    with pytest.raises(UrdfError, match="package 'pkg', which is not found; add the folder above"):
        check_urdf(path)


def test_a_case_names_a_xacro_file_and_its_arguments(arm):
    case_file = arm.parent / "case.toml"
    case_file.write_text(
        '[robot]\nurdf = "arm.urdf.xacro"\nxacro_args = { reach = 1, prefix = "b_" }\n'
        'limits_deg = { b_j1 = [-10, 10] }\n[surface]\nkind = "plane"\nu = [0, 1]\nv = [0, 1]\n'
        "cells = [2, 2]\n[task]\nstandoff = 0.1\ncone_deg = 10\n"
    )
    case = load_case(case_file)
    robot = case.robot.build()
    assert robot.joint_names == ("b_j1", "b_j2")
    assert robot.model.jointPlacements[1].translation[2] == 1.0
    assert dict(robot.xacro_args) == {"reach": 1, "prefix": "b_"}
    assert type(case).from_toml(case.to_toml()) == case
    for args, words in (
        ("{ reach = [1] }", "robot.xacro_args.reach: must be a text, a number, true or false"),
        ("'prefix'", "robot.xacro_args: must be names and values"),
        (
            "{ raech = 1 }",
            "no argument 'raech' of xacro_args; its arguments: capped, prefix, reach",
        ),
    ):
        with pytest.raises(CoverableError) as caught:
            case.with_overrides([f"robot.xacro_args={args}"]).robot.build()
        assert words in str(caught.value)
    with pytest.raises(CoverableError, match=r"robot\.xacro_args: is for a \.xacro file"):
        case.with_overrides(["robot.urdf=arm.urdf"])


def test_arguments_of_what_is_no_xacro_file_are_refused():
    with pytest.raises(RobotError, match=r"is no \.xacro file, so it has no xacro_args"):
        load_robot("puma560", xacro_args={"a": 1})
    with pytest.raises(RobotError, match=r"xacro_args\.a must be a text, a number, true or false"):
        load_robot("puma560", xacro_args={"a": None})


def test_what_is_wrong_after_expansion_has_the_line_of_the_expanded_text(tmp_path):
    path = one_file(tmp_path, '<link name="a"/><joint name="j" type="revolute"/>')
    with pytest.raises(UrdfError, match=r"line 8: joint 'j'"):
        check_urdf(path)


def test_without_the_extra_it_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr(xacro_files, "folder_of", lambda package: None)
    with pytest.raises(UrdfError, match=r"arm\.urdf\.xacro: needs the extra: pip install 'cov"):
        check_urdf(Path(one_file(tmp_path, "")).rename(tmp_path / "arm.urdf.xacro"))
    with pytest.raises(UrdfError, match="there is no such file"):
        check_urdf(tmp_path / "gone.xacro")


MACRO = '<xacro:macro name="m" params="">{}</xacro:macro><xacro:m/>'
LAUGHS = "".join(
    f'<xacro:macro name="m{k}" params="">{f"<xacro:m{k - 1}/>" * 10}</xacro:macro>'
    for k in range(1, 10)
)
ESCAPED = r"""$(eval ${'open\x28"/etc/passwd"\x29.read\x28\x29'})"""
REFUSED = {
    "missing include": ('<xacro:include filename="gone.xacro"/>', "gone.xacro', which is not the"),
    "missing yaml": ("${xacro.load_yaml('gone.yaml')}", "gone.yaml', which is not there"),
    "absolute": ('<xacro:include filename="/etc/passwd"/>', "'/etc/passwd', which lies outside"),
    "optional": ('<xacro:include filename="/etc/passwd" optional="true"/>', "lies outside"),
    "climbing": ('<xacro:include filename="../../../x"/>', "outside the folders that files may"),
    "listing": ('<xacro:include filename="/etc/*.xacro"/>', "'/etc', which lies outside"),
    "yaml outside": ("${xacro.load_yaml('/etc/passwd')}", "add its folder to package_dirs"),
    "link": ('<xacro:include filename="link.xacro"/>', "link.xacro', which lies outside"),
    "pipe": ('<xacro:include filename="pipe.xacro"/>', "pipe.xacro', which is not a regular file"),
    "broken include": ('<xacro:include filename="bad.xacro"/>', "bad.xacro: line 1: broken XML"),
    "undefined": (MACRO.format('<link name="${foo * 2}"/>'), "macro 'm': name 'foo' is not def"),
    "undefined argument": ("$(arg x)", "$(arg x) has no value; give it in xacro_args"),
    "environment": ("$(env HOME)", "environment variable 'HOME', and none is read"),
    "open": (ESCAPED, "name 'open' is not defined"),
    "way out": ("${(lambda: ().__class__.__base__)()}", "'__base__' in an expression"),
    "class": ("${python.type('a', (), dict())}", "takes 1 positional argument"),
    "vars": ("${python.vars(str)}", "'vars' is not defined"),
    "unknown macro": ("<xacro:nope/>", "unknown macro name: xacro:nope"),
    "endless macro": (MACRO.format("<xacro:m/>"), "macro 'm': goes on without end"),
    "endless include": ('<xacro:include filename="one.xacro"/>', "goes on without end"),
    "endless property": ('<xacro:property name="a" value="${a}"/>${a}', "circular variable"),
    "laughs": (f'<xacro:macro name="m0" params=""/>{LAUGHS}<xacro:m9/>', "more than 1 s of proc"),
    "power": ("${9**9**9**9}", "more than 1 s of processor time"),
    "memory": ("${'a' * 10**11}", "needs too much memory"),
    "large": ("${'a' * 9 * 10**6}", "expands to more than 8,388,608 bytes"),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_what_a_file_may_not_do_is_one_sentence(tmp_path, kind):
    inside, words = REFUSED[kind]
    (tmp_path / "bad.xacro").write_text("<robot><link></robot>")
    (tmp_path / "link.xacro").symlink_to("/etc/passwd")
    os.mkfifo(tmp_path / "pipe.xacro")
    path = one_file(tmp_path, inside)
    with pytest.raises(UrdfError) as caught:
        expanded(path, caps=xacro_files.Caps(seconds=1))
    assert words in str(caught.value)
    assert str(caught.value).startswith(f"{path}: ")
    assert len(caught.value.faults) == 1
    assert "\n" not in str(caught.value)


def test_external_entities_are_not_read(tmp_path):
    (tmp_path / "secret").write_text("secret")
    path = tmp_path / "one.xacro"
    path.write_text(
        '<!DOCTYPE robot [<!ENTITY x SYSTEM "secret">]><robot name="r"><link name="a"/>&x;</robot>'
    )
    assert b"secret</" not in expanded(str(path)).text
    with pytest.raises(UrdfError, match="DOCTYPE"):
        check_urdf(path)


def test_the_environment_is_empty(tmp_path, monkeypatch):
    monkeypatch.setenv("SECRET", "secret")
    assert b'"none"' in expanded(one_file(tmp_path, '<link name="$(optenv SECRET none)"/>')).text


@pytest.mark.parametrize(
    "expression",
    [
        "().__class__",
        "[x.__class__ for x in [1]]",
        "(lambda: (lambda: 1).__globals__)()",
        "(x for x in [1]).gi_frame",
        "a.f_back",
        "a.f_globals",
        "type(1).mro()",
        "__import__('os')",
        "(lambda __x: __x)(1)",
    ],
)
def test_names_that_lead_out_of_an_expression_are_refused(expression):
    with pytest.raises(child.Refused, match="in an expression"):
        child.evaluate(expression, {})


def test_an_expression_has_no_built_in_names():
    assert child.evaluate(" max(a, 2) ** 2 ", {"max": max, "a": 3}) == 9
    for name in ("open", "exec", "getattr", "print"):
        with pytest.raises(NameError):
            child.evaluate(name, {})


def test_the_gate_holds_without_the_other_fences(tmp_path):
    """Python that is free to run still cannot do anything but read."""
    (tmp_path / "inside").write_text("inside")
    (tmp_path / "large").write_text("x" * 200)
    inside = str(tmp_path / "inside")
    attempts = [
        "open('/etc/passwd')",
        "os.open('/etc/passwd', os.O_RDONLY)",
        f"open({inside!r}, 'w')",
        f"open({inside!r}, 'r+')",
        f"open({inside + '2'!r}, 'x')",
        f"open({str(tmp_path / 'large')!r})",
        f"open({str(tmp_path) + '/../outside'!r})",
        f"open({str(tmp_path) + '-beside'!r})",
        "open(0)",
        "os.listdir('/')",
        "os.scandir(b'/')",
        "os.system('true')",
        "os.fork()",
        "os.kill(0, 0)",
        "os.execv('/bin/true', ['true'])",
        f"os.remove({inside!r})",
        f"os.rename({inside!r}, 'x')",
        f"os.mkdir({inside + 'd'!r})",
        "subprocess.Popen(['true'])",
        "socket.socket()",
        "__import__('wave')",
        "gc.get_objects()",
        "sys._getframe()",
        "(lambda: 1).__code__",
        "sys.addaudithook(print)",
    ]
    program = f"""
import gc, os, socket, subprocess, sys
sys.path.insert(0, {str(Path(child.__file__).parent)!r})
from child import Gate, Refused
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


def test_a_file_is_expanded_again_only_where_it_or_what_it_looked_at_has_changed(
    arm, tmp_path, monkeypatch
):
    runs = []
    run = xacro_files.run_apart
    monkeypatch.setattr(xacro_files, "run_apart", lambda *job: runs.append(job) or run(*job))
    optional = arm.parent / "more.xacro"
    include = '<xacro:include filename="more.xacro" optional="true"/></robot>'
    arm.write_text(ARM.replace("</robot>", include))
    first = expanded(str(arm))
    names = ("urdf/arm.urdf.xacro", "urdf/more.xacro", "config/limits.yaml", "macros/segment.xacro")
    assert set(first.files) == {str(arm.parents[1] / name) for name in names}
    assert expanded(str(arm)) is first
    assert len(runs) == 1
    optional.write_text(f'{HEAD}<link name="extra"/></robot>')
    assert b'"extra"' in expanded(str(arm)).text
    (arm.parents[1] / "config" / "limits.yaml").write_text("turn: 180")
    assert b"3.14159" in expanded(str(arm)).text
    assert len(runs) == 3
    expanded(str(arm), args={"reach": 1})
    assert len(runs) == 4
