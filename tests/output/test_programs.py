"""Programs, read back by parsers that share nothing with what wrote them; tools switched there."""

import re
from dataclasses import replace

import numpy as np
import pytest
from command_table import FILES
from mesh_patches import panel_with_hole
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation
from timed_motions import TURN, UR5, motion

from coverable import Axis, ProgramSettings, load_robot, parallel_passes, plane, save_program
from feasibility.programs.controller_axes import ProgramError, check_program
from feasibility.programs.controllers import LANGUAGES, language_of
from feasibility.programs.writing import working_places, working_times
from robots.kinematics import Kinematics
from surfaces.passes.toolpath import PassPlaces

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
    run = motion(UR5)
    meant = CubicHermiteSpline(run.time, run.q, run.dq)(time)
    assert np.abs(q - meant).max() <= 6e-8  # rounding alone
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


@pytest.mark.parametrize(("file", "robot", "said"), [
    ("a.script", load_robot("ur5", lock={"wrist_3_joint": 0.0}), "5 of them move here"),
    ("a.script", IRB, "URScript is written with no external axes here; there are rail"),
    ("a.mod", load_robot("panda"), "7 of them move here"),
    ("a.mod", replace(UR5, surface_link="upper_arm_link"), "order of its axes"),
    ("a.ls", IRB, "TP is written with no external axes here; there are"),
    ("a.jbi", UR5, "pulses_per_deg is missing"),
    ("a.ls", load_robot("panda", lock={"panda_joint1": 0.0}),
     "panda_joint3 and panda_joint4 have no parallel axes; where it is counted from the upper arm, "
     "say --j3-from-upper-arm"),
])  # fmt: skip
def test_other_arms_are_refused_with_a_sentence(file, robot, said):
    with pytest.raises(ProgramError, match=re.escape(said)):
        check_program(language_of(file), robot)


MARKED = ProgramSettings(on="ON", off="OFF")
LIFT = 0.022  # [m] over the plate: standoff and tolerance, and no more


def states(text, move):
    """For each move whether the tool is on; and the numbers of those after which it is switched."""
    lines = [line.strip() for line in text.splitlines()]
    on, found, switches, count = False, [], [], 0
    for line in lines:
        if re.search(move, line):
            count += 1
            found.append(on)
        if line in ("ON", "OFF"):
            assert on == (line == "OFF")
            on = line == "ON"
            switches.append(count - 1)
    assert not on
    return np.array(found), switches


def test_a_tool_is_off_while_it_is_lifted(tmp_path, ask):
    case, out = tmp_path / "plate.toml", tmp_path / "run.script"
    case.write_text(FILES["panel.toml"])
    passes = ["--passes", "0", "--pitch", "0.06", "--one-way", "--approach", "0.05"]
    switch = ["--program", str(out), "--on", "ON", "--off", "OFF"]
    assert ask("path", case, *passes, *switch).status == 0
    text = out.read_text()
    on, switches = states(text, "servoj")
    rows = re.findall(r"servoj\(\[(.*?)\]", text)
    points, _ = Kinematics(UR5).tools([[float(word) for word in row.split(",")] for row in rows])
    height = points[:, 2] - 0.2
    assert (height[on] <= LIFT).all()
    along = (points[:, 0] > 0.402) & (points[:, 0] < 0.598)  # passes run along x
    assert on[(height <= LIFT) & along].all()
    assert len(switches) == 2 * 4
    assert "The tool is on along 4 stretches" in text
    # In functions of a few hundred lines, called one after another.
    body = text.split("\n")
    starts = [k for k, line in enumerate(body) if line.startswith("  def ")]
    ends = [k for k, line in enumerate(body) if line == "  end"]
    assert max(b - a - 1 for a, b in zip(starts, ends, strict=True)) <= 300
    assert [f"  {body[k].split()[1].rstrip(':')}" for k in starts] == [
        line for line in body if re.fullmatch(r"  part_\d+\(\)", line)
    ]


def test_a_tool_is_off_over_holes_and_on_from_pass_to_pass():
    passes = parallel_passes(panel_with_hole(0.03), 0.12).stretches
    levels = [each.level for each in passes]
    lift = levels.index(2)  # before the first stretch of the third pass; else along the surface
    assert levels == [0, 1, 1, 2, 2, 3]
    stretch = [k for number in range(6) for k in ([-1] * 2) * (number == lift) + [number] * 3]
    stretch[3] = -2  # on the way from the first to the second, along the surface
    on = np.array(stretch) != -1
    places = PassPlaces(np.zeros((20, 3)), np.zeros((20, 3)), np.array(stretch), on)
    work = working_places(places, passes)
    assert work.tolist() == [*[0] * 6, *[1] * 3, -1, -1, *[2] * 3, *[3] * 6]
    run = motion(UR5)
    cells = np.full(len(run), -1)
    cells[5:45:2] = np.arange(20)
    times = np.array(working_times(replace(run, cell=cells), work))
    assert (times == run.time[[[5, 15], [17, 21], [27, 31], [33, 43]]]).all()


@pytest.mark.parametrize(("file", "name", "move", "on"), [
    ("a.mod", "irb120", r"^MoveAbsJ", r"ON$"),
    ("a.src", "kr6", r"^S?PTP ", r"TRIGGER WHEN PATH=0 (ONSTART )?DELAY=0 DO ON$"),
])  # fmt: skip
def test_lines_stand_at_their_samples(tmp_path, file, name, move, on):
    run = motion(UR5)
    cell = np.full(len(run), -1)
    cell[[20, 40, 41, 60]] = 0, 0, 1, 0
    run, robot = replace(run, cell=cell), replace(UR5, name=name)
    save_program(tmp_path / file, robot, run, settings=MARKED, work=np.array([0, -1]))
    lines = [line.strip() for line in (tmp_path / file).read_text().splitlines()]
    moves = [k for k, line in enumerate(lines) if re.search(move, line)]
    assert len(moves) == len(run)
    begins = [k for k, line in enumerate(lines) if re.match(on, line)]
    ends = [k for k, line in enumerate(lines) if re.match(on.replace("ON$", "OFF$"), line)]
    # A trigger acts at the end of the motion that it stands before, a plain line where it stands.
    before = file.endswith("src")
    sample = [[sum(m < k for m in moves) - (not before) for k in found] for found in (begins, ends)]
    assert sample == [[20, 60], [40, 60]]
    # From the first sample on: a trigger at the start of the first motion of the spline.
    over = replace(run, cell=np.zeros(len(run), int))
    save_program(tmp_path / file, robot, over, settings=MARKED)
    lines = [line.strip() for line in (tmp_path / file).read_text().splitlines()]
    moves = [k for k, line in enumerate(lines) if re.search(move, line)]
    assert [k for k, line in enumerate(lines) if re.match(on, line)] == [
        next(k for k in range(moves[0] + 1, moves[1]) if re.match(on, lines[k]))
    ]


PARSED = {
    ".script": lambda v: (1e3 * v[:3], Rotation.from_rotvec(v[3:])),
    ".mod": lambda v: (v[:3], Rotation.from_quat(v[3:], scalar_first=True)),
    ".src": lambda v: (v[:3], Rotation.from_euler("ZYX", v[3:], degrees=True)),
    ".ls": lambda v: (v[:3], Rotation.from_euler("xyz", v[3:], degrees=True)),
    ".jbi": lambda v: (v[:3], Rotation.from_euler("xyz", v[3:], degrees=True)),
}
"""Frames as the makers' manuals have them: mm, and a turn."""


@pytest.mark.parametrize("ending", [f".{language.ending}" for language in LANGUAGES])
def test_the_head_has_the_frames_of_tool_and_part(tmp_path, ending):
    tcp = [0.01, -0.02, 0.12], [10, -20, 130]
    base = [0.5, 0.1, 0.8], [0, 0, 90]
    robot = replace(load_robot("ur5", tcp=tcp, base=base), name="arm")
    part = plane((0, 0.3), (0, 0.2), "outside", (0.4, -0.1, 0.2), (5, 80, -120))
    settings = ProgramSettings(pulses_per_deg=[1000.0] * 6)
    file = tmp_path / f"a{ending}"
    save_program(file, robot, motion(robot), "case", settings, part)
    text = " ".join(re.sub(r"(?m)^\s*(\d+: )?\s*['!#;]| ;$", " ", file.read_text("ascii")).split())
    root = np.linalg.inv(robot.base)
    wanted = {
        "tool": (robot.tcp[:3, 3], robot.tcp[:3, :3], "tool0"),
        "part": (root[:3, :3] @ part.position + root[:3, 3], root[:3, :3] @ part.rotation, "world"),
    }
    for name, (point, turn, link) in wanted.items():
        words = re.search(rf"{name}: (.*?) from link (\w+)", text)
        assert words[2] == link
        values = re.findall(r"(?<![a-z\d])-?\d+(?:\.\d+)?(?:e-\d+)?", words[1])
        place, rotation = PARSED[ending](np.array(values, dtype=float))
        assert np.abs(place - 1e3 * point).max() <= 2e-3
        assert np.abs(rotation.as_matrix() - turn).max() <= 2e-6
    assert "No controller has run a program" in text


def test_external_axes_carry_a_part(tmp_path):
    table = Axis("table", "revolute", (0, 0, 1), limits_deg=(-180, 180), carries="surface")
    robot = replace(load_robot("ur5", axes=[table]), name="irb120")
    part = plane((0, 0.3), (0, 0.2), "outside", (0.4, -0.1, 0.2))
    save_program(tmp_path / "a.mod", robot, motion(robot), surface=part)
    said = "part: [[400,-100,200],[1,0,0,0]] from table, which carries it"
    assert said in (tmp_path / "a.mod").read_text()
