"""Walls between an arm and a plate, and boxes of joints around configurations that are clear."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pinocchio as pin
from built_scenes import CLEARANCE, arm
from foreign_clearances import ForeignScene
from tool_scenes import random_object

from feasibility import Task
from feasibility.collisions import Bodies, Collision, Obstacle, gather
from feasibility.roadmap.motions import PROJECTION_STEPS, arrays_of, project_near_cell, work_for
from robots import Kinematics, Robot
from surfaces import Cells, plane

SURFACE = plane((0.4, 0.6), (-0.1, 0.1), "outside", (0.0, 0.0, 0.3))


def behind_a_wall(name: str, seed: int) -> tuple[Robot, Cells, Task]:
    """A plate, and a wall before it that nothing reaches around."""
    rng, robot = np.random.default_rng([seed, 3]), arm(name)
    reach, base = min(robot.reach, 1.0), np.array(robot.base_point)
    away, up = rng.uniform(0.6, 0.7), rng.uniform(-0.1, 0.3)
    half = 0.08 * reach
    at = tuple(base + reach * np.array([away, rng.uniform(-0.2, 0.2), up]))
    plate = plane((-half, half), (-half, half), "outside", at, (0.0, -rng.uniform(0.0, 60.0), 0.0))
    thick = rng.uniform(0.18, 0.25)
    place = tuple(base + np.array([reach * rng.uniform(0.28, 0.32), 0.0, 0.0]))
    wall = Obstacle.box("wall", (thick, 5.0, 5.0), place, (0.0, rng.uniform(-8.0, 8.0), 0.0))
    asked = Collision(clearance=CLEARANCE, scene=(wall,))
    cone_deg = float(rng.uniform(5.0, 25.0))
    return robot, plate.cells(1, 1), Task(0.02, cone_deg, 0.001, collision=asked)


def clear_landing(
    robot: Robot, cells: Cells, task: Task, cell: int, count: int, rng: np.random.Generator
) -> bool:
    """Is one of so many configurations over a cell clear, as fcl sees it?"""
    bodies = gather(robot, cells.surface, task.collision, task.standoff)
    assert bodies is not None
    scene, order = ForeignScene(robot, bodies), list(range(len(bodies.pairs)))
    arrays, work = arrays_of(robot, cells, task), work_for(robot.n)
    low, high = np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi)
    for q in rng.uniform(low, high, (count, robot.n)):
        landed = project_near_cell(arrays, work, cell, q, PROJECTION_STEPS)
        if landed and is_clear(scene, q, order):
            return True
    return False


def is_clear(scene: ForeignScene, q: np.ndarray, first: list[int] | None = None) -> bool:
    """Is no pair too near? What touches has a distance of 0.

    The pair that is comes to the front of `first`, the order in which they are asked.
    """
    order = list(range(len(scene.bodies.pairs))) if first is None else first
    for place, k in enumerate(order):
        away = scene.distances(q, [k])[0]
        if not (away >= scene.bodies.pairs[k].clearance and away > 0.0):
            order.insert(0, order.pop(place))
            return False
    return True


class ClearBox(NamedTuple):
    """A box of joints around a configuration that is clear, whose tool is at a target."""

    robot: Robot
    bodies: Bodies
    task: Task
    point: np.ndarray
    approach: np.ndarray
    q: np.ndarray
    low: np.ndarray
    high: np.ndarray


def clear_box(name: str, seed: int, asked_for: bool = True) -> ClearBox | None:
    """A random one, near objects; None where the configuration collides, if that is asked for."""
    rng, robot = np.random.default_rng([seed, 4]), arm(name)
    least, most = np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi)
    q = rng.uniform(least, most)
    data, model = robot.model.createData(), robot.model
    pin.forwardKinematics(model, data, pin.integrate(model, pin.neutral(model), q))
    k = int(rng.integers(2, robot.n + 1))
    around = data.oMi[k].translation + rng.normal(scale=0.25, size=3)
    scene = tuple(random_object(rng, f"object{i}", around) for i in range(2))
    asked = Collision(surface=False, clearance=float(rng.choice([0.0, 0.005])), scene=scene)
    cone_deg = float(rng.uniform(1.0, 60.0))
    task = Task(0.02, cone_deg, 0.001, collision=asked)
    bodies = gather(robot, SURFACE, asked, task.standoff)
    assert bodies is not None
    if asked_for and not is_clear(ForeignScene(robot, bodies), q):
        return None
    points, axes = Kinematics(robot).tools(q[None])
    tilt = np.cross(axes[0], rng.normal(size=3))
    tilt *= np.radians(cone_deg) * rng.uniform() / np.linalg.norm(tilt)
    off = rng.normal(size=3)
    off *= 0.001 * rng.uniform() / np.linalg.norm(off)
    half = 10.0 ** rng.uniform(-3.0, -0.3) * rng.uniform(0.1, 1.0, robot.n)
    middle = q + half * rng.uniform(-1.0, 1.0, robot.n)
    return ClearBox(
        robot, bodies, task, points[0] + off, pin.exp3(tilt) @ axes[0], q,
        middle - half, middle + half,
    )  # fmt: skip
