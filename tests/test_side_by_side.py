"""What the table of tools side by side stands on; none of the other tools is needed for it."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from eaik_ladder import shortest_way, within
from foreign_replay import STEP, chain, dense, measured, off_the_lines, placed
from squares import BASE, SQUARES, TIP, bare_urdf

from robots import list_robots

UR5 = Path(next(robot for robot in list_robots() if robot.name == "ur5").urdf).read_text()


@pytest.mark.parametrize("seed", range(20))
def test_the_way_up_the_ladder_is_the_shortest_of_all(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rungs = [rng.normal(size=(rng.integers(1, 4), 2)) for _ in range(5)]
    way = shortest_way(rungs)

    def length(of: tuple[int, ...]) -> float:
        q = np.array([rung[k] for rung, k in zip(rungs, of, strict=True)])
        return float(np.linalg.norm(np.diff(q, axis=0), axis=1).sum())

    least = min(map(length, itertools.product(*(range(len(rung)) for rung in rungs))))
    assert length(tuple(way)) == pytest.approx(least, rel=1e-12)


def test_solutions_are_turned_into_the_limits_or_left_out() -> None:
    q = np.array([[0.5 + 2 * np.pi, 0.0], [3.0, 0.0], [0.0, -1.0 - 2 * np.pi]])
    found = within(q, np.array([-1.0, -2.0]), np.array([2.0, 2.0]))
    assert np.allclose(found, [[0.5, 0.0], [0.0, -1.0]], atol=1e-12)


def test_poses_are_run_to_and_fro_and_the_tool_points_down() -> None:
    for square in SQUARES:
        points = square.points()
        assert points.shape == (90, 3)
        apart = np.linalg.norm(np.diff(points, axis=0), axis=1)
        assert apart.max() == pytest.approx(square.side / 9)  # no way back over the square
        assert np.allclose(points.mean(axis=0), square.centre)
        turned = square.rotations()
        assert len(turned) == (1 if square.fixed else 24)
        assert np.allclose(turned @ turned.transpose(0, 2, 1), np.eye(3), atol=1e-15)
        assert np.allclose(np.linalg.det(turned), 1.0)
        assert np.allclose(turned[:, :, 2], [0, 0, -1])
        assert np.allclose(turned[0], np.diag([1, -1, -1]))


@pytest.mark.parametrize("square", [SQUARES[0], SQUARES[-1]], ids=lambda square: square.name)
def test_the_replay_places_the_tool_as_pinocchio_does(square) -> None:
    urdf = bare_urdf(UR5, square)
    joints, model = chain(urdf, BASE, TIP), pin.buildModelFromXML(urdf)
    turning = [joint for joint in joints if joint.axis is not None]
    assert [joint.name for joint in turning] == list(model.names)[1:]
    for joint, low, high in zip(
        turning, model.lowerPositionLimit, model.upperPositionLimit, strict=True
    ):
        assert (joint.low, joint.high) == (low, high)
        if joint.name in square.limits_deg:
            assert np.allclose(np.degrees([low, high]), square.limits_deg[joint.name])
    data, base, tip = model.createData(), model.getFrameId(BASE), model.getFrameId(TIP)
    q = np.random.default_rng(1).uniform(-3, 3, (5, 6))
    for row, found in zip(q, placed(joints, q), strict=True):
        pin.framesForwardKinematics(model, data, row)
        expected = data.oMf[base].actInv(data.oMf[tip])
        assert np.allclose(found, expected.homogeneous, atol=1e-12)


def test_the_replay_looks_everywhere_and_at_every_row() -> None:
    q = np.array([[0.0, 0.0], [0.3, -1.0], [0.3, -1.0]])
    looked = dense(q)
    assert np.abs(np.diff(looked, axis=0)).max() <= STEP * (1 + 1e-9)
    assert all((np.abs(looked - row).max(axis=1) < 1e-15).any() for row in q)
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0]])
    points = np.array([[0.5, -0.2, 0], [1.3, 0.4, 0.4], [-3, 4, 0]])
    assert np.allclose(off_the_lines(points, corners), [0.2, 0.5, 5.0])


def test_a_jump_a_miss_and_a_limit_are_seen() -> None:
    square = SQUARES[-1]
    joints = chain(bare_urdf(UR5, square), BASE, TIP)
    down = np.radians([0.0, -90.0, 90.0, -90.0, -90.0, 0.0])
    at = placed(joints, down[None])[0]
    assert np.allclose(at[:3, 2], [0, 0, -1])  # the tool points down in this posture
    turn = np.radians([20.0, 0, 0, 0, 0, 0])  # about the upright axis of the first joint
    there = placed(joints, (down + turn)[None])[0]
    poses = np.array([at[:3, 3], there[:3, 3]])
    seen = measured(joints, np.array([down, down + turn]), poses, at[:3, :3])
    radius = np.hypot(*at[:2, 3])
    assert seen.missed_mm == pytest.approx(0.0, abs=1e-9)
    assert seen.line_mm == pytest.approx(1e3 * radius * (1 - np.cos(np.radians(10))), rel=1e-4)
    assert (seen.plane_mm, seen.tilt_deg) == (
        pytest.approx(0, abs=1e-9), pytest.approx(0, abs=1e-6),
    )  # fmt: skip
    assert seen.roll_deg == pytest.approx(20.0)
    assert seen.step_deg == pytest.approx(20.0)
    assert seen.beyond_deg == 0.0

    up = np.radians([0.0, -10.0, 0, 0, 0, 0])
    far = measured(joints, np.array([down, down + turn + up, down - 4 * up]), poses, None)
    assert far.missed_mm > 10.0
    assert far.tilt_deg == pytest.approx(40.0)
    assert (far.step_deg, far.beyond_deg) == (pytest.approx(50.0), 0.0)
    beyond = measured(joints, np.array([down, down + 4 * up]), poses, None)
    assert beyond.beyond_deg == pytest.approx(10.0)
