"""What would make a case with collisions feasible: thresholds held to distances known by hand."""

from __future__ import annotations

import math
from functools import cache

import pytest

from feasibility import Task
from feasibility.certification import replay
from feasibility.collisions import Collision, Obstacle, ToolShape
from feasibility.reports.explanation import as_json
from feasibility.reports.explanation_words import headline, in_the_way
from feasibility.sensitivity import Explanation, Threshold, explain
from feasibility.sensitivity import explanation as explanations
from feasibility.sensitivity.quantities import Kind, Quantity, Variant, quantities, without
from robots import load_robot
from surfaces import plane

UR5 = load_robot("ur5")
CELLS = plane((0.4, 0.6), (-0.1, 0.1), "outside", (0.0, 0.0, 0.3)).cells(1, 2)
WALL_AT, RADIUS, TOLERANCE = 0.63, 0.05, 0.001  # m
ROOM = WALL_AT - float(CELLS.centres[:, 0].max()) - RADIUS
"""m, between the wall and a ball around the tool point over the furthest cells."""
WALL = Obstacle.halfspace("wall", position=(WALL_AT, 0.0, 0.0), rpy_deg=(0.0, -90.0, 0.0))
POST = Obstacle.box("post", (0.1, 0.1, 1.0), position=(-0.6, -0.6, 0.5))
BALL = ToolShape.sphere(RADIUS)


@cache
def explained(clearance: float) -> Explanation:
    asked = Collision(
        self_=False, surface=False, clearance=clearance, scene=(WALL, POST), tool=(BALL,)
    )
    return explained_but_limits(Task(0.02, 30, TOLERANCE, collision=asked))


def explained_but_limits(task: Task) -> Explanation:
    """Limits have nothing to do with what is tested here, and take most of the time."""

    def all_but_limits(variant: Variant, widen: bool) -> tuple[Quantity, ...]:
        return tuple(q for q in quantities(variant, widen) if q.joint < 0)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(explanations, "quantities", all_but_limits)
        return explain(UR5, CELLS, task)


def threshold_of(explanation: Explanation, name: str) -> Threshold:
    return next(t for t in explanation.thresholds if t.quantity.name == name)


@pytest.mark.parametrize("clearance", [0.01, 0.095])
def test_the_clearance_is_the_room_between_wall_and_tool(clearance: float) -> None:
    explanation = explained(clearance)
    found = threshold_of(explanation, "clearance").feasible
    assert explanation.verdict.feasible == (clearance < ROOM)
    assert found is not None
    assert ROOM - 0.003 < found.value <= ROOM + TOLERANCE


@pytest.mark.parametrize("clearance", [0.01, 0.095])
def test_every_motion_holds_with_the_collisions_of_its_own_case(clearance: float) -> None:
    explanation = explained(clearance)
    verdict = explanation.verdict
    given = Variant(verdict.robot, verdict.cells, verdict.task)
    needed = verdict.covered | True
    count = 0
    for threshold in explanation.thresholds:
        quantity, found = threshold.quantity, threshold.feasible
        if found is not None and found.witness is not None:
            k = next(k for k in range(quantity.last + 1) if quantity.value(k) == found.value)
            changed = quantity.applied(given, k)
            assert replay(*changed, found.witness, needed).accepted
            count += 1
    assert count >= 4


def test_the_surface_moves_towards_the_wall_by_the_room_at_most() -> None:
    found = threshold_of(explained(0.01), "shift along +x").feasible
    assert found is not None
    assert 0.0 < found.value <= ROOM - 0.01 + TOLERANCE


def test_the_object_in_the_way_is_named_and_only_that() -> None:
    explanation = explained(0.095)
    lines = in_the_way(explanation)
    assert [line.split(":")[0] for line in lines] == [
        "Without collisions", "Without wall", "Without post"
    ]  # fmt: skip
    assert ["feasible" in line for line in lines] == [True, True, False]
    kinds = [t for t in as_json(explanation, "x")["thresholds"] if t["kind"] == "without"]
    assert [t["feasible"] is not None for t in kinds] == [True, True, False]
    assert kinds[1]["sentence"] == "feasible without wall."
    away = threshold_of(explanation, "shift along -x").feasible
    assert away is not None
    assert 0.095 - ROOM - TOLERANCE <= away.value < 0.095 - ROOM + 0.003
    assert "surface.position (-x) by" in headline(explanation)  # the least of what helps


def test_what_is_left_out_leaves_no_trace() -> None:
    asked = Collision(
        scene=(WALL, POST),
        allow=(("forearm_link", "post"), ("wrist_1_link", "wrist_3_link")),
        clearances=(("forearm_link", "wall", 0.02),),
    )
    left = without(asked, "post")
    assert left.scene == (WALL,)
    assert left.allow == (("wrist_1_link", "wrist_3_link"),)
    assert left.clearances == asked.clearances
    assert without(asked, "wall").clearances == ()


def test_tool_clearance_ends_at_what_reaches_beyond_the_tool_point() -> None:
    """A nozzle that reaches 5 mm beyond the tool point is 15 mm off a plane 20 mm away."""
    nozzle = ToolShape.cylinder(0.002, 0.2, position=(0.0, 0.0, -0.095))
    asked = Collision(self_=False, tool=(nozzle,), tool_links=("wrist_3_link",))
    task = Task(0.02, 10, TOLERANCE, collision=asked)
    found = threshold_of(explained_but_limits(task), "tool clearance").feasible
    assert found is not None
    assert 0.008 < found.value <= 0.015 + TOLERANCE


def test_without_collisions_nothing_of_them_is_varied() -> None:
    kinds = {q.kind for q in quantities(Variant(UR5, CELLS, Task(0.02, 30)), widen=True)}
    assert not kinds & {Kind.CLEARANCE, Kind.TOOL_CLEARANCE, Kind.WITHOUT}
    assert math.isfinite(ROOM)
