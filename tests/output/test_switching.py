"""Tools are switched where they work; what cannot be written is refused before anything else."""

import re
from dataclasses import replace

import numpy as np
import pytest
from command_table import FILES
from mesh_patches import panel_with_hole
from scipy.spatial.transform import Rotation
from timed_motions import UR5, motion

from feasibility.programs import ProgramSettings, save_program, working_places, working_times
from robots import Axis, Kinematics, load_robot
from surfaces import plane
from surfaces.passes import PassPlaces, parallel_passes

MARKED = ProgramSettings(on="ON", off="OFF")
LIFT = 0.022  # [m] over the plate: standoff and tolerance, and no more


def states(text, move):
    """For each move whether the tool is on while it is made, and the numbers of those after which
    it is switched."""
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
    lengths = [b - a - 1 for a, b in zip(starts, ends, strict=True)]
    assert max(lengths) <= 300
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


@pytest.mark.parametrize(
    ("file", "name", "move", "on"),
    [
        ("a.mod", "irb120", r"^MoveAbsJ", r"ON$"),
        ("a.src", "kr6", r"^S?PTP ", r"TRIGGER WHEN PATH=0 (ONSTART )?DELAY=0 DO ON$"),
    ],
)
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
    save_program(
        tmp_path / file, robot, replace(run, cell=np.zeros(len(run), int)), settings=MARKED
    )
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


@pytest.mark.parametrize("ending", PARSED)
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
