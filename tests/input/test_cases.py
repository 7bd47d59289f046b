"""Cases: the built-in ones, what settings change, paths, faults together, caps, units, words."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bad_input import GOOD_CASE, changed, goods, lay_out

from coverable import Case, CaseError, Search, Task, load_case
from feasibility.cases.robot_table import RobotPart

GOOD = Path(__file__).with_name("good")


def test_settings_replace_add_and_remove_keys_and_tables() -> None:
    case = load_case("paper/4a")
    settings = ["task.cone_deg=10", "surface.position=[0, 0.5, 0]", "robot.limits=set-2"]
    moved = case.with_overrides([*settings, "search.seed=7"])
    assert moved == replace(
        case,
        robot=replace(case.robot, limits="set-2"),
        surface=replace(case.surface, position=(0.0, 0.5, 0.0)),
        task=Task(0.005, 10.0),
        search=Search(seed=7),
    )
    free = case.with_overrides(["robot.limits=", "robot.limits_deg.joint4=[-90, 90]"])
    assert free.robot == RobotPart(name="puma560", limits_deg={"joint4": (-90.0, 90.0)})
    assert case == load_case("paper/4a")  # unchanged
    both = Case.from_toml(GOOD_CASE, overrides=["collision.clearance=0.01", "search.seed=3"])
    assert both.with_overrides(["collision=", "search="]) == Case.from_toml(GOOD_CASE)
    assert Case.from_toml(GOOD_CASE, overrides=["collision.clearance="]).collision is None
    # What has changed is said beside the built-in words, which speak of the cone before.
    assert moved.description.endswith(f"cone 45 deg; changed: {', '.join(settings)}, search.seed=7")


def test_a_setting_can_complete_a_file_with_windows_line_ends(tmp_path: Path) -> None:
    text = changed(GOOD_CASE, "task.cone_deg").replace("\n", "\r\n")
    (tmp_path / "case.toml").write_bytes(b"\xef\xbb\xbf" + text.encode())
    case = load_case(tmp_path / "case.toml", ["task.cone_deg=45"])
    assert case == Case.from_toml(GOOD_CASE) == Case.from_toml(case.as_written())
    with pytest.raises(CaseError, match=r'did you mean "paper/4a"\?'):
        load_case("paper/4A")


def test_paths_are_relative_to_the_case_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    text = changed(goods("case")["mesh"], ["robot.name", "robot.limits", 'robot.urdf = "arm.urdf"'])
    text = changed(text, 'robot.package_dirs = ["meshes"]') + '[collision]\nsrdf = "a.srdf"\n'
    text += '[[collision.scene]]\nname = "a"\nkind = "mesh"\nfile = "b.stl"\n'
    (tmp_path / "case.toml").write_text(text)
    (elsewhere := tmp_path / "elsewhere").mkdir()
    case = load_case(tmp_path / "case.toml")  # and no file is opened
    monkeypatch.chdir(elsewhere)
    monkeypatch.setenv("HOME", str(elsewhere))
    assert Case.from_toml(case.to_toml()) == case
    for moved, folder in (
        (case, tmp_path),
        (Case.from_toml(text, "~"), elsewhere),
        (Case.from_toml(text), elsewhere),
    ):
        assert case.collision
        if moved is not case and folder == elsewhere:
            moved = Case.from_toml(text.replace('= "part', '= "~/part'), elsewhere)
        assert moved.surface.values["file"] == str(folder / "part.stl")
        assert moved.robot.urdf == str(folder / "arm.urdf")
        assert moved.robot.package_dirs == (str(folder / "meshes"),)
        assert moved.collision is not None
        assert moved.collision.srdf == str(folder / "a.srdf")
        assert moved.collision.scene[0]["file"] == str(folder / "b.stl")
    other = case.with_overrides(["surface.file=other.stl", "robot.urdf=x.urdf"])
    assert other.surface.values["file"] == str(elsewhere / "other.stl")
    assert other.robot.urdf == str(elsewhere / "x.urdf")


def test_limits_frames_and_axes_come_through(tmp_path: Path) -> None:
    """By name and in their own units, and where each of them ends in the robot that is built."""
    four = load_case("paper/4a", ["robot.limits=", "robot.limits_deg={ joint4 = [-90, 45] }"])
    plain = load_case("paper/4a", ["robot.limits="]).build().robot
    degrees = np.degrees(np.column_stack([plain.lower, plain.upper]))
    degrees[3] = [-90, 45]
    robot = four.build().robot
    found = np.degrees(np.column_stack([robot.lower, robot.upper]))
    assert found == pytest.approx(degrees, abs=1e-12)
    lay_out(tmp_path)
    changes = ["robot.limits_deg = { turn = [-90, 450] }", "robot.limits_m = { slide = [0, 0.5] }"]
    slider = Case.from_toml(changed(goods("case")["slider"], changes), tmp_path).build().robot
    assert slider.lower.tolist() == pytest.approx([0.0, -math.pi / 2])
    assert slider.upper.tolist() == pytest.approx([0.5, 2.5 * math.pi])
    mounted = Case.from_toml(goods("case")["mounted"])
    assert Case.from_toml(mounted.to_toml()) == mounted
    robot = mounted.build().robot
    assert robot.joint_names[:2] == ("table", "rail")
    assert robot.surface_link == "table"
    np.testing.assert_allclose(robot.upper[:2], [np.pi / 2, 0.5])
    wrist = mounted.with_overrides(["surface.frame=forearm_link"]).build().robot
    assert wrist.joint_names == ("wrist_1_joint", "wrist_2_joint", "wrist_3_joint")
    short = mounted.with_overrides(["robot.limits_m={ rail = [0, 0.1] }"])
    assert short.build().robot.upper[1] == 0.1
    posed = load_case("paper/4a", [
        "robot.limits=", "robot.name=ur5", "robot.reference_axis=[0, 1, 1]",
        "robot.tcp={ position = [0, 0, 0.12], rpy_deg = [0, 90, 0] }",
        "robot.base={ position = [0, 0, 0.8], rpy_deg = [0, 0, 90] }",
    ]).build().robot  # fmt: skip
    tcp, base = [[0, 0, 1, 0], [0, 1, 0, 0], [-1, 0, 0, 0.12]], [[0, -1, 0, 0], [1, 0, 0, 0]]
    np.testing.assert_allclose(posed.tcp[:3], tcp, atol=1e-12)
    np.testing.assert_allclose(posed.base[:3], [*base, [0, 0, 1, 0.8]], atol=1e-12)
    np.testing.assert_allclose(posed.reference_axis, [0, 1, 0])


@pytest.mark.parametrize("text", [
    f"x = {'[' * 20_000}", "x = " + "{a = " * 20_000, f"{'a.' * 60_000}a = 1", f"[{'a.' * 100}a]",
    f"x = {'[' * 100}{']' * 100}",
])  # fmt: skip
def test_a_document_that_is_nested_too_deeply_is_refused(text: str) -> None:
    """So deep that Python would not get through it; rtoml's own error cannot be pickled."""
    with pytest.raises(CaseError, match="is nested too deeply") as caught:
        Case.from_toml(text)
    behind = caught.value.__cause__
    assert behind is not None
    assert behind.__cause__ is behind.__context__ is None


FILE = (GOOD / "commented.toml").read_text()
CHANGES = {
    (): [],
    ("task.cone_deg=25.5",): [("cone_deg = 30 ", "cone_deg = 25.5 ")],
    ("surface.rpy_deg=[0, 0, 5]",): [("cells = 6\n", "cells = 6\nrpy_deg = [0.0, 0.0, 5.0]\n")],
    ("robot.limits_deg.a=[-1, 1]", "task.standoff=0.1"): [
        ("one\n", "one\nlimits_deg.a = [-1.0, 1.0]\n"), ("= 0.02", "= 0.1"),
    ],
    ("surface.cells=", "surface.cell_size=0.1"): [("cells = 6", "cell_size = 0.1")],
    ("robot.base.rpy_deg=[0, 0, 9]",): [("0.1] }", "0.1], rpy_deg = [0.0, 0.0, 9.0] }")],
    ("surface.file=../other.stl",): [('"part #1.stl"', '"../other.stl"')],
    ("search.seed=4",): [("shelf.stl\"\n", "shelf.stl\"\n\n[search]\nseed = 4\n")],
}  # fmt: skip


@pytest.mark.parametrize("settings", CHANGES)
def test_only_what_has_changed_is_changed(settings, tmp_path, monkeypatch):
    """Comments, paths and short arrays stay as the file has them."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "case.toml").write_text(FILE)
    case, expected = load_case("case.toml", settings), FILE
    for old, new in CHANGES[settings]:
        expected = expected.replace(old, new, 1)
    assert case.as_written() == expected
    assert Case.from_toml(case.as_written(), tmp_path) == case
    assert "\nposition = [0.0, 0.0, 0.0]\n" in load_case("paper/4a").as_written()
