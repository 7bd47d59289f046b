"""Walls before plates: proofs over boxes of joints are confirmed, and refuted by no landing."""

from __future__ import annotations

import numpy as np
import pytest
from arm_scenes import behind_a_wall, clear_box, clear_landing
from built_scenes import ARMS

from feasibility import Answer, CauseKind, Evidence, check
from feasibility.certification import verify_proof
from feasibility.certification.joint_boxes import Overlapping
from feasibility.cut_tree import CutTree, Leaf
from feasibility.roadmap.joint_boxes import JointBoxes

LANDINGS = 2000
WALLS = 10  # of each arm
CLEAR = 300  # boxes around configurations that are clear, of each arm
PROVED = 8  # of the walls before the PUMA


@pytest.mark.parametrize("name", ["puma560", "puma560 on a rail", "ur5"])
def test_walls_are_proved_and_no_landing_refutes_them(name: str) -> None:
    proofs = 0
    for seed in range(1000, 1000 + WALLS):
        robot, cells, task = behind_a_wall(name, seed)
        verdict = check(robot, cells, task)
        assert verdict.answer is not Answer.FEASIBLE
        proofs += verdict.evidence is Evidence.PROOF
        for cause in verdict.causes:
            if cause.proved and cause.kind is CauseKind.COLLISION:
                assert verify_proof(robot, cells, task, CutTree(Leaf(cause.cell))).accepted, seed
                rng = np.random.default_rng(seed)
                assert not clear_landing(robot, cells, task, cause.cell, LANDINGS, rng), seed
    print(f"{name}: {proofs} of {WALLS} walls are proofs")
    assert proofs >= PROVED or name != "puma560"


@pytest.mark.parametrize("name", ARMS)
def test_nothing_is_claimed_around_clear_configurations(name: str) -> None:
    asked = 0
    for seed in range(1000, 1000 + CLEAR):
        found = clear_box(name, seed)
        if found is None:
            continue
        asked += 1
        case = JointBoxes(found.robot, found.bodies, found.task)
        assert case.any_clear(found.q[None]), seed
        target = case.target(found.point, found.approach)
        assert case.blocking(target, found.low, found.high, most=300) is None, seed
        overlapping = Overlapping(found.robot, found.bodies)
        assert overlapping is not None
        box = found.low[None], found.high[None]
        assert not overlapping.everywhere(*box, found.point[None], np.array([0.001]))[0], seed
    print(f"{asked} boxes around clear configurations")
    assert asked > 0.1 * CLEAR
