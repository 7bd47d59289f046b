"""Robot as a value: what it refuses, limits, pickling, and how far it reaches."""

import pickle
import re
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from approved import refused
from arm_urdfs import UNLIKE, arm, joint, load_text, random_arm, random_q, unlike
from samples import sampled, seeds

from coverable import load_robot
from robots.kinematics import Kinematics

PUMA = load_robot("puma560")


CHANGES = {
    "no axis": {"approach_axis": (0, 0, 0)}, "infinite axis": {"approach_axis": (0, np.inf, 0)},
    "flat axis": {"approach_axis": (0, 1)}, "axis word": {"approach_axis": "z"},
    "five limits": {"lower": np.full(5, -1.0)}, "NaN": {"upper": np.full(6, np.nan)},
    "crossed": {"upper": np.full(6, -9.0)},
    "infinite": {"lower": np.full(6, np.inf), "upper": np.full(6, np.inf)},
    "no speed": {"max_velocity": np.zeros(6)}, "five speeds": {"max_velocity": np.ones(5)},
    "screw": {"joint_kinds": ("revolute",) * 5 + ("screw",)},
    "five kinds": {"joint_kinds": ("revolute",) * 5},
    "five of a set": {"limit_sets": {"odd": np.zeros((5, 2))}},
    "axes alike": {"reference_axis": (0, 0, 1)}, "start": {"start": np.full(6, np.inf)},
    "another model": {"model": pin.buildSampleModelHumanoidRandom()},
}  # fmt: skip
LIMITS = {
    "no such set": "set-9", "no such joint": {"joint7": (0, 1)},
    "two faults": {"joint1": 1.0, "typo": (0, 1)}, "words": {"joint1": ("a", "b")},
    "crossed": {"joint1": (1.0, -1.0)}, "five": np.zeros((5, 2)), "ragged": [[0, 1], [0]],
    "NaN": np.full((6, 2), np.nan),
}  # fmt: skip


def test_parts_and_limits_that_do_not_fit_together_are_refused(approved):
    lines = [f"{name}: {refused(replace, PUMA, **change)}" for name, change in CHANGES.items()]
    lines += [f"limits {name}: {refused(PUMA.with_limits, x)}" for name, x in LIMITS.items()]
    lines.append("no sets: " + refused(load_robot, "ur5", limits="set-1"))
    approved("bad_robots", "\n".join(lines))


def test_limits_by_name_array_and_mapping():
    named = PUMA.with_limits("set-3")
    np.testing.assert_array_equal(named.upper, np.radians([10, 75, 90, 170, 90, 90]))
    table = np.column_stack([np.arange(6) - 7.0, np.arange(6)])
    by_array = PUMA.with_limits(table.tolist())
    np.testing.assert_array_equal(np.column_stack([by_array.lower, by_array.upper]), table)
    some = named.with_limits({"joint2": (-0.5, 9.0)})
    np.testing.assert_array_equal(np.delete(some.lower, 1), np.delete(named.lower, 1))
    assert (some.lower[1], some.upper[1]) == (-0.5, 9.0)  # unwrapped: 9 rad is a limit like any
    np.testing.assert_array_equal(PUMA.upper, [np.pi] * 6)  # the first robot is unchanged


@pytest.mark.parametrize("what", ["link name", "joint name"])
@pytest.mark.parametrize("where", [0, -1])
def test_a_link_or_a_joint_called_like_the_world(what, where, tmp_path):
    """Pinocchio calls its world so; the arm moves as it would by any name."""
    text = random_arm(np.random.default_rng(1))
    names = re.findall(rf'<{what}="(.*?)"', text)
    plain = load_text(tmp_path, text)
    robot = load_text(tmp_path, text.replace(f'"{names[where]}"', '"universe"'))
    q = random_q(robot, np.random.default_rng(2))
    for own, other in zip(Kinematics(robot).tool(q), Kinematics(plain).tool(q), strict=True):
        np.testing.assert_array_equal(own, other)
    assert (robot.base == plain.base).all()


@pytest.mark.parametrize("name", UNLIKE[3::3])
def test_pickle_round_trip(name):
    robot = unlike(name)
    data = pickle.dumps(robot)
    assert len(data) < 200_000
    copy = pickle.loads(data)
    for part in ("name", "tool_frame", "joint_names", "joint_kinds", "urdf", "package_dirs",
                 "locked", "notes"):  # fmt: skip
        assert getattr(copy, part) == getattr(robot, part)
    for part in ("approach_axis", "lower", "upper", "max_velocity"):
        np.testing.assert_array_equal(getattr(copy, part), getattr(robot, part))
    assert copy.limit_sets.keys() == robot.limit_sets.keys()
    q = random_q(robot, np.random.default_rng(0))
    np.testing.assert_array_equal(Kinematics(copy).tool(q), Kinematics(robot).tool(q))


def furthest(robot, samples, seed=0):
    """Largest distance of the tool point from the first joint's origin, at ends of limits too."""
    rng = np.random.default_rng(seed)
    q = np.array([random_q(robot, rng) for _ in range(samples)])
    low, high = (np.where(np.isfinite(x), x, 0.0) for x in (robot.lower, robot.upper))
    ends = np.where(rng.uniform(size=q.shape) < 0.5, low, high)
    q = np.where(robot.prismatic & (rng.uniform(size=(samples, 1)) < 0.7), ends, q)
    points, _ = Kinematics(robot).tools(q)
    assert (robot.distance_from_base(points) <= robot.reach + 1e-12).all()
    return np.linalg.norm(points - robot.model.jointPlacements[1].translation, axis=1).max()


@pytest.mark.parametrize("name", UNLIKE)
def test_no_configuration_reaches_further_than_reach(name):
    robot = unlike(name)
    assert furthest(robot, 1000) <= robot.reach < 1.6 * furthest(robot, 1000)


@sampled("seed", seeds(25, all=300))
def test_reach_bounds_random_chains(seed, tmp_path):
    robot = load_text(tmp_path, random_arm(np.random.default_rng(200 + seed)))
    assert furthest(robot, 500) <= robot.reach + 1e-12


def test_reach_of_the_puma_is_exact():
    # Upper arm and forearm in line, seen from the side; the offset d3 stands across.
    assert PUMA.reach == pytest.approx(np.hypot(0.7 + np.hypot(0.1, 0.7), 0.1), abs=1e-9)
    point, _ = Kinematics(PUMA).tool([0, 0, np.arctan2(0.1, 0.7) - np.pi / 2, 0, 0, 0])
    assert np.linalg.norm(point) == pytest.approx(PUMA.reach, abs=1e-9)


def test_reach_follows_the_limits_of_slides(tmp_path):
    slide = joint(2, "prismatic", xyz=(1, 0, 0), axis=(1, 0, 0), limits=(-5.0, 0.5))
    robot = load_text(tmp_path, arm([joint(1, xyz=(0, 0, 7)), slide]))
    assert robot.reach == pytest.approx(4.0)  # drawn back by 5 m
    assert robot.with_limits({"j2": (-1, 0.5)}).reach == pytest.approx(1.5)
    assert robot.with_limits({"j2": (0, np.inf)}).reach == np.inf


@pytest.mark.parametrize("limits", [(0.0, 0.1), (-0.1, 0.02)])
def test_reach_of_many_slides_in_a_row_is_still_a_bound(limits, tmp_path):
    joints = [
        joint(i, "prismatic", xyz=(0.1, 0, 0), axis=(1, i % 3, 0), limits=limits)
        for i in range(1, 14)
    ]
    robot = load_text(tmp_path, arm(joints))
    assert furthest(robot, 50) <= robot.reach < 4.0
    for ends in (robot.lower, robot.upper):
        assert robot.distance_from_base(Kinematics(robot).tool(ends)[0]) <= robot.reach
