"""What `explain` calls feasible, `check` calls feasible too, once it is told the motion."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from feasibility import Answer, Search, Task, check
from feasibility.cases import Case, load_case
from feasibility.certification import replay
from feasibility.clock import Clock
from feasibility.reports.explanation import as_text
from feasibility.sensitivity import Explanation, Kind, explain
from feasibility.sensitivity.quantities import Variant, quantities
from feasibility.verdict import Walk
from robots import load_robot
from surfaces import plane, poses

NARROW = """
[robot]
name = "talos_left"
[robot.limits_deg]
arm_left_2_joint = [83.7913, 142.0486]
arm_left_4_joint = [-121.5879, -56.8754]
arm_left_7_joint = [-36.765, 24.3572]

[surface]
kind = "cone"
cells = [1, 2]
radius = 0.6672
slope = 0.736
u_deg = [72.2804, 101.5253]
v = [0.0, 0.2384]
position = [1.236883, -0.196841, 0.817147]
rpy_deg = [-147.4784, -16.242, -133.9677]
side = "outside"

[task]
standoff = 0.055370055943281066
cone_deg = 1.0
tolerance = 0.007184648809461151
"""
"""Feasible by a motion that few seeds of a search find."""

PLATE = plane((0.4, 0.6), (-0.1, 0.1), position=(0, 0, 0.3), side="outside")


@cache
def setup() -> Case:
    return Case.from_toml(NARROW, "narrow").build()


@cache
def explained(seed: int) -> Explanation:
    robot, cells, task, _ = setup()
    return explain(robot, cells, task, Search(seed=seed))


def test_a_toolpath_stays_in_its_order() -> None:
    """The covering motion of a component goes back; what is tried has to be a run."""
    s = np.linspace(0.0, 1.0, 6)
    points = np.column_stack([0.4 + 0.2 * s, 0.1 * np.sin(5.0 * s), 0.2 + 0.0 * s])
    walk = poses(points, np.tile((0.0, 0.0, 1.0), (6, 1)), side="outside")
    robot, task = load_robot("ur5"), Task(0.01, 10.0)
    found = explain(robot, walk, task)
    assert len(found.thresholds) >= 6
    for threshold in found.thresholds:
        assert threshold.other is None or "replay refuses" not in threshold.other.detail
        assert threshold.feasible is not None
        motion = threshold.feasible.witness
        assert motion is not None
        marks = motion.cell[motion.cell >= 0]
        assert np.array_equal(np.unique(marks), np.arange(6))
        assert (np.diff(marks) >= 0).all()


def test_a_toolpath_out_of_reach_is_explained_and_not_divided() -> None:
    points = np.column_stack([np.linspace(0.7, 1.1, 4), np.zeros(4), np.full(4, 0.2)])
    walk = poses(points, np.tile((0.0, 0.0, 1.0), (4, 1)), side="outside")
    found = explain(load_robot("ur5"), walk, Task(0.01, 10.0))
    assert found.verdict.answer is Answer.INFEASIBLE
    helping = [t for t in found.thresholds if t.feasible is not None]
    assert [t.quantity.kind for t in helping] == [Kind.SHIFT]
    assert helping[0].quantity.axis == (-1, 0, 0)


@pytest.mark.parametrize("seed", [0, 1])
def test_a_motion_found_beside_a_case_is_tried_on_the_case_itself(seed: int) -> None:
    """`check` alone may end without it; `explain` must not call a case infeasible and say how its
    own motions cover it."""
    found = explained(seed)
    assert found.verdict.feasible
    assert found.alone is None or found.alone.answer is not Answer.FEASIBLE
    assert found.rates is not None
    told = f"`check` alone, with seed {seed}, says" in " ".join(as_text(found, "x").split())
    assert told == (found.alone is not None)


def test_check_finds_what_explain_found_once_it_is_told_the_motion() -> None:
    robot, cells, task, _ = setup()
    varied = {q.name: q for q in quantities(Variant(robot, cells, task), widen=False)}
    some = [t for t in explained(0).thresholds if t.feasible is not None and t.margin > 0.0]
    assert len(some) > 10
    for threshold in some:
        found, quantity = threshold.feasible, varied[threshold.quantity.name]
        k = next(k for k in range(quantity.last + 1) if quantity.value(k) == found.value)
        case = quantity.applied(Variant(robot, cells, task), k)
        assert replay(*case, found.witness, np.ones(2, dtype=bool)).accepted
        for seed in (0, 7):
            assert check(*case, Search(seed=seed), seeds=found.witness).feasible, quantity.name


def test_a_known_motion_is_taken_as_it_is_where_the_replay_accepts_it() -> None:
    verdict = check(load_robot("ur5"), PLATE.cells(3, 3), Task(0.02, 30))
    again = check(verdict.robot, verdict.cells, verdict.task, Search(seed=5), seeds=verdict.witness)
    assert again.feasible
    assert again.n_covered == 9
    assert again.n_edges == verdict.n_edges
    assert set(again.witness.cell[again.witness.cell >= 0].tolist()) == set(range(9))


def test_a_motion_of_a_case_nearby_leads_to_one_of_this_case() -> None:
    near = PLATE.moved(np.eye(3), np.array([0.01, 0.0, 0.0])).cells(3, 3)
    verdict = check(load_robot("ur5"), near, Task(0.02, 30))
    again = check(load_robot("ur5"), PLATE.cells(3, 3), Task(0.02, 30), seeds=verdict.witness)
    assert again.feasible


@pytest.mark.parametrize("damage", ["nan", "joints", "cells", "rows"])
def test_seeds_that_fit_neither_arm_nor_cells_are_refused(damage: str) -> None:
    q, cell = np.zeros((2, 6)), np.array([0, 1])
    if damage == "nan":
        q[0, 3] = np.nan
    elif damage == "joints":
        q = q[:, :5]
    elif damage == "cells":
        cell[1] = 9
    else:
        cell = cell[:1]
    with pytest.raises(ValueError, match="seeds"):
        check(load_robot("ur5"), PLATE.cells(3, 3), Task(0.02, 30), seeds=Walk(q, cell))


def test_seeds_are_not_for_the_greedy_search() -> None:
    seeds = Walk(np.zeros((1, 6)), np.zeros(1, dtype=np.int64))
    with pytest.raises(ValueError, match="greedy"):
        check(load_robot("ur5"), PLATE.cells(3, 3), Task(0.02, 30), Search("greedy"), seeds=seeds)


@pytest.mark.parametrize("name", ["paper/4a", "paper/4c"])
def test_no_limits_without_width_are_offered(name: str) -> None:
    """A case may not have them: `check --set` with what is said would be refused."""
    robot, cells, task, _ = load_case(name).build()
    for quantity in quantities(Variant(robot, cells, task), widen=False):
        if quantity.kind in (Kind.LOWER, Kind.UPPER):
            end = quantity.applied(Variant(robot, cells, task), quantity.last).robot
            width = (end.upper - end.lower)[quantity.joint]
            assert np.radians(0.1) * (1 - 1e-9) <= width < np.radians(0.2)


def test_no_limit_is_offered_a_full_turn_beyond_what_the_joint_has() -> None:
    """Whatever limits the case gives; those of the URDF are 180 deg for the elbow, else 360."""
    given = {"elbow_joint": np.radians([-400.0, 900.0]), "wrist_1_joint": np.radians([-9.0, 9.0])}
    robot = load_robot("ur5").with_limits(given)
    found = quantities(Variant(robot, PLATE.cells(3, 3), Task(0.02, 30)), True)
    ends = {q.name: round(np.degrees(q.end)) for q in found if q.kind in (Kind.LOWER, Kind.UPPER)}
    assert ends["elbow_joint lower limit"] == -540
    assert "elbow_joint upper limit" not in ends  # further than that is what the case has
    assert ends["wrist_1_joint upper limit"] == 369
    assert ends["wrist_2_joint upper limit"] == 720


def test_limits_narrower_than_a_step_are_not_varied() -> None:
    robot = load_robot("ur5").with_limits({"wrist_3_joint": np.radians([0.0, 0.05])})
    names = {q.name for q in quantities(Variant(robot, PLATE.cells(3, 3), Task(0.02, 30)), False)}
    assert not any("wrist_3_joint" in name for name in names)
    assert "wrist_2_joint upper limit" in names


def test_the_far_side_of_a_margin_is_one_where_check_finds_no_motion_either() -> None:
    """What the short searches leave undecided, `check` decides, or does not decide either."""
    given = Variant(load_robot("ur5"), PLATE.cells(2, 2), Task(0.02, 30))
    found = explain(*given)
    sides = [(t.quantity, t.other) for t in found.thresholds if t.other is not None]
    assert len(sides) > 10
    for quantity, other in sides:
        verdict = check(*quantity.applied(given, quantity.steps_to(other.value)))
        assert not verdict.feasible, quantity.name
        assert verdict.answer is other.answer or other.answer is Answer.UNDECIDED, quantity.name
    assert sum(other.answer is Answer.INFEASIBLE for _, other in sides) > len(sides) // 2


def test_a_search_ends_after_so_many_evaluations_on_any_machine() -> None:
    """As at the deadline: undecided, and why cells are missed can still be read."""
    robot, cells, task, _ = load_case("paper/5f").with_overrides(["task.standoff=0.505"]).build()
    clock = Clock()
    clock.evaluations = 30_000
    verdict = check(robot, cells, task, clock=clock)
    assert verdict.answer is Answer.UNDECIDED
    assert 30_000 < verdict.statistics["fk"] < 100_000
    assert len(verdict.causes) == len(cells) - verdict.n_covered
