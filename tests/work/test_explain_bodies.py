"""What would make a case with collisions feasible; and `check` told the motion of a case nearby."""

from dataclasses import asdict, replace
from functools import cache

import numpy as np
import pytest
from asked import question
from samples import EVERYTHING, sampled

import coverable
from coverable import Obstacle, Search, Task, ToolShape, check, explain, load_case, replay
from feasibility.sensitivity.quantities import Kind, Variant, quantities
from feasibility.verdict import Walk

UR5 = coverable.load_robot("ur5")
PLATE = coverable.plane((0.4, 0.6), (-0.1, 0.1), "outside", (0.0, 0.0, 0.3))
CELLS = PLATE.cells(1, 2)
FREE = UR5.with_limits(np.tile([-np.inf, np.inf], (6, 1)))
"""Without limits, which have nothing to do with bodies and take most of the time to vary."""
WALL_AT, RADIUS, TOLERANCE = 0.63, 0.05, 0.001  # m
ROOM = WALL_AT - 0.5 - RADIUS
"""m, between the wall and a ball around the tool point over the cells, whose centres are at 0.5."""
WALL = Obstacle.halfspace("wall", position=(WALL_AT, 0.0, 0.0), rpy_deg=(0.0, -90.0, 0.0))
POST = Obstacle.box("post", (0.1, 0.1, 1.0), position=(-0.6, -0.6, 0.5))


@cache
def explained(clearance):
    ball = ToolShape.sphere(RADIUS)
    asked = coverable.Collision(
        self_=False, surface=False, clearance=clearance, scene=(WALL, POST), tool=(ball,)
    )
    return explain(FREE, CELLS, Task(0.02, 30, TOLERANCE, collision=asked))


def threshold_of(explanation, name):
    return next(t for t in explanation.thresholds if t.quantity.name == name)


@sampled("clearance", [0.095] + [0.01] * EVERYTHING)
def test_the_clearance_is_the_room_between_wall_and_tool(clearance):
    found = explained(clearance)
    assert found.verdict.feasible == (clearance < ROOM)
    value = threshold_of(found, "clearance").feasible.value
    assert ROOM - 0.003 < value <= ROOM + TOLERANCE
    # Every motion holds with the collisions of its own case.
    task, count = found.verdict.task, 0
    for threshold in found.thresholds:
        q, side = threshold.quantity, threshold.feasible
        if side is None or q.kind not in (Kind.CLEARANCE, Kind.SHIFT, Kind.WITHOUT):
            continue
        settings, cells = task.collision, CELLS
        if q.kind is Kind.SHIFT:
            cells = PLATE.moved(np.eye(3), side.value * np.array(q.axis)).cells(1, 2)
        elif q.kind is Kind.CLEARANCE:
            settings = replace(settings, clearance=side.value)
        else:
            kept = tuple(one for one in (WALL, POST) if one.name != q.obstacle)
            settings = replace(settings, scene=kept) if q.obstacle else None
        changed = replace(task, collision=settings)
        assert replay(FREE, cells, changed, side.witness, np.ones(2, dtype=bool)).accepted
        count += 1
    assert count >= 4


@pytest.mark.parametrize("kind", [Kind.CLEARANCE, Kind.TOOL_CLEARANCE])
def test_each_clearance_is_varied_by_itself(kind):
    asked = coverable.Collision(clearance=0.01, tool_clearance=0.01)
    given = Variant(UR5, CELLS, Task(0.02, 30, collision=asked))
    (q,) = (one for one in quantities(given, widen=True) if one.kind is kind)
    changed = asdict(given.task) | {"collision": asdict(asked) | {kind.value: q.value(3)}}
    assert asdict(q.applied(given, 3).task) == changed
    assert q.value(3) < 0.01
    assert q.applied(given, 0) is given


def test_the_object_in_the_way_is_named_and_only_that():
    left_out = [t for t in explained(0.095).thresholds if t.quantity.kind is Kind.WITHOUT]
    helps = {t.quantity.name: t.feasible is not None for t in left_out}
    assert helps == {"without collisions": True, "without wall": True, "without post": False}


def test_what_is_left_out_takes_its_pairs_along():
    asked = coverable.Collision(
        self_=False, surface=False, scene=(WALL, POST), tool=(ToolShape.sphere(RADIUS),),
        allow=(("forearm_link", "post"),), clearances=(("tool", "wall", 0.2),),
    )  # fmt: skip
    task, few = Task(0.02, 30, TOLERANCE, collision=asked), Search(evaluations=2000)
    found = explain(FREE, CELLS, task, few)
    assert threshold_of(found, "without wall").feasible is not None
    assert threshold_of(found, "without post").feasible is None


WHOLE = (UR5, PLATE.cells(3, 3), Task(0.02, 30))


def test_a_known_motion_is_taken_as_it_is_and_one_of_a_case_nearby_leads_to_another():
    verdict, every = check(*WHOLE), np.ones(9, dtype=bool)
    again = check(*WHOLE, Search(seed=5), seeds=verdict.witness)
    assert (again.feasible, again.n_covered, again.n_edges) == (True, 9, verdict.n_edges)
    assert again.statistics["fk"] <= verdict.statistics["fk"]
    near = PLATE.moved(np.eye(3), np.array([0.01, 0.0, 0.0])).cells(3, 3)
    beside = check(UR5, near, Task(0.02, 30)).witness
    assert not replay(*WHOLE, beside, every).accepted
    assert replay(*WHOLE, check(*WHOLE, seeds=beside).witness, every).accepted


@pytest.mark.parametrize(("q", "cell", "method"), [
    (np.full((2, 6), np.nan), [0, 1], "complete"), (np.zeros((2, 5)), [0, 1], "complete"),
    (np.zeros((2, 6)), [0, 9], "complete"), (np.zeros((2, 6)), [0], "complete"),
    (np.zeros((2, 6)), [0, 1], "greedy"),
])  # fmt: skip
def test_seeds_that_fit_neither_arm_nor_cells_are_refused(q, cell, method):
    with pytest.raises(ValueError, match="greedy" if method == "greedy" else "seeds"):
        check(*WHOLE, Search(method), seeds=Walk(q, np.array(cell)))


def test_a_motion_found_beside_a_case_is_tried_on_the_case_itself():
    """`check` alone may end without it; `explain` must not call a case infeasible and say how its
    own motions cover it. Once it is told the motion, `check` finds what `explain` found.
    """
    asked = question("talos over a cone")  # few seeds of a search find its motion
    robot, cells, task = asked.robot, asked.cells, asked.task
    found = explain(robot, cells, task)
    assert found.verdict.feasible
    assert found.alone is None or found.alone.answer is not coverable.Answer.FEASIBLE
    some = [t for t in found.thresholds if t.margin > 0.0 and t.quantity.joint >= 0]
    assert len(some) > 5
    for threshold in some:
        q, side = threshold.quantity, threshold.feasible
        limits = [robot.lower[q.joint], robot.upper[q.joint]]
        limits[q.kind is Kind.UPPER] = side.value
        arm = robot.with_limits({robot.joint_names[q.joint]: limits})
        assert check(arm, cells, task, Search(seed=7), seeds=side.witness).feasible, q.name


def test_a_search_ends_after_so_many_evaluations_on_any_machine():
    """As at the deadline: undecided, and why cells are missed can still be read."""
    robot, cells, task, _ = load_case("paper/5f").with_overrides(["task.standoff=0.505"]).build()
    verdict = check(robot, cells, task, Search(evaluations=30_000))
    assert verdict.answer is coverable.Answer.UNDECIDED
    assert 30_000 < verdict.statistics["fk"] < 100_000
    assert len(verdict.causes) == len(cells) - verdict.n_covered
