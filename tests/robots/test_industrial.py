"""Our industrial arms against figures of others, which know nothing of our table."""

import runpy
import tomllib
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from coverable import load_robot

ROOT = Path(__file__).parents[2]
HOUSES = {  # angles of the rows 2, 3 and 6 at zero, degrees, and which way the axes turn
    "abb": ((-90, 0, 180), (1, 1, 1, 1, 1, 1)),
    "kuka": ((0, -90, 180), (-1, 1, 1, -1, 1, -1)),
    "yaskawa": ((-90, 0, 0), (1, 1, -1, -1, -1, -1)),
    "staubli": ((-90, -90, 180), (1, 1, 1, 1, 1, 1)),
}
# d1 a1 a2 a3 d4 d6, mm, of Craig's modified rows as in robotkinematicscatalogue 1.1.2, and in ARTE
# for the IRB 52. The catalogue counts the height of gp12, gp25 and rx160 from axis 2, and says so.
OTHERS = {
    "irb120": ("abb", (290, 0, 270, 70, 302, 72)),
    "irb140t": ("abb", (352, 70, 360, 0, 380, 65)),
    "irb52": ("abb", (486.5, 150, 475, 0, 600, 65)),
    "irb4600_60_205": ("abb", (495, 175, 900, 175, 960, 135)),
    "irb4600_40_255": ("abb", (495, 175, 1095, 175, 1270, 135)),
    "kr6_r700": ("kuka", (400, 25, 315, 35, 365, 80)),
    "kr6_r900": ("kuka", (400, 25, 455, 35, 420, 80)),
    "kr10_r1100": ("kuka", (400, 25, 560, 35, 515, 80)),
    "kr16_2": ("kuka", (675, 260, 680, -35, 670, 158)),
    "kr210_r2700": ("kuka", (675, 350, 1150, -41, 1200, 215)),
    "gp12": ("yaskawa", (450, 155, 614, 200, 640, 100)),
    "gp25": ("yaskawa", (505, 150, 760, 200, 795, 100)),
    "rx160": ("staubli", (550, 150, 825, 0, 625, 110)),
}


def flange(name, q):
    """The flange at joint values, rad: rows (alpha, a, d, theta) of another source."""
    house, (d1, a1, a2, a3, d4, d6) = OTHERS[name]
    (second, third, last), signs = HOUSES[house]
    rows = [(0, 0, d1, 0), (-90, a1, 0, second), (0, a2, 0, third)]
    rows += [(-90, a3, d4, 0), (90, 0, 0, 0), (-90, 0, d6, last)]
    place = np.eye(4)
    for (alpha, a, d, theta), sign, value in zip(rows, signs, q, strict=True):
        turn = pin.utils.rotate("z", np.radians(theta) + sign * value)
        step, tilt = np.eye(4), pin.utils.rotate("x", np.radians(alpha))
        step[:3, :3], step[:3, 3] = tilt @ turn, np.array([a, 0, 0]) + tilt @ [0, 0, d]
        place = place @ step
    return place


@pytest.mark.parametrize("name", OTHERS)
def test_the_flange_is_where_another_source_has_it_to_a_tenth_of_a_millimetre(name):
    robot, rng = load_robot(name), np.random.default_rng(0)
    data = robot.model.createData()
    for q in rng.uniform(robot.lower, robot.upper, (20, 6)):
        pin.framesForwardKinematics(robot.model, data, q)
        ours, theirs = data.oMf[robot.tool_frame_id], flange(name, q)
        np.testing.assert_allclose(ours.translation * 1000, theirs[:3, 3], rtol=0, atol=0.1)
        np.testing.assert_allclose(ours.rotation, theirs[:3, :3], rtol=0, atol=1e-9)
    assert "capsules of estimated radius" in robot.notes[-1]
    assert len(robot.notes) == 1


def test_the_urdfs_are_those_that_the_tool_writes():
    tool = runpy.run_path(str(ROOT / "tools" / "industrial_urdfs.py"), run_name="tool")
    folder = ROOT / "robots" / "arms"
    table = tomllib.loads((folder / "industrial.toml").read_text())
    assert list(table) == list(OTHERS)
    for name, arm in table.items():
        assert (folder / f"{name}.urdf").read_text() == tool["urdf"](name, arm)
