"""Stored PUMA cases with their surfaces remade as splines, meshes, pieces and revolutions."""

import numpy as np
import pytest
from broken_roadmaps import halves, stored
from other_kinds import proved_though_covered, remade_problems
from proving import prove

from robots import load_robot

PUMA = load_robot("puma560")


@pytest.mark.parametrize("part", range(4))
def test_cases_that_fall_apart_do_so_whatever_their_surface_is_made_of(part):
    """All of those with the same cells; a mesh has cells of its own, and a truth of its own."""
    proved = []
    for number, problem in enumerate(stored("puma560", feasible=False)[part::4]):
        for kind, case in remade_problems(PUMA, problem):
            proved.append((kind, prove(*case).tree is not None))
            assert proved[-1][1] or kind == "mesh", (part + 4 * number, problem.kind, kind)
    meshes = [found for kind, found in proved if kind == "mesh"]
    print(f"{len(proved)} problems proved but for {meshes.count(False)} of {len(meshes)} meshes")
    assert meshes.count(True) >= 0.8 * len(meshes)


@pytest.mark.parametrize("part", range(4))
def test_feasible_cases_are_never_proved_whatever_their_surface_is_made_of(part):
    rng, outcomes = np.random.default_rng(part), []
    for problem in stored("puma560", feasible=True)[part::4]:
        for kind, case in remade_problems(PUMA, problem):
            outcomes.append(proved_though_covered(*case, rng, halves, 40_000))
            assert outcomes[-1] is not True, (problem.kind, kind)
    print(f"{outcomes.count(False)} refused, {outcomes.count(None)} without a cover at once")
    assert outcomes.count(False) >= 5
