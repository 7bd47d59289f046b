"""A projected configuration is on target, inside the cone, and exactly inside the limits."""

from __future__ import annotations

import numpy as np
import pytest
from dense_replay import tools
from random_arms import QUESTIONS, finite_limits, planar_arm, question

from feasibility import Task
from feasibility.roadmap import arrays_of, place, project, stand_still, work_for
from surfaces import plane

SLACK = 1e-6  # [1] share of the cone chord kept free
DOWN = np.array([0.0, 0.0, -1.0])


def solve(arrays, work, target, approach, q, most=60):
    """Newton from q (in place) onto a target point, inside the cone about a direction."""
    work.target[0], work.target[1] = target, approach
    stand_still(arrays, work)
    place(arrays, work, 1, q)
    work.secondary_step[:] = 0.0
    return project(arrays, work, q, SLACK, np.inf, most)


@pytest.mark.parametrize("name", QUESTIONS)
@pytest.mark.parametrize("cone_deg", [1.0, 40.0, 120.0, 180.0])
@pytest.mark.parametrize("tolerance", [1e-5, 1e-2])
def test_results_obey_every_constraint(name, cone_deg, tolerance):
    """20 random starts over 3 cells each; Pinocchio says where the result is."""
    robot, cells, task = question(name)
    task = Task(task.standoff, cone_deg, tolerance)
    arrays, work = arrays_of(robot, cells, task), work_for(robot.n)
    targets = task.targets(cells)
    rng = np.random.default_rng(1)
    low, high = finite_limits(robot)
    found = 0
    for cell in rng.choice(len(cells), 3, replace=False):
        for q in rng.uniform(low, high, (20, robot.n)):
            if not solve(arrays, work, targets.points[cell], targets.approaches[cell], q):
                continue
            found += 1
            assert (q >= robot.lower).all()
            assert (q <= robot.upper).all()
            (point,), (axis,) = tools(robot, q[None])
            assert np.linalg.norm(point - targets.points[cell]) <= arrays.near + 1e-12
            assert arrays.near <= 0.02 * tolerance
            chord = np.linalg.norm(axis - targets.approaches[cell])
            assert chord <= 2.0 * np.sin(task.cone / 2.0) + 1e-12
    assert found > (5 if cone_deg < 10 else 15)


def test_results_at_limits_are_exactly_at_them():
    """A planar arm whose only solution inside narrow limits is at their corner."""
    robot = planar_arm(3)
    corner = np.array([0.3, -1.1, 0.7])
    (point,), _ = tools(robot, corner[None])
    patch = plane(
        (point[0] - 0.1, point[0] + 0.1), (point[1] - 0.1, point[1] + 0.1), side="outside"
    )
    snug = robot.with_limits(np.column_stack([corner - 0.4, corner]))
    arrays, work = arrays_of(snug, patch.cells(1, 1), Task(0.0, 180, 1e-3)), work_for(3)
    rng = np.random.default_rng(2)
    at_limits = 0
    for _ in range(50):
        q = rng.uniform(snug.lower, snug.upper)
        if solve(arrays, work, point, DOWN, q):
            assert (q >= snug.lower).all()
            assert (q <= snug.upper).all()
            at_limits += (q == snug.upper).any()
    assert at_limits >= 25


def test_impossible_targets_are_not_found():
    """Beyond reach, outside the cone, and NaN: no result, and nothing leaves the limits."""
    robot = planar_arm(3)
    cells = plane((-2, 2), (-2, 2), side="outside").cells(1, 1)
    rng = np.random.default_rng(3)
    for task, point in (
        (Task(0.0, 180, 1e-3), np.array([1.5, 0.1, 0.0])),
        (Task(0.0, 80, 1e-3), np.array([0.5, 0.1, 0.0])),  # the axis lies in the plane
        (Task(0.0, 0, 1e-3), np.array([0.5, 0.1, 0.0])),
        (Task(0.0, 180, 1e-3), np.array([np.nan, 0.1, 0.0])),
    ):
        arrays, work = arrays_of(robot, cells, task), work_for(3)
        for _ in range(20):
            q = rng.uniform(robot.lower, robot.upper)
            assert not solve(arrays, work, point, DOWN, q)
            assert np.isnan(q).any() or (np.abs(q) <= robot.upper).all()
