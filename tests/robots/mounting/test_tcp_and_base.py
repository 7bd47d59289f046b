"""Tool centre point, base and reference axis: in the model, in the chain, and what is refused."""

import pickle
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from arm_urdfs import load_text, random_arm, random_q
from scipy.spatial.transform import Rotation

from robots import Kinematics, RobotError, load_robot

POSE = ((0.03, -0.02, 0.12), (20.0, -30.0, 75.0))
STAND = ((0.4, -0.3, 0.8), (5.0, 10.0, 90.0))
TCP_JOINT = """<link name="tip"/><joint name="to tip" type="fixed"><parent link="{tool}"/>
<child link="tip"/><origin xyz="{x} {y} {z}" rpy="{roll} {pitch} {yaw}"/></joint></robot>"""


def matrix(pose):
    position, rpy_deg = pose
    placed = np.eye(4)
    placed[:3, :3] = Rotation.from_euler("xyz", rpy_deg, degrees=True).as_matrix()
    placed[:3, 3] = position
    return placed


def tool_frames(robot, q):
    """(m, 4, 4) the TCP in the world."""
    data, found = robot.model.createData(), []
    for row in q:
        pin.forwardKinematics(robot.model, data, Kinematics(robot).configuration(row))
        pin.updateFramePlacement(robot.model, data, robot.tool_frame_id)
        found.append(data.oMf[robot.tool_frame_id].homogeneous.copy())
    return np.array(found)


def last_rotation(chain, q):
    """(3, 3) of the last joint's frame, by the constants of the chain."""
    turned = np.eye(3)
    for rotation, slides, value in zip(chain.rotations, chain.prismatic, q, strict=True):
        turned = turned @ rotation
        turned = turned if slides else turned @ Rotation.from_rotvec([0, 0, value]).as_matrix()
    return turned


@pytest.mark.parametrize("given", [POSE, matrix(POSE), pin.SE3(matrix(POSE))])
def test_a_pose_is_a_pair_or_a_matrix(given):
    robot = load_robot("ur5", tcp=given, base=given)
    np.testing.assert_allclose(robot.tcp, matrix(POSE), atol=1e-15)
    np.testing.assert_allclose(robot.base, matrix(POSE), atol=1e-15)
    again = pickle.loads(pickle.dumps(robot))
    np.testing.assert_array_equal(again.tcp, robot.tcp)
    assert repr(again) == "Robot('ur5', 6 joints, tool 'tool0' + (0.03, -0.02, 0.12) m)"


@pytest.mark.parametrize("seed", range(3))
def test_tcp_and_base_are_where_they_are_said_to_be(seed, tmp_path):
    rng = np.random.default_rng(seed)
    text = random_arm(rng)
    plain = load_text(tmp_path, text)
    moved = load_text(tmp_path, text, tcp=POSE, base=STAND)
    q = np.array([random_q(plain, rng) for _ in range(50)])
    expected = matrix(STAND) @ tool_frames(plain, q) @ matrix(POSE)
    found = tool_frames(moved, q)
    np.testing.assert_allclose(found, expected, atol=1e-11)
    for row, frame in zip(q, found, strict=True):
        turned = last_rotation(moved.chain, row)
        for axis in ("approach", "reference"):
            given = getattr(moved, f"{axis}_axis")
            placed = turned @ getattr(moved.chain, axis)
            np.testing.assert_allclose(placed, frame[:3, :3] @ given, atol=1e-11)


@pytest.mark.parametrize("seed", range(3))
def test_a_tcp_by_a_fixed_joint_is_the_same(seed, tmp_path):
    text = random_arm(np.random.default_rng(seed))
    given = load_text(tmp_path, text, tcp=POSE)
    (x, y, z), rpy_deg = POSE
    roll, pitch, yaw = np.radians(rpy_deg)
    end = TCP_JOINT.format(tool=given.tool_frame, x=x, y=y, z=z, roll=roll, pitch=pitch, yaw=yaw)
    joined = load_text(tmp_path, text.replace("</robot>", end), tool_frame="tip")
    for one, other in zip(given.chain, joined.chain, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-14)
    assert np.isclose(given.reach, joined.reach)


@pytest.mark.parametrize(
    ("approach", "reference", "expected"),
    [
        ((0, 0, 1), None, (1, 0, 0)),
        ((-2, 0, 0), None, (0, 0, 1)),
        ((1, 1e-7, 0), None, (0, 0, 1)),
        ((1, 0, 1), None, (np.sqrt(0.5), 0, -np.sqrt(0.5))),
        ((0, 0, 1), (0, 3e200, 5e200), (0, 1, 0)),
    ],
)
def test_the_reference_axis_is_across_the_approach_axis(approach, reference, expected):
    robot = load_robot("ur5", approach_axis=np.array(approach), reference_axis=reference)
    np.testing.assert_allclose(robot.reference_axis, expected, atol=2e-7)
    assert abs(robot.reference_axis @ robot.approach_axis) < 1e-15
    assert np.isclose(np.linalg.norm(robot.reference_axis), 1.0, atol=1e-15)
    with pytest.raises(ValueError, match="read-only"):
        robot.reference_axis[0] = 0.0


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        (
            {"tcp": ((0, 0, 1e4), (0, 0, 0))},
            r"tcp.position .* with a number beyond 10; millimetres\?$",
        ),
        ({"tcp": ((0, 0, np.nan), (0, 0, 0))}, "tcp.position must be three finite numbers"),
        ({"tcp": ((0, 0, 0), "z")}, r"tcp.rpy_deg must be three finite numbers \(degrees\)"),
        ({"tcp": np.diag([1, 1, -1, 1])}, "tcp must be a pair .* without scale or mirror"),
        ({"tcp": np.diag([np.inf, 1, 1, 1])}, "tcp must be a pair .* rigid motion"),
        ({"base": 7}, r"base must be a pair \(position, rpy_deg\), or a 4 x 4 matrix .* got 7"),
        ({"reference_axis": (0, 0, -2)}, "reference_axis must point across .* parallel"),
        ({"reference_axis": (0, 0, 0)}, "reference_axis must be three finite numbers that are"),
    ],
)
def test_poses_and_axes_that_make_no_sense(asked, message):
    with pytest.raises(RobotError, match=message):
        load_robot("ur5", **asked)


def test_all_that_is_wrong_is_said_at_once():
    with pytest.raises(RobotError) as caught:
        load_robot("ur5", tcp=7, base=((0, 0, 2e4), (0, 0, 0)), reference_axis=(0, 0, 0))
    assert [fault.key for fault in caught.value.faults] == [
        "reference_axis",
        "tcp",
        "base.position",
    ]


def test_a_value_with_both_axes_alike_is_refused():
    with pytest.raises(RobotError, match="not parallel to the approach axis"):
        replace(load_robot("ur5"), reference_axis=(0, 0, 1))
