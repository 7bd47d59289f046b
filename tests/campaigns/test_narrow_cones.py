"""110 random cases with cones of 0.05 to 1 degree, feasible by a motion along the normals."""

from functools import partial

import pytest
from planted import assert_covers, planted_motion, read_planted
from tally import assert_all_feasible, tally

CASES = read_planted("narrow_cones")
SEEDS = (0, 1)


@pytest.mark.parametrize("seed", SEEDS)
def test_none_is_called_infeasible(seed):
    assert_all_feasible(tally((case.name, partial(case.setup, seed)) for case in CASES))


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_the_planted_motion_covers(case):
    setup, way, q = planted_motion(case, 2e-3, 0.0)
    assert_covers(setup, way, q, 0.6)
