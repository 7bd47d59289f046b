"""Programs, read back by parsers that share nothing with what wrote them."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from timed_motions import TURN, UR5, at, motion

from feasibility.programs import (
    ProgramError,
    ProgramSettings,
    check_program,
    language_of,
    save_program,
)
from feasibility.safe_files import FileError
from robots import Axis, load_robot

RAIL = Axis("rail", "prismatic", (1, 0, 0), limits=(-2.0, 4.0))
IRB = replace(load_robot("ur5", axes=[RAIL]), name="irb1200_on_a_rail")


def numbers(text):
    return [float(word) for word in re.findall(r"-?\d+\.?\d*(?:E\d+)?", text)]


def read_script(text):
    """Times (s) and positions (rad) of a URScript program."""
    first = re.search(r"movej\(\[(.*?)\]", text)
    moves = re.findall(r"servoj\(\[(.*?)\], 0, 0, (.*?), 0.1, 300\)", text)
    assert text.count("servoj") == len(moves)
    steps = [float(step) for _, step in moves]
    return np.cumsum([0.0, *steps]), np.array([numbers(first[1]), *(numbers(m) for m, _ in moves)])


def read_module(text):
    """Times (s), arm (deg) and external axes of a RAPID module."""
    found = re.findall(r"MoveAbsJ \[\[(.*?)\],\[(.*?)\]\],v\d+(?:\\T:=(.*?))?,(\w+),tool0;", text)
    assert text.count("MoveAbsJ") == len(found)
    assert [zone for *_, zone in found] == ["fine", *["z0"] * (len(found) - 2), "fine"]
    time = np.cumsum([float(step or 0.0) for *_, step, _ in found])
    return time, np.array([numbers(f[0]) for f in found]), np.array([numbers(f[1]) for f in found])


def read_source(text):
    """Times (s) and axes (deg or mm) of a KRL program."""
    assert text.count("PTP_SPLINE") == text.count("ENDSPLINE") == 1
    points = re.findall(r"^ *S?PTP \{(.*)\}$", text, re.MULTILINE)
    names = [re.findall(r"([AE]\d) ", point) for point in points]
    assert names == [names[0]] * len(names)
    parts = np.array([float(p) for p in re.findall(r"TIME_BLOCK PART = (.*)", text)])
    whole = float(re.search(r"TIME_BLOCK END = (.*)", text)[1])
    assert parts.sum() == pytest.approx(100.0, abs=1e-5)
    time = np.append(0.0, np.cumsum(parts) / parts.sum() * whole)
    values = [[float(v) for v in re.findall(r"[AE]\d (\S+?)(?:,|$)", p)] for p in points]
    return names[0], time, np.array(values)


def saved(tmp_path, name, robot, **given):
    settings = ProgramSettings(**given)
    save_program(tmp_path / name, robot, motion(robot), "a case\nof two lines", settings)
    return (tmp_path / name).read_text(encoding="ascii")


def test_urscript_gives_the_motion_at_the_servo_period(tmp_path):
    text = saved(tmp_path, "a.script", UR5)
    time, q = read_script(text)
    assert time[-1] == pytest.approx(2.0)
    assert np.abs(q - at(time, 6)[0]).max() <= 6e-8  # the motion is a quintic: rounding alone
    assert "collisions are not checked" in text
    assert "joint 1 = shoulder_pan_joint, in rad" in text
    assert "a case?of two lines" in text


def test_rapid_gives_samples_times_and_the_rail(tmp_path):
    run = motion(IRB)
    time, arm, external = read_module(saved(tmp_path, "a.mod", IRB))
    assert np.abs(time - run.time).max() <= 5.1e-5
    assert np.abs(arm - run.q[:, 1:] * TURN).max() <= 5.1e-5
    assert np.abs(external[:, 0] - 1e3 * run.q[:, 0]).max() <= 5.1e-5
    assert (external[:, 1:] == 9e9).all()


def test_krl_gives_samples_times_and_signs(tmp_path):
    kuka = replace(UR5, name="kr210l150")
    run, signs, offsets = motion(kuka), [-1, 1, 1, -1, 1, -1], [0, -90, 90, 0, 0, 12.5]
    text = saved(tmp_path, "2 a-b.src", kuka, signs=signs, offsets_deg=offsets)
    names, time, axes = read_source(text)
    assert names == ["A1", "A2", "A3", "A4", "A5", "A6"]
    assert "DEF p_2_a_b()" in text
    assert "A4 = -wrist_1_joint, in deg" in text
    assert "A2 = shoulder_lift_joint - 90 deg, in deg" in text
    assert np.abs(time - run.time).max() <= 1e-4
    assert np.abs((axes - offsets) * signs - run.q * TURN).max() <= 5.1e-5


def test_rounding_leaves_no_joint_outside_its_limits():
    third = 1.0 / 3.0
    robot = replace(UR5, lower=np.full(6, -third), upper=np.full(6, third))
    for name, unit, digits in (("a.script", 1.0, 7), ("a.mod", TURN, 4), ("a.src", TURN, 4)):
        axes = check_program(language_of(name), replace(robot, name="arm"))
        for end in (-third, third):
            arm, _ = axes.values(robot, np.full((1, 6), end))
            assert (np.abs(arm) <= third * unit).all()
            assert np.abs(arm - end * unit).max() <= 10.0**-digits


@pytest.mark.parametrize(
    ("file", "robot", "said"),
    [
        ("a.script", load_robot("panda"), "'panda' is of Franka"),
        ("a.script", load_robot("puma560"), "is of Unimation"),
        ("a.mod", UR5, "RAPID is for arms of ABB; 'ur5' is of Universal Robots"),
        ("a.src", replace(UR5, name="lbr_iiwa_14"), "Sunrise, in Java"),
        ("a.script", load_robot("ur5", lock={"wrist_3_joint": 0.0}), "5 of them move here"),
        ("a.script", replace(IRB, name="ur5"), "URScript has no external axes; there are rail"),
        ("a.mod", replace(load_robot("panda"), name="arm"), "7 of them move here"),
        ("a.mod", replace(UR5, name="a", surface_link="upper_arm_link"), "order of its axes"),
        ("a.ls", UR5, "TP is for arms of FANUC; 'ur5' is of Universal Robots"),
        ("a.ls", replace(IRB, name="arm"), "external axes are not written in TP yet; there are"),
        ("a.jbi", replace(UR5, name="gp7"), "pulses_per_deg is missing"),
    ],
)
def test_other_arms_are_refused_with_a_sentence(file, robot, said):
    with pytest.raises(ProgramError, match=re.escape(said)):
        check_program(language_of(file), robot)


def test_signs_and_endings_are_checked(tmp_path):
    for signs in ([1, 1, 1, 1, 1, 2], [1] * 5):
        with pytest.raises(ProgramError, match="signs"):
            check_program(language_of("a.mod"), replace(UR5, name="arm"), ProgramSettings(signs))
    with pytest.raises(FileError, match=r"\.script"):
        save_program(tmp_path / "a.prg", UR5, motion(UR5))
    assert list(tmp_path.iterdir()) == []
