"""Branch and bound never rules out a configuration that exists, and proves plain impossibility."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from arm_urdfs import FREE, joint
from dense_replay import tools
from random_arms import (
    planar_arm,
    rail_arm,
    random_arm,
    random_configuration,
    random_turn,
    robot_of,
    tilted,
    turn_onto,
)

from feasibility import Task
from feasibility.roadmap import (
    Exploration,
    Ruling,
    arrays_of,
    margin_shares,
    root_box,
    rule,
    work_for,
)
from robots import load_robot
from surfaces import plane

BOXES = 2000


def one_target(point, approach, rng):
    """One cell whose target, without a standoff, is a point and an approach direction."""
    turn = turn_onto(np.array([0.0, 0.0, 1.0]), -approach, rng)
    return plane((-0.01, 0.01), (-0.01, 0.01), side="outside").moved(turn, point).cells(1, 1)


def ruling(robot, cells, task, boxes=BOXES):
    """The ruling on the only cell, the configuration found, and the number of boxes."""
    arrays = arrays_of(robot, cells, task)
    stack = root_box(arrays)
    outcome, found = rule(arrays, work_for(robot.n), 0, stack, boxes)
    return outcome, found, int(stack.counts[1])


@cache
def some_arm(name):
    """An arm of the tests below."""
    makers = {
        "puma560": lambda: load_robot("puma560", limits="set-1"),
        "planar": lambda: planar_arm(3),
        "long planar": lambda: planar_arm(5, (-0.9, 1.1)),
        "ur5 on a rail": lambda: rail_arm("ur5"),
        "ur5, far windings": lambda: load_robot("ur5", limits=np.radians([[190.0, 560.0]] * 6)),
        "free joints": lambda: robot_of(
            [
                joint(1, "continuous", limits=FREE),
                joint(2, "continuous", (0.1, 0, 0.3), (np.pi / 2, 0, 0), limits=FREE),
                joint(3, "continuous", (0.3, 0, 0), (0, np.pi / 2, 0), limits=FREE),
                joint(4, "prismatic", (0.2, 0, 0), axis=(1, 0, 0), limits=(0.0, 0.4)),
            ]
        ),
    }
    return makers[name]() if name in makers else load_robot(name)


@pytest.mark.parametrize(
    "name",
    [
        "puma560", "ur5", "panda", "planar", "long planar", "ur5 on a rail", "ur5, far windings",
        "free joints",
    ],
)  # fmt: skip
def test_what_an_arm_reaches_is_never_proved_out_of_reach(name):
    """60 targets an arm: 480 in all, from configurations that may be at limits or singular.

    The target is as far off as the tolerance allows and as tilted as the cone allows (0 to 180
    degrees), so that a bound that is slightly too tight would be found. The joints are held
    to boxes about the configuration, 1e-3 to 2 rad wide, which branch and bound can finish; the
    configuration may be at their borders. Boxes beside it are often proved, which shows this.
    """
    robot = some_arm(name)
    rng = np.random.default_rng(sum(name.encode()))
    beside = []
    for k in range(60):
        q = random_configuration(robot, rng)
        (point,), (axis,) = tools(robot, q[None])
        task = Task(0.0, (0.0, 0.01, 5.0, 45.0, 120.0, 180.0)[k % 6], (1e-3, 1e-5, 0.02)[k % 3])
        offset = rng.normal(size=3)
        offset *= 0.999 * task.tolerance / np.linalg.norm(offset)
        approach = tilted(axis, 0.9999 * task.cone, rng)
        cells = one_target(point + offset, approach, rng)
        width = 10.0 ** rng.uniform(-3.0, 0.3)
        share = np.clip(rng.uniform(-0.3, 1.3, robot.n), 0.0, 1.0)
        low = q - share * width
        box = robot.with_limits(np.column_stack([low, np.maximum(low + width, q)]))
        outcome, found, _ = ruling(box, cells, task)
        assert outcome is not Ruling.PROVED, (q.tolist(), box.lower, box.upper, task)
        if outcome is Ruling.REACHED:
            (there,), (held,) = tools(robot, found[None])
            assert np.linalg.norm(there - point - offset) <= task.tolerance + 1e-12
            assert np.arccos(np.clip(held @ approach, -1, 1)) <= task.cone + 1e-7
        shifted = np.column_stack([low, low + width]) + 1.5 * width + 0.05
        beside.append(ruling(robot.with_limits(shifted), cells, task)[0])
    assert beside.count(Ruling.PROVED) >= 20
    assert ruling(robot, cells, task)[0] is not Ruling.PROVED


def test_what_random_arms_reach_is_never_proved_out_of_reach():
    """200 targets of 50 random arms, joints of every kind, 500 boxes each."""
    rng = np.random.default_rng(4)
    for _ in range(50):
        robot = random_arm(rng)
        for _ in range(4):
            q = random_configuration(robot, rng)
            (point,), (axis,) = tools(robot, q[None])
            task = Task(0.0, float(rng.choice([0.0, 10.0, 90.0])), 10.0 ** rng.uniform(-5, -2))
            approach = tilted(axis, 0.9999 * task.cone, rng)
            width = 10.0 ** rng.uniform(-3.0, 0.3, robot.n)
            low = q - rng.random(robot.n) * width
            box = robot.with_limits(np.column_stack([low, np.maximum(low + width, q)]))
            outcome, _, _ = ruling(box, one_target(point, approach, rng), task, 500)
            assert outcome is not Ruling.PROVED, (robot.lower, robot.upper, q.tolist(), task)


@pytest.mark.parametrize("name", ["puma560", "planar", "free joints"])
def test_newton_finds_nothing_where_there_is_a_proof(name):
    """60 random targets, near the edge of what the arm can do: both answers come up."""
    robot = some_arm(name)
    rng = np.random.default_rng(7)
    proved = 0
    for _ in range(60):
        direction = rng.normal(size=3)
        if name == "planar":
            direction[2] = 0.0
        point = direction / np.linalg.norm(direction) * rng.uniform(0.2, 1.3) * robot.reach
        approach = random_turn(rng)[0]
        task = Task(0.0, 70.0, 1e-3)
        cells = one_target(point, approach, rng)
        if ruling(robot, cells, task)[0] is not Ruling.PROVED:
            continue
        proved += 1
        arrays, work = arrays_of(robot, cells, task), work_for(robot.n)
        low = np.maximum(robot.lower, -np.pi)
        high = np.minimum(robot.upper, np.pi)
        guesses = rng.uniform(low, high, (25, robot.n))
        assert (margin_shares(arrays, work, 0, guesses) == -1.0).all()
    assert 5 <= proved < 60


@pytest.mark.parametrize(
    ("name", "most"), [("puma560", 20_000), ("planar", 2000), ("free joints", 20_000)]
)
def test_beyond_reach_is_proved(name, most):
    """1.02 times the reach away from the shoulder, in 10 directions."""
    rng = np.random.default_rng(5)
    robot = some_arm(name)
    shoulder = robot.model.jointPlacements[1].translation
    took = []
    for _ in range(10):
        direction = random_turn(rng)[0]
        if name == "planar":
            direction = np.array([*direction[:2], 0.0]) / np.linalg.norm(direction[:2])
        cells = one_target(shoulder + 1.02 * robot.reach * direction, -direction, rng)
        outcome, _, boxes = ruling(robot, cells, Task(0.0, 180, 1e-3), most)
        took.append((outcome, boxes))
    assert all(outcome is Ruling.PROVED for outcome, _ in took), took


def test_a_planar_arm_cannot_point_out_of_its_plane():
    """The tool axis lies in the plane: 90 degrees from z, whatever the joints do."""
    robot = planar_arm(3)
    rng = np.random.default_rng(6)
    up = np.array([0.0, 0.0, 1.0])
    for distance in (0.1, 0.4, 0.8):
        cells = one_target(np.array([distance, 0.1, 0.0]), up, rng)
        outcome, _, boxes = ruling(robot, cells, Task(0.0, 85.0, 1e-3), 5000)
        assert outcome is Ruling.PROVED, boxes
        assert ruling(robot, cells, Task(0.0, 90.1, 1e-3), 5000)[0] is not Ruling.PROVED
    # Nor can it leave the plane, be it by little more than the tolerance.
    for height, impossible in ((1.1e-3, True), (0.9e-3, False)):
        cells = one_target(np.array([0.5, 0.1, height]), up, rng)
        outcome, _, boxes = ruling(robot, cells, Task(0.0, 180.0, 1e-3), 20_000)
        assert (outcome is Ruling.PROVED) == impossible, boxes


def crank(low_deg, high_deg, kind="revolute"):
    """A single link of 0.5 m about z."""
    limits = tuple(np.radians([low_deg, high_deg]).tolist()) if kind == "revolute" else FREE
    return robot_of([joint(1, kind, limits=limits), joint(2, "fixed", (0.5, 0, 0))])


@pytest.mark.parametrize(
    ("limits", "inside", "outside"),
    [
        ((120, 240), (120, 150, 180, -150, -120), (119, -119, 0, 90, -90)),
        ((-30, 30), (-30, 0, 30, 360), (31, -31, 180)),
        ((170, 190), (170, 180, -170), (169, -169, 0)),
        ((300, 420), (300, -60, 0, 59, 60), (299, 61, 180)),
        ((-400, -300), (-40, 0, 60), (-41, 61, 180)),
        ((-180, 180), (-180, 180, 0, 90), ()),
        ((0, 360), (0, 360, -90, -1, 180), ()),
        ((10, 369), (10, 9, 369, -170), (9.5,)),
        ((10, 371), (10, 9.5, 180, -5), ()),
        ((1000, 1400), (0, 90, 180, 270), ()),
    ],
)
def test_limits_are_real_intervals_and_full_turns_are_not_cut(limits, inside, outside):
    """Angles (degrees) of a crank that are inside limits, and that are not, by any winding."""
    rng = np.random.default_rng(8)
    robot = crank(*limits)
    task = Task(0.0, 180, 1e-4)
    for angles, expected in ((inside, Ruling.REACHED), (outside, Ruling.PROVED)):
        for angle in np.radians(angles):
            target = 0.5 * np.array([np.cos(angle), np.sin(angle), 0.0])
            outcome = ruling(robot, one_target(target, np.array([0.0, 0.0, 1.0]), rng), task)[0]
            at_limit = expected is Ruling.REACHED and outcome is Ruling.UNKNOWN
            assert outcome is expected or at_limit, (np.degrees(angle), outcome)


@pytest.mark.parametrize("limits", [(10, 371), (190, 560), (-350, 20), (1000, 1400)])
def test_what_branch_and_bound_finds_is_seeded_at_its_winding(limits):
    """It searches one turn about zero; the limits may lie elsewhere. The seed must not be lost."""
    rng = np.random.default_rng(11)
    robot = robot_of(
        [
            joint(1, limits=tuple(np.radians(limits).tolist())),
            joint(2, xyz=(0.3, 0, 0), limits=(-1.5, 1.5)),
            joint(3, "fixed", (0.3, 0, 0)),
        ]
    )
    for angle in np.radians([-170.0, -90.0, -10.0, 5.0, 95.0, 175.0]):
        target = 0.5 * np.array([np.cos(angle), np.sin(angle), 0.0])
        cells = one_target(target, np.array([0.0, 0.0, 1.0]), rng)
        exploration = Exploration(robot, cells, arrays_of(robot, cells, Task(0.0, 180, 1e-2)), 0)
        outcome = exploration.rule(0, root_box(exploration.arrays), BOXES)
        assert outcome in (Ruling.REACHED, Ruling.UNKNOWN)
        assert exploration.reached[0]


def test_a_continuous_joint_turns_all_the_way():
    """No angle of a free crank is proved out of reach."""
    rng = np.random.default_rng(9)
    robot = crank(0, 0, "continuous")
    for angle in np.linspace(-np.pi, np.pi, 33):
        target = 0.5 * np.array([np.cos(angle), np.sin(angle), 0.0])
        cells = one_target(target, np.array([0.0, 0.0, 1.0]), rng)
        assert ruling(robot, cells, Task(0.0, 180, 1e-4))[0] is Ruling.REACHED


def test_a_slide_without_ends_proves_nothing():
    """Boxes of infinite width cannot be split to the end: the ruling stays unknown."""
    rng = np.random.default_rng(10)
    for limits in (FREE, (0.0, np.inf), (-np.inf, 1.0)):
        robot = robot_of(
            [
                joint(1, "prismatic", axis=(1, 0, 0), limits=(-1.0, 1.0)),
                joint(2, limits=(-3.0, 3.0)),
                joint(3, "fixed", (0.5, 0, 0)),
            ]
        ).with_limits({"j1": limits})
        for x in (0.7, 30.0, -30.0):
            q = np.array([np.clip(x, *limits), 0.4])
            (point,), _ = tools(robot, q[None])
            cells = one_target(point, np.array([0.0, 0.0, 1.0]), rng)
            outcome = ruling(robot, cells, Task(0.0, 180, 1e-3))[0]
            assert outcome is not Ruling.PROVED
