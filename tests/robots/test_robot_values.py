"""Robot as a value: what it refuses, limits, pickling, reach."""

import pickle
import re
from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest
from arm_urdfs import UNLIKE, arm, joint, load_text, random_arm, random_q, unlike

from robots import Kinematics, RobotError, load_robot


@pytest.fixture(scope="module")
def puma():
    return load_robot("puma560")


def test_arrays_are_copies_that_cannot_be_written(puma):
    lower = np.full(6, -1.0)
    robot = replace(puma, lower=lower)
    lower[:] = 5.0
    np.testing.assert_array_equal(robot.lower, [-1.0] * 6)
    for array in (robot.lower, robot.upper, robot.approach_axis, robot.limit_sets["set-2"]):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0.0
    with pytest.raises(FrozenInstanceError):
        robot.name = "other"
    with pytest.raises(TypeError):
        robot.limit_sets["mine"] = np.zeros((6, 2))
    with pytest.raises(TypeError):
        robot.locked["joint1"] = 0.0


@pytest.mark.parametrize("what", ["link name", "joint name"])
@pytest.mark.parametrize("where", [0, -1])
def test_a_link_or_a_joint_called_like_the_world(what, where, tmp_path):
    text = random_arm(np.random.default_rng(1))
    names = re.findall(rf'<{what}="(.*?)"', text)
    with pytest.raises(RobotError, match=r"'universe' is Pinocchio's for the world; rename"):
        load_text(tmp_path, text.replace(f'"{names[where]}"', '"universe"'))


def test_an_axis_of_any_length_is_brought_to_one(puma):
    axis = replace(puma, approach_axis=(0, 3e300, 4e300)).approach_axis
    np.testing.assert_allclose(axis, [0, 0.6, 0.8])


def test_the_approach_axis_is_brought_to_length_one(puma):
    np.testing.assert_allclose(replace(puma, approach_axis=(0, 3, 4)).approach_axis, [0, 0.6, 0.8])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"approach_axis": (0, 0, 0)}, "approach_axis must be a finite vector that is not zero"),
        ({"approach_axis": (0, np.inf, 0)}, "approach_axis must be a finite vector"),
        ({"approach_axis": (0, 1)}, r"approach_axis has shape \(2,\), not \(3,\)"),
        ({"approach_axis": "z"}, "approach_axis must be an array of numbers"),
        ({"lower": np.full(5, -1.0)}, r"lower has shape \(5,\), not \(6,\)"),
        ({"upper": np.full(6, np.nan)}, "upper holds NaN"),
        ({"upper": np.full(6, -9.0)}, "(?s)'joint1' has limits .* 'joint6' has limits"),
        ({"lower": np.full(6, np.inf), "upper": np.full(6, np.inf)}, "limits inf .. inf"),
        ({"max_velocity": np.zeros(6)}, "max_velocity must be 6 positive numbers"),
        ({"max_velocity": np.ones(5)}, "max_velocity must be 6 positive numbers"),
        ({"joint_kinds": ("revolute",) * 5 + ("screw",)}, "'joint6' is 'screw', not one of"),
        ({"joint_kinds": ("revolute",) * 5}, "6 joint names and 5 kinds"),
        ({"limit_sets": {"odd": np.zeros((5, 2))}}, r"limit set 'odd' has shape \(5, 2\)"),
    ],
)
def test_parts_that_do_not_fit_together_are_refused(puma, change, message):
    with pytest.raises(RobotError, match=message):
        replace(puma, **change)


def test_limits_by_name_array_and_mapping(puma):
    named = puma.with_limits("set-3")
    np.testing.assert_array_equal(named.upper, np.radians([10, 75, 90, 170, 90, 90]))
    table = np.column_stack([np.arange(6) - 7.0, np.arange(6)])
    by_array = puma.with_limits(table.tolist())
    np.testing.assert_array_equal(by_array.lower, table[:, 0])
    np.testing.assert_array_equal(by_array.upper, table[:, 1])
    some = named.with_limits({"joint2": (-0.5, 9.0)})
    np.testing.assert_array_equal(np.delete(some.lower, 1), np.delete(named.lower, 1))
    assert (some.lower[1], some.upper[1]) == (-0.5, 9.0)  # unwrapped: 9 rad is a limit like any
    np.testing.assert_array_equal(puma.upper, [np.pi] * 6)  # the first robot is unchanged


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        ("set-9", "no limit set 'set-9'; it has: set-1, set-2, set-3, set-4"),
        ({"joint7": (0, 1)}, "no free joint 'joint7'.*free joints are: joint1, joint2"),
        ({"joint1": 1.0, "typo": (0, 1)}, "(?s)'joint1' must be a pair.*no free joint 'typo'"),
        ({"joint1": ("a", "b")}, "limits of joint 'joint1' must be an array of numbers"),
        ({"joint1": (1.0, -1.0)}, "joint 'joint1' has limits 1 .. -1"),
        (np.zeros((5, 2)), r"must have shape \(6, 2\), one \(lower, upper\) for each of joint1"),
        ([[0, 1], [0]], "must be an array of numbers"),
        (np.full((6, 2), np.nan), "holds NaN"),
    ],
)
def test_limits_that_make_no_sense_are_refused(puma, limits, message):
    with pytest.raises(RobotError, match=message):
        puma.with_limits(limits)


def test_thousands_of_wrong_joints_stay_readable(monkeypatch):
    """And names that come close are looked up for a few of them, for that takes a while each."""
    asked = []

    def looked_up(name, *rest, **options):
        asked.append(name)
        return []

    monkeypatch.setattr("robots.joint_selection.close_matches", looked_up)
    many = {f"elbow{k}": (0.0, 1.0) for k in range(5000)}
    held = dict.fromkeys(many, 0.0)
    for wrong in ({"limits": many}, {"limits": many, "tool_frame": "l9"}, {"lock": held}):
        asked.clear()
        with pytest.raises(RobotError) as caught:
            load_robot("puma560", **wrong)
        assert len(caught.value.faults) >= 5000
        assert len(str(caught.value)) < 6000
        assert len(asked) < 50


def test_a_robot_without_limit_sets_says_so():
    with pytest.raises(RobotError, match="'ur5': there is no limit set 'set-1'; it has: none"):
        load_robot("ur5", limits="set-1")


@pytest.mark.parametrize("name", UNLIKE)
def test_pickle_round_trip(name):
    robot = unlike(name)
    data = pickle.dumps(robot)
    assert len(data) < 200_000
    copy = pickle.loads(data)
    for name in ("name", "tool_frame", "joint_names", "joint_kinds", "urdf", "package_dirs"):
        assert getattr(copy, name) == getattr(robot, name)
    for name in ("approach_axis", "lower", "upper", "max_velocity"):
        np.testing.assert_array_equal(getattr(copy, name), getattr(robot, name))
    assert copy.locked == robot.locked
    assert copy.limit_sets.keys() == robot.limit_sets.keys()
    q = random_q(robot, np.random.default_rng(0))
    for value, expected in zip(Kinematics(copy).tool(q), Kinematics(robot).tool(q), strict=True):
        np.testing.assert_array_equal(value, expected)


def furthest(robot, samples, seed=0):
    """Largest distance of the tool point from the first joint's origin over random samples."""
    tool, rng = Kinematics(robot).tool, np.random.default_rng(seed)
    origin = robot.model.jointPlacements[1].translation
    return max(np.linalg.norm(tool(random_q(robot, rng))[0] - origin) for _ in range(samples))


@pytest.mark.parametrize("name", UNLIKE)
def test_no_configuration_reaches_further_than_reach(name):
    robot = unlike(name)
    found = furthest(robot, samples=1000)
    assert found <= robot.reach
    assert robot.reach < 1.6 * found


@pytest.mark.parametrize("seed", range(40))
def test_reach_bounds_random_chains(seed, tmp_path):
    robot = load_text(tmp_path, random_arm(np.random.default_rng(200 + seed)))
    assert furthest(robot, samples=500) <= robot.reach + 1e-12


def test_reach_of_the_puma_is_exact(puma):
    # Upper arm and forearm in line, seen from the side; the offset d3 stands across.
    assert puma.reach == pytest.approx(np.hypot(0.7 + np.hypot(0.1, 0.7), 0.1), abs=1e-9)
    point, _ = Kinematics(puma).tool([0, 0, np.arctan2(0.1, 0.7) - np.pi / 2, 0, 0, 0])
    assert np.linalg.norm(point) == pytest.approx(puma.reach, abs=1e-9)


def test_reach_follows_the_limits_of_slides(tmp_path):
    slide = joint(2, "prismatic", xyz=(1, 0, 0), axis=(1, 0, 0), limits=(-5.0, 0.5))
    robot = load_text(tmp_path, arm([joint(1, xyz=(0, 0, 7)), slide]))
    assert robot.reach == pytest.approx(4.0)  # drawn back by 5 m
    assert robot.with_limits({"j2": (-1, 0.5)}).reach == pytest.approx(1.5)
    assert robot.with_limits({"j2": (0, np.inf)}).reach == np.inf


def test_reach_of_many_slides_in_a_row_is_still_a_bound(tmp_path):
    joints = [
        joint(i, "prismatic", xyz=(0.1, 0, 0), axis=(1, i % 3, 0), limits=(0.0, 0.1))
        for i in range(1, 14)
    ]
    robot = load_text(tmp_path, arm(joints))
    point, _ = Kinematics(robot).tool(robot.upper)
    assert np.linalg.norm(point - [0.1, 0, 0]) <= robot.reach < 3.0


def test_repr_says_which_arm_it_is(puma):
    assert repr(puma) == "Robot('puma560', 6 joints, tool 'link6')"


def test_notes_come_from_the_urdf_and_survive_pickling():
    kinova = load_robot("kinova")
    assert len(kinova.notes) == 3
    assert all("continuous" in note for note in kinova.notes)
    assert pickle.loads(pickle.dumps(kinova)).notes == kinova.notes
    assert load_robot("puma560").notes == ()


def test_a_tool_is_shown_without_the_noise_of_rounding():
    off = ([0.1, -1e-28, 0.2], [0, 0, 0])
    assert "tool 'tool0' + (0.1, 0, 0.2) m" in repr(load_robot("ur5", tcp=off))
