"""Verdicts at a speed on random patches in front of four arms: they turn where timed motions do."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from speed_oracle import fastest, largest

from feasibility import Task, check, verify
from robots import Kinematics, load_robot
from surfaces import cylinder, plane, sphere

ARMS = ("ur5", "panda", "puma560", "kinova")
TASK = Task(standoff=0.02, cone_deg=20)
NUMBERS = range(6)


@cache
def drawn(arm, number):
    """An arm and cells around a random place that its tool reaches, or None."""
    rng = np.random.default_rng([ARMS.index(arm), number])
    robot = load_robot(arm)
    robot = replace(robot, max_velocity=rng.uniform(0.5, 3.0, robot.n))
    low, high = np.maximum(robot.lower, -2.5), np.minimum(robot.upper, 2.5)
    for _ in range(20):
        point, axis = Kinematics(robot).tool(rng.uniform(low, high))
        x = np.cross(axis, rng.normal(size=3))
        x /= np.linalg.norm(x)
        turn = np.column_stack([x, np.cross(-axis, x), -axis])
        rpy = tuple(Rotation.from_matrix(turn).as_euler("xyz", degrees=True))
        at, size = point + TASK.standoff * axis, rng.uniform(0.04, 0.12)
        kind = number % 3
        if kind == 0:
            part = plane((-size, size), (-size, size), "outside", tuple(at), rpy)
        elif kind == 1:
            ends = np.degrees(size / 0.3)
            part = sphere(0.3, (1, ends), (0, 90), "outside", tuple(at + 0.3 * axis), rpy)
        else:
            centre = tuple(at + 0.3 * axis)
            lying = Rotation.from_matrix(
                turn @ Rotation.from_euler("y", 90, degrees=True).as_matrix()
            )
            angle = np.degrees(size / 0.3)
            part = cylinder(0.3, (180 - angle, 180 + angle), (-size, size), "outside", centre,
                            tuple(lying.as_euler("xyz", degrees=True)))  # fmt: skip
        cells = part.cells(2, 3)
        if check(robot, cells, TASK).feasible:
            return robot, cells
    return None


@pytest.mark.parametrize("number", NUMBERS)
@pytest.mark.parametrize("arm", ARMS)
def test_turn(arm, number):
    found = drawn(arm, number)
    assert found is not None, "no patch of twenty is covered"
    robot, cells = found
    turn = largest(robot, cells, TASK)
    slower, faster = (check(robot, cells, replace(TASK, speed=f * turn)) for f in (0.98, 1.02))
    assert slower.feasible
    assert str(faster.answer) == "undecided"
    assert verify(slower).holds
    targets = TASK.targets(cells).points
    near = 0.1 * TASK.effective_tolerance
    assert fastest(robot, targets, near, slower.witness.q) >= 0.98 * turn
