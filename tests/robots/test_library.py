"""Robots by name and by file: every listed one, tool frames, locks, and what is refused."""

import subprocess
import sys
from importlib.metadata import distribution

import numpy as np
import pinocchio as pin
import pytest
from arm_urdfs import arm, joint, load_text, random_q

import robots.urdf
from robots import Kinematics, RobotError, list_robots, load_robot
from robots.urdf import check_urdf

ROBOTS = {info.name: info for info in list_robots()}


@pytest.fixture(scope="module", params=ROBOTS)
def robot(request):
    return load_robot(request.param)


# Every listed robot


def test_the_arms_that_are_promised_are_there():
    promised = """puma560 ur3 ur5 ur5_limited ur5_gripper ur10 ur10_limited panda kinova xarm7 z1
        talos_arm so100 so101 baxter_left baxter_right tiago tiago_dual_left tiago_dual_right
        tiago_no_hand tiago_pro_left tiago_pro_right"""
    assert set(promised.split()) <= ROBOTS.keys()


def test_every_urdf_of_the_arm_families_is_listed():
    families = ("ur_", "panda_", "kinova_", "xarm_", "z1_", "so_arm_", "baxter_", "tiago_")
    listed = {info.urdf.rsplit("/", 1)[1] for info in ROBOTS.values()}
    packed = {
        file.name
        for file in distribution("example-robot-data").files
        if file.suffix == ".urdf" and file.parts[4].startswith(families)
    }
    assert packed - listed == {"ur3.urdf"}  # a file without links


def test_joints_and_limits_are_the_urdfs_and_held_joints_are_inside_theirs(robot):
    joints = {info.name: info for info in check_urdf(robot.urdf, robot.package_dirs).joints}
    moving = {name for name, info in joints.items() if info.moves}
    assert set(robot.joint_names) | robot.locked.keys() == moving
    assert not set(robot.joint_names) & robot.locked.keys()
    for name, kind, low, high in zip(
        robot.joint_names, robot.joint_kinds, robot.lower, robot.upper, strict=True
    ):
        assert (kind, low, high) == (joints[name].kind, joints[name].lower, joints[name].upper)
        assert np.isfinite([low, high]).all() == (kind != "continuous")
        assert low < high
    speeds = [joints[name].max_velocity for name in robot.joint_names]
    np.testing.assert_array_equal(robot.max_velocity, speeds)
    for name, value in robot.locked.items():
        if joints[name].lower is not None:
            assert joints[name].lower <= value <= joints[name].upper


def test_tools_point_away_from_the_arm(robot):
    """The approach axis leads outwards, from the last joint's side to where a tool would go.

    Outwards is the direction from the origin of the last joint whose origin is not the tool point
    itself; and if the last joint turns about a line through the tool, outwards lies on that line.
    """
    model, data = robot.model, robot.model.createData()
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    tool = data.oMf[robot.tool_frame_id]
    approach = tool.rotation @ robot.approach_axis
    offsets = [tool.translation - data.oMi[i].translation for i in range(robot.n, 0, -1)]
    outwards = next(offset for offset in offsets if np.linalg.norm(offset) > 1e-6)
    outwards /= np.linalg.norm(outwards)
    columns = pin.computeJointJacobians(model, data, pin.neutral(model))
    last_axis = columns[3:, -1]
    assert approach @ outwards > 0.75
    if approach @ outwards < 0.9:  # an offset wrist: then the roll axis decides
        assert abs(approach @ last_axis) > 0.999


def test_approach_axes_are_the_known_ones():
    axes = {name: info.approach_axis for name, info in ROBOTS.items()}
    assert axes["ur5"] == axes["panda"] == axes["xarm7"] == axes["puma560"] == (0, 0, 1)
    assert axes["kinova"] == axes["z1"] == axes["tiago"] == (1, 0, 0)
    assert axes["talos_arm"] == (0, 0, -1)


def test_dual_arms_are_mirror_images():
    for left, right in (("baxter_left", "baxter_right"), ("talos_left", "talos_right")):
        assert load_robot(left).reach == pytest.approx(load_robot(right).reach, rel=1e-3)


def test_holding_the_whole_body_leaves_arm_joints_only():
    for name, expected in {
        "tiago": [f"arm_{i}_joint" for i in range(1, 8)],
        "baxter_left": [f"left_{part}" for part in ("s0", "s1", "e0", "e1", "w0", "w1", "w2")],
        "panda": [f"panda_joint{i}" for i in range(1, 8)],
        "z1": [f"joint{i}" for i in range(1, 7)],
        "so100": ["shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll"],
    }.items():
        assert list(load_robot(name).joint_names) == expected


def test_listing_reads_no_urdf_and_loading_compiles_nothing():
    program = (
        "import sys; from robots import list_robots, load_robot; list_robots();"
        "early = {'pinocchio', 'numba', 'trimesh'} & set(sys.modules);"
        "load_robot('puma560').reach; late = {'numba', 'trimesh'} & set(sys.modules);"
        "sys.exit(f'imported {early | late}' if early | late else 0)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


def test_listing_checks_nothing(monkeypatch):
    def refuse(*args, **kwargs):
        raise AssertionError("listing read a URDF")

    monkeypatch.setattr(robots.urdf, "check_urdf", refuse)
    assert len(list_robots()) == len(ROBOTS)


# Tool frames, axes, limits


def test_any_link_can_be_the_tool_and_the_chain_ends_there():
    elbow = load_robot("panda", tool_frame="panda_link4")
    assert elbow.joint_names == tuple(f"panda_joint{i}" for i in range(1, 5))
    # Zero is outside the limits of joint4; held, it has to stand inside.
    upper = load_robot("panda", tool_frame="panda_link3")
    assert upper.locked["panda_joint4"] == -0.0698


def test_the_librarys_axis_goes_with_the_librarys_tool_frame():
    np.testing.assert_array_equal(load_robot("kinova").approach_axis, [1, 0, 0])
    other = load_robot("kinova", tool_frame="j2s6s200_link_6")
    np.testing.assert_array_equal(other.approach_axis, [0, 0, 1])
    asked = load_robot("kinova", approach_axis=(0, -2, 0))
    np.testing.assert_array_equal(asked.approach_axis, [0, -1, 0])


def test_both_tool_frames_of_a_ur_point_the_same_way():
    flange = load_robot("ur5")
    ee_link = load_robot("ur5", tool_frame="ee_link", approach_axis=(1, 0, 0))
    for q in np.random.default_rng(0).uniform(-3, 3, (20, 6)):
        for value, expected in zip(
            Kinematics(ee_link).tool(q), Kinematics(flange).tool(q), strict=True
        ):
            np.testing.assert_allclose(value, expected, rtol=0, atol=1e-11)


def test_the_only_leaf_is_the_tool_and_several_have_to_be_chosen_from(tmp_path):
    assert load_text(tmp_path, arm([joint(1), joint(2)])).tool_frame == "l2"
    fork = (
        '<link name="side"/><joint name="js" type="fixed"><parent link="l1"/>'
        '<child link="side"/></joint>'
    )
    text = arm([joint(1), joint(2)], fork)
    with pytest.raises(RobotError, match=r"has 2 leaf links, so tool_frame must name one: .*side"):
        load_text(tmp_path, text)
    assert load_text(tmp_path, text, tool_frame="side").joint_names == ("j1",)
    with pytest.raises(RobotError, match="has no link 'sid' for tool_frame; did you mean 'side'"):
        load_text(tmp_path, text, tool_frame="sid")
    with pytest.raises(RobotError, match="no free joint lies between the root link 'l0' and 'l0'"):
        load_text(tmp_path, text, tool_frame="l0")


def test_a_continuous_joint_turns_freely_until_it_is_given_limits(tmp_path):
    text = arm([joint(1, "continuous", extra='<limit lower="-1" upper="1"/>'), joint(2)])
    free = load_text(tmp_path, text)
    assert (free.lower[0], free.upper[0]) == (-np.inf, np.inf)
    stopped = load_text(tmp_path, text, limits={"j1": (-7.0, 8.0)})
    assert (stopped.lower[0], stopped.upper[0]) == (-7.0, 8.0)
    assert stopped.joint_kinds == ("continuous", "revolute")


def test_limits_can_be_given_for_a_joint_that_has_none(tmp_path):
    text = arm([joint(1), joint(2).replace("<limit", "<nothing")])
    with pytest.raises(RobotError, match="'j2' is revolute and has no <limit>"):
        load_text(tmp_path, text)
    assert load_text(tmp_path, text, limits={"j2": (-1, 2)}).upper[1] == 2
    assert load_text(tmp_path, text, limits=[[-1, 1], [-2, 2]]).upper[1] == 2
    assert load_text(tmp_path, text, lock={"j2": 40.0}).locked == {"j2": 40.0}
    with pytest.raises(RobotError, match="has no <limit>"):
        load_text(tmp_path, text, limits={"j1": (-1, 2)})


def test_velocity_limits_are_those_of_the_file(tmp_path):
    assert load_robot("ur5").max_velocity.tolist() == [3.15, 3.15, 3.15, 3.2, 3.2, 3.2]
    assert load_robot("panda").max_velocity.tolist() == [2.175] * 4 + [2.61] * 3
    text = arm([joint(1, "continuous"), joint(2)])
    np.testing.assert_array_equal(load_text(tmp_path, text).max_velocity, [np.nan, 1.0])


def test_limit_sets_follow_the_free_joints():
    robot = load_robot("puma560", lock={"joint4": 0.5}, limits="set-2")
    assert robot.joint_names == ("joint1", "joint2", "joint3", "joint5", "joint6")
    np.testing.assert_array_equal(robot.upper, np.radians([170, 75, 175, 90, 90]))


# Locked joints


def test_a_locked_joint_stays_where_it_is_put():
    whole, held = load_robot("kinova"), load_robot("kinova", lock={"j2s6s200_joint_4": 2.5})
    assert held.locked == {"j2s6s200_joint_4": 2.5}  # a continuous joint
    assert held.n == 5
    rng = np.random.default_rng(0)
    for _ in range(20):
        q = random_q(whole, rng)
        q[3] = 2.5
        for value, expected in zip(
            Kinematics(held).tool(np.delete(q, 3)), Kinematics(whole).tool(q), strict=True
        ):
            np.testing.assert_allclose(value, expected, rtol=0, atol=1e-12)


def test_own_locks_join_those_of_the_library_and_may_replace_their_values():
    low, high = (
        load_robot("tiago_no_hand"),
        load_robot("tiago_no_hand", lock={"torso_lift_joint": 0.3}),
    )
    assert (low.locked["torso_lift_joint"], high.locked["torso_lift_joint"]) == (0.0, 0.3)
    q = np.zeros(7)
    np.testing.assert_allclose(
        Kinematics(high).tool(q)[0] - Kinematics(low).tool(q)[0], [0, 0, 0.3], atol=1e-12
    )
    fewer = load_robot("tiago_no_hand", lock={"arm_1_joint": 1.0})
    assert fewer.n == 6
    assert fewer.locked["torso_lift_joint"] == 0.0


def test_fingers_follow_the_finger_they_mimic():
    open_hand = load_robot("panda", lock={"panda_finger_joint1": 0.04})
    assert open_hand.locked == {"panda_finger_joint1": 0.04, "panda_finger_joint2": 0.04}
    uneven = load_robot("panda", lock={"panda_finger_joint1": 0.04, "panda_finger_joint2": 0.01})
    assert uneven.locked["panda_finger_joint2"] == 0.01


@pytest.mark.parametrize(
    ("lock", "message"),
    [
        ({"panda_joint9": 0.0}, "'panda_joint9', which is no moving joint; did you mean"),
        ({"panda_joint8": 0.0}, "'panda_joint8', which is no moving joint"),  # it is fixed
        (
            {"panda_joint4": 0.0},
            r"'panda_joint4' at 0 rad, outside its limits -3.0718 \.\. -0.0698",
        ),
        ({"panda_finger_joint1": 1.0}, "at 1 m, outside its limits"),
        ({"panda_joint1": np.nan}, "must be a finite number .*got nan"),
        ({"panda_joint1": "up"}, "must be a finite number .*got 'up'"),
        ({"panda_joint1": True}, "must be a finite number .*got True"),
        ({"a": 0.0, "panda_joint1": 9.0}, "(?s)lock names 'a'.*lock holds joint 'panda_joint1'"),
        ({f"panda_joint{i}": -0.07 * (i == 4) for i in range(1, 8)}, "no free joint lies between"),
    ],
)
def test_locks_that_make_no_sense_are_refused(lock, message):
    with pytest.raises(RobotError, match=message):
        load_robot("panda", lock=lock)


def test_a_mimic_joint_on_the_chain_has_to_be_held(tmp_path):
    mimic = '<mimic joint="j1" multiplier="2" offset="0.1"/>'
    text = arm([joint(1), joint(2, extra=mimic), joint(3, xyz=(1, 0, 0))])
    with pytest.raises(RobotError, match="'j2' on the chain to 'l3' mimics 'j1'; lock one"):
        load_text(tmp_path, text)
    assert load_text(tmp_path, text, lock={"j2": 0.5}).joint_names == ("j1", "j3")
    held = load_text(tmp_path, text, lock={"j1": 0.5})
    # The leader is held, so its follower is: at 2 * 0.5 + 0.1.
    assert held.locked == {"j1": 0.5, "j2": pytest.approx(1.1)}
    assert held.joint_names == ("j3",)


def test_a_chain_of_mimic_joints_is_held_as_one(tmp_path):
    follow = '<mimic joint="j{}" multiplier="-1"/>'
    text = arm([joint(1), *(joint(i, extra=follow.format(i - 1)) for i in (2, 3)), joint(4)])
    held = load_text(tmp_path, text, lock={"j1": 0.25})
    assert held.locked == {"j1": 0.25, "j2": -0.25, "j3": 0.25}
    assert held.joint_names == ("j4",)
    with pytest.raises(RobotError, match=r"(?s)'j2' .* mimics 'j1'.*'j3' .* mimics 'j2'"):
        load_text(tmp_path, text)


@pytest.mark.parametrize(
    ("renamed", "clash"), [("j1", "l0"), ("j1", "l1"), ("j2", "l2"), ("j3", "l2"), ("j3", "l4")]
)
def test_a_joint_may_have_the_name_of_a_link(renamed, clash, tmp_path):
    joints = [joint(1), joint(2, "fixed", xyz=(1, 0, 0)), joint(3, xyz=(1, 0, 0)), joint(4)]
    text = arm(joints)
    plain = load_text(tmp_path, text)
    clashing = text.replace(f'"{renamed}"', f'"{clash}"')
    robot = load_text(tmp_path, clashing)
    assert robot.joint_names == tuple(clash if n == renamed else n for n in plain.joint_names)
    held = load_text(tmp_path, clashing, lock={robot.joint_names[1]: 0.4})
    for other, q in ((robot, [0.3, 0.4, -0.2]), (held, [0.3, -0.2])):
        for value, expected in zip(
            Kinematics(other).tool(q), Kinematics(plain).tool([0.3, 0.4, -0.2]), strict=True
        ):
            np.testing.assert_allclose(value, expected, atol=1e-15)


# Names and files


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("ur6", r"no robot 'ur6' in the library; did you mean 'ur5'.*`coverable robots` lists"),
        ("qqqqqqq", "no robot 'qqqqqqq' in the library; it has: puma560"),
        ("", "no robot '' in the library"),
        ("nowhere/arm.urdf", "arm.urdf"),
        ("arm.URDF", "arm.URDF"),
    ],
)
def test_unknown_robots_are_refused_with_what_would_do(name, message):
    with pytest.raises(RobotError, match=message):
        load_robot(name)


def test_a_file_is_a_robot_named_after_it(tmp_path):
    robot = load_text(tmp_path, arm([joint(1)]))
    assert robot.name == "test_arm"
    assert robot.urdf == str(tmp_path / "test_arm.urdf")
    assert load_robot(str(tmp_path / "test_arm.urdf")).joint_names == ("j1",)


def test_a_relative_path_is_kept_absolute(tmp_path, monkeypatch):
    load_text(tmp_path, arm([joint(1)]))
    monkeypatch.chdir(tmp_path)
    assert load_robot("test_arm.urdf").urdf == str(tmp_path / "test_arm.urdf")


def test_meshes_in_packages_need_their_folder(tmp_path):
    (tmp_path / "packages" / "my_arm").mkdir(parents=True)
    robot = load_text(tmp_path, arm([joint(1)]), package_dirs=(tmp_path / "packages",))
    assert robot.package_dirs == (str(tmp_path / "packages"),)
    single = load_text(tmp_path, arm([joint(1)]), package_dirs=str(tmp_path / "packages"))
    assert single.package_dirs == robot.package_dirs
    shipped = load_robot("panda", package_dirs=(tmp_path / "packages",))
    assert shipped.package_dirs[0] == str(tmp_path / "packages")
    assert len(shipped.package_dirs) == 2


def test_what_pinocchio_prints_is_in_the_error(capfd):
    from robots.pinocchio_model import parse

    with pytest.raises(RobotError, match=r"x\.urdf: Pinocchio refuses this URDF: .*\w+"):
        parse("<robot name='x'><link name='a'/><link name='b'/></robot>", "x.urdf")
    assert capfd.readouterr().err == ""
