"""All stored problems of the oracles: none answered wrongly, and each "no" is a proof."""

import pytest
from oracle_build import built
from random_cases import read

from feasibility import check
from feasibility.verdict import Evidence
from robots import load_robot


@pytest.mark.parametrize("name", ["puma560", "ur5"])
def test_every_stored_problem_is_decided(name):
    arm, wrong = load_robot(name), []
    for number, (problem, truth) in enumerate(read(name)):
        verdict = check(*built(problem, arm))
        expected = Evidence.WITNESS if truth.feasible else Evidence.PROOF
        if verdict.evidence is not expected:
            wrong.append((number, verdict.evidence, verdict.message))
    assert not wrong
