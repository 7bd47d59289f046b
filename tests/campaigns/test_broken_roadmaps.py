"""Feasible cases with broken roadmaps: the prover never finds a proof, with Newton or without."""

import numpy as np
import pytest
from broken_roadmaps import proved_wrongly, stored

from robots import load_robot

SPLITS = 4  # of each case
BUDGET = 40_000  # boxes


@pytest.mark.parametrize("newton", [True, False], ids=["newton", "boxes alone"])
@pytest.mark.parametrize("arm", ["puma560", "ur5"])
@pytest.mark.parametrize("part", range(4))
def test_a_feasible_case_is_never_proved(arm, newton, part):
    robot, rng = load_robot(arm), np.random.default_rng(part)
    outcomes = [
        proved_wrongly(robot, problem, rng, newton, BUDGET)
        for problem in stored(arm, feasible=True)[part::4]
        for _ in range(SPLITS)
    ]
    print(f"{outcomes.count(False)} refused, {outcomes.count(None)} without a covering component")
    assert outcomes.count(False) >= SPLITS
    assert True not in outcomes
