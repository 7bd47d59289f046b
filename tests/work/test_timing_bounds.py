"""Bounds on what is between samples of a timed motion, against Pinocchio at many places there."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from timed_motions import UR5, interpolated, motion

from feasibility.timing import Trajectory, motion_limits, used
from feasibility.timing.between_samples import deviations, deviations_between, motion_near
from feasibility.timing.sampled_trajectory import KINDS, held_inside, motion_between, past_limits
from feasibility.timing.smoothing import Curve, control_points
from feasibility.timing.speed_limits import fine_grid, squared_speeds
from feasibility.timing.tool_between_samples import fastest_tool
from feasibility.verdict import Walk
from robots import Kinematics, load_robot

DEGREES = {"quintic": 5, "cubic": 3}
MANY = 16  # places between two samples


@cache
def run_named(name):
    """A smooth motion; one whose joints swing between samples; few samples, far apart; ..."""
    run, rng = motion(UR5), np.random.default_rng(3)
    if name == "smooth":
        return run
    if name == "jumpy":
        return replace(run, ddq=run.ddq + rng.normal(size=run.q.shape))
    if name.startswith(
        "bulging"
    ):  # the first joint goes on, and three parallel ones bulge to one side
        time, three = 0.02 * np.arange(20.0), np.array([0.0, 1.0, 1.0, 1.0, 0.0, 0.0])
        q = np.array([0.0, -0.8, 0.0, -2.3, -0.5 * np.pi, 0.0]) + np.eye(6)[0] * time[:, None]
        speed = 1e-4 if name == "bulging" else 4e-3
        dq = np.eye(6)[0] + speed * three * (-1.0) ** np.arange(20)[:, None]
        still, nowhere = np.zeros(20), np.full(20, -1)
        return Trajectory(UR5.joint_names, time, q, dq, 0.0 * q, still, nowhere)
    time = np.cumsum(rng.uniform(0.05, 0.15, 12))
    given = {"q": np.cumsum(rng.normal(0, 0.04, (12, 6)), 0), "dq": rng.normal(0, 0.3, (12, 6))}
    return Trajectory(
        UR5.joint_names, time, **given, ddq=rng.normal(0, 2.0, (12, 6)),
        tool_speed=np.zeros(12), cell=np.full(12, -1),
    )  # fmt: skip


RUNS = ("smooth", "jumpy", "bulging", "bulging more", "far apart")


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
    assert dense * (1.0 - 1e-9) <= looked_at <= (1.5 if name == "far apart" else 1.05) * dense
    # What is not looked at is slower than what is enough: at every enough.
    for enough in np.linspace(0.5, 1.1, 25) * dense:
        assert dense <= max(fastest_tool(UR5, run, enough), enough) * (1.0 + 1e-9)
    limits = motion_limits(UR5, 1.0)
    assert used(UR5, run, limits).tool_speed >= min(dense, 1.0) * (1.0 - 1e-9)


def two_samples(q, last, dq, end):
    """From one to the other in a second, rad and rad/s; the quintic between them is the cubic."""
    way, nowhere = last - q, np.full(2, -1)
    ddq = np.array([6.0 * way - 4.0 * dq - 2.0 * end, 2.0 * dq + 4.0 * end - 6.0 * way])
    return Trajectory(
        UR5.joint_names, np.array([0.0, 1.0]), np.array([q, last]), np.array([dq, end]), ddq,
        np.zeros(2), nowhere,
    )  # fmt: skip


@pytest.mark.parametrize("what", ["from rest to rest", "ever faster", "stretching out"])
def test_what_is_fastest_between_samples_is_looked_at(what):
    """One joint that starts and stops, or slows down just before its end; two that run evenly, past
    the place where the arm is stretched out. The remainders of the bound are just large enough.
    """
    one, two = 0.01 * np.eye(6)[1], np.eye(6)[1] + np.eye(6)[2]
    base, still = np.array([0.0, -0.8, 0.4, 0.3, 0.5, 0.0]), np.zeros(6)
    run = {
        "from rest to rest": two_samples(base, base + one, still, still),
        "ever faster": two_samples(base, base + 0.75 * one, still, one),
        "stretching out": two_samples(
            np.array([0.0, -0.5, -0.5, -1.57, 0.5, 0.0]),
            np.array([0.0, 0.5, 0.5, -1.57, 0.5, 0.0]), two, two,
        ),
    }[what]  # fmt: skip
    q, dq, _ = interpolated(run, 3, 400)
    speed = tool_speeds(q, dq)
    at, dense = max(speed[[0, -1]]), speed.max()
    assert dense > 1.005 * at
    for enough in at + np.array([0.05, 0.25, 0.5, 0.75, 0.95]) * (dense - at):
        assert fastest_tool(UR5, run, enough) >= dense * (1.0 - 1e-3)


# -- straight lines in place of polynomials --------------------------------------------------------


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


@pytest.mark.parametrize("kind", DEGREES)
@pytest.mark.parametrize("name", RUNS)
def test_what_a_controller_makes_of_samples_is_near_lines(name, kind):
    run, places, finer = run_named(name), 4, 6
    walk = motion_between(run, kind, places)
    bounds = deviations_between(run, kind, walk.q)
    q, _, _ = interpolated(run, DEGREES[kind], places * finer)
    np.testing.assert_allclose(q[::finer], walk.q, atol=1e-9)
    dense = np.stack([q[k : len(q) - finer + k : finer] for k in range(finer + 1)], axis=1)
    assert beyond(walk.q, dense, bounds).max() <= 1e-9
    # The tool: as few lines as are near the polynomials, in point and axis.
    near, kinematics = motion_near(UR5, run, kind), Kinematics(UR5)
    assert (near.walk.cell[near.walk.cell >= 0] == run.cell[run.cell >= 0]).all()
    first, row = [], 0
    for sample in run.q:
        while not np.array_equal(near.walk.q[row], sample):
            row += 1
        first.append(row)
        row += 1
    bents, points, turns = interpolated(run, DEGREES[kind], MANY)[0], [], []
    for k, (low, high) in enumerate(pairwise(first)):
        bent = bents[k * MANY : (k + 1) * MANY + 1]
        share = np.linspace(low, high, MANY * (high - low) + 1)
        rows = [np.interp(share, range(low, high + 1), q) for q in near.walk.q[low : high + 1].T]
        (tips, axes), (line, leant) = (kinematics.tools(q) for q in (bent, np.stack(rows, 1)))
        points.append(away(tips, line))
        turns.append(away(axes, leant))
    assert max(points) <= near.point
    assert max(turns) <= near.turn
    if name != "far apart":
        assert max(near.point, near.turn) <= 2e-6
    if (
        name.startswith("bulging") and kind == "cubic"
    ):  # all of them together use most of the bounds
        assert max(points) > 0.78 * near.point > 1e-7
        assert max(turns) > 0.8 * near.turn > 1e-7


def test_levers_that_are_longer_between_samples_count_as_they_are_there():
    """The elbow opens and folds again while the first joint bulges: off the plane of all lines."""
    q = np.array([0.0, 0.0, -1.2, 0.0, 0.5 * np.pi, 0.0])
    dq = np.array([4e-6, 0.0, 2.4, 0.0, 0.0, 0.0])
    still, nowhere, flip = np.zeros((2, 6)), np.full(2, -1), np.array([[-1.0], [1.0]])
    run = Trajectory(
        UR5.joint_names, np.array([0.0, 1.0]), q * [[1, 1, 1, 1, 1, 1], [1, 1, -1, 1, 1, 1]],
        np.where(np.arange(6) == 0, -flip * dq, dq), still, np.zeros(2), nowhere,
    )  # fmt: skip
    near = motion_near(UR5, run, "cubic")
    tips = Kinematics(UR5).tools(interpolated(run, 3, 200)[0])[0]
    truth = np.abs(tips[:, 1] - tips[0, 1]).max()
    assert len(near.walk.q) == 2
    assert truth > 1.1 * 1e-6 * np.hypot(*tips[0, :2])  # so much longer than at its ends
    assert truth <= near.point <= 2.0 * truth


def away(points, line):
    """The largest distance of points (k, 3) from a curve, by a polygon (m, 3) in it; at least."""
    begin, way = line[:-1], np.diff(line, axis=0)
    length = np.maximum((way**2).sum(axis=1), 1e-300)
    share = np.clip(((points[:, None] - begin) * way).sum(axis=2) / length, 0.0, 1.0)
    off = np.linalg.norm(begin + share[..., None] * way - points[:, None], axis=2).min(1).max()
    bend = np.linalg.norm(np.diff(line, 2, axis=0), axis=1).max(initial=0.0)
    return max(off - 0.14 * bend - 1e-9, 0.0)


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


@pytest.mark.parametrize("width", [0.01, 0.5])
def test_a_joint_that_is_fastest_in_the_middle_of_a_piece_is_bounded_there(width):
    """Control points 0, 0, 1, 1: it moves at 1/2 at both ends of the piece, and at 3/4 between."""
    steps = width * np.array([0.0, 0.0, 1.0, 1.0])[:, None] * np.eye(6)[1]
    curve = Curve(np.array([0.0, -0.8, 0.4, 0.3, 0.5, 0.0]) + steps, np.array([0, 3]), np.arange(2))
    spline, grid, k = curve.spline(), np.arange(4.0), np.linspace(0.0, 3.0, 301)
    slope = spline.derivative(1)(k)
    assert np.abs(slope).max() == pytest.approx(0.75 * width, rel=1e-3)
    for speed in (0.1, 50.0):
        limits = motion_limits(UR5, speed)
        rate = np.sqrt(np.interp(k, grid, squared_speeds(UR5, spline, grid, limits)))[:, None]
        tool = np.linalg.norm(Kinematics(UR5).tool_velocities(spline(k), slope * rate), axis=1)
        assert tool.max() <= speed * (1.0 + 1e-9)
        assert (np.abs(slope * rate) <= limits.velocity * (1.0 + 1e-9)).all()
