"""Motions along joint limits: what a controller puts between samples nowhere passes them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from path_cases import SPEED, path_of

from feasibility.certification import replay
from feasibility.timing import Trajectory, trajectory
from feasibility.timing.sampled_trajectory import ROUNDING, held_inside, past_limits
from robots import Robot


def tight_path(name):
    """A path, and the same arm with limits that the path touches at both ends of each joint."""
    path = path_of(name)
    lower, upper = path.walk.q.min(axis=0), path.walk.q.max(axis=0)
    limits = np.column_stack([lower, np.maximum(upper, lower + 1e-3)])
    return replace(path, robot=path.robot.with_limits(limits))


def cubic_extrema(run: Trajectory) -> tuple[np.ndarray, np.ndarray]:
    """(n,) the least and the largest value of each joint on the cubics between samples, exactly."""
    h = np.diff(run.time)[:, None]
    q, last, slope, end = run.q[:-1], run.q[1:], h * run.dq[:-1], h * run.dq[1:]
    c = 3.0 * (last - q) - 2.0 * slope - end
    d = slope + end - 2.0 * (last - q)
    found = [q, last]
    root = np.sqrt(np.maximum(c**2 - 3.0 * d * slope, 0.0))
    # Roots of 3 d t^2 + 2 c t + slope, both in the form that does not cancel.
    sign = np.where(c >= 0.0, 1.0, -1.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        for t in (-(c + sign * root) / (3.0 * d), -slope / (c + sign * root)):
            t = np.where(np.isfinite(t), np.clip(t, 0.0, 1.0), 0.0)
            found.append(q + t * (slope + t * (c + t * d)))
    return np.min(found, axis=(0, 1)), np.max(found, axis=(0, 1))


@pytest.mark.parametrize("name", ["panda"])
def test_the_cubics_between_samples_stay_inside_the_limits(name):
    path = tight_path(name)
    run = trajectory(path, SPEED)
    least, most = cubic_extrema(run)
    assert (least >= path.robot.lower).all()
    assert (most <= path.robot.upper).all()
    # The limits are touched, or nearly so: the test would see a motion that passes them.
    assert min((least - path.robot.lower).min(), (path.robot.upper - most).min()) < 1e-6
    assert replay(path.robot, path.cells, path.task, run.walk, path.needed).accepted


@pytest.mark.parametrize("ends", ["both", "lower", "upper"])
def test_a_motion_drawn_in_keeps_its_shape(ends):
    """Random samples with steep ends, whose cubics pass the limits of all joints."""
    rng, k, robot = np.random.default_rng(3), 9, path_of("panda").robot
    q = rng.uniform(robot.lower, robot.upper, (k, robot.n))
    limits = np.column_stack([robot.lower, robot.upper])
    tight = np.column_stack([q.min(axis=0), q.max(axis=0)])
    limits[:, 0] = tight[:, 0] if ends != "upper" else -np.inf
    limits[:, 1] = tight[:, 1] if ends != "lower" else np.inf
    bounded: Robot = robot.with_limits(limits)
    run = Trajectory(
        robot.joint_names, np.arange(k) * 0.02, q, rng.normal(size=q.shape),
        rng.normal(size=q.shape), np.zeros(k), np.full(k, -1),
    )  # fmt: skip
    assert past_limits(bounded, run).max() > 0.0
    held = held_inside(bounded, run)
    least, most = cubic_extrema(held)
    assert (least >= bounded.lower).all()
    assert (most <= bounded.upper).all()
    assert (past_limits(bounded, held) <= 0.0).all()
    assert np.abs(held.q - run.q).max() <= 2.0 * past_limits(bounded, run).max() + 4 * ROUNDING
    scale = held.dq / run.dq
    assert scale == pytest.approx(np.broadcast_to(scale[0], scale.shape))


def test_a_motion_far_from_its_limits_is_left_as_it_is():
    run = trajectory(path_of("ur5"), SPEED)
    assert held_inside(path_of("ur5").robot, run) is run
