"""Pinocchio's answers against the URDF's own rules, written out without Pinocchio."""

import numpy as np
import pytest
from arm_urdfs import UNLIKE, arm, joint, load_text, placement, random_arm, random_q, unlike

from robots import Kinematics, list_robots, load_robot, moved_by_joints
from robots.urdf import check_urdf


@pytest.mark.parametrize("info", list_robots(), ids=lambda info: info.name)
def test_tool_is_where_the_urdf_puts_it_with_the_locked_joints_held(info):
    robot = load_robot(info.name)
    path = check_urdf(robot.urdf, robot.package_dirs).path_to(robot.tool_frame)
    tool = Kinematics(robot).tool
    rng = np.random.default_rng(3)
    for _ in range(20):
        q = random_q(robot, rng)
        values = {**robot.locked, **dict(zip(robot.joint_names, q, strict=True))}
        expected = placement(path, values)
        point, axis = tool(q)
        np.testing.assert_allclose(point, expected[:3, 3], rtol=0, atol=1e-12)
        np.testing.assert_allclose(axis, expected[:3, :3] @ robot.approach_axis, rtol=0, atol=1e-12)
        assert np.linalg.norm(axis) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("seed", range(30))
def test_jacobians_are_the_slopes_of_the_tool(seed, tmp_path):
    rng = np.random.default_rng(100 + seed)
    robot = load_text(tmp_path, random_arm(rng), approach_axis=rng.normal(size=3))
    kinematics = Kinematics(robot)
    q = random_q(robot, rng)
    point_rows, axis_rows = kinematics.jacobians(q)
    step = 1e-5
    for i in range(robot.n):
        shift = step * np.eye(robot.n)[i]
        after, before = kinematics.tool(q + shift), kinematics.tool(q - shift)
        for rows, ahead, behind in zip((point_rows, axis_rows), after, before, strict=True):
            slope = (ahead - behind) / (2 * step)
            np.testing.assert_allclose(rows[:, i], slope, rtol=0, atol=2e-9)


@pytest.mark.parametrize("seed", range(10))
def test_the_tool_moves_as_its_jacobian_says(seed, tmp_path):
    rng = np.random.default_rng(500 + seed)
    robot = load_text(tmp_path, random_arm(rng))
    kinematics = Kinematics(robot)
    q = np.array([random_q(robot, rng) for _ in range(5)])
    dq = rng.normal(size=q.shape)
    expected = [kinematics.jacobians(place)[0] @ rate for place, rate in zip(q, dq, strict=True)]
    np.testing.assert_allclose(kinematics.tool_velocities(q, dq), expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("seed", range(10))
def test_the_chain_moves_the_tool_as_pinocchio_does(seed, tmp_path):
    rng = np.random.default_rng(700 + seed)
    robot = load_text(tmp_path, random_arm(rng))
    q = np.array([random_q(robot, rng) for _ in range(5)])
    expected = [Kinematics(robot).jacobians(row)[0].T for row in q]
    moved = moved_by_joints(robot.chain, q).transpose(2, 0, 1)
    np.testing.assert_allclose(moved, expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", UNLIKE)
def test_many_configurations_are_those_of_one_bit_for_bit(name):
    robot = unlike(name)
    kinematics, rng = Kinematics(robot), np.random.default_rng(9)
    q = np.array([random_q(robot, rng) for _ in range(20)])
    points, axes = kinematics.tools(q)
    for row, point, axis in zip(q, points, axes, strict=True):
        expected_point, expected_axis = kinematics.tool(row)
        np.testing.assert_array_equal(point, expected_point)
        np.testing.assert_array_equal(axis, expected_axis)
    assert [part.shape for part in kinematics.tools(q[:0])] == [(0, 3), (0, 3)]


@pytest.mark.parametrize("seed", range(10))
def test_twists_moved_to_the_tool_are_its_jacobian(seed, tmp_path):
    rng = np.random.default_rng(700 + seed)
    robot = load_text(tmp_path, random_arm(rng), approach_axis=rng.normal(size=3))
    kinematics = Kinematics(robot)
    q = np.array([random_q(robot, rng) for _ in range(3)])
    for row, twists, point in zip(q, kinematics.twists(q), kinematics.tools(q)[0], strict=True):
        expected = kinematics.jacobians(row)[0]
        moved = twists[:3] + np.cross(twists[3:], point, axis=0)
        np.testing.assert_allclose(moved, expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("shapes", "message"),
    [
        (((6,), (6,)), r"q must have shape \(m, 6\), got \(6,\)"),
        (((2, 5), (2, 5)), r"q must have shape \(m, 6\), got \(2, 5\)"),
        (((2, 6), (3, 6)), r"dq must have the shape of q, \(2, 6\), got \(3, 6\)"),
    ],
)
def test_rows_of_the_wrong_shape_are_refused(shapes, message):
    with pytest.raises(ValueError, match=message):
        Kinematics(load_robot("puma560")).tool_velocities(*map(np.zeros, shapes))


def test_a_full_turn_is_another_configuration_with_the_same_placement():
    robot = load_robot("kinova")
    assert robot.joint_kinds.count("continuous") == 3
    kinematics = Kinematics(robot)
    q = np.array([0.3, 2.0, 1.5, -4.0, 3.0, 5.0])
    for i, kind in enumerate(robot.joint_kinds):
        turned = q + 2 * np.pi * np.eye(6)[i]
        for value, expected in zip(kinematics.tool(turned), kinematics.tool(q), strict=True):
            np.testing.assert_allclose(value, expected, rtol=0, atol=1e-12)
        assert (robot.lower[i], robot.upper[i]) == (-np.inf, np.inf) or kind == "revolute"


def test_an_arm_on_a_rail_moves_with_it(tmp_path):
    text = arm(
        [
            joint(1, "prismatic", axis=(0, 1, 0), limits=(-1.0, 2.0)),
            joint(2, xyz=(0, 0, 0.5)),
            joint(3, "prismatic", xyz=(0.4, 0, 0), axis=(2, 0, 0), limits=(0.0, 0.3)),
        ]
    )
    robot = load_text(tmp_path, text)
    assert robot.joint_kinds == ("prismatic", "revolute", "prismatic")
    np.testing.assert_array_equal(robot.prismatic, [True, False, True])
    point, axis = Kinematics(robot).tool([1.5, np.pi / 2, 0.2])
    np.testing.assert_allclose(point, [0, 1.5 + 0.4 + 0.2, 0.5], atol=1e-15)
    np.testing.assert_allclose(axis, [0, 0, 1], atol=1e-15)
    # Furthest from the rail's origin: at its end, stretched.
    assert robot.reach == pytest.approx(np.hypot(0.5, 2.0) + 0.7)


def test_answers_are_copies():
    kinematics = Kinematics(load_robot("puma560"))
    first = [*kinematics.tool(np.zeros(6)), *kinematics.jacobians(np.zeros(6))]
    kept = [array.copy() for array in first]
    kinematics.tool(np.ones(6))
    kinematics.jacobians(np.ones(6))
    for array, expected in zip(first, kept, strict=True):
        np.testing.assert_array_equal(array, expected)


@pytest.mark.parametrize("q", [[0.0] * 5, [0.0] * 7, [[0.0] * 6]])
def test_a_configuration_of_the_wrong_shape_is_refused(q):
    with pytest.raises(ValueError, match=r"q must have shape \(6,\)"):
        Kinematics(load_robot("puma560")).tool(q)
