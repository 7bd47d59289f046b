"""The treated share of certified motions, and what a demanded coverage makes of an answer."""

import itertools
from functools import cache

import numpy as np
import pytest
from gantry import configurations, gantry

from coverable import Answer, CaseError, Task, check, load_case, load_robot, plane, poses
from coverable.errors import CoverableError
from feasibility.demands.area import treated_by_walk
from feasibility.demands.treated_words import with_coverage
from feasibility.verdict import Decision, Evidence, Walk

UR5 = load_robot("ur5")
CELLS = plane((0.0, 0.3), (0.0, 0.2), "outside", (0.4, -0.1, 0.2)).cells(3, 2)
WIDE = {"standoff": 0.02, "cone_deg": 20, "footprint": 0.08}


@pytest.fixture(scope="module")
def found():
    return check(UR5, CELLS, Task(**WIDE))


CORNERS = np.array([[0.43, -0.07], [0.66, -0.07], [0.66, 0.03], [0.43, 0.03]])
S = np.linspace(0.0, 1.0, 60)[:, None]
FEET = np.vstack([a + S * (b - a) for a, b in itertools.pairwise(CORNERS)])  # of a zigzag


@cache
def squared():
    """By other code: points drawn by area, and their distance from dense feet by brute force."""
    drawn = np.random.default_rng(4).uniform([0.4, -0.1], [0.7, 0.1], (20_000, 2))
    return np.min([((drawn - foot) ** 2).sum(axis=1) for foot in FEET], axis=0)


@pytest.mark.parametrize("footprint", [0.05, 0.08, (0.05, 0.08), (0.08, 0.05)])
def test_the_share_of_a_motion_agrees_with_points_drawn_by_area(footprint):
    """An ellipse treats between what the disc in it and that around it treat."""
    points = np.column_stack([FEET, np.full(len(FEET), 0.22)])
    q = configurations(points, np.tile([0.0, 0.0, -1.0], (len(FEET), 1)))
    task, walk = Task(0.02, 20, footprint=footprint), Walk(q, np.full(len(q), -1))
    treated = treated_by_walk(gantry(), CELLS, task, walk)
    small, large = ((squared() <= (0.5 * end(footprint)) ** 2).mean() for end in (np.min, np.max))
    assert treated.area == pytest.approx(0.06)
    assert treated.lower == pytest.approx(small, abs=0.012)  # 4 standard errors: 0.012
    assert treated.upper == pytest.approx(large, abs=0.012)
    assert treated.lower <= treated.upper
    assert treated.upper - treated.lower <= (0.006 if small == large else 1.0)
    assert 0.0 < treated.twice < treated.upper
    left = sum(each.area for each in treated.untreated) / treated.area
    assert left == pytest.approx(1.0 - treated.upper, abs=0.008)
    for each in treated.untreated:
        away = np.linalg.norm(FEET - each.centre[:2], axis=1).min()
        assert away > 0.5 * np.max(footprint) - 0.02
    sizes = [each.area for each in treated.untreated]
    assert sizes == sorted(sizes, reverse=True)


@pytest.mark.parametrize(("beyond", "answer"), [(-1e-6, "feasible"), (1e-6, "undecided")])
def test_coverage_decides_by_the_lower_end(found, beyond, answer):
    low, high = found.treated.lower, found.treated.upper
    verdict = check(UR5, CELLS, Task(**WIDE, coverage=low + beyond))
    assert str(verdict.answer) == answer
    assert (verdict.witness is None) == (answer == "undecided")
    assert verdict.treated.lower == low
    assert verdict.covered.all()
    assert f"{100 * high:.1f}"[:3] in verdict.message


@pytest.mark.parametrize("answer", [Answer.INFEASIBLE, Answer.FEASIBLE, Answer.UNDECIDED])
def test_what_is_not_measured_is_not_enough_and_what_is_proved_stays_proved(answer):
    evidence = {Answer.INFEASIBLE: Evidence.PROOF, Answer.FEASIBLE: Evidence.WITNESS}
    given = Decision(answer, evidence.get(answer, Evidence.BUDGET), "It is so.")
    left = with_coverage(given, Task(**WIDE, coverage=0.5), None)
    if answer is Answer.FEASIBLE:
        assert left[:2] == (Answer.UNDECIDED, Evidence.BUDGET)
    else:
        assert left == given
    assert with_coverage(given, Task(**WIDE), None) == given


def test_automatic_cells_are_fine_enough():
    """On a panel and over a dome every place is treated by a tool that visits the centres."""
    case = load_case("paper/4a", ["surface.cells=auto", "task.footprint=0.4"])
    verdict = check(*case.build())
    assert verdict.feasible
    assert verdict.treated.lower >= 0.999
    assert case.from_toml(case.to_toml()) == case
    assert case.surface.is_grid
    with pytest.raises(CaseError, match=r"makes .* cells"):
        load_case("paper/4a", ["surface.cells=auto", "task.footprint=1e-3"]).build()


def test_between_poses_nothing_can_be_treated():
    cells = poses([[0.4, 0.0, 0.2], [0.5, 0.0, 0.2]], [[0, 0, 1], [0, 0, 1]])
    with pytest.raises(CoverableError, match="no surface to treat"):
        check(UR5, cells, Task(**WIDE))
