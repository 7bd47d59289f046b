"""The chain between the surface's link and the tool, against the whole tree by Pinocchio."""

import pickle

import numpy as np
import pinocchio as pin
import pytest
from two_trees import Tree, cell_text, random_values, write

from robots import Kinematics, RobotError, load_robot

ARM = (
    "shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint",
    "wrist_3_joint",
)  # fmt: skip
ROUNDS = {"two axes": 1000, "in the hall": 1000, "held part": 1000}


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    return write(tmp_path_factory.mktemp("cell"), cell_text())


@pytest.fixture(scope="module")
def tree(cell):
    return Tree(cell)


CHAINS = {
    "two axes": ("jig", "tool0", ("turn", "tilt", "rail", *ARM)),
    "tilt": ("cradle", "tool0", ("tilt", "rail", *ARM)),
    "in the hall": ("hall", "tool0", ("rail", *ARM)),
    "middle of the arm": ("upper_arm_link", "tool0", ARM[2:]),
    "held part": ("tool0", "hall", (*ARM[::-1], "rail")),
    "held part, tool on the table": ("tool0", "jig", (*ARM[::-1], "rail", "tilt", "turn")),
}


@pytest.mark.parametrize("name", CHAINS)
def test_the_chain_is_where_the_tree_is(name, cell, tree):
    link, tool, joints = CHAINS[name]
    robot = load_robot(cell, tool_frame=tool, surface_link=link)
    assert robot.joint_names == joints
    kinematics, data = Kinematics(robot), robot.model.createData()
    rng = np.random.default_rng(7)
    for _ in range(ROUNDS.get(name, 100)):
        q = random_values(robot, rng)
        values = {**robot.locked, **dict(zip(joints, q, strict=True))}
        expected = tree.relative(link, tool, values)
        pin.computeJointJacobians(robot.model, data, kinematics.configuration(q))
        pin.framesForwardKinematics(robot.model, data, kinematics.configuration(q))
        found = data.oMf[robot.tool_frame_id].homogeneous
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)
        columns = pin.getFrameJacobian(
            robot.model, data, robot.tool_frame_id, pin.ReferenceFrame.LOCAL
        )
        wanted = tree.relative_jacobian(link, tool, values, joints)
        np.testing.assert_allclose(columns.reshape(6, -1), wanted, rtol=0, atol=1e-12)
    assert robot.chain is not None  # compares itself with Pinocchio


@pytest.mark.parametrize("name", CHAINS)
def test_every_link_and_the_world_are_where_the_tree_has_them(name, cell, tree):
    link, tool, joints = CHAINS[name]
    robot = load_robot(cell, tool_frame=tool, surface_link=link)
    assert set(robot.link_names) == {
        f.name for f in tree.model.frames if f.type == pin.FrameType.BODY
    }
    rng, data = np.random.default_rng(3), robot.model.createData()
    for _ in range(20):
        q = random_values(robot, rng)
        values = {**robot.locked, **dict(zip(joints, q, strict=True))}
        pin.framesForwardKinematics(robot.model, data, Kinematics(robot).configuration(q))
        for frame, place in zip(robot.model.frames, data.oMf, strict=True):
            if frame.type == pin.FrameType.BODY:
                expected = tree.relative(link, frame.name, values)
                np.testing.assert_allclose(place.homogeneous, expected, rtol=0, atol=1e-12)
        world = data.oMf[robot.world_frame_id].homogeneous
        np.testing.assert_allclose(world, tree.relative(link, "hall", values), rtol=0, atol=1e-12)


def test_limits_velocities_and_names_stay_with_their_joints(cell):
    plain = load_robot(cell, tool_frame="tool0")
    robot = load_robot(cell, tool_frame="tool0", surface_link="jig", start=np.linspace(0, 0.8, 9))
    for joint in plain.joint_names:
        one, other = plain.joint_names.index(joint), robot.joint_names.index(joint)
        assert plain.lower[one] == robot.lower[other]
        assert plain.upper[one] == robot.upper[other]
        assert plain.joint_kinds[one] == robot.joint_kinds[other]
        np.testing.assert_equal(plain.max_velocity[one], robot.max_velocity[other])
    turn, tilt = (robot.joint_names.index(joint) for joint in ("turn", "tilt"))
    assert (robot.lower[tilt], robot.upper[tilt]) == (-1.0, 1.2)
    assert np.isinf(robot.lower[turn])
    assert (robot.max_velocity[turn], robot.max_velocity[tilt]) == (2.0, 1.1)
    again = pickle.loads(pickle.dumps(robot))
    assert again.surface_link == "jig"
    np.testing.assert_array_equal(again.start, robot.start)
    assert repr(again) == "Robot('cell', 9 joints, tool 'tool0', seen from 'jig')"


def test_tcp_and_base_come_along(cell, tree):
    tcp, base = ((0.01, 0.02, 0.1), (10, 20, 30)), ((1, 2, 3), (20, 0, 45))
    robot = load_robot(cell, tool_frame="tool0", surface_link="jig", tcp=tcp, base=base)
    plain = load_robot(cell, tool_frame="tool0", tcp=tcp, base=base)
    np.testing.assert_allclose(robot.tcp, plain.tcp, atol=1e-14)
    np.testing.assert_allclose(robot.base, plain.base, atol=1e-14)
    q = random_values(robot, np.random.default_rng(0))
    values = dict(zip(robot.joint_names, q, strict=True))
    point, _ = Kinematics(robot).tool(q)
    expected = tree.relative("jig", "tool0", values) @ [*plain.tcp[:3, 3], 1.0]
    np.testing.assert_allclose(point, expected[:3], atol=1e-12)  # where the base is does not matter


def test_a_joint_that_moves_both_is_held_and_a_note_says_so(cell, tree):
    robot = load_robot(cell, tool_frame="tool0", surface_link="upper_arm_link")
    held = [note for note in robot.notes if "moves both" in note]
    assert [note.split("'")[1] for note in held] == ["rail", *ARM[:2]]
    assert "held at 0 m" in held[0]
    assert "held at 0 rad" in held[1]
    by_hand = load_robot(cell, tool_frame="tool0").relative_to("upper_arm_link")
    assert by_hand.joint_names == robot.joint_names
    assert [note for note in by_hand.notes if "moves both" in note] == held
    for one, other in zip(robot.chain, by_hand.chain, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-12)
    assert not [
        note
        for note in load_robot(
            cell, tool_frame="tool0", surface_link="upper_arm_link", lock={"rail": 0.2}
        ).notes
        if "'rail'" in note
    ]


def test_seen_from_two_links_in_turn(cell):
    robot = load_robot(cell, tool_frame="tool0", surface_link="jig")
    there = robot.relative_to("cradle")
    assert there.joint_names == ("tilt", "rail", *ARM)
    once = load_robot(cell, tool_frame="tool0", surface_link="cradle")
    for seed in range(5):
        q = random_values(there, np.random.default_rng(seed))
        for one, other in zip(Kinematics(there).tool(q), Kinematics(once).tool(q), strict=True):
            np.testing.assert_allclose(one, other, atol=1e-12)
    np.testing.assert_allclose(there.base, once.base, atol=1e-12)


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({"surface_link": "jib"}, r"has no link 'jib' that could carry .* did you mean 'jig'"),
        (
            {"surface_link": "tool0"},
            "'tool0' cannot carry .* it moves with the tool, 'tool0'",
        ),
        ({"surface_link": "ee_link"}, "it moves with the tool"),
        ({"surface_link": "hall", "tool_frame": "hall"}, "neither it nor the tool, 'hall', is mo"),
        (
            {"surface_link": "jig", "tool_frame": "cradle", "lock": {"turn": 1.0}},
            "every joint between it and the tool is held: turn; lock fewer",
        ),
    ],
)
def test_links_that_cannot_carry_the_surface(asked, message, cell):
    with pytest.raises(RobotError, match=message):
        load_robot(cell, **{"tool_frame": "tool0", **asked})


def test_seeing_from_a_link_that_is_not_there_or_does_not_move(cell):
    robot = load_robot(cell, tool_frame="tool0")
    with pytest.raises(RobotError, match=r"there is no link 'jib'; did you mean 'jig'"):
        robot.relative_to("jib")
    with pytest.raises(RobotError, match=r"no free joint lies .* load_robot\(..., surface_link="):
        robot.relative_to("ee_link")


def test_the_reach_holds_whatever_carries_the_surface(cell):
    rng = np.random.default_rng(5)
    for link, tool, _ in CHAINS.values():
        robot = load_robot(cell, tool_frame=tool, surface_link=link)
        q = np.array([random_values(robot, rng) for _ in range(300)])
        points, _ = Kinematics(robot).tools(q)
        assert (robot.distance_from_base(points) <= robot.reach + 1e-12).all()


def test_a_locked_table_takes_no_reach(cell):
    ur5 = load_robot("ur5").reach
    table = {"turn": (0.7, 0.7), "tilt": (0.3, 0.3), "rail": (0.5, 0.5)}
    robot = load_robot(cell, tool_frame="tool0", surface_link="jig", limits=table)
    assert np.isclose(robot.reach, ur5)
    q = np.array([random_values(robot, np.random.default_rng(k)) for k in range(200)])
    points, _ = Kinematics(robot).tools(q)
    assert (robot.distance_from_base(points) <= robot.reach + 1e-12).all()
