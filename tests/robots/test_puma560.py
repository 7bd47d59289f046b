"""The PUMA 560 against the paper, and what the shipped URDF is made of (`tools/puma560.py`)."""

import runpy
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from coverable import load_robot
from robots.kinematics import Kinematics
from robots.urdf.checked_urdf import check_urdf

TOOL = SimpleNamespace(
    **runpy.run_path(str(Path(__file__).parents[2] / "tools" / "puma560.py"), run_name="tool")
)
A2, A3, D3, D4 = 0.7, 0.1, 0.1, 0.7  # m, the paper's


def test_the_shipped_file_is_what_its_rows_give():
    assert TOOL.PUMA560_URDF.read_text(encoding="utf-8") == TOOL.puma560_urdf()


def test_tool_point_and_axis_are_those_of_equations_8_and_10():
    tool = Kinematics(load_robot("puma560")).tool
    for q in np.random.default_rng(0).uniform(-np.pi, np.pi, (300, 6)):
        c1, c2, c4, c5 = np.cos(q[[0, 1, 3, 4]])
        s1, s2, s4, s5 = np.sin(q[[0, 1, 3, 4]])
        c23, s23 = np.cos(q[1] + q[2]), np.sin(q[1] + q[2])
        radius = A2 * c2 + A3 * c23 - D4 * s23
        point = [c1 * radius - D3 * s1, s1 * radius + D3 * c1, -A3 * s23 - A2 * s2 - D4 * c23]
        axis = [
            -c1 * (c23 * c4 * s5 + s23 * c5) - s1 * s4 * s5,
            -s1 * (c23 * c4 * s5 + s23 * c5) + c1 * s4 * s5,
            s23 * c4 * s5 - c23 * c5,
        ]
        for found, expected in zip(tool(q), (point, axis), strict=True):
            np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)


def test_it_collides_as_drawn_and_its_nozzle_ends_at_the_tool_point():
    """At a tilt of 45 degrees no point of the nozzle's body is ahead of the tool point."""
    checked = check_urdf(TOOL.PUMA560_URDF)
    fixed = ("base", "link1", "link2", "link3")
    bodies, drawn = (
        [(s.link, s.geometry, s.origin.tolist()) for s in shapes if s.link in fixed]
        for shapes in (checked.collisions.shapes, checked.visuals)
    )
    assert bodies == drawn
    assert {shape.link for shape in checked.visuals} == {"base", *(f"link{i}" for i in range(1, 7))}
    assert (checked.collisions.without, checked.collisions.faults) == (("link4", "link5"), ())
    nozzle = [s for s in checked.collisions.shapes if s.link not in fixed]
    assert {s.link for s in nozzle} == {"link6"}
    for shape in nozzle:
        end = shape.origin[2, 3] + shape.geometry.length / 2
        assert end + shape.geometry.radius <= 1e-12
    ends = [s.origin[2, 3] + s.geometry.length / 2 for s in checked.visuals
            if s.link == "link6" and np.allclose(s.origin[:3, :3], np.eye(3))]  # fmt: skip
    assert max(ends) == pytest.approx(0.0, abs=1e-12)


def test_limit_sets_are_those_of_table_1():
    table = {
        "set-1": ([-180] * 6, [180] * 6),
        "set-2": ([-170, -170, -180, -135, -100, -90], [170, 75, 175, 190, 90, 90]),
        "set-3": ([-90, -170, -180, -135, -100, -90], [10, 75, 90, 170, 90, 90]),
        "set-4": ([-110, -110, -110, -150, -45, -180], [145, 75, 40, 120, 140, 180]),
    }
    sets = load_robot("puma560").limit_sets
    assert sets.keys() == table.keys()
    for name, limits in table.items():
        np.testing.assert_array_equal(sets[name], np.radians(limits).T)
