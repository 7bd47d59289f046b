"""Targets just out of reach are covered within the tolerance, and no further."""

from __future__ import annotations

import numpy as np
import pytest
from dense_replay import tools
from random_arms import finite_limits, planar_arm

from feasibility import Search, Task, check
from feasibility.roadmap import arrays_of, work_for
from feasibility.roadmap.motions.off_target import project_near_cell
from robots import load_robot
from surfaces import plane, sphere

STEPS = np.int64(60)


def beyond_reach(short, size=0.02):
    """A planar arm of three links, and one small cell `short` (m) beyond its reach."""
    robot = planar_arm(3)
    (reach,), _ = tools(robot, np.zeros((1, 3)))
    x = reach[0] + short
    patch = plane((x - size, x + size), (reach[1] - size, reach[1] + size), side="outside")
    return robot, patch.cells(1, 1)


@pytest.mark.parametrize("share", [0.3, 0.8, 0.99])
def test_a_target_beyond_reach_is_covered_within_the_tolerance(share):
    robot, cells = beyond_reach(share * 0.01)
    for seed in range(3):
        verdict = check(robot, cells, Task(0.0, 180.0, 0.01), Search(seed=seed))
        assert verdict.evidence == "witness"
        (point,), _ = tools(robot, verdict.witness.q[:1])
        off = np.linalg.norm(point - cells.centres[0])
        assert 0.999 * share * 0.01 <= off <= 0.01


def test_a_target_beyond_the_tolerance_is_proved_uncoverable():
    robot, cells = beyond_reach(1.01 * 0.01)
    assert check(robot, cells, Task(0.0, 180.0, 0.01)).evidence == "proof"


@pytest.mark.parametrize("name", ["puma560", "ur5", "panda"])
def test_results_off_target_obey_every_constraint(name):
    """Narrowed limits put most targets out of exact reach; Pinocchio says where the results are."""
    robot, task = load_robot(name), Task(0.0, 20.0, 0.05)
    rng = np.random.default_rng(3)
    low, high = finite_limits(robot)
    middle = rng.uniform(low, high)
    span = 0.15 * (high - low)
    robot = robot.with_limits(np.column_stack([middle - span, middle + span]))
    (point,), (axis,) = tools(robot, middle[None])
    patch = plane((-0.1, 0.1), (-0.1, 0.1), side="inside")
    turn = _turn_onto(axis)
    cells = patch.moved(turn, point).cells(3, 3)
    arrays, work = arrays_of(robot, cells, task), work_for(robot.n)
    targets = task.targets(cells)
    off = []
    for cell in range(9):
        for q in rng.uniform(robot.lower, robot.upper, (10, robot.n)):
            if not project_near_cell(arrays, work, cell, q, STEPS):
                continue
            assert (q >= robot.lower).all()
            assert (q <= robot.upper).all()
            (point,), (axis,) = tools(robot, q[None])
            off.append(np.linalg.norm(point - targets.points[cell]))
            assert off[-1] <= task.tolerance
            assert np.linalg.norm(axis - targets.approaches[cell]) <= task.cone_chord + 1e-12
    assert len(off) > 10


def _turn_onto(axis):
    """(3, 3) a rotation whose z column is `axis`."""
    x = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(axis, x), axis])


@pytest.mark.parametrize("cone_deg", [0.05, 0.2, 0.57])
def test_narrow_cones_are_kept_by_both_tilts(cone_deg):
    """With one row for the cone, 0.05 deg ended "exhausted" after 4.7 million evaluations."""
    patch = plane((-0.2, 0.2), (-0.2, 0.2), position=(0.45, 0.0, 0.2), side="outside")
    for seed in range(3):
        verdict = check(
            load_robot("ur5"), patch.cells(6, 6), Task(0.005, cone_deg), Search(seed=seed)
        )
        assert verdict.evidence == "witness"
        assert verdict.statistics["fk"] < 20_000


def test_the_cone_of_a_sphere_is_kept_off_the_target_too():
    """Where the surface bends, the approach direction beside the target is another."""
    robot = load_robot("puma560")
    ball = sphere(
        0.2, polar_deg=(80, 100), azimuth_deg=(170, 190), side="outside", position=(1.0, 0.1, 0.0)
    )
    for push in np.linspace(0.55, 0.7, 16):
        cells = ball.moved(np.eye(3), (push, 0.0, 0.0)).cells(1, 1)
        verdict = check(robot, cells, Task(0.0, 30.0, 0.01))
        if not verdict.feasible:
            continue
        (point,), (axis,) = tools(robot, verdict.witness.q[:1])
        targets = verdict.task.targets(cells)
        assert np.linalg.norm(point - targets.points[0]) <= 0.01
        assert np.linalg.norm(axis - targets.approaches[0]) <= verdict.task.cone_chord + 1e-12
