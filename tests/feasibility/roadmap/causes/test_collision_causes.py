"""Cells over which every configuration collides: the pair and its distance, known by hand."""

from __future__ import annotations

from dataclasses import replace

import pytest

from feasibility import Task
from feasibility.collisions import Collision, Obstacle, ToolShape, gather
from feasibility.roadmap import Exploration, arrays_of
from feasibility.roadmap.causes.collision import colliding
from feasibility.roadmap.causes.disconnection import _stopped_by
from feasibility.verdict import Cause, CauseKind
from robots import load_robot
from surfaces import plane

UR5 = load_robot("ur5")
CELLS = plane((0.4, 0.6), (-0.1, 0.1), "outside", (0.0, 0.0, 0.3)).cells(1, 1)
X, RADIUS = 0.5, 0.05
ALONE = Collision(self_=False, surface=False, tool=(ToolShape.sphere(RADIUS),))
"""Of the tool only a ball around its point is asked for."""


def cause_of(obstacle: Obstacle, clearance: float) -> Cause | None:
    links = [name for name in UR5.link_names if name != "tool"]
    asked = replace(
        ALONE, clearance=clearance, scene=(obstacle,),
        allow=tuple((name, obstacle.name) for name in links),
    )  # fmt: skip
    task = Task(0.02, 30, 0.001, collision=asked)
    exploration = Exploration(UR5, CELLS, arrays_of(UR5, CELLS, task), 0)
    bodies = gather(UR5, CELLS.surface, asked, task.standoff)
    assert bodies is not None
    assert [(pair.first, pair.second) for pair in bodies.pairs] == [("tool", obstacle.name)]
    return colliding(exploration, 0, bodies.pairs)


@pytest.mark.parametrize("gap", [-0.02, 0.03])
def test_the_distance_is_that_of_ball_and_wall(gap: float) -> None:
    at = X + RADIUS + gap
    wall = Obstacle.halfspace("wall", position=(at, 0.0, 0.0), rpy_deg=(0.0, -90.0, 0.0))
    cause = cause_of(wall, 0.05)
    assert cause is not None
    assert cause.kind is CauseKind.COLLISION
    assert not cause.proved
    assert cause.pair == ("tool", "wall")
    assert cause.clearance == pytest.approx(gap, abs=0.0012)
    assert ("overlap" in cause.detail) == (gap < 0.0)
    assert "none is clear; in the way: tool and wall in" in cause.detail
    assert cause_of(wall, 0.0 if gap > 0.0 else 0.05) is None or gap < 0.0


def test_a_box_that_swallows_the_target_is_named() -> None:
    box = Obstacle.box("crate", (0.4, 0.4, 0.4), position=(X, 0.0, 0.3))
    cause = cause_of(box, 0.0)
    assert cause is not None
    assert cause.pair == ("tool", "crate")
    assert cause.clearance is not None
    assert cause.clearance < -RADIUS


def test_a_clear_landing_is_no_collision() -> None:
    assert cause_of(Obstacle.sphere("ball", 0.05, position=(-1.0, 0.0, 0.0)), 0.01) is None


def test_a_pair_that_stopped_a_motion_is_named_with_what_it_kept() -> None:
    from feasibility.collisions import Pair

    assert _stopped_by(None) == ""
    assert _stopped_by(Pair("a", "b", 0.0)) == "a and b would collide"
    assert _stopped_by(Pair("a", "b", 0.005)) == "a and b would come nearer than 5 mm"
