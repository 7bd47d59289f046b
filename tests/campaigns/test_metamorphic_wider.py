"""200 random cases of nine arms: what is wider loses nothing, and the seed decides nothing."""

import numpy as np
import pytest
from widening import ARMS, WIDENINGS, case_of, decided, lost, widened

from feasibility import Search, Task, check
from feasibility.verdict import Answer
from robots import load_robot
from surfaces import plane

CASES = 200
SEEDS = 10


@pytest.mark.parametrize("arm", range(len(ARMS)), ids=ARMS)
@pytest.mark.parametrize("what", WIDENINGS)
def test_what_is_wider_loses_nothing(arm, what):
    losses = []
    for number in range(arm, CASES, len(ARMS)):
        tables, rng = case_of(number)
        loss = lost(decided(tables), decided(widened(rng, tables, what)))
        losses += [(number, loss)] if loss else []
    assert losses == []


def test_the_seed_decides_nothing():
    both, beside, answers = [], [], {}
    for number in range(CASES):
        tables, _ = case_of(number)
        said = {decided(tables, seed).answer for seed in range(SEEDS)}
        key = " and ".join(sorted(said))
        answers[key] = answers.get(key, 0) + 1
        if {Answer.FEASIBLE, Answer.INFEASIBLE} <= said:
            both.append(number)
        elif len(said) > 1:
            beside.append(number)
    print(answers, "feasible and infeasible:", both, "undecided and another:", beside)
    assert both == []
    assert len(beside) <= 0.05 * CASES


@pytest.mark.parametrize("seed", range(SEEDS))
def test_a_wider_elbow_keeps_the_cells_of_a_plane(seed):
    limits = [(-70, 70), (-122, 125), (-70, 110), (-70, 119), (-70, 79), (-70, 70)]
    surface = plane(
        (-0.281, 0.141), (0.094, 0.719), "outside", (-0.719, -0.688, -0.078), (3, 69, 0)
    )
    puma, covered = load_robot("puma560"), []
    for upper in (110, 174):
        limits[2] = (-70, upper)
        arm = puma.with_limits(np.radians(limits))
        verdict = check(arm, surface.cells(3, 4), Task(0.0, 45), Search(seed=seed))
        covered.append(verdict.n_covered)
    assert covered[1] >= covered[0]
