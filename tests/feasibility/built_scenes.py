"""Scenes built around a known motion: obstacles where the arm may not go, clear of where it may.

An arm and a plate before it, drawn at random. One motion over the plate is found as if there were
no collisions; another one, clear of the arm itself and of the plate, under other limits of a joint.
Obstacles then stand where the first one passes, and elsewhere, as long as the judge of collisions
(coal) finds the second one further from them than is asked. So a covering motion exists.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from xml.etree import ElementTree as ET

import numpy as np
import pinocchio as pin
from arm_builds import built, on_a_base
from foreign_clearances import assert_clear

from feasibility import Answer, Evidence, Search, Task, Verdict, check
from feasibility.certification import collision_replay
from feasibility.collisions import Collision, Obstacle, gather
from robots import Robot, load_robot
from surfaces import Cells, plane

ARMS = ("ur5", "panda", "kinova", "xarm7", "puma560", "puma560 on a rail")
RAIL = (-0.5, 0.5)  # m
CLEARANCE = 0.005  # m, that is asked for
ROOM = 0.02  # m, that the known motion keeps from every obstacle
OBSTACLES = 6
CANDIDATES = 24
OTHERS = 3  # joints that the known motion may differ in
APART = 0.3  # rad or m, by how much
DENSE_DEG = 0.1

_FOLDER = TemporaryDirectory()  # the URDF is read again when shapes are asked for


@cache
def arm(name: str) -> Robot:
    """The arm of that name, with its own collision shapes."""
    if name != "puma560 on a rail":
        return load_robot(name)
    puma = arm("puma560")
    root = ET.parse(puma.urdf).getroot()
    on_rail = on_a_base(root, "prismatic", axis=(0, 1, 0), limits=RAIL)
    return built(on_rail, Path(_FOLDER.name), puma)


@dataclass(frozen=True, eq=False)
class BuiltScene:
    """A question whose answer is known: feasible."""

    robot: Robot
    cells: Cells
    task: Task
    """With the collisions."""
    blind_collides: bool
    """Does the motion that is found without collisions collide?"""

    def verdict(self, seed: int = 0) -> Verdict:
        """The answer of the search."""
        return check(self.robot, self.cells, self.task, Search(seed=seed))


def built_scene(name: str, seed: int) -> BuiltScene | None:
    """The scene of that number; None where the plate cannot be covered without obstacles either."""
    rng = np.random.default_rng([seed, zlib.crc32(name.encode())])
    robot = arm(name)
    cells, task = a_plate(rng, robot)
    blind = check(robot, cells, task)
    if blind.witness is None:
        return None
    alone = replace(task, collision=Collision(clearance=CLEARANCE))
    known = _another_motion(rng, robot, cells, alone, blind.witness.q)
    if known is None:
        return None
    drawn = tuple(_obstacle(rng, robot, blind.witness.q, k) for k in range(CANDIDATES))
    apart = Collision(self_=False, surface=False, clearance=ROOM, scene=drawn)
    bodies = gather(robot, cells.surface, apart, task.standoff)
    assert bodies is not None
    hit = {fault.pair[1] for fault in collision_replay(robot, bodies, known).faults}
    scene = [one for one in drawn if one.name not in hit][:OBSTACLES]
    collision = Collision(clearance=CLEARANCE, scene=tuple(scene))
    bodies = gather(robot, cells.surface, collision, task.standoff)
    assert bodies is not None
    assert collision_replay(robot, bodies, known).accepted
    collides = not collision_replay(robot, bodies, blind.witness.q).accepted
    return BuiltScene(robot, cells, replace(task, collision=collision), collides)


def _another_motion(
    rng: np.random.Generator, robot: Robot, cells: Cells, task: Task, blind: np.ndarray
) -> np.ndarray | None:
    """A motion that has a joint where the blind one never has it; or any other; or none."""
    for joint in rng.permutation(robot.n)[:OTHERS].tolist():
        low, high = float(robot.lower[joint]), float(robot.upper[joint])
        below, above = blind[:, joint].min() - APART, blind[:, joint].max() + APART
        ranges = [(low, below), (above, high)]
        if not np.isfinite(low + high):  # a joint that turns freely
            ranges = [(below - np.pi, below), (above, above + np.pi)]
        ranges = [(lower, upper) for lower, upper in ranges if lower < upper]
        if not ranges:
            continue
        chosen = ranges[int(rng.integers(len(ranges)))]
        elsewhere = robot.with_limits({robot.joint_names[joint]: chosen})
        found = check(elsewhere, cells, task)
        if found.witness is not None:
            return found.witness.q
    found = check(robot, cells, task, Search(seed=1))
    return None if found.witness is None else found.witness.q


def a_plate(rng: np.random.Generator, robot: Robot) -> tuple[Cells, Task]:
    """A plate that looks up, or at the arm, or between, somewhere around the arm."""
    reach = min(robot.reach, 1.0)
    away, turn = rng.uniform(0.4, 0.65) * reach, rng.uniform(-60.0, 60.0)
    tilt, height = rng.uniform(0.0, 90.0), rng.uniform(0.0, 0.4) * reach
    position = (away * np.cos(np.radians(turn)), away * np.sin(np.radians(turn)), height)
    position = tuple(np.array(position) + robot.base_point)
    half = rng.uniform(0.08, 0.15) * reach
    plate = plane((-half, half), (-half, half), "outside", position, (0.0, -tilt, turn))
    return plate.cells(3, 4), Task(standoff=0.05, cone_deg=float(rng.uniform(15.0, 40.0)))


def _obstacle(rng: np.random.Generator, robot: Robot, q: np.ndarray, number: int) -> Obstacle:
    """A body where the motion q passes with a joint, or (every third) anywhere."""
    name = f"object{number}"
    data = robot.model.createData()
    row = q[rng.integers(len(q))]
    pin.forwardKinematics(
        robot.model, data, pin.integrate(robot.model, pin.neutral(robot.model), row)
    )
    joints = [data.oMi[k].translation for k in range(2, robot.n + 1)]
    k = int(rng.integers(len(joints) - 1))
    place = joints[k] + rng.uniform() * (joints[k + 1] - joints[k])
    if number % 3 == 2:
        place = robot.base_point + rng.uniform(-0.8, 0.8, 3) * min(robot.reach, 1.0)
    size, turn = rng.uniform(0.03, 0.25, 3), tuple(rng.uniform(-180.0, 180.0, 3))
    place = tuple(place + rng.normal(scale=0.05, size=3))
    match int(rng.integers(4)):
        case 0:
            return Obstacle.box(name, tuple(size), place, turn)
        case 1:
            return Obstacle.sphere(name, 0.5 * size[0], place)
        case 2:
            return Obstacle.capsule(name, 0.3 * size[0], 2.0 * size[1], place, turn)
    return Obstacle.cylinder(name, 0.5 * size[0], 2.0 * size[1], place, turn)


def assert_found(scene: BuiltScene) -> bool:
    """True where the search finds a motion, which has to be right; the contrary is never proved."""
    verdict = scene.verdict()
    assert verdict.evidence is not Evidence.PROOF
    assert not any(cause.proved for cause in verdict.causes)
    if verdict.answer is Answer.FEASIBLE:
        assert_clear(verdict, DENSE_DEG)
    return verdict.answer is Answer.FEASIBLE
