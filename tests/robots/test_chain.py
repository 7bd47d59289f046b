"""The compiled chain against Pinocchio, on real arms and on random chains."""

import dataclasses
import pickle

import numpy as np
import pytest
from arm_urdfs import UNLIKE, arm, joint, load_text, random_arm, random_q, unlike

import robots.chain
from robots import Kinematics, Robot, RobotError, frames, jacobians, load_robot


def evaluate(chain, q):
    """Point, axis and their Jacobians by the kernels."""
    n = len(q)
    origins, axes = np.empty((n, 3)), np.empty((n, 3))
    point, axis = np.empty(3), np.empty(3)
    point_rows, axis_rows = np.empty((3, n)), np.empty((3, n))
    frames(chain, q, origins, axes, point, axis, np.empty(3))
    jacobians(chain, origins, axes, point, axis, point_rows, axis_rows)
    return point, axis, point_rows, axis_rows


def check_against_pinocchio(robot: Robot, samples: int) -> None:
    chain, authority = robot.chain, Kinematics(robot)
    rng = np.random.default_rng(7)
    for _ in range(samples):
        q = random_q(robot, rng)
        ours = evaluate(chain, q)
        for value, expected in zip(
            ours, (*authority.tool(q), *authority.jacobians(q)), strict=True
        ):
            np.testing.assert_allclose(value, expected, rtol=0, atol=1e-12)
    step = 1e-5
    for i in range(robot.n):
        shift = step * np.eye(robot.n)[i]
        after, before = evaluate(chain, q + shift), evaluate(chain, q - shift)
        for value, rows in ((0, 2), (1, 3)):
            slope = (after[value] - before[value]) / (2 * step)
            np.testing.assert_allclose(ours[rows][:, i], slope, rtol=0, atol=2e-9)


@pytest.mark.parametrize("name", UNLIKE)
def test_real_arms(name):
    check_against_pinocchio(unlike(name), samples=50)


@pytest.mark.parametrize("seed", range(40))
def test_random_chains(seed, tmp_path):
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=3)
    check_against_pinocchio(load_text(tmp_path, random_arm(rng), approach_axis=axis), samples=20)


@pytest.mark.parametrize("tilt", [0.0, 1e-15, 1e-9, 1e-8, 1e-7, 1e-3])
@pytest.mark.parametrize("sign", [1, -1])
def test_axes_that_are_almost_z_keep_their_tilt(tilt, sign, tmp_path):
    text = arm([joint(1, axis=(tilt, 0, sign)), joint(2, xyz=(1, 0, 0), axis=(0, tilt, sign))])
    check_against_pinocchio(load_text(tmp_path, text), samples=20)


def test_frames_of_a_planar_arm_are_those_worked_out_by_hand(tmp_path):
    text = arm([joint(1), joint(2, xyz=(2, 0, 0)), joint(3, "fixed", xyz=(1, 0, 0))])
    robot = load_text(tmp_path, text, approach_axis=(1, 0, 0))
    point, axis, point_rows, axis_rows = evaluate(robot.chain, np.array([np.pi / 2, np.pi / 2]))
    np.testing.assert_allclose(point, [-1, 2, 0], atol=1e-15)
    np.testing.assert_allclose(axis, [-1, 0, 0], atol=1e-15)
    np.testing.assert_allclose(point_rows, [[-2, 0], [-1, -1], [0, 0]], atol=1e-15)
    np.testing.assert_allclose(axis_rows, [[0, 0], [-1, -1], [0, 0]], atol=1e-15)


def test_a_branched_model_is_refused():
    panda = load_robot("panda")
    with pytest.raises(RobotError, match="do not form one serial chain"):
        _ = dataclasses.replace(panda, tool_frame="panda_link3").chain


def test_a_chain_that_differs_from_pinocchio_is_refused(monkeypatch):
    monkeypatch.setattr(robots.chain, "_rotation_onto", lambda axis: np.eye(3))
    assert load_robot("panda").chain  # all its axes are z
    with pytest.raises(RobotError, match="differ by"):
        _ = load_robot("ur5").chain


def test_the_comparison_with_pinocchio_happens_once_for_each_robot(monkeypatch):
    compared = []
    tool = robots.chain.tool
    monkeypatch.setattr(
        robots.chain, "tool", lambda chain, q: compared.append(chain) or tool(chain, q)
    )
    robot = load_robot("panda")
    assert robot.chain is robot.chain is compared[0]
    assert len(compared) == robots.chain.SAMPLES
    copy = pickle.loads(pickle.dumps(robot))
    for value, expected in zip(copy.chain, robot.chain, strict=True):
        np.testing.assert_array_equal(value, expected)
    assert len(compared) == 2 * robots.chain.SAMPLES
