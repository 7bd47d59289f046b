"""Timed motions: limits everywhere, not only at samples; the same path; replayed from outside."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from dense_replay import assert_motion, assert_over, dense
from mesh_patches import bent
from path_cases import (
    PATCHES,
    SPEED,
    assert_keeps_to_limits,
    interpolated,
    path_of,
    run_of,
    verdict_of,
)
from random_arms import question
from small_cases import small_verdict

from feasibility import Task, check
from feasibility.certification import replay
from feasibility.paths import PathError, coverage_path
from feasibility.timing import Trajectory, motion_limits, trajectory, used
from feasibility.timing.sampled_trajectory import (
    KINDS,
    closely,
    coefficients,
    derivative,
    past_limits,
    values,
)
from feasibility.timing.smoothing import Curve, blended, control_points, graded, without_slivers
from feasibility.timing.speed_limits import fine_grid, squared_speeds, tool_slopes
from feasibility.timing.timed_curve import samples, speed_bounds, timed_curve
from feasibility.verdict import Walk
from robots import Kinematics, load_robot
from surfaces import mesh

NAMES = ("5c, coarse", *PATCHES)
ROUNDING = 1.0 + 1e-9


def random_walk(rng, n=3, waypoints=8):
    """Waypoints at random, the first and last over a cell."""
    cell = np.full(waypoints, -1)
    cell[[0, 3, -1]] = [0, 1, 2]
    return Walk(q=rng.normal(size=(waypoints, n)), cell=cell)


def acceleration_excess(spline, grid, x, most):
    """(m - 1,) largest share of its limit that a joint's acceleration has on each piece."""
    h = np.diff(grid)
    u = 0.5 * np.diff(x) / h
    slope, bend = spline.derivative(1), spline.derivative(2)
    values = [
        slope(grid[:-1] + part * h) * u[:, None]
        + bend(grid[:-1] + part * h) * (x[:-1] + part * np.diff(x))[:, None]
        for part in (0.0, 0.5, 1.0)
    ]
    # The last place of a piece is evaluated on the piece: second derivatives are continuous.
    inner = 2.0 * values[1] - 0.5 * (values[0] + values[2])
    shares = [(np.abs(value) / most).max(axis=1) for value in (values[0], inner, values[2])]
    return np.asarray(np.max(shares, axis=0))


# -- the trajectory as a whole ------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
def test_a_trajectory_is_a_motion_that_the_replay_accepts(name):
    verdict, run = verdict_of(name), run_of(name)
    every = np.ones(len(verdict.cells), dtype=bool)
    replayed = replay(verdict.robot, verdict.cells, verdict.task, run.walk, every)
    assert replayed.accepted, replayed.refusal
    marks = run.cell >= 0
    assert_over(verdict, run.cell[marks], run.q[marks])
    assert np.array_equal(run.cell[marks], path_of(name).visits)


@pytest.mark.parametrize("name", NAMES)
def test_a_controller_that_interpolates_the_samples_keeps_to_all_limits(name):
    verdict, run = verdict_of(name), run_of(name)
    assert_keeps_to_limits(verdict, run, motion_limits(verdict.robot, SPEED))
    # What is left free for that costs little time.
    path = path_of(name)
    curve = blended(path.robot, path.cells, path.task, path.walk)
    fastest = timed_curve(speed_bounds(path.robot, curve, motion_limits(path.robot, SPEED)))
    assert run.duration <= 1.1 * fastest.duration


@pytest.mark.parametrize("degree", [3, 5])
@pytest.mark.parametrize("name", NAMES)
def test_a_controller_that_interpolates_the_samples_stays_on_the_surface(name, degree):
    verdict, run = verdict_of(name), run_of(name)
    walk = interpolated(run, degree, per_interval=3)[0]
    assert (walk >= verdict.robot.lower).all()
    assert (walk <= verdict.robot.upper).all()
    assert_motion(verdict, walk)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(5))
def test_what_is_between_samples(seed, kind):
    """Polynomials, their derivatives and bounds, against coefficients that were solved for."""
    rng, m = np.random.default_rng(seed), 6
    time = np.cumsum(rng.uniform(0.01, 0.1, m))
    run = Trajectory(
        joint_names=("a", "b"), time=time, q=rng.normal(size=(m, 2)),
        dq=rng.normal(size=(m, 2)), ddq=rng.normal(size=(m, 2)), tool_speed=np.zeros(m),
        cell=np.full(m, -1),
    )  # fmt: skip
    points = coefficients(run, kind)
    for solved in interpolated(run, {"quintic": 5, "cubic": 3}[kind], per_interval=50):
        found = values(points, 50)
        size = np.abs(solved).max()
        assert found == pytest.approx(solved[:-1], rel=1e-9, abs=1e-9 * size)
        bound = closely(points)
        assert bound.max() >= found.max() - 1e-9 * size
        assert bound.min() <= found.min() + 1e-9 * size
        assert np.abs(bound).max() <= 1.03 * size
        points = derivative(run, points)


def test_what_is_used_is_what_it_comes_to():
    robot, run = verdict_of("ur5").robot, run_of("ur5")
    limits = motion_limits(robot, SPEED)
    here = used(robot, run, limits)
    assert 0.9 < here.too_fast <= 1.0
    shares = []
    for degree in (3, 5):
        _, dq, ddq = interpolated(run, degree, per_interval=200)
        shares.append([np.abs(dq).max(axis=0), np.abs(ddq[:-1]).max(axis=0)])
    most = np.max(shares, axis=0)
    assert here.velocity * limits.velocity == pytest.approx(most[0], rel=0.02)
    assert here.acceleration * limits.acceleration == pytest.approx(most[1], rel=0.02)
    assert (here.velocity * limits.velocity >= most[0] * (1 - 1e-9)).all()
    assert (here.acceleration * limits.acceleration >= most[1] * (1 - 1e-9)).all()
    weaker = replace(limits, acceleration=limits.acceleration / 9.0)
    assert used(robot, run, weaker).too_fast == pytest.approx(3.0 * here.acceleration.max() ** 0.5)
    jump = replace(run, q=np.where(run.cell[:, None] == 5, run.q + 10.0, run.q))
    assert (past_limits(robot, run) < 0.0).all()
    assert past_limits(robot, jump).max() > 1.0


def test_a_slower_motion_is_the_same():
    path, robot = path_of("ur5"), verdict_of("ur5").robot
    curve = blended(path.robot, path.cells, path.task, path.walk)
    timed = timed_curve(speed_bounds(robot, curve, motion_limits(robot, SPEED)))
    slower = timed.slowed(1.7)
    time = np.linspace(0.0, timed.duration, 500)[:-1]
    for order, (fast, slow) in enumerate(zip(timed.at(time), slower.at(1.7 * time), strict=True)):
        size = np.abs(fast).max()
        away = np.abs(fast / 1.7**order - slow) > 1e-6 * size
        assert away.mean() <= (0.01 if order == 2 else 0.0)  # accelerations jump


def test_times_are_whole_nanoseconds():
    time = run_of("ur5").time * 1e9
    assert np.abs(time - np.rint(time)).max() < 1e-5


@pytest.mark.parametrize("name", NAMES)
def test_samples_keep_to_all_limits(name):
    robot, run = verdict_of(name).robot, run_of(name)
    limits = motion_limits(robot, SPEED)
    assert (np.abs(run.dq) <= limits.velocity * ROUNDING).all()
    assert (np.abs(run.ddq) <= limits.acceleration * ROUNDING).all()
    assert run.tool_speed.max() <= SPEED * ROUNDING
    kinematics = Kinematics(robot)
    speed = [
        np.linalg.norm(kinematics.jacobians(q)[0] @ dq) for q, dq in zip(run.q, run.dq, strict=True)
    ]
    assert run.tool_speed == pytest.approx(speed, rel=1e-9, abs=1e-12)
    assert not run.dq[[0, -1]].any()
    assert run.time[0] == 0.0
    # No faster than the tool's way at full speed, and not much slower: the arm stops nowhere.
    q = path_of(name).walk.q
    points, _ = kinematics.tools(dense(q, 8))
    way = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    assert run.tool_way == pytest.approx(way, rel=0.02)
    assert 0.98 * way <= run.duration * SPEED <= 1.6 * way + SPEED


@pytest.mark.parametrize("name", NAMES)
def test_velocities_and_accelerations_are_the_derivatives_of_positions(name):
    run = run_of(name)
    h = np.diff(run.time)[:, None]
    # Between samples the acceleration may jump; its bound is what the differences must keep to.
    most = motion_limits(verdict_of(name).robot, SPEED).acceleration
    assert (np.abs(np.diff(run.q, axis=0) - h * run.dq[:-1]) <= 0.5 * h**2 * most + 1e-12).all()
    assert (np.abs(np.diff(run.dq, axis=0)) <= h * most + 1e-9).all()


@pytest.mark.parametrize("name", ["5c, coarse", *PATCHES])
def test_limits_hold_between_samples_too(name):
    robot, path = verdict_of(name).robot, path_of(name)
    limits = motion_limits(robot, SPEED)
    curve = blended(robot, path.cells, path.task, path.walk)
    timed = timed_curve(speed_bounds(robot, curve, limits))
    time = np.sort(np.random.default_rng(1).uniform(0.0, timed.duration, 20_000))
    q, dq, ddq = timed.at(time)
    assert (np.abs(dq) <= limits.velocity * ROUNDING).all()
    assert (np.abs(ddq) <= limits.acceleration * ROUNDING).all()
    assert tool_slopes(robot, q, dq).max() <= SPEED * ROUNDING
    assert (q >= robot.lower - 1e-12).all()
    assert (q <= robot.upper + 1e-12).all()
    # Finite differences of the motion itself.
    step = 1e-6
    inner = time[(time > 0.1) & (time < timed.duration - 0.1)]
    ahead, behind = timed.at(inner + step)[0], timed.at(inner - step)[0]
    slope = timed.at(inner)[1]
    assert (ahead - behind) / (2 * step) == pytest.approx(slope, abs=1e-4)
    over = acceleration_excess(curve.spline(), timed.grid, timed.x, limits.acceleration)
    assert over.max() <= ROUNDING


def test_a_slower_tool_takes_longer_and_weaker_joints_do_too():
    path = path_of("ur5")
    fast = trajectory(path, 0.2)
    slow = trajectory(path, 0.05)
    assert slow.duration > 3 * fast.duration
    assert slow.tool_speed.max() <= 0.05 * ROUNDING
    weak = trajectory(path, 0.2, velocity=0.05, acceleration=[0.1] * 6)
    assert weak.duration > fast.duration
    assert np.abs(weak.dq).max() <= 0.05 * ROUNDING
    assert np.abs(weak.ddq).max() <= 0.1 * ROUNDING
    assert np.abs(weak.dq).max() > 0.04
    assert_keeps_to_limits(verdict_of("ur5"), weak, motion_limits(path.robot, 0.2, 0.05, 0.1))
    assert np.array_equal(weak.cell[weak.cell >= 0], fast.cell[fast.cell >= 0])


def test_a_longer_period_has_fewer_samples_of_the_same_motion():
    path = path_of("ur5")
    fine, coarse = trajectory(path, period=0.01), trajectory(path, period=0.04)
    assert len(coarse) < 0.5 * len(fine)
    assert coarse.duration == pytest.approx(fine.duration, rel=0.1)
    assert np.diff(fine.time).min() > 0.001


def test_a_single_cell_stands_still():
    path = coverage_path(small_verdict("plate"), only=[5])
    run = trajectory(path)
    assert (len(run), run.duration, run.cell.tolist()) == (1, 0.0, [5])
    assert replay(path.robot, path.cells, path.task, run.walk, path.needed).accepted


@pytest.mark.parametrize("name", ["ur5 on a rail", "puma, tube"])
def test_other_arms_and_surfaces(name):
    robot, cells, task = question(name)
    path = coverage_path(check(robot, cells, task), "columns")
    run = trajectory(path, 0.2, velocity=1.0, acceleration=3.0)
    assert_keeps_to_limits(path, run, motion_limits(robot, 0.2, 1.0, 3.0))
    replayed = replay(robot, cells, task, run.walk, path.needed)
    assert replayed.accepted, replayed.refusal
    assert np.abs(run.dq).max() <= ROUNDING
    assert np.abs(run.ddq).max() <= 3.0 * ROUNDING
    assert run.tool_speed.max() <= 0.2 * ROUNDING
    if robot.prismatic.any():
        margins = np.minimum(path.walk.q - robot.lower, robot.upper - path.walk.q)
        assert path.figures.slide_margin == margins[:, robot.prismatic].min()
        assert path.figures.turn_margin == margins[:, ~robot.prismatic].min()


def test_a_mesh():
    hill = bent(
        lambda u, v: (0.35 + 0.2 * u, -0.1 + 0.2 * v, 0.25 + 0.04 * np.sin(np.pi * u)), 16, 16
    )
    cells = mesh(hill, side="outside").cells(12)
    task = Task(standoff=0.02, cone_deg=30)
    path = coverage_path(check(load_robot("ur5"), cells, task), "shortest")
    run = trajectory(path, SPEED)
    every = np.ones(len(cells), dtype=bool)
    replayed = replay(path.robot, cells, task, run.walk, every)
    assert replayed.accepted, replayed.refusal
    assert path.figures.revisited_share <= 0.15
    assert_keeps_to_limits(path, run, motion_limits(path.robot, SPEED))
    for degree in (3, 5):
        q = interpolated(run, degree, per_interval=3)[0]
        marks = np.full(len(q), -1)
        marks[::3] = run.cell
        held = np.clip(q, path.robot.lower, path.robot.upper)
        between = replay(path.robot, cells, task, Walk(q=held, cell=marks), every)
        assert between.accepted, between.refusal
    assert run.tool_speed.max() <= SPEED * ROUNDING


# -- the smooth curve ---------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(10))
def test_the_curve_is_smooth_and_inside_the_box_of_its_waypoints(seed):
    rng = np.random.default_rng(seed)
    walk = random_walk(rng)
    curve = control_points(walk, rng.uniform(0.01, 0.5, len(walk.q)))
    spline = curve.spline()
    k = np.linspace(0, curve.pieces, 5001)
    q = spline(k)
    assert np.array_equal(curve.cell, [0, 1, 2])
    assert q[[0, -1]] == pytest.approx(walk.q[[0, -1]], abs=1e-12)
    assert (q >= walk.q.min(axis=0) - 1e-12).all()
    assert (q <= walk.q.max(axis=0) + 1e-12).all()
    # Twice continuously differentiable: across knots too.
    knots = np.arange(1.0, curve.pieces)
    for order in (0, 1, 2):
        part = spline.derivative(order)
        assert part(knots - 1e-9) == pytest.approx(part(knots + 1e-9), abs=1e-6)


@pytest.mark.parametrize("share", [0.5, 0.1, 0.01, 0.001])
def test_the_sharper_the_turns_the_nearer_the_curve_is_to_the_lines(share):
    walk = random_walk(np.random.default_rng(4))
    curve = control_points(walk, np.full(len(walk.q), share))
    q = curve.spline()(np.linspace(0, curve.pieces, 20_001))
    away = np.min(
        [distance_from_line(q, a, b) for a, b in zip(walk.q[:-1], walk.q[1:], strict=True)], axis=0
    )
    line = np.linalg.norm(np.diff(walk.q, axis=0), axis=1)
    # (W- - 2 W + W+) / 6, each neighbour at most share * line away.
    assert away.max() <= share * line.max() / 3 + 1e-12
    at = curve.spline()(curve.marks.astype(float))
    centres = walk.q[walk.cell >= 0]
    assert np.linalg.norm(at - centres, axis=1).max() <= share * line.max() / 3 + 1e-12


def distance_from_line(points, a, b):
    """Distances of points (k, n) from the straight line between a and b."""
    t = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
    return np.linalg.norm(points - a - t[:, None] * (b - a), axis=1)


@pytest.mark.parametrize("first", [0.5, 0.3, 0.01, 2.0**-12])
@pytest.mark.parametrize("last", [0.5, 0.25, 0.003, 2.0**-12])
def test_pieces_grow_gently_from_both_ends(first, last):
    places = graded(first, last)
    gaps = np.diff([0.0, *places, 1.0])
    assert (gaps > 0.0).all()
    assert gaps[0] == pytest.approx(first)
    assert gaps[-1] == pytest.approx(last)
    assert (gaps[1:] / gaps[:-1]).max() <= 4.0
    assert (gaps[:-1] / gaps[1:]).max() <= 4.0


def test_slivers_are_left_out_and_marks_stay():
    q = np.array([[0.0], [1e-4], [0.5], [1.0], [1.0001], [1.0002], [2.0], [2.0]])
    cell = np.array([0, -1, -1, -1, -1, 1, 2, 2])
    thin = without_slivers(Walk(q=q, cell=cell), 1e-3)
    assert thin.q[:, 0].tolist() == [0.0, 0.5, 1.0002, 2.0]
    assert thin.cell.tolist() == [0, -1, 1, 2]
    same = np.array([0, -1, -1, -1, -1, 1, 2, 3])
    assert without_slivers(Walk(q=q, cell=same), 1e-3).cell.tolist() == [0, -1, 1, 2, 3]


def test_a_motion_that_turns_back_is_run_without_a_stop_in_between():
    robot = load_robot("ur5")
    q = np.array([[0.0] * 6, [0.4] * 6, [0.0] * 6, [0.4, 0, 0, 0, 0, 0]]) - [0, 1, 0, 0, 0, 0]
    curve = control_points(Walk(q=q, cell=np.arange(4)), np.full(4, 0.25))
    limits = motion_limits(robot, 0.3)
    timed = timed_curve(speed_bounds(robot, curve, limits))
    run = samples(robot, timed, 0.01)
    assert (np.abs(run.ddq) <= limits.acceleration * ROUNDING).all()
    assert (timed.x[1:-1] > 0.0).all()
    assert run.cell[run.cell >= 0].tolist() == [0, 1, 2, 3]


# -- bounds -------------------------------------------------------------------------------------


def test_steps_of_very_different_size_are_timed():
    """From a micrometre to a stride, with turns of every sharpness; toppra alone gives it up."""
    rng = np.random.default_rng(5)
    steps = 10.0 ** rng.uniform(-7, -1, (80, 1)) * rng.normal(size=(80, 6))
    q = 0.3 * np.vstack([np.zeros(6), np.cumsum(steps, axis=0)])
    cell = np.full(len(q), -1)
    cell[[0, -1]] = [0, 1]
    curve = control_points(Walk(q, cell), 2.0 ** -rng.integers(1, 13, len(q)).astype(float))
    robot = load_robot("ur5")
    limits = motion_limits(robot, SPEED)
    timed = timed_curve(speed_bounds(robot, curve, limits))
    over = acceleration_excess(curve.spline(), timed.grid, timed.x, limits.acceleration)
    assert over.max() <= 1.0 + 1e-9
    assert (timed.x <= squared_speeds(robot, curve.spline(), timed.grid, limits) + 1e-12).all()
    assert np.isfinite(timed.time).all()


@pytest.mark.parametrize("name", ["puma560", "ur5", "panda"])
def test_bounds_on_the_speed_hold_on_whole_pieces(name):
    robot, rng = load_robot(name), np.random.default_rng(2)
    low, high = np.maximum(robot.lower, -2.0), np.minimum(robot.upper, 2.0)
    walk = Walk(q=rng.uniform(low, high, (6, robot.n)), cell=np.arange(6))
    curve = control_points(walk, np.full(6, 0.5))
    spline, limits = curve.spline(), motion_limits(robot, 0.2)
    grid = fine_grid(robot, spline, curve.pieces)
    assert set(range(curve.pieces + 1)) <= set(grid.tolist())
    x = squared_speeds(robot, spline, grid, limits)
    k = np.sort(rng.uniform(0, curve.pieces, 20_000))
    rate = np.sqrt(np.interp(k, grid, x))
    slope = spline.derivative(1)(k)
    tool = tool_slopes(robot, spline(k), slope) * rate
    assert (np.abs(slope) * rate[:, None] <= limits.velocity * ROUNDING).all()
    assert tool.max() <= 0.2 * ROUNDING
    # Tight: somewhere nearly all of it is used.
    assert max(tool.max() / 0.2, (np.abs(slope) * rate[:, None] / limits.velocity).max()) > 0.9


# -- what cannot be asked -----------------------------------------------------------------------


def test_an_arm_without_velocities_needs_some():
    robot = replace(load_robot("puma560"), max_velocity=np.nan)
    with pytest.raises(PathError, match=r"no velocity limit for joint1, .*give velocity"):
        motion_limits(robot, 0.1)
    assert motion_limits(robot, 0.1, velocity=2.0).acceleration.tolist() == [4.0] * 6
    some = replace(robot, max_velocity=[1.0, np.nan, 1.0, np.inf, 1.0, 1.0])
    with pytest.raises(PathError, match="no velocity limit for joint2, joint4; give"):
        motion_limits(some, 0.1)


@pytest.mark.parametrize("speed", [0.0, -0.1, np.nan, np.inf, "fast", None, True])
def test_a_speed_that_is_none(speed):
    with pytest.raises(PathError, match="tool speed must be a positive number"):
        trajectory(path_of("ur5"), speed)


@pytest.mark.parametrize(
    "value", [0.0, -1.0, np.nan, np.inf, [1.0, 2.0], "1 rad/s", [1.0] * 5 + [0.0]]
)
@pytest.mark.parametrize("what", ["velocity", "acceleration"])
def test_limits_that_are_none(what, value):
    with pytest.raises(
        PathError, match=f"{what} must be one positive number .*or 6 for the joints"
    ):
        trajectory(path_of("ur5"), **{what: value})


def test_all_faults_at_once():
    with pytest.raises(PathError, match=r"(?s)tool speed.*velocity must be.*acceleration must be"):
        motion_limits(load_robot("ur5"), -1, velocity=-1, acceleration=-1)


@pytest.mark.parametrize("period", [0.0, -1.0, np.nan, 1e-9, 1e9, "often"])
def test_a_period_that_is_none(period):
    with pytest.raises(PathError, match="the period must be"):
        trajectory(path_of("ur5"), period=period)


def test_a_curve_that_the_replay_refuses_is_not_given():
    verdict = small_verdict("plate")
    walk = verdict.witness
    far = Walk(q=walk.q + 0.1, cell=walk.cell)
    with pytest.raises(PathError, match="no smooth motion was found that the replay accepts"):
        blended(verdict.robot, verdict.cells, verdict.task, far)


def test_a_trajectory_checks_its_arrays():
    good = {
        "joint_names": ("a", "b"), "time": [0.0, 1.0], "q": np.zeros((2, 2)),
        "dq": np.zeros((2, 2)), "ddq": np.zeros((2, 2)), "tool_speed": [0.0, 0.0], "cell": [0, -1],
    }  # fmt: skip
    run = Trajectory(**good)
    assert not run.q.flags.writeable
    bad = {
        "joint_names": ("a", "a"), "time": [0.0, 0.0], "q": np.zeros((2, 3)),
        "dq": np.full((2, 2), np.nan), "tool_speed": [0.0], "cell": [0, -2],
    }  # fmt: skip
    for name, value in bad.items():
        with pytest.raises(ValueError, match=r"\w"):
            Trajectory(**good | {name: value})
    with pytest.raises(
        ValueError, match=r"(?s)name twice.*q must have.*dq must hold.*times must.*cells"
    ):
        Trajectory(**good | bad)


def test_a_curve_knows_its_pieces():
    curve = Curve(np.zeros((5, 2)), np.array([0, 4]), np.array([1, 2]))
    assert curve.pieces == 4
    assert curve.spline()(np.array([0.0, 4.0])).tolist() == [[0.0, 0.0], [0.0, 0.0]]
