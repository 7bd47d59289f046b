"""Boxes of joints: bounds that hold, contraction that loses nothing, proofs that are confirmed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from arm_scenes import behind_a_wall, clear_box, clear_landing
from built_scenes import arm

from feasibility import CauseKind, Evidence, check
from feasibility.certification import verify_proof
from feasibility.certification.joint_boxes import Overlapping
from feasibility.roadmap.joint_boxes import JointBoxes
from feasibility.roadmap.joint_boxes.at_target import at_target
from feasibility.roadmap.joint_boxes.frames import Boxes, frames_at, moves, moves_from_tool
from robots import Kinematics

FEW = ("puma560", "puma560 on a rail", "ur5")
ROUNDING = 1e-9
BOXES, SAMPLES = 40, 30
CLEAR = 60  # boxes around configurations that are clear, of each arm


def random_boxes(name: str) -> Boxes:
    """Boxes of all sizes."""
    rng, robot = np.random.default_rng(5), arm(name)
    middle = rng.uniform(-2.5, 2.5, (BOXES, robot.n))
    half = 10.0 ** rng.uniform(-3.0, 0.0, (BOXES, 1)) * rng.uniform(0.0, 1.0, middle.shape)
    return Boxes(middle - half, middle + half)


def samples(boxes: Boxes) -> np.ndarray:
    """(SAMPLES, BOXES, n) configurations of boxes, most of them at corners."""
    rng = np.random.default_rng(6)
    shares = np.clip(1.2 * rng.uniform(-1.0, 1.0, (SAMPLES, *boxes.low.shape)), -1.0, 1.0)
    return boxes.centre + shares * boxes.half


@pytest.mark.parametrize("name", FEW)
def test_frames_are_those_of_pinocchio(name: str) -> None:
    robot = arm(name)
    q = random_boxes(name).centre
    frames, expected = frames_at(robot.chain, q), Kinematics(robot).joints(q)
    tips, axes = Kinematics(robot).tools(q)
    assert np.abs(frames.points - expected.points).max() < ROUNDING
    tip = frames.carried(robot.n, robot.chain.translations[-1:])[:, 0]
    assert np.abs(tip - tips).max() < ROUNDING
    assert np.abs(frames.rotations[:, -1] @ robot.chain.approach - axes).max() < ROUNDING


@pytest.mark.parametrize("name", FEW)
def test_no_point_moves_further_than_the_bounds(name: str) -> None:
    robot, boxes = arm(name), random_boxes(name)
    chain, n = robot.chain, robot.n
    middles = frames_at(chain, boxes.centre)
    places = np.array([[0.2, -0.1, 0.3]])
    for joint in range(1, n + 1):
        x = middles.carried(joint, places)
        bound = moves(chain, middles, boxes.half, x, joint).by_joint
        tool, from_tool = moves_from_tool(chain, middles, boxes.half, x, joint)
        inner = joint // 2
        tightest = 0.0
        for q in samples(boxes):
            frames = frames_at(chain, q)
            y = frames.carried(joint, places)
            moved = np.linalg.norm(y - x, axis=2)
            assert (moved <= bound.sum(axis=2) + ROUNDING).all()
            tightest = max(tightest, float((moved / bound.sum(axis=2)).max()))
            seen = [
                np.einsum("mki,mij->mkj", z - f.points[:, inner, None], f.rotations[:, inner])
                for z, f in ((x, middles), (y, frames))
            ]
            seen_moved = np.linalg.norm(seen[1] - seen[0], axis=2)
            assert (seen_moved <= bound[..., inner:].sum(axis=2) + ROUNDING).all()
            tip = frames.carried(n, chain.translations[-1:])
            changed = np.linalg.norm((y - tip) - (x - tool[:, None]), axis=2)
            assert (changed <= from_tool.sum(axis=2) + ROUNDING).all()
        assert tightest > 0.2


@pytest.mark.parametrize("name", FEW)
def test_contraction_loses_no_configuration_at_the_target(name: str) -> None:
    robot, boxes, cut = arm(name), random_boxes(name), 0
    for seed in range(CLEAR):
        found = clear_box(name, seed, asked_for=False)
        assert found is not None
        case = JointBoxes(robot, found.bodies, found.task)
        target = case.target(found.point, found.approach)
        boxes = Boxes(found.low[None], found.high[None])
        left = at_target(robot.chain, frames_at(robot.chain, boxes.centre), boxes, target, 0.2)
        assert left.kept[0]
        assert (left.boxes.low[0] <= found.q + ROUNDING).all()
        assert (left.boxes.high[0] >= found.q - ROUNDING).all()
        cut += (left.boxes.high - left.boxes.low).sum() < 0.9 * (found.high - found.low).sum()
    assert cut > 5


@pytest.mark.parametrize("name", FEW[:2])
def test_nothing_is_claimed_where_a_configuration_is_clear(name: str) -> None:
    asked = 0
    for seed in range(CLEAR // 4):
        found = clear_box(name, seed)
        if found is None:
            continue
        asked += 1
        case = JointBoxes(found.robot, found.bodies, found.task)
        target = case.target(found.point, found.approach)
        assert case.any_clear(found.q[None]), seed
        assert case.blocking(target, found.low, found.high, most=200) is None, seed
        overlapping = Overlapping(found.robot, found.bodies)
        assert overlapping is not None
        box = found.low[None], found.high[None]
        assert not overlapping.everywhere(*box, found.point[None], np.array([0.001]))[0], seed
    assert asked > 3


def test_a_wall_before_a_plate_is_a_proof_that_landings_bear_out() -> None:
    robot, cells, task = behind_a_wall("puma560", 0)
    verdict = check(robot, cells, task)
    assert verdict.evidence is Evidence.PROOF
    assert "wherever the tool is" in verdict.message
    (cause,) = verdict.causes
    assert cause.proved
    assert cause.kind is CauseKind.COLLISION
    assert cause.pair is not None
    assert verdict.proof is not None
    assert verify_proof(robot, cells, task, verdict.proof).accepted
    assert not clear_landing(robot, cells, task, 0, 10, np.random.default_rng(0))
    without = replace(task, collision=None)
    assert not verify_proof(robot, cells, without, verdict.proof).accepted
