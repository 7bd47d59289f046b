"""A sample of `make campaign NAME=oracle`: the oracles know the answers of a few cases."""

import numpy as np
import puma_oracle
import pytest
import ur5_oracle
from oracle_cases import Answer, Problem
from random_cases import TABLE_1, read

TUBE = ("cylinder", (0.5,), (-60, 60), (0, 0.9))
CENTRED = (0.0, 0.0, 0.0)


def test_one_of_the_papers_cases_has_its_known_answer():
    """4d; the others take longer: `make campaign NAME=oracle`."""
    problem = Problem(*TUBE, CENTRED, CENTRED, "inside", (9, 10), 0.005, 45, TABLE_1[2])
    assert puma_oracle.solve(problem, "patch") == Answer(False, 60, 60)


@pytest.mark.parametrize(("arm", "oracle"), [("puma560", puma_oracle), ("ur5", ur5_oracle)])
def test_a_stored_answer_is_the_oracles(arm, oracle):
    stored = read(arm)
    number = int(np.random.default_rng(7).integers(len(stored)))
    problem, answer = stored[number]
    assert oracle.solve(problem, "patch") == answer
