"""What is proved over a surface is proved over it as a spline, a mesh, pieces or a revolution."""

import numpy as np
import pytest
from broken_roadmaps import halves, stored
from other_kinds import proved_though_covered, remade_problems
from proving import prove

from robots import load_robot

PUMA = load_robot("puma560")


@pytest.mark.parametrize("number", [0, 4, 30])
def test_a_case_that_falls_apart_does_so_whatever_its_surface_is_made_of(number):
    problem = stored("puma560", feasible=False)[number]
    for kind, case in remade_problems(PUMA, problem):
        assert prove(*case).tree is not None, (problem.kind, kind)


def test_a_feasible_case_is_never_proved_whatever_its_surface_is_made_of():
    rng, refused = np.random.default_rng(5), 0
    for problem in stored("puma560", feasible=True)[::14]:
        for kind, case in remade_problems(PUMA, problem):
            outcome = proved_though_covered(*case, rng, halves)
            assert outcome is not True, (problem.kind, kind)
            refused += outcome is False
    assert refused >= 4
