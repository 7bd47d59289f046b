"""What collisions cost: a check beside the same check without, and the judge of a known motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from coverable import Collision, Obstacle, Task, check
from feasibility.cases import load_case
from feasibility.certification import collision_replay
from feasibility.problem import Problem
from robots import Robot, load_robot
from surfaces import Cells, plane

POST = Obstacle.cylinder("post", 0.04, 1.0, (0.3, 0.32, 0.5))
SHELF = Obstacle.box("shelf", (0.5, 0.6, 0.02), (0.55, 0.0, 0.5))
SCENES = {
    "none": None,
    "self": Collision(surface=False, clearance=0.005),
    "self, surface": Collision(clearance=0.005),
    "self, surface, post": Collision(clearance=0.005, scene=(POST,)),
    "self, surface, post, shelf": Collision(clearance=0.005, scene=(POST, SHELF)),
}
ASKED = [(arm, scene) for arm in ("ur5", "panda") for scene in SCENES]
ASKED += [(f"paper/{k}", s) for k in ("4a", "4c", "5e") for s in ("none", "self, surface")]


def question(name: str, scene: str) -> tuple[Robot, Cells, Task]:
    """A plate of 0.3 m x 0.4 m before an arm, or a case of the paper."""
    if name.startswith("paper/"):
        robot, cells, task, _ = load_case(name).build()
    else:
        cells = plane((0.35, 0.65), (-0.2, 0.2), "outside", (0.0, 0.0, 0.1)).cells(6, 8)
        robot, task = load_robot(name), Task(0.02, 20.0)
    return robot, cells, replace(task, collision=SCENES[scene])


@pytest.mark.parametrize(("name", "scene"), ASKED)
def bench_check(name: str, scene: str, measured: Callable[..., Any]) -> None:
    """Goals: 1.5 times the check without for an arm alone, 4 times with what stands around."""
    asked = question(name, scene)
    measured(lambda: check(*asked), 3)


@pytest.mark.parametrize(("name", "scene"), [a for a in ASKED if a[1] != "none"])
def bench_judge(name: str, scene: str, measured: Callable[..., Any]) -> None:
    """Goal: 40 ms for 200 waypoints, and five calls of coal a segment."""
    robot, cells, task = question(name, scene)
    witness, bodies = check(robot, cells, task).witness, Problem.of(robot, cells, task).bodies
    if witness is None:
        pytest.skip("no motion was found")
    segments = len(witness.q) - 1
    measured(
        lambda: collision_replay(robot, bodies, witness.q), 3, segments=lambda _: segments,
        **{"coal calls a segment": lambda found: round(found.calls / segments, 2)},
    )  # fmt: skip
