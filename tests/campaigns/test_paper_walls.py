"""The paper's cases with their surfaces as walls, and an arm between a post and a shelf."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from foreign_clearances import assert_clear
from paper_cases import PAPER_CASES

from feasibility import Answer, CauseKind, Evidence, Search, check
from feasibility.cases import load_case
from feasibility.collisions import Collision

SHELF = Path(__file__).parents[1] / "feasibility" / "ur5_post_and_shelf.toml"
LIMIT = 120.0  # s
WALLS = Collision(clearance=0.005)


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("name", ["4a", "4c", "4e", "5e"])
def test_cases_are_feasible_with_their_walls(name: str, seed: int) -> None:
    case = PAPER_CASES[name]
    found = check(case.robot(), case.cells(), case.task(), Search(seed=seed), collision=WALLS)
    assert (found.answer, found.evidence) == (Answer.FEASIBLE, Evidence.WITNESS)
    assert found.certificate is not None
    assert found.certificate.min_clearance is not None
    if seed == 0:
        assert_clear(found, 0.5)


def test_5f_is_decided_or_nearly_covered() -> None:
    case = PAPER_CASES["5f"]
    found = check(case.robot(), case.cells(), case.task(), collision=WALLS)
    if found.answer is Answer.FEASIBLE:
        assert_clear(found, 0.5)
        return
    assert found.n_covered >= 88
    missed = set(np.flatnonzero(~found.covered).tolist())
    assert {cause.cell for cause in found.causes} == missed
    assert all(
        cause.kind in (CauseKind.COLLISION, CauseKind.DISCONNECTED) for cause in found.causes
    )


def test_between_post_and_shelf_almost_all_is_covered() -> None:
    setup = load_case(SHELF).build()
    found = check(setup.robot, setup.cells, setup.task, Search(time_limit=LIMIT))
    if found.answer is Answer.FEASIBLE:
        assert_clear(found, 0.5)
        return
    assert found.n_covered >= 46
    assert found.causes
    assert any(cause.pair or "would collide" in cause.detail for cause in found.causes)
