"""The search's bound between samples, against dense sampling by Pinocchio, on random arms."""

from dataclasses import replace

import numpy as np
import pytest
import random_arms
from arm_urdfs import joint
from bounds import holds
from plain import tools
from random_arms import between, deviation, planar_arm, random_arm, random_configuration, robot_of
from referee import unit
from samples import sampled, seeds
from search_kernels import Motions

from coverable import Task, sphere
from feasibility.roadmap.motions import roll_kernels, segment_bound
from feasibility.roll import Roll, projected, roll_of
from surfaces.patches.grid_cells import GridCells

ROUNDING = 1e-12
frame_rates, peak = roll_kernels.frame_rates, segment_bound.peak
KINDS = ["sphere", "cylinder", "hyperboloid", "plane"]


def references(robot, q):
    """The reference axes (k, 3) of configurations (k, n), by Pinocchio."""
    turned = replace(robot, approach_axis=robot.reference_axis, reference_axis=robot.approach_axis)
    return tools(turned, q)[1]


def sag_of(values, s):
    """(k,) how far values (k, 3) along s are off their chord, over s (1 - s) / 2; ends left out."""
    chord = (1.0 - s[:, None]) * values[0] + s[:, None] * values[-1]
    off = np.linalg.norm(values - chord, axis=1)[1:-1]
    return np.maximum(off - ROUNDING, 0.0) / (0.5 * s * (1.0 - s))[1:-1]


def test_second_derivatives_bound_the_sag_of_every_segment():
    """300 segments of 30 arms, steps of 1e-4 to 3 rad in all joints or in a few."""
    rng, bounds, truths = np.random.default_rng(1), [], []
    for _ in range(30):
        robot = random_arm(rng)
        motions = Motions(robot)
        for _ in range(10):
            q0 = random_configuration(robot, rng)
            step = rng.normal(size=robot.n) * 10.0 ** rng.uniform(-4.0, 0.5)
            if rng.random() < 0.5:
                step *= rng.random(robot.n) < 0.4
            s, q = between(q0, q0 + step, 32)
            truths.append([sag_of(values, s).max() for values in tools(robot, q)])
            bounds.append(np.multiply(motions.sag(q0, q0 + step), 1.0 + 1e-9) + 1e-8)
    for bound, truth in zip(np.transpose(bounds), np.transpose(truths), strict=True):
        holds(bound, truth, 0.99)
        some = bound > 1e-6
        assert np.median(truth[some] / bound[some]) > 0.15


def test_levers_hold_where_they_are_longer_in_the_middle_than_at_the_ends():
    """Folded, stretched, folded again: the lever of the first joint peaks halfway."""
    robot, bounds, truths = planar_arm(2, (-3.1, 3.1)), [], []
    motions, s, h = Motions(robot), np.linspace(0.01, 0.99, 99)[:, None], 1e-4
    for bend in np.linspace(0.05, 3.1, 30):
        for turn in (0.01, 0.1, 1.0, 3.0):
            q0, q1 = np.array([0.0, -bend]), np.array([turn, bend])
            before, at, behind = (tools(robot, q0 + t * (q1 - q0))[0] for t in (s - h, s, s + h))
            second = np.linalg.norm(before - 2.0 * at + behind, axis=1) / h**2
            truths.append(second.max())
            bounds.append(motions.sag(q0, q1)[0] * (1.0 + 1e-6) + 1e-6)
    holds(bounds, truths, 0.9)


def test_peak_is_the_largest_value():
    """Against 2,001 points of the parabola, for random ones; exactly at its corner cases."""
    rng, s = np.random.default_rng(2), np.linspace(0.0, 1.0, 2001)
    for _ in range(500):
        (a, b), most = rng.uniform(0.0, 1.0, 2), 10.0 ** rng.uniform(-3.0, 2.0)
        sampled_most = ((1.0 - s) * a + s * b + 0.5 * most * s * (1.0 - s)).max()
        assert sampled_most <= peak(a, b, most) * (1.0 + 1e-12)
        assert peak(a, b, most) <= sampled_most + 0.5 * most * 2.6e-7
    assert (peak(0.3, 0.3, 0.0), peak(0.0, 0.5, 1.0)) == (0.3, 0.5)
    assert peak(0.2, 0.2, 8.0) == pytest.approx(1.2, rel=1e-15)
    assert peak(0.1, 0.2, np.inf) == np.inf
    assert all(np.isnan(peak(*np.where(np.arange(3) == k, np.nan, 0.1))) for k in range(3))


def two_cells(surface, parameters):
    """Two neighbouring cells of a patch with their centres at given parameters (2, 2)."""
    u, v = np.transpose(parameters)
    points, normals = surface.point(u, v), surface.normal(u, v)
    return GridCells(surface, points, normals, np.ones(2), (1, 2), u=u, v=v)


def surface_segment(rng, robot, kind, task, offsets, longest, onto):
    """A segment that starts near a random target surface, its axis at some share of the cone."""
    surface = random_arms.random_surface(rng, kind)
    u, v = (rng.uniform(*span) * 0.9 for span in (surface.u_range, surface.v_range))
    sign, normal = surface.side_sign, surface.normal(u, v)
    target = surface.point(u, v) + sign * task.standoff * normal
    q0 = random_configuration(robot, rng)
    (point,), (axis,) = tools(robot, q0[None])
    share = rng.random() if onto is not None else rng.uniform(0.5, 1.0)
    approach = random_arms.tilted(axis, share * min(task.cone, 3.1), rng)
    offset = unit(rng.normal(size=3)) * rng.choice(offsets) * task.tolerance
    turn = random_arms.turn_onto(-sign * normal, approach, rng)
    surface = surface.moved(turn, point + offset - turn @ target)
    q1 = q0 + rng.normal(size=robot.n) * 10.0 ** rng.uniform(-3.0, longest)
    (away,), _ = tools(robot, q1[None])
    closest = surface.closest(np.array([surface.point(u, v), away]))
    cells = two_cells(surface, np.column_stack([closest.u, closest.v]))
    motions = Motions(robot, cells, task)
    if task.roll is not None:
        middle = motions.roll_off(q0) + rng.uniform(-1.0, 1.0) * task.roll.half
        motions.turn_range(middle, task.roll.half)
    if onto:
        q1 = motions.onto(q1)
    return None if q1 is None else (motions, cells, q0, q1)


def beside_the_curve(robot, cells, task, q):
    """Distance from the moving target and |a - b|, at even places of the curve; and its normals."""
    points, axes = tools(robot, q)
    s = np.linspace(0.0, 1.0, len(q))
    on_curve, normal = cells.curves.at(np.zeros(len(q), dtype=np.int64), s)
    sign = cells.surface.side_sign
    off = np.linalg.norm(points - on_curve - sign * task.standoff * normal, axis=1)
    return off, np.linalg.norm(axes + sign * normal, axis=1), normal


@sampled("seed", seeds(1, all=10))
@pytest.mark.parametrize("rolled", [False, True], ids=["free", "rolled"])
@pytest.mark.parametrize("kind", KINDS)
def test_a_segment_that_is_accepted_holds_everywhere(kind, rolled, seed):
    """120 segments or more at either side of random surfaces in any pose, 30 samples on each.

    Ranges of roll of 0.5 to 300 deg. Goes on until 20 hold and one needs half of what it may.
    """
    rng, passed, worst = np.random.default_rng([KINDS.index(kind), rolled, seed]), 0, 0.0
    for number in range(1200):
        if number >= 120 and passed > 20 and (rolled or worst > 0.5):
            return
        if number % 20 == 0:
            robot = random_arm(rng)
        cone_deg = float(rng.choice([2, 20, 60, 90] if rolled else [2, 20, 60, 120, 179, 180]))
        task = Task(float(rng.choice([0.0, 0.05])), cone_deg, 10.0 ** rng.uniform(-4.0, -2.0))
        if rolled:
            half, along = float(rng.choice([0.25, 2.0, 15.0, 150.0])), rng.normal(size=3)
            task = replace(task, roll_deg=(-half, half), roll_reference=tuple(along.tolist()))
        onto = bool(rolled or rng.random() < 0.8)
        made = surface_segment(rng, robot, kind, task, (0.0, 0.02, 0.7)[: 3 - rolled], -0.3, onto)
        held = None if made is None else made[0].along_curve(*made[2:])
        if held is None or not held.holds:
            continue
        passed += 1
        motions, cells, q0, q1 = made
        q = between(q0, q1, 30)[1]
        points, axes = tools(robot, q)
        off, chord, normals = beside_the_curve(robot, cells, task, q)
        assert off.max() <= min(held.off + ROUNDING, task.tolerance)
        if cone_deg < 180.0:
            assert chord.max() <= held.chord + ROUNDING
            if held.on_target:
                own = deviation(cells.surface, points, axes)
                assert 2.0 * np.arcsin(np.minimum(0.5 * own, 1.0)).max() <= task.cone + 1e-9
        if rolled:
            most = Roll(*motions.arrays.roll.tolist())
            off_middle = roll_off_middles(cells, task, most, axes, references(robot, q))
            assert off_middle(normals) <= min(held.roll + held.roll_off, most.half)
            if held.on_target:
                assert off_middle(cells.surface.closest(points).normal) <= most.half
        ends = max(off[0], off[-1])
        if held.off - ends > 1e-7:
            worst = max(worst, (off.max() - ends) / (held.off - ends))
    pytest.fail(f"{passed} hold, and need {worst:.2f} of what they may")


def roll_off_middles(cells, task, most, axes, x):
    """rad, the largest roll off the middle of its range over given normals (k, 3)."""

    def off_middle(normals):
        b = -cells.surface.side_sign * normals
        t, sine = projected(np.broadcast_to(task.fixed_reference(cells), b.shape), b)
        return np.where(sine > 0.02, np.abs(most.off(roll_of(x, axes, t, b))), 0.0).max()

    return off_middle


def test_the_cone_holds_at_the_tool_point_s_own_place_on_the_surface():
    """The tool goes round a small circle across a ball's normal, beside the curve between its ends.

    Its axis stays; halfway it is 20 mm further out than the curve, where the normal leans more.
    """
    robot = robot_of([joint(1, xyz=(0, 0.22, 0)), joint(2, "fixed", (0, 0.1, 0))], (0, 0, -1))
    turn = np.arcsin(0.6)
    ends = tools(robot, np.array([[turn], [-turn]]))[0]
    ball = sphere(1.0, (0, 90), (-180, 180), side="outside")
    down = np.sqrt(1.0 - ends[0, 0] ** 2 - ends[0, 1] ** 2)
    ball = ball.moved(np.eye(3), (0.0, 0.0, -down))
    at = ball.closest(ends)
    motions = Motions(robot, two_cells(ball, np.column_stack([at.u, at.v])), Task(0.0, 30.0, 0.2))
    held = motions.along_curve(np.array([turn]), np.array([-turn]))
    assert held.on_target
    own = deviation(ball, *tools(robot, np.linspace(turn, -turn, 41)[:, None]))
    assert own.max() <= held.chord
    assert own.max() - own[0] > 0.35 * (held.chord - own[0])


def test_nothing_that_is_not_a_number_passes():
    """NaN or infinity in a joint, or a surface that folds, never certifies a segment."""
    q, up = np.array([0.1, 0.2, 0.3]), np.array([0.0, 0.0, 1.0])
    motions = Motions(planar_arm(3), None, Task(0.0, 100, 1.0))
    there = motions.at_rest(q, q, np.zeros(3), up)
    assert there.holds
    assert there.chord == pytest.approx(np.sqrt(2.0))
    for bad in (np.nan, np.inf):
        assert not motions.at_rest(q, np.array([0.1, bad, 0.3]), np.zeros(3), up).holds
    assert motions.at_rest(q, q + 1e-3, np.zeros(3), up).holds
    motions.arrays = motions.arrays._replace(curvature=np.inf)
    assert not motions.at_rest(q, q + 1e-3, np.zeros(3), up).holds


@pytest.mark.parametrize("turn", [0.1, 2.0, 2.0 * np.pi, 4.0 * np.pi])
def test_a_tool_that_turns_all_around_does_not_keep_its_roll(turn):
    """About its own axis: after whole turns the roll is what it was, and was everything between."""
    robot = robot_of([joint(1, limits=(-20.0, 20.0)), joint(2, "fixed")])
    task = Task(0.0, 30, roll_deg=(-10, 10), roll_reference=(1, 0, 0))
    held = Motions(robot, None, task).at_rest(np.zeros(1), np.array([turn]), np.zeros(3), (0, 0, 1))
    assert held.holds == (turn < 0.17)


@pytest.mark.parametrize("size", [1e-3, 0.01, 0.05])
def test_two_joints_across_the_tool_axis_turn_the_roll_as_fast_as_is_said(size):
    """Joints about x and y under a tool axis along z: the second derivative of roll is d1 d2."""
    robot = robot_of([joint(1, axis=(1, 0, 0)), joint(2, axis=(0, 1, 0)), joint(3, "fixed")])
    task = Task(0.0, 90, roll_deg=(-10, 10), roll_reference=(1, 0, 0))
    q0, q1, h = np.zeros(2), size * np.array([1.0, 2.0]), 1e-2
    s = np.concatenate([np.linspace(h, 1.0 - h, 50) + way * h for way in (-1, 0, 1)])
    q = q0 + s[:, None] * (q1 - q0)
    axes, b = tools(robot, q)[1], np.tile([0.0, 0.0, 1.0], (len(q), 1))
    psi = roll_of(references(robot, q), axes, np.tile([1.0, 0.0, 0.0], (len(q), 1)), b)
    before, at, behind = psi.reshape(3, -1)
    second = np.abs(before - 2.0 * at + behind) / h**2
    chord = np.linalg.norm(axes - b, axis=1).max()
    _, most = Motions(robot, None, task).roll_rates(q0, q1, (0.0, 0.0, 0.0), chord)
    holds(most * (1.0 + 1e-6) + 1e-9, second.max(), 0.7)
