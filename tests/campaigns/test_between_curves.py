"""100 random cases that are feasible over the patch, and not along the curves between centres."""

from functools import partial

import pytest
from draw_between_curves import moves, read_between
from oracle_build import built
from tally import assert_all_feasible, tally

from feasibility import Search
from robots import load_robot

CASES = read_between()
PUMA = load_robot("puma560")


def setup(problem, seed):
    return (*built(problem, PUMA), Search(seed=seed))


@pytest.mark.parametrize("seed", [0, 1])
def test_none_is_called_infeasible(seed):
    cases = enumerate(CASES)
    assert_all_feasible(tally((str(k), partial(setup, case.problem, seed)) for k, case in cases))


@pytest.mark.parametrize("case", CASES, ids=range(len(CASES)))
def test_the_oracle_has_a_motion(case):
    assert moves(case.problem) is not None
