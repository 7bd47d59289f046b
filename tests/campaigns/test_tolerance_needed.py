"""100 random cases that are feasible only off the exact centres of some cells."""

from functools import partial

import pytest
from planted import assert_covers, planted_motion, read_planted
from tally import assert_all_feasible, tally

CASES = read_planted("tolerance_needed")
SEEDS = (0, 1)


@pytest.mark.parametrize("seed", SEEDS)
def test_none_is_called_infeasible(seed):
    assert_all_feasible(tally((case.name, partial(case.setup, seed)) for case in CASES))


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_the_planted_motion_covers(case):
    setup, way, q = planted_motion(case, 4e-3, 0.9)
    assert_covers(setup, way, q, 0.98)
