"""Placements next to a wall: none is called feasible whose motion would not stay clear of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from feasibility import Task
from feasibility.collisions import Collision, Obstacle, ToolShape
from feasibility.placement import Pose, Region, Stage, place
from feasibility.placement.evaluator import LocalEvaluator
from feasibility.placement.quick_search import probe
from feasibility.reports.placement import as_json
from feasibility.roadmap import Exploration
from feasibility.search import Search
from robots import load_robot
from surfaces import plane

UR5 = load_robot("ur5")
CELLS = plane((0.4, 0.6), (-0.1, 0.1), "outside", (0.0, 0.0, 0.3)).cells(1, 2)
WALL_AT, RADIUS, TOLERANCE, CLEARANCE = 0.8, 0.05, 0.001, 0.01  # m
ROOM = WALL_AT - float(CELLS.centres[:, 0].max()) - RADIUS - CLEARANCE
"""m that the surface may move towards the wall, with a ball around the tool point."""
WALL = Obstacle.halfspace("wall", position=(WALL_AT, 0.0, 0.0), rpy_deg=(0.0, -90.0, 0.0))
TASK = Task(0.02, 30, TOLERANCE)
BESIDE = replace(
    TASK,
    collision=Collision(
        self_=False, clearance=CLEARANCE, scene=(WALL,), tool=(ToolShape.sphere(RADIUS),),
        allow=(("tool", "surface"),),
    ),
)  # fmt: skip
REGION = Region.around(Pose.of_surface(CELLS.surface), {"x": (0.0, 2.0 * ROOM)})


def pose_at(beyond: float) -> Pose:
    """The surface nearer to the wall than it may be, by so much (m)."""
    return Pose((ROOM + beyond, 0.0, 0.3), (0.0, 0.0, 0.0))


def test_feasible_placements_leave_room_beside_the_wall() -> None:
    placements = place(UR5, CELLS, BESIDE, REGION, count=6, around=0, keep=3)
    assert placements.best is not None
    assert len({trial.pose.position[0] for trial in placements.trials}) >= 6
    assert max(trial.pose.position[0] for trial in placements.trials) > ROOM + TOLERANCE
    assert max(trial.pose.position[0] for trial in placements.found) <= ROOM + TOLERANCE
    assert as_json(placements)["collisions"] == ["surface", "scene"]


def test_it_is_the_wall_that_forbids_the_rest() -> None:
    assert LocalEvaluator(UR5, CELLS, TASK, Search()).try_at(pose_at(0.05)).complete


@pytest.mark.parametrize("beyond", [-0.05, 0.05])
def test_probes_land_where_nothing_collides(beyond: float) -> None:
    evaluator = LocalEvaluator(UR5, CELLS, BESIDE, Search())
    pose = pose_at(beyond)
    exploration = Exploration(UR5, CELLS, evaluator.problem_at(pose), 0)
    assert probe(exploration, np.arange(2)).all() == (beyond < 0.0)
    assert (evaluator.try_at(pose).stage is Stage.PROBE) == (beyond > 0.0)
