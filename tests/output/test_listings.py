"""FANUC and Yaskawa programs, read back by small readers of the formats' descriptions.

A TP move takes T msec; VJ of INFORM is the share (%) of the speed of the axis that takes longest.
"""

import re
from dataclasses import replace

import numpy as np
import pytest
from arm_urdfs import arm, joint, load_text
from timed_motions import TURN, UR5, motion

from coverable import ProgramSettings, save_program
from feasibility.programs import program_texts
from robots.kinematics import Kinematics

PULSES = (1341.4, 1341.4, 1000.0, 811.0, 800.5, 452.2)


@pytest.fixture
def fanuc(tmp_path):
    """An arm as in the URDFs of ROS-Industrial: forearm along x at zero, axis 3 against axis 2."""
    y, minus_x = (0, 1, 0), (-1, 0, 0)
    joints = [
        joint(1, axis=(0, 0, 1)), joint(2, xyz=(0.05, 0, 0.33), axis=y),
        joint(3, xyz=(0, 0, 0.44), axis=(0, -1, 0)), joint(4, xyz=(0, 0, 0.04), axis=minus_x),
        joint(5, xyz=(0.42, 0, 0), axis=(0, -1, 0)), joint(6, xyz=(0.08, 0, 0), axis=minus_x),
    ]  # fmt: skip
    return replace(load_text(tmp_path, arm(joints), tool_frame="l6"), name="lrmate200id")


def sections(text, marks):
    """The lines between some lines that stand alone or begin so, in their order."""
    assert text.endswith("\r\n")
    assert "\n" not in text.replace("\r\n", "")
    lines, found = text.split("\r\n")[:-1], {}
    starts = [next(k for k, line in enumerate(lines) if line.startswith(mark)) for mark in marks]
    assert starts == sorted(starts)
    assert starts[0] == 0
    for mark, a, b in zip(marks, starts, [*starts[1:], len(lines)], strict=True):
        found[mark] = [lines[a].removeprefix(mark).strip(), *lines[a + 1 : b]]
    return found


def read_tp(text):
    """The name, instructions, and times (ms, nan of the first) and J1 to J6 (deg) of the moves."""
    found = sections(text, ("/PROG", "/ATTR", "/MN", "/POS", "/END"))
    lines = found["/MN"][1:]
    assert f"LINE_COUNT\t= {len(lines)};" in found["/ATTR"]
    read = [re.fullmatch(r" *(\d+):(.*) ;", line) for line in lines]
    assert [int(one[1]) for one in read] == list(range(1, len(read) + 1))
    instructions = [one[2] for one in read]
    assert max(len(line) for line in instructions if line.startswith("  !")) <= 2 + 1 + 32
    positions = {}
    for number, block in re.findall(r"P\[(\d+)\]\{(.*?)\};", "\n".join(found["/POS"]), re.DOTALL):
        assert re.match(r"\n   GP1:\n\tUF : 0, UT : 1,\n", block)
        axes = re.findall(r"J(\d)= (-?\d+\.\d+) deg", block)
        assert [k for k, _ in axes] == list("123456")
        positions[number] = [float(value) for _, value in axes]
    times, rows = [], []
    for line in instructions:
        move = re.fullmatch(r"J P\[(\d+)\] (?:(\d+)msec|5%) (FINE|CNT100)", line)
        if move:
            times.append(float(move[2] or "nan"))
            rows.append(positions.pop(move[1]))
    assert not positions
    return found["/PROG"][0], instructions, np.array(times), np.array(rows)


def read_job(text):
    """The name, instructions, and VJ (%) and pulses of the moves."""
    marks = ("/JOB", "//NAME", "//POS", "//INST")
    found = sections(text, marks)
    rows = dict(re.findall(r"^(C\d{5})=(.*)$", "\n".join(found["//POS"]), re.MULTILINE))
    assert f"///NPOS {len(rows)},0,0,0,0,0" in found["//POS"]
    assert ("///POSTYPE PULSE" in found["//POS"]) == bool(rows)
    start = found["//INST"].index("NOP") + 1
    assert re.fullmatch(r"///DATE \d{4}/\d\d/\d\d \d\d:\d\d", found["//INST"][1])
    assert found["//INST"][start - 1 - 3 : start - 1] == [
        "///COMM coverable", "///ATTR SC,RW", "///GROUP1 RB1"
    ]  # fmt: skip
    *lines, end = found["//INST"][start:]
    assert end == "END"
    assert max(len(line) for line in lines if line.startswith("'")) <= 1 + 32
    shares, pulses = [], []
    for line in lines:
        move = re.fullmatch(r"MOVJ (C\d{5}) VJ=(\d+\.\d\d)( PL=0)?", line)
        if move:
            shares.append(float(move[2]))
            pulses.append([int(value) for value in rows.pop(move[1]).split(",")])
    assert not rows
    return found["//NAME"][0], lines, np.array(shares), np.array(pulses)


def test_fanuc_has_samples_times_and_j3_from_the_horizontal(tmp_path, fanuc):
    run = motion(fanuc)
    save_program(tmp_path / "panel-2.ls", fanuc, run)
    name, lines, times, axes = read_tp((tmp_path / "panel-2.ls").read_bytes().decode("ascii"))
    assert name == "PANEL_2"
    assert np.abs(np.cumsum(times[1:]) - 1e3 * run.time[1:]).max() <= 0.51
    joints = axes.copy()
    joints[:, 2] += axes[:, 1]  # fanuc_driver's J23_factor of 1
    assert np.abs(joints - run.q * TURN).max() <= 1.1e-4
    frames = Kinematics(fanuc).joints(run.q)
    forearm = frames.points[:, 5] - frames.points[:, 4]
    rise = np.degrees(np.arcsin(forearm[:, 2] / np.linalg.norm(forearm, axis=1)))
    steep = np.abs(axes[:, 2]) < 89.0
    assert steep.any()
    assert np.abs(rise - axes[:, 2])[steep].max() <= 1e-3
    assert "J3 = j3 - j2, in deg" in "".join(lines)
    plain = ProgramSettings(j3_from_horizontal=False)
    save_program(tmp_path / "b.ls", fanuc, run, settings=plain)
    _, _, _, axes = read_tp((tmp_path / "b.ls").read_bytes().decode("ascii"))
    assert np.abs(axes - run.q * TURN).max() <= 5.1e-5


def test_yaskawa_has_pulses_and_shares_of_the_largest_speeds(tmp_path):
    robot = replace(UR5, name="gp7")
    signs = [1, -1, 1, 1, -1, 1]
    given = ProgramSettings(signs, [0, 0, 90, 0, 0, 0], PULSES, on="DOUT OT#(1) ON", off="'")
    run = motion(robot)
    save_program(tmp_path / "a.jbi", robot, run, settings=given)
    name, lines, shares, pulses = read_job((tmp_path / "a.jbi").read_bytes().decode("ascii"))
    assert name == "A"
    assert np.abs(pulses - (run.q * TURN * signs + [0, 0, 90, 0, 0, 0]) * PULSES).max() <= 0.51
    took = (np.abs(np.diff(run.q, axis=0)) / robot.max_velocity).max(axis=1) / (shares[1:] / 100)
    steps = np.diff(run.time)
    coarse = 0.0051 / shares[1:]  # VJ has steps of 0.01
    assert (np.abs(took - steps) <= 1.01e-4 + steps * coarse)[shares[1:] > 0.01].all()
    said = " ".join(lines).replace(" '", " ")
    speeds = ", ".join(f"{speed:.4g}" for speed in robot.max_velocity * TURN)
    assert f"VJ is a share of {speeds} deg/s" in said
    assert "S = shoulder_pan_joint, 1341.4" in said


@pytest.mark.parametrize("language", ["ls", "jbi"])
def test_a_long_motion_becomes_programs_that_one_calls(tmp_path, monkeypatch, fanuc, language):
    monkeypatch.setattr(program_texts, "MOST_TP", 40)
    monkeypatch.setattr(program_texts, "MOST_INFORM", 40)
    robot = fanuc if language == "ls" else replace(UR5, name="gp7")
    run = motion(robot)
    run = replace(run, cell=np.where(np.arange(len(run)) % 50 == 0, 0, -1))
    settings = ProgramSettings(pulses_per_deg=PULSES, on="SWITCH ON", off="SWITCH OFF")
    save_program(tmp_path / f"run.{language}", robot, run, settings=settings)
    files = [tmp_path / f"run{k}.{language}" for k in ("", "_p1", "_p2", "_p3")]
    read = {"ls": read_tp, "jbi": read_job}[language]
    whole, *parts = (read(file.read_bytes().decode("ascii")) for file in files)
    calls = [line.split(":")[-1].split()[-1] for line in whole[1] if "CALL" in line]
    assert calls == [part[0] for part in parts] == ["RUN_P1", "RUN_P2", "RUN_P3"]
    assert len(whole[3]) == 0
    assert len(np.concatenate([part[3] for part in parts])) == len(run)
    lines = [line.strip() for part in parts for line in part[1]]
    moves = [k for k, line in enumerate(lines) if line.startswith(("J P", "MOVJ"))]
    switches = [k for k, line in enumerate(lines) if line.startswith("SWITCH")]
    assert [lines[k] for k in switches] == ["SWITCH ON", "SWITCH OFF"]
    assert [sum(move < k for move in moves) - 1 for k in switches] == [0, 100]
