"""Speeds and singular values along segments: the bounds against dense samples by other code."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from arm_urdfs import UNLIKE, unlike

from coverable_errors import ArgumentError
from feasibility import Task
from feasibility.certification.rates import (
    check_rates,
    fastest_anywhere,
    replay_rates,
    segment_rates,
)
from feasibility.verdict import Walk
from robots import Kinematics, load_robot
from surfaces import plane

PLATE = plane((0.4, 0.6), (-0.1, 0.1), "outside", (0, 0, 0.3)).cells(3, 3)
TASK = Task(standoff=0.02, cone_deg=30)


def segments(robot, count, seed):
    rng = np.random.default_rng(seed)
    low, high = np.maximum(robot.lower, -3.0), np.minimum(robot.upper, 3.0)
    starts = rng.uniform(low, high, (count, robot.n))
    return starts, starts + rng.normal(0.0, 0.15, starts.shape)


def sampled(robot, start, end):
    """Speeds (m/s) and singular values at 200 places of a segment, from Jacobians one by one."""
    kinematics, way = Kinematics(robot), end - start
    time = np.max(np.abs(way) / robot.max_velocity)
    speeds, values = [], []
    for share in np.linspace(0.0, 1.0, 200):
        point, axis = kinematics.jacobians(start + share * way)
        speeds.append(np.linalg.norm(point @ way) / time)
        both = np.vstack([point / robot.reach, axis])
        values.append(np.sort(np.sqrt(np.abs(np.linalg.eigvalsh(both @ both.T))))[-5:][0])
    return min(speeds), min(values)


@pytest.mark.parametrize("name", UNLIKE)
def test_bounds_hold_and_are_close(name):
    robot = unlike(name)
    robot = replace(robot, max_velocity=np.linspace(1.0, 3.0, robot.n))
    starts, ends = segments(robot, 4, 1)
    found = segment_rates(robot, starts, ends, sigma=np.inf, group=np.arange(4))
    for k, (a, b) in enumerate(zip(starts, ends, strict=True)):
        speed, value = sampled(robot, a, b)
        assert found.speed[k] <= speed * (1 + 1e-9)
        assert found.speed[k] >= 0.99 * speed
        assert found.sampled_speed[k] >= speed * (1 - 1e-3)
        assert found.sigma[k] <= value * (1 + 1e-6) + 1e-9
        assert found.sigma[k] >= 0.99 * value - 1e-4
        assert fastest_anywhere(robot) >= speed


def test_a_single_joint_turns_the_tool_round_its_axis():
    """At the radius r the tool has r times the joint's velocity, whatever the step."""
    robot = load_robot("puma560")
    q = np.array([[0.1, -0.4, 0.3, 0.2, 0.5, 0.0]])
    point = Kinematics(robot).tool(q[0])[0]
    found = segment_rates(robot, q, q + np.eye(6)[:1] * 0.8)
    assert found.sampled_speed[0] == pytest.approx(3.0 * np.hypot(*point[:2]))
    assert found.speed[0] == pytest.approx(found.sampled_speed[0], rel=0.01)
    still = segment_rates(robot, q, q)
    assert np.isinf(still.speed[0])


def test_what_is_asked_is_decided_and_nothing_more():
    robot = load_robot("ur5")
    starts, ends = segments(robot, 6, 3)
    exact = np.array([sampled(robot, a, b)[0] for a, b in zip(starts, ends, strict=True)])
    for factor, possible in ((0.98, True), (1.02, False)):
        for k in range(6):
            asked = factor * exact[k]
            found = segment_rates(robot, starts[k : k + 1], ends[k : k + 1], speed=asked)
            assert (found.speed[0] >= asked) == possible


def landed(robot, points):
    """Configurations with the tool at points, its axis down: by Newton's method."""
    kinematics, q = Kinematics(robot), np.array([0.3, -1.3, 1.8, -2.0, -1.5708, 0.0])
    rows = []
    for point in points:
        for _ in range(60):
            tool, axis = kinematics.tool(q)
            off = np.concatenate([tool - point, axis - [0.0, 0.0, -1.0]])
            q = q - np.linalg.lstsq(np.vstack(kinematics.jacobians(q)), off, rcond=None)[0]
        assert np.abs(off).max() < 1e-9
        rows.append(q.copy())
    return np.array(rows)


def test_stops_are_counted_and_the_joint_is_named():
    robot = load_robot("ur5")
    at = PLATE.centres[[0, 1, 4]] + 0.02 * PLATE.normals[[0, 1, 4]]
    share = np.linspace(0.0, 1.0, 30)[:, None]
    line = np.vstack([at[0] + share * (at[1] - at[0]), (at[1] + share * (at[2] - at[1]))[1:]])
    q = landed(robot, line)
    turn = 0.4 * np.eye(6)[5]
    turned = np.vstack([q[:30], q[29:30] + turn, q[30:] + turn])
    bent = replay_rates(robot, PLATE, TASK, Walk(q, np.full(len(q), -1)), closely=True)
    assert [(s.why, s.row, s.cell) for s in bent.stops] == [("corner", 29, 1)]
    waits = replay_rates(robot, PLATE, TASK, Walk(turned, np.full(len(turned), -1)), closely=True)
    assert [(s.why, s.row, s.cell) for s in waits.stops] == [("in place", 29, 1)]
    assert waits.waiting == pytest.approx(0.4 / robot.max_velocity[5])
    assert waits.speed == pytest.approx(bent.speed, rel=0.01)
    fast = replace(TASK, speed=2.0 * bent.speed)
    refused = replay_rates(robot, PLATE, fast, Walk(q, np.full(len(q), -1)))
    assert not refused.accepted
    worst = int(np.argmin(bent.segment.sampled_speed))
    name = robot.joint_names[bent.segment.joint[worst]]
    limit = robot.max_velocity[bent.segment.joint[worst]]
    needed = float(refused.refusals[0].split("would need ")[1].split()[0])
    assert refused.refusals[0].startswith(f"{name} would need ")
    assert f"it allows {limit:.3g}" in refused.refusals[0]
    assert needed == pytest.approx(2.0 * limit, rel=0.01)
    assert replay_rates(robot, PLATE, replace(TASK, speed=0.98 * bent.speed),
                        Walk(q, np.full(len(q), -1))).accepted  # fmt: skip


def test_what_cannot_be_judged_is_refused():
    robot, task = load_robot("ur5"), replace(TASK, speed=0.2)
    with pytest.raises(ArgumentError, match="limits no velocity of wrist_3_joint"):
        check_rates(replace(robot, max_velocity=[3, 3, 3, 3, 3, np.nan]), task)
    with pytest.raises(ArgumentError, match=r"got 200, but .* less than .* m/s anywhere"):
        check_rates(robot, replace(task, speed=200.0))
    check_rates(replace(robot, max_velocity=np.full(6, np.nan)), TASK)
