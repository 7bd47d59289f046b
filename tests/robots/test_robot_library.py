"""Robots by name and by file: every listed one, which link is the tool, what is held."""

import random
from importlib.metadata import distribution

import numpy as np
import pinocchio as pin
import pytest
from approved import refused
from arm_urdfs import arm, joint, load_text, random_q
from samples import sampled, seeds

from coverable import RobotError, list_robots, load_robot
from robots.kinematics import Kinematics
from robots.urdf.checked_urdf import check_urdf

ROBOTS = {info.name: info for info in list_robots()}
USUAL = ("tcp", "tool0", "flange", "ee_link")


@pytest.fixture(scope="module", params=ROBOTS)
def robot(request):
    return load_robot(request.param)


def test_the_arms_that_are_promised_are_there_and_every_urdf_of_their_families():
    promised = """puma560 ur3 ur5 ur5_limited ur5_gripper ur10 ur10_limited panda kinova xarm7 z1
        talos_arm so100 so101 baxter_left baxter_right tiago tiago_dual_left tiago_dual_right
        tiago_no_hand tiago_pro_left tiago_pro_right"""
    assert set(promised.split()) <= ROBOTS.keys()
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
    limits = zip(robot.joint_names, robot.joint_kinds, robot.lower, robot.upper, strict=True)
    for name, kind, low, high in limits:
        assert (kind, low, high) == (joints[name].kind, joints[name].lower, joints[name].upper)
        assert np.isfinite([low, high]).all() == (kind != "continuous")
        assert low < high
    speeds = [joints[name].max_velocity for name in robot.joint_names]
    np.testing.assert_array_equal(robot.max_velocity, speeds)
    for name, value in robot.locked.items():
        if joints[name].lower is not None:
            assert joints[name].lower <= value <= joints[name].upper


def test_joints_stand_where_pinocchios_reader_has_them_to_the_last_bit():
    """On that bit depends what a search finds where it finds neither a motion nor a proof."""
    robot = load_robot("ur5")
    mine, theirs = robot.model, pin.buildModelFromUrdf(str(robot.urdf))
    for name in robot.joint_names:
        one, other = (m.jointPlacements[m.getJointId(name)].homogeneous for m in (mine, theirs))
        np.testing.assert_array_equal(one, other)


def test_tools_point_away_from_the_arm(robot):
    """From the origin of the last joint whose origin is not the tool point itself; and if the last
    joint turns about a line through the tool, on that line."""
    model, data = robot.model, robot.model.createData()
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    tool = data.oMf[robot.tool_frame_id]
    approach = tool.rotation @ robot.approach_axis
    offsets = [tool.translation - data.oMi[i].translation for i in range(robot.n, 0, -1)]
    outwards = next(offset for offset in offsets if np.linalg.norm(offset) > 1e-6)
    along = approach @ outwards / np.linalg.norm(outwards)
    assert along > 0.75
    if along < 0.9:  # an offset wrist: then the roll axis decides
        last_axis = pin.computeJointJacobians(model, data, pin.neutral(model))[3:, -1]
        assert abs(approach @ last_axis) > 0.999


def tree(edges):
    names = dict.fromkeys(name for parent, child, _ in edges for name in (parent, child))
    links = "".join(f'<link name="{name}"/>' for name in names)
    joints = "".join(
        f'<joint name="to_{child}" type="{"revolute" if turns else "fixed"}">'
        f'<parent link="{parent}"/><child link="{child}"/><origin xyz="0 0 0.1"/>'
        '<axis xyz="0 1 0"/><limit lower="-1" upper="1"/></joint>'
        for parent, child, turns in edges
    )
    return f'<robot name="arm">{links}{joints}</robot>'


def random_tree(rng):
    count = rng.randint(3, 10)
    names = [f"l{k}" for k in range(count)]
    for name in rng.sample(USUAL, rng.randint(0, 2)):
        names[rng.randrange(1, count)] = name
    parents = [names[rng.randrange(max(0, k - 3), k)] for k in range(1, count)]
    return [(p, c, rng.random() < 0.5) for p, c in zip(parents, names[1:], strict=True)]


@sampled("seed", seeds(60, all=600))
def test_any_tree(tmp_path, seed):
    """By the definition, link by link."""
    edges = random_tree(random.Random(seed))
    above = {child: (parent, turns) for parent, child, turns in edges}

    def moves(link):
        while link in above:
            link, turns = above[link]
            if turns:
                return True
        return False

    leaves = [child for child in above if child not in {parent for parent, _, _ in edges}]
    known = [name for name in USUAL if name in above and moves(name)]
    moving = [leaf for leaf in leaves if moves(leaf)]
    expected = known[0] if known else moving[0] if len(moving) == 1 else None
    expected = leaves[0] if len(leaves) == 1 else expected
    if not any(turns for _, _, turns in edges):
        return
    if expected is None or not moves(expected):
        words = "tool_frame must name one" if expected is None else "no free joint lies between"
        with pytest.raises(RobotError, match=words):
            load_text(tmp_path, tree(edges))
    else:
        assert load_text(tmp_path, tree(edges)).tool_frame == expected


def test_any_link_can_be_the_tool_and_the_chain_ends_there(tmp_path):
    elbow = load_robot("panda", tool_frame="panda_link4")
    assert elbow.joint_names == tuple(f"panda_joint{i}" for i in range(1, 5))
    # Zero is outside the limits of joint4; held, it has to stand inside.
    assert load_robot("panda", tool_frame="panda_link3").locked["panda_joint4"] == -0.0698
    fork = ('<link name="side"/><joint name="js" type="fixed"><parent link="l1"/>'
            '<child link="side"/></joint>')  # fmt: skip
    text = arm([joint(1), joint(2)], fork)
    assert load_text(tmp_path, text, tool_frame="side").joint_names == ("j1",)
    flange = load_robot("ur5")
    ee_link = load_robot("ur5", tool_frame="ee_link", approach_axis=(1, 0, 0))
    q = np.random.default_rng(0).uniform(-3, 3, 6)
    np.testing.assert_allclose(Kinematics(ee_link).tool(q), Kinematics(flange).tool(q), atol=1e-11)


def test_limits_can_be_given_for_joints_that_have_none(tmp_path):
    text = arm([joint(1, "continuous", extra='<limit lower="-1" upper="1"/>'), joint(2)])
    free = load_text(tmp_path, text)
    assert (free.lower[0], free.upper[0]) == (-np.inf, np.inf)
    np.testing.assert_array_equal(free.max_velocity, [np.nan, 1.0])
    stopped = load_text(tmp_path, text, limits={"j1": (-7.0, 8.0)})
    assert (stopped.lower[0], stopped.upper[0]) == (-7.0, 8.0)
    assert stopped.joint_kinds == ("continuous", "revolute")
    text = arm([joint(1), joint(2).replace("<limit", "<nothing")])
    for limits in ({}, {"limits": {"j1": (-1, 2)}}):
        with pytest.raises(RobotError, match="'j2' is revolute and has no <limit>"):
            load_text(tmp_path, text, **limits)
    assert load_text(tmp_path, text, limits={"j2": (-1, 2)}).upper[1] == 2
    assert load_text(tmp_path, text, limits=[[-1, 1], [-2, 2]]).upper[1] == 2
    assert load_text(tmp_path, text, lock={"j2": 40.0}).locked == {"j2": 40.0}
    robot = load_robot("puma560", lock={"joint4": 0.5}, limits="set-2")  # of the free joints
    assert robot.joint_names == ("joint1", "joint2", "joint3", "joint5", "joint6")
    np.testing.assert_array_equal(robot.upper, np.radians([170, 75, 175, 90, 90]))


def test_a_locked_joint_stays_where_it_is_put():
    whole, held = load_robot("kinova"), load_robot("kinova", lock={"j2s6s200_joint_4": 2.5})
    assert (held.locked, held.n) == ({"j2s6s200_joint_4": 2.5}, 5)  # a continuous joint
    q = random_q(whole, np.random.default_rng(0))
    q[3] = 2.5
    found, expected = Kinematics(held).tool(np.delete(q, 3)), Kinematics(whole).tool(q)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)
    low, high = (load_robot("tiago_no_hand", lock=lock)
                 for lock in ({}, {"torso_lift_joint": 0.3}))  # fmt: skip
    assert (low.locked["torso_lift_joint"], high.locked["torso_lift_joint"]) == (0.0, 0.3)
    up = Kinematics(high).tool(np.zeros(7))[0] - Kinematics(low).tool(np.zeros(7))[0]
    np.testing.assert_allclose(up, [0, 0, 0.3], atol=1e-12)
    fewer = load_robot("tiago_no_hand", lock={"arm_1_joint": 1.0})  # and the library's own
    assert (fewer.n, fewer.locked["torso_lift_joint"]) == (6, 0.0)


def test_followers_are_held_with_what_they_mimic(tmp_path):
    for lock, second in (({}, 0.04), ({"panda_finger_joint2": 0.01}, 0.01)):
        hand = load_robot("panda", lock={"panda_finger_joint1": 0.04, **lock})
        assert hand.locked == {"panda_finger_joint1": 0.04, "panda_finger_joint2": second}
    mimic = '<mimic joint="j1" multiplier="2" offset="0.1"/>'
    text = arm([joint(1), joint(2, extra=mimic), joint(3, xyz=(1, 0, 0))])
    with pytest.raises(RobotError, match="'j2' on the chain to 'l3' mimics 'j1'; lock one"):
        load_text(tmp_path, text)
    assert load_text(tmp_path, text, lock={"j2": 0.5}).joint_names == ("j1", "j3")
    held = load_text(tmp_path, text, lock={"j1": 0.5})
    assert (held.locked, held.joint_names) == ({"j1": 0.5, "j2": pytest.approx(1.1)}, ("j3",))
    follow = '<mimic joint="j{}" multiplier="-1"/>'
    text = arm([joint(1), *(joint(i, extra=follow.format(i - 1)) for i in (2, 3)), joint(4)])
    held = load_text(tmp_path, text, lock={"j1": 0.25})
    assert (held.locked, held.joint_names) == ({"j1": 0.25, "j2": -0.25, "j3": 0.25}, ("j4",))
    with pytest.raises(RobotError, match=r"(?s)'j2' .* mimics 'j1'.*'j3' .* mimics 'j2'"):
        load_text(tmp_path, text)


@pytest.mark.parametrize(("renamed", "clash"), [
    ("j1", "l0"), ("j1", "l1"), ("j2", "l2"), ("j3", "l2"), ("j3", "l4")])  # fmt: skip
def test_a_joint_may_have_the_name_of_a_link(renamed, clash, tmp_path):
    joints = [joint(1), joint(2, "fixed", xyz=(1, 0, 0)), joint(3, xyz=(1, 0, 0)), joint(4)]
    plain = load_text(tmp_path, arm(joints))
    expected = Kinematics(plain).tool([0.3, 0.4, -0.2])
    text = arm(joints).replace(f'"{renamed}"', f'"{clash}"')
    robot = load_text(tmp_path, text)
    assert robot.joint_names == tuple(clash if n == renamed else n for n in plain.joint_names)
    held = load_text(tmp_path, text, lock={robot.joint_names[1]: 0.4})
    for other, q in ((robot, [0.3, 0.4, -0.2]), (held, [0.3, -0.2])):
        np.testing.assert_allclose(Kinematics(other).tool(q), expected, atol=1e-15)


def test_what_is_refused_by_name_frame_and_lock(approved, tmp_path):
    asked = [(name, {}) for name in ("ur6", "qqqqqqq", "", "nowhere/arm.urdf", "arm.URDF")]
    asked += [("panda", {"lock": lock}) for lock in (
        {"panda_joint9": 0.0}, {"panda_joint8": 0.0}, {"panda_joint4": 0.0},
        {"panda_finger_joint1": 1.0}, {"panda_joint1": np.nan}, {"panda_joint1": "up"},
        {"panda_joint1": True}, {"a": 0.0, "panda_joint1": 9.0},
        {f"panda_joint{i}": -0.07 * (i == 4) for i in range(1, 8)},
    )]  # fmt: skip
    lines = [f"{name} {options}: {refused(load_robot, name, **options)}" for name, options in asked]
    turning = [("base_link", "upper", True), ("upper", "wrist", True)]
    forked = tree([*turning, ("upper", "side", False), ("wrist", "end", False)])
    for options in ({}, {"tool_frame": "sid"}, {"tool_frame": "base_link"}):
        lines.append(f"fork {options}: {refused(load_text, tmp_path, forked, **options)}")
    approved("bad_loads", "\n".join(lines).replace(load_robot("panda").urdf, "PANDA"))


def test_a_file_is_a_robot_named_after_it_with_its_path_kept_absolute(tmp_path, monkeypatch):
    robot = load_text(tmp_path, arm([joint(1)]))
    monkeypatch.chdir(tmp_path)
    path = str(tmp_path / "test_arm.urdf")
    for found in (robot, load_robot(path), load_robot("test_arm.urdf", package_dirs=tmp_path)):
        assert (found.name, found.joint_names) == ("test_arm", ("j1",))
        assert found.urdf == path
    assert found.package_dirs == (str(tmp_path),)
