"""Where arms have their tools: Pinocchio, the compiled chain, and the referee's reader of URDFs."""

import dataclasses
import pickle

import numpy as np
import pytest
from arm_urdfs import UNLIKE, arm, joint, load_text, random_arm, random_q, unlike
from plain import arm_of
from samples import sampled, seeds, spread

from coverable import RobotError, list_robots, load_robot
from robots.chain import frames, jacobians, moved_by_joints
from robots.kinematics import Kinematics

CLOSE = {"rtol": 0, "atol": 1e-12}


def by_chain(chain, q):
    """Point, axis, their Jacobians and the reference axis by the compiled kernels."""
    n = len(q)
    origins, axes = np.empty((n, 3)), np.empty((n, 3))
    point, axis, reference = np.empty((3, 3))
    rows = np.empty((3, n)), np.empty((3, n))
    frames(chain, q, origins, axes, point, axis, reference)
    jacobians(chain, origins, axes, point, axis, *rows)
    return point, axis, *rows, reference


def check_arm(robot, rng, samples):
    """Pinocchio against the URDF's rules, the chain against Pinocchio, slopes as differences."""
    kinematics = Kinematics(robot)
    q = np.array([random_q(robot, rng) for _ in range(samples)])
    points, axes = kinematics.tools(q)
    moved = moved_by_joints(robot.chain, q).transpose(2, 0, 1)
    placed = arm_of(robot).tool(q)
    for k, (row, twists) in enumerate(zip(q, kinematics.twists(q), strict=True)):
        point, axis = kinematics.tool(row)
        np.testing.assert_allclose((points[k], axes[k]), (point, axis), rtol=0, atol=2e-15)
        np.testing.assert_allclose(point, placed[0][k], **CLOSE)
        np.testing.assert_allclose(axis, placed[1][k], **CLOSE)
        rows = kinematics.jacobians(row)
        expected = point, axis, *rows, placed[2][k]
        for ours, theirs in zip(by_chain(robot.chain, row), expected, strict=True):
            np.testing.assert_allclose(ours, theirs, **CLOSE)
        np.testing.assert_allclose(moved[k], rows[0].T, rtol=0, atol=1e-9)
        at_tool = twists[:3] + np.cross(twists[3:], point, axis=0)
        np.testing.assert_allclose(at_tool, rows[0], **CLOSE)
    for i, shift in enumerate(1e-5 * np.eye(robot.n)):
        ends = zip(kinematics.tool(row + shift), kinematics.tool(row - shift), strict=True)
        for slopes, (ahead, behind) in zip(rows, ends, strict=True):
            np.testing.assert_allclose(slopes[:, i], (ahead - behind) / 2e-5, rtol=0, atol=2e-9)


@sampled("info", spread(list_robots(), 16), ids=lambda info: info.name)
def test_arms_of_the_library(info):
    check_arm(load_robot(info.name), np.random.default_rng(3), 5)


def test_an_arm_on_its_lift():
    check_arm(unlike(UNLIKE[-1]), np.random.default_rng(3), 5)


@sampled("seed", seeds(25, all=500))
def test_random_chains(seed, tmp_path):
    rng = np.random.default_rng(seed)
    more = {"approach_axis": rng.normal(size=3), "tcp": ((0.03, -0.02, 0.12), (20, -30, 75))}
    check_arm(load_text(tmp_path, random_arm(rng), **more), rng, 5)


@pytest.mark.parametrize("tilt", [0.0, 1e-15, 1e-9, 1e-8, 1e-7, 1e-3])
@pytest.mark.parametrize("sign", [1, -1])
def test_axes_that_are_almost_z_keep_their_tilt(tilt, sign, tmp_path):
    text = arm([joint(1, axis=(tilt, 0, sign)), joint(2, xyz=(1, 0, 0), axis=(0, tilt, sign))])
    check_arm(load_text(tmp_path, text), np.random.default_rng(7), 10)


def test_rows_of_the_wrong_shape_are_refused():
    kinematics = Kinematics(load_robot("puma560"))
    tools, tool = kinematics.tools, kinematics.tool
    for ask, shape in ((tools, (2, 5)), (tools, (6,)), (tool, (1, 6))):
        with pytest.raises(ValueError, match="must have"):
            ask(np.zeros(shape))


def test_a_chain_is_serial_and_pickles():
    panda = load_robot("panda")
    with pytest.raises(RobotError, match="do not form one serial chain"):
        _ = dataclasses.replace(panda, tool_frame="panda_link3").chain
    assert panda.chain is panda.chain
    copy = pickle.loads(pickle.dumps(panda))
    for value, expected in zip(copy.chain, panda.chain, strict=True):
        np.testing.assert_array_equal(value, expected)


def test_a_chain_that_differs_from_pinocchio_is_refused(monkeypatch):
    """The one fault that no file can bring about: a rotation that is none of the arm's."""
    monkeypatch.setattr("robots.chain._rotation_onto", lambda axis: np.eye(3))
    assert dataclasses.replace(load_robot("panda")).chain  # all its axes are z
    with pytest.raises(RobotError, match="differ by"):
        _ = dataclasses.replace(load_robot("ur5")).chain
