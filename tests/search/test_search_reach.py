"""Branch and bound never rules out a configuration that exists, and proves plain impossibility."""

from functools import cache

import numpy as np
import pytest
import random_arms
from arm_urdfs import FREE, joint
from bounds import holds
from plain import tools
from random_arms import planar_arm, rail_arm, random_arm, random_configuration, robot_of
from referee import unit
from search_kernels import Motions, ruled

from coverable import Task, load_robot, plane
from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.motions.search_arrays import arrays_of
from feasibility.roadmap.proofs.branching import root_box
from feasibility.roadmap.proofs.ruling import Ruling
from feasibility.roadmap.rulings import rule

UP = np.array([0.0, 0.0, 1.0])


def one_target(point, approach, rng):
    """One cell whose target, without a standoff, is a point and an approach direction."""
    turn = random_arms.turn_onto(UP, -approach, rng)
    return plane((-0.01, 0.01), (-0.01, 0.01), side="outside").moved(turn, point).cells(1, 1)


MADE = {
    "puma560": lambda: load_robot("puma560", limits="set-1"),
    "ur5": lambda: load_robot("ur5"),
    "panda": lambda: load_robot("panda"),
    "planar": lambda: planar_arm(3),
    "long planar": lambda: planar_arm(5, (-0.9, 1.1)),
    "ur5 on a rail": lambda: rail_arm("ur5"),
    "ur5, far windings": lambda: load_robot("ur5", limits=np.radians([[190.0, 560.0]] * 6)),
    "free joints": lambda: robot_of([
        joint(1, "continuous", limits=FREE),
        joint(2, "continuous", (0.1, 0, 0.3), (np.pi / 2, 0, 0), limits=FREE),
        joint(3, "continuous", (0.3, 0, 0), (0, np.pi / 2, 0), limits=FREE),
        joint(4, "prismatic", (0.2, 0, 0), axis=(1, 0, 0), limits=(0.0, 0.4)),
    ]),
}  # fmt: skip
some_arm = cache(lambda name: MADE[name]())


def covered(rng, robot, task):
    """A configuration at random, and a target that it just covers: point, approach."""
    q = random_configuration(robot, rng)
    (point,), (axis,) = tools(robot, q[None])
    offset = 0.999 * task.tolerance * unit(rng.normal(size=3))
    return q, point + offset, random_arms.tilted(axis, 0.9999 * task.cone, rng)


@pytest.mark.parametrize("name", [*MADE, "random"])
def test_what_an_arm_reaches_is_never_proved_out_of_reach(name):
    """40 targets an arm, 120 of random ones; configurations may be at limits or singular."""
    rng, beside = np.random.default_rng(sum(name.encode())), []
    for k in range(120 if name == "random" else 40):
        if k % 4 == 0:
            robot = random_arm(rng) if name == "random" else some_arm(name)
        task = Task(0.0, (0.0, 0.01, 5.0, 45.0, 120.0, 180.0)[k % 6], (1e-3, 1e-5, 0.02)[k % 3])
        q, point, approach = covered(rng, robot, task)
        cells = one_target(point, approach, rng)
        width = 10.0 ** rng.uniform(-3.0, 0.3)
        low = q - np.clip(rng.uniform(-0.3, 1.3, robot.n), 0.0, 1.0) * width
        box = robot.with_limits(np.column_stack([low, np.maximum(low + width, q)]))
        outcome, found, _ = ruled(box, cells, task, 500 if name == "random" else 2000)
        assert outcome is not Ruling.PROVED, (q.tolist(), box.lower, box.upper, task)
        if outcome is Ruling.REACHED:
            (there,), (held,) = tools(robot, found[None])
            assert np.linalg.norm(there - point) <= task.tolerance + 1e-12
            assert np.arccos(np.clip(held @ approach, -1, 1)) <= task.cone + 1e-7
        shifted = np.column_stack([low, low + width]) + 1.5 * width + 0.05
        beside.append(ruled(robot.with_limits(shifted), cells, task).ruling)
    assert beside.count(Ruling.PROVED) >= 12
    assert ruled(robot, cells, task).ruling is not Ruling.PROVED


@pytest.mark.parametrize("name", [*MADE, "random"])
def test_the_tool_gets_no_further_in_a_box_than_levers_in_its_middle_say(name):
    """Tool point and axis at 40 places of 60 boxes, and beside their linear models."""
    rng, bounds, truths = np.random.default_rng(len(name)), [], []
    for _ in range(60):
        robot = random_arm(rng) if name == "random" else some_arm(name)
        q, half = random_configuration(robot, rng), 10.0 ** rng.uniform(-3.0, 0.0, robot.n)
        half[rng.random(robot.n) < 0.7] = 0.0
        d = half * np.clip(rng.uniform(-2.0, 2.0, (40, robot.n)), -1.0, 1.0)
        box, (at, there) = Motions(robot), (tools(robot, some) for some in (q[None], q + d))
        for which in range(2):
            *bound, rows = box.reach(q, half, which)
            moved = there[which] - at[which]
            bounds.append(bound)
            truths.append([np.linalg.norm(x, axis=1).max() for x in (moved, moved - d @ rows.T)])
    for bound, truth in zip(np.transpose(bounds), np.transpose(truths), strict=True):
        holds(bound, truth, 0.99)


def test_no_box_loses_the_roll_of_a_place_in_it():
    """Where a target has the roll of one place, that place stays in the box, and others go."""
    rng, lost, cut = np.random.default_rng(5), 0, 0
    task = Task(0.0, 60, roll_deg=(-1, 1), roll_reference=(1, 0, 0))
    for _ in range(100):
        robot = random_arm(rng)
        box, n = Motions(robot, task=task), robot.n
        box.turn_range(0.0, 1e-9)
        for _ in range(60):
            q, half = random_configuration(robot, rng), 10.0 ** rng.uniform(-2.0, 0.0, n)
            half[rng.random(n) < 0.5] = 0.0
            d = half * np.clip(rng.uniform(-2.0, 2.0, n), -1.0, 1.0)
            b = tools(robot, q[None])[1][0] + rng.choice([1e-3, 0.1]) * rng.normal(size=3)
            low, high = box.cut_by_roll(q, half, d, unit(b))
            lost += bool((low > d + 1e-9).any() or (high < d - 1e-9).any())
            cut += bool((low > -half).any() or (high < half).any())
    assert lost == 0
    assert cut >= 2000


@pytest.mark.parametrize("name", ["puma560", "planar", "free joints"])
def test_beyond_reach_is_proved(name):
    """1.02 times the reach away from the shoulder, in 10 directions."""
    rng, robot = np.random.default_rng(5), some_arm(name)
    shoulder = robot.model.jointPlacements[1].translation
    for _ in range(10):
        direction = unit(rng.normal(size=3) * [1.0, 1.0, name != "planar"])
        cells = one_target(shoulder + 1.02 * robot.reach * direction, -direction, rng)
        assert ruled(robot, cells, Task(0.0, 180, 1e-3), 20_000).ruling is Ruling.PROVED


def test_a_planar_arm_cannot_point_out_of_its_plane():
    """The tool axis lies in the plane: 90 degrees from z, whatever the joints do."""
    robot, rng = planar_arm(3), np.random.default_rng(6)
    for distance in (0.1, 0.4, 0.8):
        cells = one_target(np.array([distance, 0.1, 0.0]), UP, rng)
        assert ruled(robot, cells, Task(0.0, 85.0, 1e-3), 5000).ruling is Ruling.PROVED
        assert ruled(robot, cells, Task(0.0, 90.1, 1e-3), 5000).ruling is not Ruling.PROVED
    # Nor can it leave the plane, be it by little more than the tolerance.
    for height, impossible in ((1.1e-3, True), (0.9e-3, False)):
        cells = one_target(np.array([0.5, 0.1, height]), UP, rng)
        proved = ruled(robot, cells, Task(0.0, 180.0, 1e-3), 20_000).ruling is Ruling.PROVED
        assert proved == impossible


def crank(low_deg, high_deg, kind="revolute"):
    """A single link of 0.5 m about z."""
    limits = tuple(np.radians([low_deg, high_deg]).tolist()) if kind == "revolute" else FREE
    return robot_of([joint(1, kind, limits=limits), joint(2, "fixed", (0.5, 0, 0))])


def at_angle(angle):
    return 0.5 * np.array([np.cos(angle), np.sin(angle), 0.0])


@pytest.mark.parametrize(("limits", "inside", "outside"), [
    ((120, 240), (120, 150, 180, -150, -120), (119, -119, 0, 90, -90)),
    ((-30, 30), (-30, 0, 30, 360), (31, -31, 180)),
    ((170, 190), (170, 180, -170), (169, -169, 0)),
    ((300, 420), (300, -60, 0, 59, 60), (299, 61, 180)),
    ((-400, -300), (-40, 0, 60), (-41, 61, 180)), ((-180, 180), (-180, 180, 0, 90), ()),
    ((0, 360), (0, 360, -90, -1, 180), ()), ((10, 369), (10, 9, 369, -170), (9.5,)),
    ((10, 371), (10, 9.5, 180, -5), ()), ((1000, 1400), (0, 90, 180, 270), ()),
])  # fmt: skip
def test_limits_are_real_intervals_and_full_turns_are_not_cut(limits, inside, outside):
    """Angles (degrees) of a crank that are inside limits, and that are not, by any winding."""
    rng, robot, task = np.random.default_rng(8), crank(*limits), Task(0.0, 180, 1e-4)
    for angles, expected in ((inside, Ruling.REACHED), (outside, Ruling.PROVED)):
        for angle in np.radians(angles):
            outcome = ruled(robot, one_target(at_angle(angle), UP, rng), task).ruling
            at_limit = expected is Ruling.REACHED and outcome is Ruling.UNKNOWN
            assert outcome is expected or at_limit, (np.degrees(angle), outcome)


@pytest.mark.parametrize("limits", [(10, 371), (190, 560), (-350, 20), (1000, 1400)])
def test_what_branch_and_bound_finds_is_seeded_at_its_winding(limits):
    """It searches one turn about zero; the limits may lie elsewhere. The seed must not be lost."""
    rng, turning = np.random.default_rng(11), tuple(np.radians(limits).tolist())
    elbow = joint(2, xyz=(0.3, 0, 0), limits=(-1.5, 1.5))
    robot = robot_of([joint(1, limits=turning), elbow, joint(3, "fixed", (0.3, 0, 0))])
    for angle in np.radians([-170.0, -90.0, -10.0, 5.0, 95.0, 175.0]):
        cells = one_target(at_angle(angle), UP, rng)
        exploration = Exploration(robot, cells, arrays_of(robot, cells, Task(0.0, 180, 1e-2)), 0)
        boxes = root_box(exploration.arrays)
        outcome = rule(exploration, 0, boxes, 2000)
        examined = int(boxes.counts[1])  # the box stays there: without it the rest is no proof
        assert rule(exploration, 0, boxes, 2000) is outcome in (Ruling.REACHED, Ruling.UNKNOWN)
        assert boxes.counts[1] == examined + 1
        assert exploration.reached[0]


@pytest.mark.parametrize("limits", [FREE, (0.0, np.inf), (-np.inf, 1.0)])
def test_a_slide_without_ends_proves_nothing(limits):
    """Boxes of infinite width cannot be split to the end: the ruling stays unknown."""
    rng, turning = np.random.default_rng(10), joint(2, limits=(-3.0, 3.0))
    sliding = joint(1, "prismatic", axis=(1, 0, 0), limits=(-1.0, 1.0))
    robot = robot_of([sliding, turning, joint(3, "fixed", (0.5, 0, 0))]).with_limits({"j1": limits})
    for x in (0.7, 30.0, -30.0):
        (point,), _ = tools(robot, np.array([[np.clip(x, *limits), 0.4]]))
        outcome = ruled(robot, one_target(point, UP, rng), Task(0.0, 180, 1e-3)).ruling
        assert outcome is not Ruling.PROVED
