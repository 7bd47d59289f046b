"""A sample of `make campaign NAME=oracle`: the oracles know the answers of a few cases."""

import numpy as np
import puma_oracle
import pytest
import ur5_oracle
from oracle_cases import Answer, Problem
from random_cases import TABLE_1, read

DOME = ("sphere", (1.0,), (10, 90), (10, 180))
TUBE = ("cylinder", (0.5,), (-60, 60), (0, 0.9))
CENTRED = (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("surface", "limits", "best"), [(DOME, 1, 90), (TUBE, 3, 60)], ids=["4a", "4d"]
)
def test_two_of_the_papers_cases_have_their_known_answers(surface, limits, best):
    limits_deg = TABLE_1[limits - 1]
    problem = Problem(*surface, CENTRED, CENTRED, "inside", (9, 10), 0.005, 45, limits_deg)
    assert puma_oracle.solve(problem, "patch") == Answer(best == 90, best, best)


@pytest.mark.parametrize(("arm", "oracle"), [("puma560", puma_oracle), ("ur5", ur5_oracle)])
def test_a_stored_answer_is_the_oracles(arm, oracle):
    stored = read(arm)
    number = int(np.random.default_rng(7).integers(len(stored)))
    problem, answer = stored[number]
    assert oracle.solve(problem, "patch") == answer
