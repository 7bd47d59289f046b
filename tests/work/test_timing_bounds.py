"""Bounds on what is between samples of a timed motion, against Pinocchio at many places there."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from samples import sampled, seeds
from timed_motions import UR5, interpolated, motion

from feasibility.timing import Trajectory, motion_limits, used
from feasibility.timing.between_samples import deviations, deviations_between, motion_near
from feasibility.timing.sampled_trajectory import KINDS, held_inside, motion_between, past_limits
from feasibility.timing.smoothing import control_points
from feasibility.timing.speed_limits import fine_grid, squared_speeds
from feasibility.timing.tool_between_samples import fastest_tool
from feasibility.verdict import Walk
from robots import Kinematics, load_robot

DEGREES = {"quintic": 5, "cubic": 3}
MANY = 16  # places between two samples


@cache
def run_named(name):
    """A smooth motion; one whose joints swing between samples; few samples, far apart."""
    run, rng = motion(UR5), np.random.default_rng(3)
    if name == "smooth":
        return run
    if name == "jumpy":
        return replace(run, ddq=run.ddq + rng.normal(size=run.q.shape))
    if name == "one joint":
        only = np.eye(6)[1]
        return replace(run, q=run.q * only, dq=run.dq * only, ddq=run.ddq * only + 3.0 * only)
    time = np.cumsum(rng.uniform(0.1, 0.4, 12))
    given = {"q": np.cumsum(rng.normal(0, 0.15, (12, 6)), 0), "dq": rng.normal(0, 0.4, (12, 6))}
    return Trajectory(
        UR5.joint_names, time, **given, ddq=rng.normal(0, 2.0, (12, 6)),
        tool_speed=np.zeros(12), cell=np.full(12, -1),
    )  # fmt: skip


RUNS = ("smooth", "jumpy", "one joint", "far apart")


def tool_speeds(q, dq):
    """By Pinocchio."""
    kinematics = Kinematics(UR5)
    return np.array(
        [np.linalg.norm(kinematics.jacobians(a)[0] @ b) for a, b in zip(q, dq, strict=True)]
    )


@pytest.mark.parametrize("name", RUNS)
def test_the_tool_is_nowhere_faster_than_said_and_nearly_so(name):
    run, dense = run_named(name), 0.0
    for degree in DEGREES.values():
        q, dq, _ = interpolated(run, degree, MANY)
        dense = max(dense, tool_speeds(q, dq).max())
    looked_at = fastest_tool(UR5, run, 0.0)
    assert dense * (1.0 - 1e-9) <= looked_at <= 1.05 * dense
    # What is not looked at is slower than what is enough: at every enough.
    for enough in np.linspace(0.5, 1.1, 25) * dense:
        assert dense <= max(fastest_tool(UR5, run, enough), enough) * (1.0 + 1e-9)
    limits = motion_limits(UR5, 1.0)
    assert used(UR5, run, limits).tool_speed >= min(dense, 1.0) * (1.0 - 1e-9)


@sampled
@pytest.mark.parametrize("seed", seeds(6, all=300))
def test_what_is_taken_to_be_slow_enough_is(seed):
    """One joint, or two, that jerk between two samples at rest: the tool is fastest in between."""
    rng = np.random.default_rng(seed)
    joints = np.eye(6)[rng.choice(4, rng.integers(1, 4), replace=False)].sum(axis=0)
    base = rng.uniform(-1.5, 1.5, 6)
    step = rng.uniform(0.2, 1.5) * joints * rng.choice([-1.0, 1.0], 6)
    q = np.array([base, base + step, base + rng.uniform(0.0, 1.0) * step])
    still = np.zeros((3, 6))
    dq = still if seed % 2 else rng.normal(0, 0.3, (3, 6)) * joints
    run = Trajectory(
        UR5.joint_names, np.array([0.0, 0.7, 1.5]), q, dq, still, np.zeros(3), np.full(3, -1)
    )
    dense = 0.0
    for degree in DEGREES.values():
        q, dq, _ = interpolated(run, degree, 60)
        dense = max(dense, tool_speeds(q, dq).max())
    for enough in np.linspace(0.3, 1.02, 40) * dense:
        assert dense <= max(fastest_tool(UR5, run, enough), enough) * (1.0 + 1e-9)


# -- straight lines in place of polynomials --------------------------------------------------------


def off_lines(rows, dense):
    """(m - 1, k, n) how far dense places are from the line between two rows, as a set."""
    found = []
    for (a, b), places in zip(pairwise(rows), dense, strict=True):
        way = b - a
        share = np.clip((places - a) @ way / max(float(way @ way), 1e-300), 0.0, 1.0)
        found.append(np.abs(places - a - share[:, None] * way))
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
    shares, turned = [], 0.0
    for k in range(count):
        rows = curve[k, [0, -1]]
        most = off_lines(rows, curve[k][None])[0].max(axis=0)
        bound = deviations(rows, ends[k][:, None])[0]
        assert (most <= bound + 1e-12).all()
        shares.append((most / bound).max())
        turned = max(turned, most.max())
        if k % 3 == 0:
            assert bound.max() < 1e-9
    assert max(shares) > 0.97
    assert turned > 1.0


@pytest.mark.parametrize("times", [3.0, 8.0, 30.0])
def test_what_turns_back_along_its_chord_is_beyond_it(times):
    """A motion along a line that overshoots its end is off the line between its ends."""
    way = np.array([0.3, -0.2, 0.1])
    rows = np.array([0.0 * way, way])
    t = np.linspace(0.0, 1.0, 401)[:, None]
    second = -times * way
    places = way * t + 0.5 * second * (t**2 - t)
    most = off_lines(rows, places[None])[0].max(axis=0)
    assert most.max() > 1e-3
    assert (most <= deviations(rows, np.stack([second, second])[:, None])[0]).all()


@pytest.mark.parametrize("kind", DEGREES)
@pytest.mark.parametrize("name", RUNS)
def test_what_a_controller_makes_of_samples_is_near_lines(name, kind):
    run, places, finer = run_named(name), 4, 6
    walk = motion_between(run, kind, places)
    bounds = deviations_between(run, kind, walk.q)
    q, _, _ = interpolated(run, DEGREES[kind], places * finer)
    np.testing.assert_allclose(q[::finer], walk.q, atol=1e-9)
    dense = np.stack([q[k : len(q) - finer + k : finer] for k in range(finer + 1)], axis=1)
    assert (off_lines(walk.q, dense) <= bounds[:, None] + 1e-9).all()
    # The tool: as few lines as are near the polynomials, in point and axis.
    near, kinematics = motion_near(UR5, run, kind), Kinematics(UR5)
    assert (near.walk.cell[near.walk.cell >= 0] == run.cell[run.cell >= 0]).all()
    first, row = [], 0
    for sample in run.q:
        while not np.array_equal(near.walk.q[row], sample):
            row += 1
        first.append(row)
        row += 1
    counts = np.diff(first)
    points, turns = [], []
    for k in np.argsort(-counts)[:8].tolist() + list(range(0, len(counts), len(counts) // 6)):
        lines = near.walk.q[first[k] : first[k + 1] + 1]
        part = slice(k * MANY * 4, (k + 1) * MANY * 4 + 1)
        bent = interpolated(run, DEGREES[kind], MANY * 4)[0][part]
        share = np.linspace(0.0, 1.0, len(bent)) * counts[k]
        straight = np.stack([np.interp(share, range(len(lines)), joint) for joint in lines.T], 1)
        (tips, axes), (line, leant) = (kinematics.tools(rows) for rows in (bent, straight))
        points.append(away(tips, line))
        turns.append(np.linalg.norm(axes[:, None] - leant[None], axis=2).min(axis=1).max())
    assert max(points) <= near.point + 1e-9  # chords for the tool's way along a line
    assert max(turns) <= near.turn + 1e-4 * max(turns) + 1e-9
    if name != "far apart":
        assert max(near.point, near.turn) <= 2e-6
    if name == "one joint":  # of one joint alone all of the bound can be used
        assert max(points) > 0.2 * near.point


def away(points, line):
    """The largest distance of points (k, 3) from the nearest piece of a polygon (m, 3)."""
    begin, way = line[:-1], np.diff(line, axis=0)
    length = np.maximum((way**2).sum(axis=1), 1e-300)
    share = np.clip(((points[:, None] - begin) * way).sum(axis=2) / length, 0.0, 1.0)
    return np.linalg.norm(begin + share[..., None] * way - points[:, None], axis=2).min(1).max()


# -- limits of joints, and of speeds along a curve -------------------------------------------------


@pytest.mark.parametrize("ends", ["both", "lower", "upper"])
def test_a_motion_drawn_in_keeps_its_shape_and_its_limits(ends):
    """Random samples with steep ends, whose cubics pass the limits of all joints."""
    rng, k, robot = np.random.default_rng(3), 9, load_robot("panda")
    q = rng.uniform(robot.lower, robot.upper, (k, robot.n))
    limits = np.column_stack([q.min(axis=0), q.max(axis=0)])
    if ends != "both":
        limits[:, int(ends == "lower")] = np.inf if ends == "lower" else -np.inf
    bounded = robot.with_limits(limits)
    run = Trajectory(
        robot.joint_names, np.arange(k) * 0.02, q, rng.normal(size=q.shape),
        rng.normal(size=q.shape), np.zeros(k), np.full(k, -1),
    )  # fmt: skip
    held = held_inside(bounded, run)
    for made, inside in ((run, False), (held, True)):
        dense = np.vstack([interpolated(made, degree, 50)[0] for degree in (3, 5)])
        past = np.maximum(bounded.lower - dense.min(axis=0), dense.max(axis=0) - bounded.upper)
        bound = past_limits(bounded, made)
        assert (past <= bound + 1e-12).all()
        assert (bound.max() <= 0.0) == inside
        assert (past[past > 1e-3] >= 0.9 * bound[past > 1e-3]).all()
    assert np.abs(held.q - run.q).max() <= 2.0 * past_limits(bounded, run).max() + 1e-11
    scale = held.dq / run.dq
    assert scale == pytest.approx(np.broadcast_to(scale[0], scale.shape))
    assert held_inside(UR5, run_named("smooth")) is run_named("smooth")


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("name", ["puma560", "ur5", "panda"])
def test_bounds_on_the_speed_hold_on_whole_pieces(name, seed):
    robot, rng = load_robot(name), np.random.default_rng(seed)
    low, high = np.maximum(robot.lower, -2.0), np.minimum(robot.upper, 2.0)
    curve = control_points(
        Walk(rng.uniform(low, high, (5, robot.n)), np.arange(5)), np.full(5, 0.5)
    )
    spline, kinematics = curve.spline(), Kinematics(robot)
    for speed in (0.2, 50.0):  # the tool's speed is the limit, or the joints' are
        limits = motion_limits(robot, speed)
        # On the grid that is used, and on coarser ones, between whose places more happens.
        for grid in (fine_grid(robot, spline, curve.pieces), np.arange(curve.pieces + 1.0)):
            x = squared_speeds(robot, spline, grid, limits)
            k = np.sort(rng.uniform(0, curve.pieces, 1500))
            rate = np.sqrt(np.interp(k, grid, x))[:, None]
            slope = spline.derivative(1)(k) * rate
            tool = np.linalg.norm(kinematics.tool_velocities(spline(k), slope), axis=1)
            assert (np.abs(slope) <= limits.velocity * (1.0 + 1e-9)).all()
            assert tool.max() <= speed * (1.0 + 1e-9)
        assert set(range(curve.pieces + 1)) <= set(fine_grid(robot, spline, curve.pieces).tolist())
    x = squared_speeds(robot, spline, fine := fine_grid(robot, spline, curve.pieces), limits)
    k = np.linspace(0, curve.pieces, 4000)
    share = np.abs(spline.derivative(1)(k)) * np.sqrt(np.interp(k, fine, x))[:, None]
    assert (share / limits.velocity).max() > 0.9  # tight: somewhere nearly all of it is used
    assert set(KINDS) == set(DEGREES)
