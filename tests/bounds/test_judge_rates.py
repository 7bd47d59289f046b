"""Speeds and singular values along segments: the bounds against dense samples by other code."""

from dataclasses import replace

import numpy as np
import pytest
from arm_urdfs import UNLIKE, joint, unlike
from gantry import configurations, gantry
from random_arms import robot_of
from samples import sampled, seeds

from coverable import Task, load_robot, plane
from coverable.errors import ArgumentError
from feasibility.certification import segment_rates as rates
from feasibility.certification.lever_bounds import jacobians, levers_along, second_derivatives
from feasibility.certification.rate_replay import check_rates, in_place, replay_rates
from feasibility.verdict import Walk
from robots.kinematics import Kinematics

PLATE = plane((0.4, 0.6), (-0.1, 0.1), "outside", (0, 0, 0.3)).cells(3, 3)
TASK = Task(standoff=0.02, cone_deg=30)
UR5 = load_robot("ur5")


def segments(robot, count, seed):
    rng = np.random.default_rng(seed)
    low, high = np.maximum(robot.lower, -3.0), np.minimum(robot.upper, 3.0)
    starts = rng.uniform(low, high, (count, robot.n))
    return starts, starts + rng.normal(0.0, 0.15, starts.shape)


def sampled_rates(robot, start, end):
    """Least speed (m/s) and singular value at 200 places, from Jacobians one by one."""
    kinematics, way = Kinematics(robot), end - start
    time = np.max(np.abs(way) / robot.max_velocity)
    speeds, values = [], []
    for share in np.linspace(0.0, 1.0, 200):
        point, axis = kinematics.jacobians(start + share * way)
        speeds.append(np.linalg.norm(point @ way) / time)
        both = np.vstack([point / robot.reach, axis])
        square = np.sort(np.linalg.eigvalsh(both @ both.T))[::-1]  # the root of the fifth, at most
        values.append(np.sqrt(abs(square[min(robot.n, 5) - 1])))
    return min(speeds), min(values)


@sampled("seed", seeds(1, all=20))
@pytest.mark.parametrize("name", UNLIKE)
def test_bounds_hold_and_are_close(name, seed):
    robot = unlike(name)
    robot = replace(robot, max_velocity=np.linspace(1.0, 3.0, robot.n))
    starts, ends = segments(robot, 4, seed + 1)
    found = rates.segment_rates(robot, starts, ends, sigma=np.inf, group=np.arange(4))
    for k, (a, b) in enumerate(zip(starts, ends, strict=True)):
        speed, value = sampled_rates(robot, a, b)
        assert 0.99 * speed <= found.speed[k] <= speed * (1 + 1e-9)
        assert found.sampled_speed[k] >= speed * (1 - 1e-3)
        assert 0.99 * value - 1e-4 <= found.sigma[k] <= value * (1 + 1e-6) + 1e-9
        assert rates.fastest_anywhere(robot) >= speed


CHAINS = {
    "elbow": [joint(1), joint(2, xyz=(1, 0, 0)), joint(3, axis=(1, 0, 0))],
    "slide": [joint(1), joint(2, "prismatic", axis=(1, 0, 0)), joint(3, axis=(1, 0, 0))],
    "wrist": [joint(1), joint(2, axis=(0, 1, 0)), joint(3, axis=(1, 0, 0))],
}  # fmt: skip


@pytest.mark.parametrize("name", ["elbow", "slide", "wrist"])
def test_a_single_look_shows_what_the_lemmas_say(name):
    """|p'| >= (|p'(0)| + |p'(1)| - D) / 2, or the chord less D / 2; and of singular values."""
    rng = np.random.default_rng(3)
    robot = robot_of([*CHAINS[name], joint(4, "fixed", (1.0, 0.2, 0.1))], (0.0, 1.0, 0.0))
    robot, slides = replace(robot, max_velocity=np.ones(3)), robot.prismatic
    shown = 0
    for _ in range(40):
        q = rng.uniform(-3.0, 3.0, 3) + np.array([[0.0], [1.0]]) * rng.uniform(-0.1, 0.1, 3)
        at, steps = jacobians(Kinematics(robot), q), np.abs(q[1] - q[0])
        bent = second_derivatives(steps[None], slides, at.levers, np.inf)[0]
        ends = np.linalg.norm(at.point @ (q[1] - q[0]), axis=1)
        chord = np.linalg.norm(at.points[1] - at.points[0])
        speed = max(0.5 * (ends.sum() - bent), chord - 0.5 * bent) / steps.max()
        square, turns = 0.0, np.where(slides, 0.0, steps)
        for levers, cap, unit in ((at.levers, np.inf, robot.length_unit), (at.sines, 1.0, 1.0)):
            (r,) = levers_along(steps[None], slides, levers[:1], levers[1:], cap)
            for j in range(3):
                change = r[j] * turns[: j + 1].sum() + (r * steps)[j + 1 :].sum()
                if slides[j]:
                    change = turns[:j].sum() if cap > 1.0 else 0.0
                square += (change / unit) ** 2
        sigma = 0.5 * (rates.smallest_singular_values(robot, q).sum() - np.sqrt(square))
        if min(speed, sigma) > 1e-6:
            found = rates.segment_rates(robot, q[:1], q[1:], speed=1e-6, sigma=1e-6)
            assert found.speed[0] == pytest.approx(speed)
            assert found.sigma[0] == pytest.approx(sigma)
            shown += 1
    assert shown > 3


def test_the_smallest_of_the_singular_values_is_the_fifth():
    """A gantry: three slides of 1 / reach each, and two turns of the axis."""
    robot = gantry()
    scale = robot.length_unit
    q = configurations(np.zeros((1, 3)), -np.eye(3)[2:])
    point = np.vstack(Kinematics(robot).jacobians(q[0]))
    point[:3] /= scale
    values = np.sort(np.linalg.svd(point, compute_uv=False))
    assert rates.smallest_singular_values(robot, q)[0] == pytest.approx(values[1])
    assert values[0] < 1e-9


def test_no_speed_is_more_than_all_joints_make_in_one_line():
    robot = robot_of(
        [joint(1), joint(2, "prismatic", (1, 0, 0), axis=(1, 0, 0), limits=(-2.0, 0.5)),
         joint(3, "fixed", (0.3, 0, 0))]
    )  # fmt: skip
    robot = replace(robot, max_velocity=np.array([2.0, 0.7]))
    assert rates.fastest_anywhere(robot) == pytest.approx(2.0 * (1.0 + 2.0 + 0.3) + 0.7)


@pytest.mark.parametrize(("factor", "possible"), [(0.98, True), (1.02, False)])
def test_what_is_asked_is_decided_and_nothing_more(factor, possible):
    starts, ends = segments(UR5, 6, 3)
    for a, b in zip(starts, ends, strict=True):
        speed, sigma = sampled_rates(UR5, a, b)
        found = rates.segment_rates(UR5, a[None], b[None], factor * speed, factor * sigma)
        assert (found.speed[0] >= factor * speed) == possible
        assert (found.sigma[0] >= factor * sigma) == possible


def line(turn=0.0):
    """The gantry's tool from the first cell to the second and round a corner to the fifth."""
    at = PLATE.centres[[0, 1, 4]] + [0.0, 0.0, 0.02]
    share = np.linspace(0.0, 1.0, 30)[:, None]
    points = np.vstack([at[0] + share * (at[1] - at[0]), at[1] + share[1:] * (at[2] - at[1])])
    q = configurations(points, np.tile([0.0, 0.0, -1.0], (len(points), 1)))
    turned = q[29:] + turn * np.eye(6)[5]
    q = np.vstack([q[:30], turned]) if turn else q
    return Walk(q, np.full(len(q), -1))


ARM = replace(gantry(), max_velocity=np.array([0.5, 0.4, 1.0, 1.0, 1.0, 2.0]))


def test_stops_are_counted_and_the_joint_is_named():
    bent = replay_rates(ARM, PLATE, TASK, line(), closely=True)
    assert [(s.why, s.row, s.cell) for s in bent.stops] == [("corner", 29, 1)]
    assert bent.speed == pytest.approx(0.4, rel=0.01)  # along y; along x it has 0.5
    waits = replay_rates(ARM, PLATE, TASK, line(0.4), closely=True)
    assert [(s.why, s.row, s.cell) for s in waits.stops] == [("in place", 29, 1)]
    assert waits.waiting == pytest.approx(0.4 / 2.0)
    assert waits.speed == pytest.approx(bent.speed, rel=0.01)
    for factor, accepted in ((0.98, True), (1.02, False), (2.0, False)):
        found = replay_rates(ARM, PLATE, replace(TASK, speed=0.4 * factor), line())
        assert found.accepted == accepted
    assert found.faults[0].startswith("j2 would need 0.8 m/s at cell")
    assert "it allows 0.4" in found.faults[0]


@pytest.mark.parametrize("sigma", [0.98, 1.02])
def test_the_distance_from_singularities_is_kept_also_where_the_tool_rests(sigma):
    walk = line(0.4)
    least = rates.smallest_singular_values(ARM, walk.q).min()
    for rows in (walk.q, walk.q[:1]):
        asked = replace(TASK, min_manipulability=sigma * least)
        found = replay_rates(ARM, PLATE, asked, Walk(rows, np.full(len(rows), -1)))
        assert found.accepted == (sigma < 1.0)
        assert found.accepted or "smallest singular value" in found.faults[0]


IN_PLACE = {  # mm beside the target at both ends; radius (mm) of a whole turn between them
    "still": ((0.0, 0.0), 0.0, True),
    "a tenth": ((0.099, 0.099), 0.0, True),
    "more at last": ((0.0, 0.101), 0.0, False),
    "more at first": ((0.101, 0.0), 0.0, False),
    "round": ((0.0, 0.0), 0.19, True),
    "round, further than 1 mm": ((0.0, 0.0), 0.51, False),
}  # fmt: skip


@pytest.mark.parametrize("name", IN_PLACE)
def test_in_place_is_a_tenth_of_the_tolerance_at_the_ends_and_all_of_it_between(name):
    (first, last), radius, expected = IN_PLACE[name]
    at = (1e-3 * radius, 0, 0)
    arm = [joint(1, "prismatic", axis=(1, 0, 0)), joint(2), joint(3, "fixed", at)]
    cells = plane((-0.1, 0.1), (-0.1, 0.1), "outside", at).cells(1, 1)
    rows = np.array([[1e-3 * first, 0.0], [1e-3 * last, 2.0 * np.pi]])
    assert in_place(robot_of(arm), cells, Task(0.0, 90, 1e-3), rows)[0] == expected


def test_what_cannot_be_judged_is_refused():
    with pytest.raises(ArgumentError, match="limits no velocity of wrist_3_joint"):
        check_rates(replace(UR5, max_velocity=[3, 3, 3, 3, 3, np.nan]), replace(TASK, speed=0.2))
    with pytest.raises(ArgumentError, match=r"got 200, but .* less than .* m/s anywhere"):
        check_rates(UR5, replace(TASK, speed=200.0))
    check_rates(replace(UR5, max_velocity=np.full(6, np.nan)), TASK)
