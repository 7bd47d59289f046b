"""Timed motions: limits everywhere, not only at samples; the same path; replayed from outside."""

import warnings
from dataclasses import replace
from functools import cache

import numpy as np
import path_cases
import pytest
from path_cases import PATCHES, SPEED
from plain import assert_motion, assert_over
from referee import evenly as dense
from samples import EVERYTHING, sampled
from timed_motions import interpolated, keeps_to_limits

import coverable
from coverable import Collision, PathError, Task, check, coverage_path, motion_limits, trajectory
from feasibility.certification.collisions.collision_replay import collision_replay
from feasibility.collisions.asked_bodies import gather
from feasibility.demands.fast_motions import rate_figures
from feasibility.timing.path_timing import within_limits
from feasibility.timing.smooth_curve import control_points
from feasibility.timing.speed_limits import past_limits, used
from feasibility.verdict import Walk
from robots.kinematics import Kinematics

UR5 = coverable.load_robot("ur5")
POST = coverable.Obstacle.box("post", (0.1, 0.1, 0.6), position=(0.75, 0.0, 0.3))
AMONG = Collision(clearance=0.005, scene=(POST,))
FLAT = coverable.plane((0.4, 0.6), (-0.1, 0.1), position=(0, 0, 0.3), side="outside")
CASES = ("5c, coarse", *PATCHES, *("4a", "4c", "5c") * EVERYTHING)


@cache
def path_of(name):
    """With a post that the tool passes; or one of the paths that several files look at."""
    if name != "post":
        return path_cases.path_of(name)
    return coverage_path(check(UR5, FLAT.cells(2, 3), Task(0.02, 30, collision=AMONG)), "rows")


@cache
def run_of(name):
    return trajectory(path_of(name), SPEED)


@sampled("name", CASES)
def test_a_trajectory_is_its_path_and_keeps_to_all_limits_however_it_is_interpolated(name):
    run, path = run_of(name), path_of(name)
    robot, limits = path.robot, motion_limits(path.robot, SPEED)
    assert coverable.replay(robot, path.cells, path.task, run.walk, path.needed).accepted
    marks = run.cell >= 0
    assert_over(path, run.cell[marks], run.q[marks])
    assert np.array_equal(run.cell[marks], path.visits)
    keeps_to_limits(robot, run, limits)
    for degree in (3, 5):  # what a controller makes of it stays on the surface
        assert_motion(path, interpolated(run, degree, 3)[0])
    # Speeds are those of the tool, by Pinocchio; at rest at both ends; whole nanoseconds.
    kinematics = Kinematics(robot)
    speed = [
        np.linalg.norm(kinematics.jacobians(q)[0] @ dq) for q, dq in zip(run.q, run.dq, strict=True)
    ]
    assert run.tool_speed == pytest.approx(speed, rel=1e-9, abs=1e-12)
    assert not run.dq[[0, -1]].any()
    assert np.abs(run.time * 1e9 - np.rint(run.time * 1e9)).max() < 1e-5
    # No faster than the tool's way at full speed, and not much slower: the arm stops nowhere.
    points, _ = kinematics.tools(dense(path.walk.q, 8))
    way = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    assert run.tool_way == pytest.approx(way, rel=0.02)
    assert 0.98 * way <= run.duration * SPEED <= 1.6 * way + SPEED


@pytest.mark.parametrize("name", ["panda", "ur5"])
def test_joint_limits_that_the_path_touches_are_nowhere_passed(name):
    path = path_of(name)
    lower, upper = path.walk.q.min(axis=0), path.walk.q.max(axis=0)
    limits = np.column_stack([lower, np.maximum(upper, lower + 1e-3)])
    path = replace(path, robot=path.robot.with_limits(limits))
    run = trajectory(path, SPEED)
    q = interpolated(run, 3, 100)[0]
    least, most = q.min(axis=0), q.max(axis=0)
    assert (past_limits(path.robot, run) <= 0.0).all()
    # The limits are touched, or nearly so: the test would see a motion that passes them.
    assert min((least - path.robot.lower).min(), (path.robot.upper - most).min()) < 1e-6
    assert coverable.replay(path.robot, path.cells, path.task, run.walk, path.needed).accepted


def test_a_motion_takes_hardly_longer_than_toppra_says():
    """Along the curve that the samples are on, toppra asks for no less but in rounding."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # its sources hold escapes that Python frowns at
        import toppra
        from toppra.algorithm import TOPPRA
        from toppra.constraint import JointAccelerationConstraint, JointVelocityConstraint
    rows = np.random.default_rng(0).uniform(-1.0, 1.0, (5, 6))
    limits = motion_limits(UR5, 1e3)  # of the joints alone
    curve = control_points(Walk(rows, np.array([0, -1, -1, -1, 1])), np.full(5, 0.3))
    run = within_limits(UR5, [curve], limits, 0.01)
    keeps_to_limits(UR5, run, limits)
    assert np.allclose(run.q[[0, -1]], rows[[0, -1]])
    for name, given in (("velocity", run.dq), ("acceleration", run.ddq)):
        assert (np.abs(given) / getattr(limits, name)).max() > 0.9
    h = np.diff(run.time)
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(run.q, axis=0), axis=1))])
    curve = toppra.SplineInterpolator(s / s[-1], run.q)
    ends = [np.column_stack([-most, most]) for most in (limits.velocity, limits.acceleration)]
    both = [JointVelocityConstraint(ends[0]), JointAccelerationConstraint(ends[1])]
    least = TOPPRA(both, curve, gridpoints=s / s[-1]).compute_trajectory()
    assert 0.97 <= run.duration / least.duration <= 1.1
    assert h.min() > 0.0


def bodies_of(task):
    return gather(UR5, FLAT, task.collision, task.standoff)


def test_a_run_past_a_post_keeps_its_clearance_everywhere():
    """Single configurations of the quintics, densely: none is nearer than it may be."""
    run = run_of("post")
    assert run.collisions == ("self", "surface", "scene")
    bodies = bodies_of(path_of("post").task)
    for degree in (3, 5):
        for row in interpolated(run, degree, 2)[0][::36]:
            assert collision_replay(UR5, bodies, row[None]).accepted


@pytest.mark.parametrize("what", ["in the way", "where it passes", "hardly clear"])
def test_a_timed_motion_that_would_collide_is_refused_with_the_pair(what):
    """An object that the path passes through, a ball that only it meets; or sharper turns do."""
    path = path_of("post")
    if what == "hardly clear":  # rounding its corners may take nothing of the clearance it keeps
        nearest = path.certificate
        tight = (*nearest.nearest_pair, nearest.min_clearance - 1e-5)
        task = replace(path.task, collision=replace(AMONG, clearances=(tight,)))
        run = trajectory(replace(path, task=task), SPEED)
        for row in interpolated(run, 5, 2)[0][::36]:
            assert collision_replay(UR5, bodies_of(task), row[None]).accepted
        return
    if what == "in the way":
        ahead = coverable.Obstacle.box("bracket", (0.05, 0.05, 0.3), position=(0.5, 0.0, 0.5))
    else:
        half = Kinematics(UR5).joints(run_of("post").q[len(run_of("post")) // 2][None])
        middle = half.points[0, -1]
        ahead = coverable.Obstacle.sphere("bracket", 0.01, position=tuple(middle))
    task = replace(path.task, collision=Collision(self_=False, surface=False, scene=(ahead,)))
    with pytest.raises(PathError, match=r"\w+ and bracket"):
        trajectory(replace(path, task=task), SPEED)


def test_over_one_cell_the_arm_rests():
    verdict = check(UR5, FLAT.cells(1, 1), Task(0.02, 30, speed=SPEED))
    run = trajectory(coverage_path(verdict), SPEED)
    assert (run.time.tolist(), run.q.tolist()) == ([0.0], verdict.witness.q.tolist())
    assert (run.at(np.array([0.0, 1.0])) == run.q).all()
    assert not run.at(np.array([0.0, 1.0]), order=1).any()
    assert not used(UR5, run, motion_limits(UR5, SPEED)).velocity.any()
    assert rate_figures(verdict).largest == np.inf


def test_limits_and_numbers_that_are_none():
    puma, path = replace(coverable.load_robot("puma560"), max_velocity=np.nan), path_of("ur5")
    with pytest.raises(PathError, match=r"joint1, .*give velocity"):
        motion_limits(puma, 0.1)
    assert motion_limits(puma, 0.1, velocity=2.0).acceleration.tolist() == [4.0] * 6
    some = replace(puma, max_velocity=[1.0, np.nan, 1.0, np.inf, 1.0, 1.0])
    with pytest.raises(PathError, match="for joint2, joint4; give"):
        motion_limits(some, 0.1)
    for bad in (0.0, -1.0, np.nan, np.inf, "fast", [1.0, 2.0], [1.0] * 5 + [0.0], 1e-320):
        with pytest.raises(PathError, match=r"(?s)tool speed.*velocity must be.*acceleration must"):
            motion_limits(UR5, bad, velocity=bad, acceleration=bad)
        with pytest.raises(PathError, match="the period must be"):
            trajectory(path, period=bad)
    few = np.flatnonzero(path.walk.cell >= 0)[2] + 1
    off = replace(path, walk=Walk(path.walk.q[:few] + 0.1, path.walk.cell[:few]))
    with pytest.raises(PathError, match="no smooth motion was found"):
        trajectory(off)
