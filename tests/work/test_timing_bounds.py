"""What is said of a motion between its samples, against what controllers make of these."""

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from timed_motions import UR5, interpolated, motion

from coverable import Trajectory, load_robot, motion_limits
from feasibility.timing.sampled_trajectory import deviations
from feasibility.timing.speed_limits import past_limits, used
from robots.kinematics import Kinematics

MANY = 40  # places between two samples


@cache
def run_of(name):
    """A smooth motion; one whose samples jump; one whose samples are far apart; two samples."""
    rng = np.random.default_rng(3)
    if name == "even":
        time, q = motion(UR5).time, motion(UR5).q
    elif name == "jumpy":
        time = np.cumsum(rng.uniform(0.004, 0.02, 40))
        q = 0.01 * np.cumsum(rng.normal(size=(40, 6)), axis=0)
    elif name == "far apart":
        time, q = np.cumsum(rng.uniform(0.05, 0.15, 12)), np.cumsum(rng.normal(0, 0.04, (12, 6)), 0)
    else:
        time, q = np.array([0.0, 0.5]), np.array([[0.0] * 6, [0.3, -0.2, 0.1, 0.0, 0.2, -0.1]])
    return Trajectory.through(UR5, np.round(time - time[0], 9), q, np.full(len(time), -1))


RUNS = ("even", "jumpy", "far apart", "two")


@pytest.mark.parametrize("name", RUNS)
def test_quintics_and_cubics_of_controllers_are_one_spline_and_what_is_used_is_what_it_uses(name):
    run, limits = run_of(name), motion_limits(UR5, 0.5)
    here, most = used(UR5, run, limits), []
    for degree in (3, 5):
        q, dq, ddq = interpolated(run, degree, MANY)
        time = np.append(run.time[:-1, None] + np.linspace(0, 1, MANY, endpoint=False)
                         * np.diff(run.time)[:, None], run.time[-1])  # fmt: skip
        for order, made in enumerate((q, dq, ddq[:-1])):
            scale = np.abs(made).max()
            assert np.abs(run.at(time, order)[: len(made)] - made).max() <= 1e-9 * scale
        columns = [Kinematics(UR5).jacobians(row)[0] for row in q]
        tool = np.linalg.norm(np.einsum("kij,kj->ki", columns, dq), axis=1)
        most.append([*np.abs(dq).max(0), *np.abs(ddq).max(0), tool.max()])
    truth = np.max(most, axis=0)
    said = np.concatenate([here.velocity * limits.velocity, here.acceleration * limits.acceleration,
                           [here.tool_speed * limits.tool_speed]])  # fmt: skip
    assert (said >= truth * (1.0 - 1e-7)).all()
    assert (said[:-1] <= truth[:-1] * 1.01).all()
    assert said[-1] <= 1.2 * truth[-1]
    weaker = replace(limits, acceleration=limits.acceleration / 1e4)
    assert used(UR5, run, weaker).too_fast == pytest.approx(100.0 * here.acceleration.max() ** 0.5)
    slower = replace(run, time=2.0 * run.time, dq=run.dq / 2.0, ddq=run.ddq / 4.0)
    assert used(UR5, slower, limits).acceleration == pytest.approx(here.acceleration / 4.0)
    assert (used(UR5, slower, limits).velocity <= here.velocity / 2.0 * (1.0 + 1e-9)).all()


@pytest.mark.parametrize("name", RUNS)
def test_the_motion_is_as_near_its_lines_as_is_said(name):
    run = run_of(name)
    for places in (1, 4):
        rows, finer = run.between(places), MANY // places
        assert np.array_equal(rows.cell[::places], run.cell)
        q = interpolated(run, 5, MANY)[0]
        assert np.allclose(q[::finer], rows.q, atol=1e-12)
        dense = np.stack([q[k : len(q) - finer + k : finer] for k in range(finer + 1)], axis=1)
        assert beyond(rows.q, dense, run.off_lines(places)).max() <= 1e-11


def beyond(rows, dense, bounds):
    """(m - 1, k, n) how much further dense places are from the line between two rows than bounds.

    From where they are due on it, or from the nearest place on it: either will do.
    """
    found = []
    for (a, b), places, bound in zip(pairwise(rows), dense, bounds, strict=True):
        way, due = b - a, np.linspace(0.0, 1.0, len(places))
        near = np.clip((places - a) @ way / max(float(way @ way), 1e-300), 0.0, 1.0)
        over = [np.abs(places - a - share[:, None] * way) - bound for share in (due, near)]
        least = np.argmin(np.max(over, axis=2), axis=0)
        found.append(np.where(least[:, None] == 0, *over))
    return np.array(found)


@pytest.mark.parametrize("seed", range(5))
def test_deviations_bound_how_far_parabolas_and_cubics_are_from_their_chords(seed):
    """Random cubics, some of them almost straight, some turning back: most of it is used."""
    rng = np.random.default_rng(seed)
    count, n = 60, 3
    a, way = rng.normal(size=(count, n)), rng.normal(size=(count, n))
    ends = np.geomspace(1e-4, 30.0, count)[:, None, None] * rng.normal(size=(count, 2, n))
    ends[::3] = way[::3, None] * rng.uniform(-1.0, 1.0, (len(ends[::3]), 2, 1))  # along the chord
    ends[1::3, 1] = ends[1::3, 0]  # parabolas
    t = np.linspace(0.0, 1.0, 201)[None, :, None]
    first, last = ends[:, :1], ends[:, 1:]  # q'' runs straight from one to the other
    curve = first * t**2 / 2 + (last - first) * t**3 / 6
    curve = a[:, None] + way[:, None] * t + curve - t * curve[:, -1:]
    used = []
    for k in range(count):
        rows = curve[k, [0, -1]]
        bound = deviations(rows, ends[k][:, None])[0]
        over = beyond(rows, curve[k][None], bound[None])[0]
        assert over.max() <= 1e-12
        used.append(((over + bound) / bound).max())
        if k % 3 == 0:
            assert bound.max() < 1e-9
    assert max(used) > 0.97


@pytest.mark.parametrize("times", [3.0, 8.0, 15.0])
def test_what_turns_back_along_its_chord_is_beyond_it(times):
    """A motion along a line that overshoots its end is off the line between its ends."""
    way = np.array([0.3, -0.2, 0.1])
    rows = np.array([0.0 * way, way])
    t = np.linspace(0.0, 1.0, 401)[:, None]
    second = -times * way
    places = way * t + 0.5 * second * (t**2 - t)
    assert np.abs(places).max() > 1.01 * np.abs(way).max()
    bound = deviations(rows, np.stack([second, second])[:, None])
    assert beyond(rows, places[None], bound).max() <= 1e-12


@pytest.mark.parametrize("ends", ["both", "lower", "upper"])
def test_how_far_joints_pass_their_limits_between_samples(ends):
    """Random samples with steep ends, whose cubics pass the limits of all joints."""
    rng, k, robot = np.random.default_rng(3), 9, load_robot("panda")
    q = rng.uniform(robot.lower, robot.upper, (k, robot.n))
    limits = np.column_stack([q.min(axis=0), q.max(axis=0)])
    if ends != "both":
        limits[:, int(ends == "lower")] = np.inf if ends == "lower" else -np.inf
    bounded = robot.with_limits(limits)
    run = Trajectory.through(robot, np.arange(k) * 0.02, q, np.full(k, -1))
    dense = np.vstack([interpolated(run, degree, 400)[0] for degree in (3, 5)])
    past = np.maximum(bounded.lower - dense.min(axis=0), dense.max(axis=0) - bounded.upper)
    bound = past_limits(bounded, run)
    assert (past <= bound + 1e-12).all()
    assert bound.max() > 0.0
    assert (past[past > 1e-3] >= 0.99 * bound[past > 1e-3]).all()
