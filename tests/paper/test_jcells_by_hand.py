"""Algorithms 1 and 2 on arms and patches small enough to know the answer, and their ends."""

import math

import numpy as np
import pytest
from arm_urdfs import joint
from random_arms import robot_of

import coverable
from coverable import Answer, CauseKind, Evidence, Task, greedy_check, load_robot, sphere
from feasibility.paper.continuity import CallOutcome, JSpace

PUMA = load_robot("puma560", limits="set-1")


def planar_arm(low=-3.1, high=3.1):
    """Two links of 1 m in the xy plane; the tool axis is +x of the second."""
    turning = joint(1, limits=(low, high)), joint(2, xyz=(1, 0, 0), limits=(-3.1, 3.1))
    return robot_of([*turning, joint(3, "fixed", (1, 0, 0))], (1.0, 0.0, 0.0))


def greedy(**settings):
    return coverable.Search(method="greedy", **settings)


def edges(graph):
    return {(min(e), max(e)) for e in graph.edges}


# An arc of a circle of radius 1.5 m about the base: elbow angle and shoulder angle are independent,
# so turning the shoulder alone runs along the arc, and the shoulder's limits cut it where they say.
ARC = coverable.cylinder(1.5, (0, 80), (-0.1, 0.1), side="inside").cells(8, 1)  # 10 degrees each
ELBOW = math.acos(1.5**2 / 2.0 - 1.0)  # cosine rule: |p|^2 = 2 + 2 cos(elbow)


def test_planar_arm_covers_the_arc_cell_by_cell():
    verdict = greedy_check(planar_arm(), ARC, Task(0.0, 60), greedy(step_deg=0.1))
    assert verdict.answer is Answer.FEASIBLE
    assert edges(verdict.graph) == {(i, i + 1) for i in range(7)}
    assert verdict.start == 4
    assert set(verdict.tree.edges) == {(4, 3), (3, 2), (2, 1), (1, 0), (4, 5), (5, 6), (6, 7)}
    assert list(verdict.tree) == [4, 3, 2, 1, 0, 5, 6, 7]  # depth first
    assert verdict.statistics["calls"] == 7
    for cell in range(8):
        shoulder, elbow = verdict.graph.nodes[cell]["q"]
        assert abs(abs(elbow) - ELBOW) < 1e-6
        polar = math.degrees(shoulder + elbow / 2)  # of the tool point
        assert 10 * cell - 1e-9 <= polar <= 10 * (cell + 1) + 1e-9


@pytest.mark.parametrize("last", [44.0, 53.0, 67.0])
def test_shoulder_limit_cuts_the_arc_where_it_stands(last):
    """Elbow down, the tool is at shoulder + elbow / 2; elbow up it is at shoulder - |elbow| / 2."""
    arm = planar_arm(-1.0, math.radians(last - math.degrees(ELBOW) / 2))
    verdict = greedy_check(arm, ARC, Task(0.0, 60), greedy(step_deg=0.1))
    reached = math.floor(last / 10)
    assert (verdict.answer, verdict.evidence) == (Answer.INFEASIBLE, Evidence.EXHAUSTED)
    assert "not found by the greedy search" in verdict.message
    assert np.flatnonzero(verdict.covered).tolist() == list(range(reached + 1))
    assert edges(verdict.graph) == {(i, i + 1) for i in range(reached)}
    assert [cause.cell for cause in verdict.causes] == list(range(reached + 1, 8))
    kinds = {(cause.kind, cause.proved) for cause in verdict.causes}
    assert kinds == {(CauseKind.DISCONNECTED, False)}


DOME = sphere(1.0, (10, 90), (10, 180))


def test_capped_is_not_exhausted():
    cells = sphere(1.0, (10, 90), (10, 180), position=(0.005, 0, 0)).cells(9, 10)
    task = Task(0.005, 10)
    verdict = greedy_check(PUMA, cells, task, greedy(starts=1, cap=2000))

    ends = [(a, k) for a in verdict.tree for k in cells.neighbours.of(a).tolist()
            if not verdict.graph.has_edge(a, k)]  # fmt: skip
    some = (JSpace(PUMA, cells, task, verdict.graph.nodes[a]["q"], greedy(cap=50))
            .continuity(np.zeros(6), k) for a, k in ends)  # fmt: skip
    found = next(one for one in some if one.outcome is CallOutcome.CAPPED)
    assert (found.checked, len(found.jcells)) == (50, 0)


def test_cells_out_of_reach_are_proved_to_be():
    far = sphere(1.0, (10, 90), (10, 180), position=(9, 0, 0)).cells(3, 3)
    verdict = greedy_check(PUMA, far, Task(0.005, 45), greedy())
    assert (verdict.answer, verdict.n_covered, verdict.tree) == (Answer.INFEASIBLE, 0, None)
    assert "no configuration was found" in verdict.message
    assert {(c.kind, c.proved) for c in verdict.causes} == {(CauseKind.OUT_OF_REACH, True)}
    assert len(verdict.causes) == 9


def test_time_limits_coarse_steps_and_bad_starts_are_said():
    slow = greedy(step_deg=0.001, time_limit=0.05)
    verdict = greedy_check(PUMA, DOME.cells(30, 30), Task(0.005, 45), slow)
    assert (verdict.answer, verdict.evidence) == (Answer.UNDECIDED, Evidence.BUDGET)
    assert "time limit" in verdict.message
    cells = DOME.cells(3, 3)
    verdict = greedy_check(PUMA, cells, Task(0.005, 45, tolerance=1e-6), greedy(step_deg=1.0))
    assert verdict.answer is Answer.INFEASIBLE
    assert "too coarse" in verdict.message
    for start, said in ((np.zeros(6), "start must satisfy"), ([0.0, math.nan], "6 finite joint")):
        with pytest.raises(ValueError, match=said):
            greedy_check(PUMA, cells, Task(0.005, 45), greedy(), start=start)
