"""The prover on stored problems with a known answer, whatever their surface is made of."""

from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import pytest
from asked import question
from cut_attempts import nothing, prove, proved_wrongly
from oracle_cases import read
from samples import sampled, seeds, spread

from feasibility.cut_tree import Cut, Leaf
from feasibility.roadmap.proofs.branching import branch_and_bound
from feasibility.roadmap.proofs.ruling import Ruling


def stored(arm, feasible):
    """The stored questions of an arm that are feasible, or fall apart with every cell in reach."""
    found = [(k, p, truth) for k, (p, truth) in enumerate(read(arm)) if truth.feasible == feasible]
    wanted = [k for k, p, t in found if feasible or t.reachable == p.cells[0] * p.cells[1]]
    return [question(f"{arm} {k}")[2:5] for k in wanted]


@pytest.fixture(scope="module", params=[("puma560", 9), ("ur5", 2)], ids=lambda p: p[0])
def proved(request):
    """Some stored disconnected cases, proved."""
    arm, every = request.param
    return [prove(*problem) for problem in stored(arm, feasible=False)[::every]]


def test_cases_that_fall_apart_are_proved_and_proved_again(proved):
    assert all(proving.tree is not None for proving in proved)
    assert {proving.tree.kind for proving in proved} == {"cut"}
    for proving in proved:
        for region, node in proving.statements():
            assert proving.ruling(region, node) is Ruling.PROVED
    assert len(branch_and_bound.signatures) == 1  # compiled once


def test_a_cut_through_the_motion_set_and_a_leaf_of_a_covered_cell_are_refuted(proved):
    """Cuts moved to where points are known, in their region; leaves of what components cover."""
    refuted = 0
    for proving in proved:
        samples = proving.prover.findings.samples
        for region, node in proving.statements():
            if isinstance(node, Cut):
                for q in samples[region.inside(samples)][:5]:
                    moved = replace(node, value=float(q[node.joint]))
                    assert proving.ruling(region, moved, 3000) is not Ruling.PROVED
                    refuted += 1
                continue
            for component in proving.components:
                if region.inside(component.q).all() and component.cover.any():
                    leaf = Leaf(int(np.flatnonzero(component.cover)[0]))
                    assert proving.ruling(region, leaf, 20_000) is not Ruling.PROVED
                    refuted += 1
    assert refuted >= 10


@sampled("seed", seeds(1, all=4))
@pytest.mark.parametrize("newton", [True, False], ids=["newton", "boxes alone"])
@pytest.mark.parametrize(("arm", "few"), [("puma560", 7), ("ur5", 6)])
def test_a_feasible_case_is_never_proved(arm, few, newton, seed):
    """However its roadmap is broken: branch and bound has to refuse, with Newton and without."""
    rng, problems = np.random.default_rng(2 + seed), stored(arm, feasible=True)
    some = spread(problems, few)
    wrong = [proved_wrongly(*problem, rng, newton) for problem in some]
    assert wrong.count(False) >= 3
    assert True not in wrong


def test_a_budget_is_kept_and_ticks_may_end_an_attempt():
    proving = prove(*stored("ur5", feasible=False)[2], budget=200, attempts=2)
    assert proving.tree is None
    assert proving.attempt.boxes <= 200
    tick = Mock(side_effect=[None, None, None, KeyboardInterrupt])
    with pytest.raises(KeyboardInterrupt):
        proving.prover.attempt(proving.components, 100_000, tick)
    assert 0 < proving.prover.attempt(proving.components, 500, nothing).boxes <= 500
