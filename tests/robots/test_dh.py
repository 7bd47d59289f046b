"""The PUMA 560 against the paper, and DH rows against the URDF made of them."""

import numpy as np
import pinocchio as pin
import pytest
from dh import PUMA560_ROWS, PUMA560_URDF, DHRow, Shape, dh_urdf, puma560_urdf

from robots import Kinematics, load_robot
from robots.urdf import check_urdf

A2, A3, D3, D4 = 0.7, 0.1, 0.1, 0.7


def configurations(count: int) -> np.ndarray:
    return np.random.default_rng(0).uniform(-np.pi, np.pi, (count, 6))


def dh_transform(row: DHRow, theta: float) -> np.ndarray:
    """Craig, Introduction to Robotics, eq. (3.6)."""
    ca, sa, ct, st = np.cos(row.alpha), np.sin(row.alpha), np.cos(theta), np.sin(theta)
    return np.array(
        [
            [ct, -st, 0, row.a],
            [st * ca, ct * ca, -sa, -sa * row.d],
            [st * sa, ct * sa, ca, ca * row.d],
            [0, 0, 0, 1],
        ]
    )


def test_tool_point_and_axis_are_those_of_equations_8_and_10():
    tool = Kinematics(load_robot("puma560")).tool
    for q in configurations(1000):
        point, axis = tool(q)
        c1, c2, c4, c5 = np.cos(q[[0, 1, 3, 4]])
        s1, s2, s4, s5 = np.sin(q[[0, 1, 3, 4]])
        c23, s23 = np.cos(q[1] + q[2]), np.sin(q[1] + q[2])
        radius = A2 * c2 + A3 * c23 - D4 * s23
        expected_point = [
            c1 * radius - D3 * s1,
            s1 * radius + D3 * c1,
            -A3 * s23 - A2 * s2 - D4 * c23,
        ]
        expected_axis = [
            -c1 * (c23 * c4 * s5 + s23 * c5) - s1 * s4 * s5,
            -s1 * (c23 * c4 * s5 + s23 * c5) + c1 * s4 * s5,
            s23 * c4 * s5 - c23 * c5,
        ]
        np.testing.assert_allclose(point, expected_point, rtol=0, atol=1e-12)
        np.testing.assert_allclose(axis, expected_axis, rtol=0, atol=1e-12)


def test_every_link_frame_is_its_dh_frame():
    robot = load_robot("puma560")
    model, data = robot.model, robot.model.createData()
    links = ["base", *(f"link{i}" for i in range(1, 7))]
    for q in configurations(100):
        pin.framesForwardKinematics(model, data, q)
        expected = np.eye(4)
        for link, row, theta in zip(links, (None, *PUMA560_ROWS), (0.0, *q), strict=True):
            expected = expected if row is None else expected @ dh_transform(row, theta)
            frame = model.getFrameId(link, pin.FrameType.BODY)
            assert frame < model.nframes
            np.testing.assert_allclose(data.oMf[frame].homogeneous, expected, rtol=0, atol=1e-12)


def test_urdf_of_random_rows_is_the_product_of_their_transforms(tmp_path):
    rng = np.random.default_rng(1)
    rows = [DHRow(*rng.uniform(-2, 2, 3)) for _ in range(7)]
    path = tmp_path / "random.urdf"
    path.write_text(dh_urdf("random", rows, [(-170, 170)] * 7), encoding="utf-8")
    robot = load_robot(path)
    np.testing.assert_array_equal(robot.upper, np.radians([170] * 7))
    tool = Kinematics(robot).tool
    for q in rng.uniform(-2, 2, (100, 7)):
        expected = np.eye(4)
        for row, theta in zip(rows, q, strict=True):
            expected = expected @ dh_transform(row, theta)
        point, axis = tool(q)
        np.testing.assert_allclose(point, expected[:3, 3], rtol=0, atol=1e-12)
        np.testing.assert_allclose(axis, expected[:3, 2], rtol=0, atol=1e-12)


def test_shipped_urdf_is_what_its_rows_give():
    assert PUMA560_URDF.read_text(encoding="utf-8") == puma560_urdf()


def test_every_link_is_drawn_and_the_nozzle_ends_at_the_tool_point():
    visuals = check_urdf(PUMA560_URDF).visuals
    assert {visual.link for visual in visuals} == {"base", *(f"link{i}" for i in range(1, 7))}
    ends = [
        visual.origin[2, 3] + visual.geometry.length / 2
        for visual in visuals
        if visual.link == "link6" and np.allclose(visual.origin[:3, :3], np.eye(3))
    ]
    assert max(ends) == pytest.approx(0.0, abs=1e-12)


def test_base_to_forearm_collide_as_drawn_and_a_nozzle_behind_the_tool_point():
    """At a tilt of 45 degrees no point of the nozzle is ahead of the tool point."""
    checked = check_urdf(PUMA560_URDF)
    fixed = ("base", "link1", "link2", "link3")
    bodies, drawn = (
        [(s.link, s.geometry, s.origin.tolist()) for s in shapes if s.link in fixed]
        for shapes in (checked.collisions.shapes, checked.visuals)
    )
    assert bodies == drawn
    assert checked.collisions.without == ("link4", "link5")
    assert checked.collisions.faults == ()
    nozzle = [s for s in checked.collisions.shapes if s.link not in fixed]
    assert {s.link for s in nozzle} == {"link6"}
    for shape in nozzle:
        end = shape.origin[2, 3] + shape.geometry.length / 2
        assert end + shape.geometry.radius <= 1e-12


def test_rows_limits_and_shapes_have_to_fit_together():
    with pytest.raises(ValueError, match="2 DH rows need as many limits, got 1"):
        dh_urdf("arm", [DHRow(0, 0, 0)] * 2, [(-1, 1)])
    with pytest.raises(ValueError, match=r"must name a link in 0 \.\. 1"):
        dh_urdf("arm", [DHRow(0, 0, 0)], [(-1, 1)], [Shape(2, (0.1,))], {"body": (1, 1, 1, 1)})
    with pytest.raises(ValueError, match="a colour of"):
        dh_urdf("arm", [DHRow(0, 0, 0)], [(-1, 1)], [Shape(1, (0.1,))])


def test_limit_sets_are_those_of_table_1():
    sets = load_robot("puma560").limit_sets
    table = {
        "set-1": ([-180] * 6, [180] * 6),
        "set-2": ([-170, -170, -180, -135, -100, -90], [170, 75, 175, 190, 90, 90]),
        "set-3": ([-90, -170, -180, -135, -100, -90], [10, 75, 90, 170, 90, 90]),
        "set-4": ([-110, -110, -110, -150, -45, -180], [145, 75, 40, 120, 140, 180]),
    }
    assert sets.keys() == table.keys()
    for name, limits in table.items():
        np.testing.assert_array_equal(sets[name], np.radians(limits).T)
