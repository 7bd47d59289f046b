"""The prover against cases with a known answer, and its proofs against Newton."""

from itertools import count

import numpy as np
import pytest
from broken_roadmaps import proved_wrongly, stored
from oracle_build import built
from proving import nodes, nothing, prove, root_region, ruling, statement_of

from feasibility.cut_tree import Cut, Leaf
from feasibility.roadmap.branch_and_bound.branching import Ruling, branch_and_bound
from feasibility.roadmap.cuts import components_of
from feasibility.roadmap.cuts.findings import projected, random_targets
from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.motions import arrays_of
from robots import load_robot

ATTACKS = 300  # Newton starts on each statement


@pytest.fixture(scope="module", params=[("puma560", 9), ("ur5", 2)], ids=lambda p: p[0])
def proved(request):
    """Some stored disconnected cases, proved."""
    arm, every = request.param
    robot = load_robot(arm)
    cases = stored(arm, feasible=False)[::every]
    return [prove(*built(problem, robot)) for problem in cases]


def test_cases_that_fall_apart_are_proved(proved):
    assert all(proving.tree is not None for proving in proved)
    assert {proving.tree.kind for proving in proved} == {"cut"}


def test_newton_finds_nothing_on_a_cut_or_in_a_leaf(proved):
    rng = np.random.default_rng(1)
    for proving in proved:
        prover = proving.prover
        for region, node in nodes(root_region(prover, proving.tree), proving.tree.root):
            if isinstance(node, Leaf):
                target = np.hstack([t[node.cell] for t in prover.arrays[3:5]])
                targets = np.tile(target, (ATTACKS, 1))
            else:
                region = region.on(np.array(node.weights), node.value)
                targets = random_targets(prover.places, ATTACKS, rng)
            hits = projected(prover.arrays, prover.findings.work, region, targets, 1, rng)
            assert not len(hits), node


def test_every_statement_can_be_proved_again(proved):
    for proving in proved:
        prover = proving.prover
        for region, node in nodes(root_region(prover, proving.tree), proving.tree.root):
            assert ruling(prover, statement_of(prover, region, node)) is Ruling.PROVED


def test_a_cut_through_the_motion_set_is_refuted(proved):
    """Cuts moved to where points of the motion set are known, in their own region."""
    refuted = 0
    for proving in proved:
        prover = proving.prover
        for region, node in nodes(root_region(prover, proving.tree), proving.tree.root):
            inside = prover.findings.samples[region.inside(prover.findings.samples)]
            if not isinstance(node, Cut) or not len(inside):
                continue
            for q in inside[:5]:
                moved = Cut(node.weights, float(np.array(node.weights) @ q), node.below, node.above)
                outcome = ruling(prover, statement_of(prover, region, moved), 3000)
                assert outcome is not Ruling.PROVED
                refuted += 1
    assert refuted >= 10


def test_a_leaf_of_a_covered_cell_is_refuted(proved):
    """Leaves of cells that components inside their region cover."""
    for proving in proved:
        prover = proving.prover
        components = components_of(proving.exploration.roadmap)
        for region, node in nodes(root_region(prover, proving.tree), proving.tree.root):
            if isinstance(node, Cut):
                continue
            for component in components:
                if region.inside(component.q).all() and component.cover.any():
                    cell = Leaf(int(np.flatnonzero(component.cover)[0]))
                    outcome = ruling(prover, statement_of(prover, region, cell), 20_000)
                    assert outcome is not Ruling.PROVED


@pytest.mark.parametrize("newton", [True, False], ids=["newton", "boxes alone"])
@pytest.mark.parametrize(("arm", "every"), [("puma560", 8), ("ur5", 4)])
def test_a_feasible_case_is_never_proved(arm, every, newton):
    """However its roadmap is broken: branch and bound has to refuse, with Newton and without."""
    robot, rng = load_robot(arm), np.random.default_rng(2)
    wrong = [
        proved_wrongly(robot, problem, rng, newton, 4000)
        for problem in stored(arm, feasible=True)[::every]
    ]
    assert wrong.count(False) >= 3
    assert True not in wrong


def test_the_same_seed_proves_alike():
    robot = load_robot("puma560")
    problem = stored("puma560", feasible=False)[4]
    one, other = (prove(*built(problem, robot), seed=3) for _ in range(2))
    assert one.tree == other.tree
    assert one.attempt.boxes == other.attempt.boxes


def test_a_budget_is_kept_and_ticks_may_end_an_attempt():
    robot = load_robot("ur5")
    problem = stored("ur5", feasible=False)[2]
    proving = prove(*built(problem, robot), budget=200, attempts=2)
    assert proving.tree is None
    assert proving.attempt.boxes <= 200
    ticks = count()

    def tick():
        if next(ticks) == 3:
            raise KeyboardInterrupt

    components = components_of(proving.exploration.roadmap)
    with pytest.raises(KeyboardInterrupt):
        proving.prover.attempt(components, 100_000, tick)
    again = proving.prover.attempt(components, 500, nothing)
    assert 0 < again.boxes <= 500


def test_kernels_are_compiled_once(proved):
    assert proved
    assert len(branch_and_bound.signatures) == 1


def test_a_roadmap_without_nodes_has_no_components():
    robot, cells, task = built(stored("puma560", feasible=False)[12], load_robot("puma560"))
    exploration = Exploration(robot, cells, arrays_of(robot, cells, task), 0)
    assert components_of(exploration.roadmap) == []
