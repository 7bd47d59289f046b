"""Proofs that the tool collides in every pose: never against a known pose, refuted by no other."""

from __future__ import annotations

import numpy as np
import pytest
from built_scenes import ARMS
from tool_scenes import Over, planted_over, random_over, with_an_object_over_a_cell

from feasibility import CauseKind, Evidence, check
from feasibility.certification import verify_proof

BLOCKS = 10
SCENES = 50  # of a block
PLANTED = 84  # of each arm, of which the known pose is clear
LANDINGS = 2000
PROVED = 4  # scenes of each arm


@pytest.mark.parametrize("block", range(BLOCKS))
def test_claims_are_confirmed_and_no_pose_refutes_them(block: int) -> None:
    claims = 0
    for seed in range(1000 + SCENES * block, 1000 + SCENES * (block + 1)):
        over, rng = random_over(seed), np.random.default_rng(seed)
        claimed = over.claimed()
        if claimed is not None:
            claims += 1
            assert over.confirmed().confirmed, seed
            assert not over.clear_pose(LANDINGS, rng), seed
        elif over.clear_pose(60, rng):
            assert not over.confirmed().confirmed, seed
    print(f"{claims} of {SCENES} scenes are proved")
    assert claims >= 0.2 * SCENES


@pytest.mark.parametrize("name", ARMS)
def test_a_cell_with_a_known_pose_is_never_proved(name: str) -> None:
    known, seed = 0, 1000
    while known < PLANTED:
        over, seed = planted_over(name, seed), seed + 1
        if over is not None:
            known += 1
            assert over.claimed() is None, seed
            assert not over.confirmed().confirmed, seed
    print(f"{known} poses that are clear, of {seed - 1000}")


@pytest.mark.parametrize("name", ARMS)
@pytest.mark.parametrize("seed", range(1000, 1000 + PROVED))
def test_an_object_over_a_cell_is_a_proof_that_landings_bear_out(name: str, seed: int) -> None:
    robot, cells, task, cell = with_an_object_over_a_cell(name, seed)
    verdict = check(robot, cells, task)
    assert verdict.evidence is Evidence.PROOF
    assert verdict.proof is not None
    assert verify_proof(robot, cells, task, verdict.proof).accepted
    proved = [one for one in verdict.causes if one.proved and one.kind is CauseKind.COLLISION]
    assert cell in [one.cell for one in proved]
    rng = np.random.default_rng(seed)
    for one in proved:
        over = Over.cell(robot, cells, task, one.cell)
        assert over.confirmed().confirmed
        assert not over.clear_pose(LANDINGS, rng)
