"""200 random cases of two arms with (nearly) fixed orientations, feasible by a planted motion."""

import numpy as np
import pytest
from planted_rolls import planted_roll

from feasibility import check


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("name", ["puma560", "ur5"])
def test_none_is_called_infeasible(name, seed):
    rng = np.random.default_rng([seed, len(name)])
    for number in range(20):
        verdict = check(*planted_roll(name, rng))
        assert verdict.feasible, (number, verdict.message)
