"""What an arm stands on, carries, and works on: tcp, base, axes, and the link with the surface."""

import math
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import referee
from approved import refused
from arm_urdfs import arm, joint, load_text, random_arm, random_q
from scipy.spatial.transform import Rotation

from coverable import Axis, as_yourdfpy, list_robots, load_robot
from robots.kinematics import Kinematics
from robots.poses import about_fixed_axes
from robots.shapes.links import link_shapes
from robots.urdf.checked_urdf import check_urdf

POSE = ((0.03, -0.02, 0.12), (20.0, -30.0, 75.0))
STAND = ((0.4, -0.3, 0.8), (5.0, 10.0, 90.0))
CLOSE = {"rtol": 0, "atol": 1e-12}


def matrix(pose):
    return referee.placement(pose[0], np.radians(pose[1]))


def tool_placement(robot, q):
    """(4, 4) the TCP where the robot's model has it."""
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, Kinematics(robot).configuration(q))
    return pin.updateFramePlacement(robot.model, data, robot.tool_frame_id).homogeneous.copy()


def test_roll_pitch_and_yaw_are_scipys_to_the_last_bit():
    rng = np.random.default_rng(0)
    right = np.array([0.0, 0.5 * math.pi, -0.5 * math.pi, math.pi, -math.pi])
    for rpy in [*rng.uniform(-7.0, 7.0, (200, 3)), *rng.choice(right, (50, 3))]:
        expected = Rotation.from_euler("xyz", rpy).as_matrix()
        np.testing.assert_array_equal(about_fixed_axes(*rpy.tolist()), expected)


@pytest.mark.parametrize("given", [POSE, matrix(POSE), pin.SE3(matrix(POSE))])
def test_a_pose_is_a_pair_or_a_matrix(given):
    robot = load_robot("ur5", tcp=given, base=given)
    for placed in (robot.tcp, robot.base, pickle.loads(pickle.dumps(robot)).tcp):
        np.testing.assert_allclose(placed, matrix(POSE), atol=1e-15)
    assert repr(robot) == "Robot('ur5', 6 joints, tool 'tool0' + (0.03, -0.02, 0.12) m)"


@pytest.mark.parametrize("seed", range(4))
def test_tcp_and_base_are_where_they_are_said_to_be(seed, tmp_path):
    """In the model and in the chain; and a TCP by a fixed joint of the file is the same."""
    rng = np.random.default_rng(seed)
    text = random_arm(rng)
    plain, moved = load_text(tmp_path, text), load_text(tmp_path, text, tcp=POSE, base=STAND)
    for _ in range(10):
        q = random_q(plain, rng)
        expected = matrix(STAND) @ tool_placement(plain, q) @ matrix(POSE)
        np.testing.assert_allclose(tool_placement(moved, q), expected, atol=1e-11)
    xyz, rpy = (" ".join(map(repr, map(float, x))) for x in (POSE[0], np.radians(POSE[1])))
    end = (f'<link name="tip"/><joint name="to tip" type="fixed">'
           f'<parent link="{moved.tool_frame}"/><child link="tip"/>'
           f'<origin xyz="{xyz}" rpy="{rpy}"/></joint></robot>')  # fmt: skip
    given = load_text(tmp_path, text, tcp=POSE)
    joined = load_text(tmp_path, text.replace("</robot>", end), tool_frame="tip")
    for one, other in zip(given.chain, joined.chain, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-14)
    assert np.isclose(given.reach, joined.reach)


@pytest.mark.parametrize(("approach", "reference", "expected"), [
    ((-2, 0, 0), None, (0, 0, 1)), ((1, 1e-7, 0), None, (0, 0, 1)),
    ((1, 0, 1), None, (np.sqrt(0.5), 0, -np.sqrt(0.5))), ((0, 0, 1), (0, 3e200, 5e200), (0, 1, 0)),
])  # fmt: skip
def test_the_reference_axis_is_across_the_approach_axis(approach, reference, expected):
    robot = load_robot("ur5", approach_axis=np.array(approach), reference_axis=reference)
    np.testing.assert_allclose(robot.reference_axis, expected, atol=2e-7)
    assert abs(robot.reference_axis @ robot.approach_axis) < 1e-15
    assert np.isclose(np.linalg.norm(robot.reference_axis), 1.0, atol=1e-15)


FIXED = '<joint name="{0}" type="fixed"><parent link="{1}"/><child link="{2}"/>{3}</joint>'
MOVING = (
    '<joint name="{0}" type="{1}"><parent link="{2}"/><child link="{3}"/>{4}'
    '<axis xyz="{5}"/><limit lower="{6}" upper="{7}" effort="1" velocity="{8}"/></joint>'
)


def origin(xyz: str, rpy: str = "0 0 0") -> str:
    return f'<origin xyz="{xyz}" rpy="{rpy}"/>'


def cell_text() -> str:
    """A UR5 on a rail, beside a table that turns on one that tilts."""
    path = next(info.urdf for info in list_robots() if info.name == "ur5")
    text = Path(path).read_text("utf-8").rsplit("</robot>", 1)[0]
    links = ("hall", "carriage", "cradle", "turntable", "jig")
    more = [f'<link name="{name}"/>' for name in links]
    more += [
        MOVING.format(
            "rail", "prismatic", "hall", "carriage", origin("0 -1 0.3", "0 0.1 0.2"), "1 0 0",
            -1.0, 1.5, 0.7,
        ),
        FIXED.format("on rail", "carriage", check_urdf(path).root, origin("0 0 0.1", "0 0 1")),
        MOVING.format(
            "tilt", "revolute", "hall", "cradle", origin("0.7 0 0.4", "0.2 0 0"), "0 1 0.1",
            -1.0, 1.2, 1.1,
        ),
        MOVING.format(
            "turn", "continuous", "cradle", "turntable", origin("0 0 0.2"), "0 0 -1", 0, 0, 2.0
        ),
        FIXED.format("clamped", "turntable", "jig", origin("0.1 0 0.05", "0.3 0.2 0.1")),
    ]  # fmt: skip
    return text + "\n".join(more) + "</robot>"


ARM = ("shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint",
       "wrist_2_joint", "wrist_3_joint")  # fmt: skip
CHAINS = {
    "two axes": ("jig", "tool0", ("turn", "tilt", "rail", *ARM)),
    "tilt": ("cradle", "tool0", ("tilt", "rail", *ARM)),
    "in the hall": ("hall", "tool0", ("rail", *ARM)),
    "middle of the arm": ("upper_arm_link", "tool0", ARM[2:]),
    "held part": ("tool0", "hall", (*ARM[::-1], "rail")),
    "held part, tool on the table": ("tool0", "jig", (*ARM[::-1], "rail", "tilt", "turn")),
}


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    path = tmp_path_factory.mktemp("cell") / "cell.urdf"
    path.write_text(cell_text(), encoding="utf-8")
    return str(path)


@pytest.fixture(scope="module")
def tree(cell):
    """tree(link, tool, values): (4, 4) the frame of one link in that of another, by the referee."""

    joints = referee.joints_of(cell)

    def relative(link, tool, values):
        frames = referee.Arm(joints, tool, [], values).frames(np.zeros((1, 0)))
        return np.linalg.inv(frames[link][0]) @ frames[tool][0]

    return relative


@pytest.mark.parametrize("name", CHAINS)
def test_chain_links_and_reach_are_those_of_the_tree(name, cell, tree):
    link, tool, joints = CHAINS[name]
    robot = load_robot(cell, tool_frame=tool, surface_link=link)
    assert robot.joint_names == joints
    joints_there = referee.joints_of(cell)
    assert set(robot.link_names) == {joint.child for joint in joints_there} | {"hall"}
    kinematics, data = Kinematics(robot), robot.model.createData()
    rng = np.random.default_rng(7)
    points = []
    for k in range(30):
        q = random_q(robot, rng)
        values = {**robot.locked, **dict(zip(joints, q, strict=True))}
        points.append(kinematics.tool(q)[0])
        np.testing.assert_allclose(points[-1], tree(link, tool, values)[:3, 3], **CLOSE)
        pin.framesForwardKinematics(robot.model, data, kinematics.configuration(q))
        for frame, place in zip(robot.model.frames, data.oMf, strict=True) if k < 5 else ():
            if frame.type == pin.FrameType.BODY:
                np.testing.assert_allclose(
                    place.homogeneous, tree(link, frame.name, values), **CLOSE
                )
        world = data.oMf[robot.world_frame_id].homogeneous
        np.testing.assert_allclose(world, tree(link, "hall", values), **CLOSE)
    assert robot.chain is not None  # compares itself with Pinocchio
    assert (robot.distance_from_base(np.array(points)) <= robot.reach + 1e-12).all()


@pytest.mark.parametrize(("link", "tool"), [("jig", "tool0"), ("tool0", "jig"), ("hall", "tool0")])
def test_held_joints_stand_where_they_are_held(link, tool, cell, tree):
    held = {"rail": 0.4, "tilt": -0.5, "elbow_joint": 0.7}
    robot = load_robot(cell, tool_frame=tool, surface_link=link, lock=held)
    assert not set(held) & set(robot.joint_names)
    q = random_q(robot, np.random.default_rng(3))
    values = {**robot.locked, **dict(zip(robot.joint_names, q, strict=True))}
    np.testing.assert_allclose(
        Kinematics(robot).tool(q)[0], tree(link, tool, values)[:3, 3], **CLOSE
    )
    assert {name: robot.locked[name] for name in held} == held


def test_limits_velocities_tcp_and_base_stay_with_their_joints(cell, tree):
    pose = {"tcp": ((0.01, 0.02, 0.1), (10, 20, 30)), "base": ((1, 2, 3), (20, 0, 45))}
    plain = load_robot(cell, tool_frame="tool0", **pose)
    robot = load_robot(cell, tool_frame="tool0", surface_link="jig", start=np.linspace(0, 0.8, 9),
                       **pose)  # fmt: skip
    order = [robot.joint_names.index(joint) for joint in plain.joint_names]
    for part in ("lower", "upper", "max_velocity", "joint_kinds"):
        np.testing.assert_array_equal(np.array(getattr(robot, part))[order], getattr(plain, part))
    turn, tilt = (robot.joint_names.index(joint) for joint in ("turn", "tilt"))
    assert (robot.lower[tilt], robot.upper[tilt], robot.upper[turn]) == (-1.0, 1.2, np.inf)
    assert (robot.max_velocity[turn], robot.max_velocity[tilt]) == (2.0, 1.1)
    np.testing.assert_allclose(robot.tcp, plain.tcp, atol=1e-14)
    np.testing.assert_allclose(robot.base, plain.base, atol=1e-14)
    q = random_q(robot, np.random.default_rng(0))
    values = dict(zip(robot.joint_names, q, strict=True))
    expected = tree("jig", "tool0", values) @ [*plain.tcp[:3, 3], 1.0]
    np.testing.assert_allclose(Kinematics(robot).tool(q)[0], expected[:3], atol=1e-12)
    again = pickle.loads(pickle.dumps(robot))
    assert again.surface_link == "jig"
    np.testing.assert_array_equal(again.start, robot.start)


def test_a_joint_that_moves_both_is_held_and_a_note_says_so(cell):
    asked = {"tool_frame": "tool0", "surface_link": "upper_arm_link"}
    robot = load_robot(cell, **asked)
    held = [note for note in robot.notes if "moves both" in note]
    assert [note.split("'")[1] for note in held] == ["rail", *ARM[:2]]
    assert "held at 0 m" in held[0]
    assert "held at 0 rad" in held[1]
    asked_for = load_robot(cell, **asked, lock={"rail": 0.2})
    assert not [note for note in asked_for.notes if "'rail'" in note]


RAIL = Axis("rail", "prismatic", (1, 0, 0), limits=(-1.0, 1.5), position=(0, -1, 0.3),
            rpy_deg=tuple(np.degrees([0, 0.1, 0.2])), max_velocity=0.7)  # fmt: skip
TILT = Axis("tilt", "revolute", (0, 1, 0.1), limits=(-1.0, 1.2), position=(0.7, 0, 0.4),
            rpy_deg=(np.degrees(0.2), 0, 0), carries="surface", max_velocity=1.1)  # fmt: skip
TURN = Axis("turn", "revolute", (0, 0, -1), position=(0, 0, 0.2), carries="surface", max_velocity=2)


def test_a_composed_cell_is_the_cell_that_one_urdf_describes(cell, tree):
    base = ((0, 0, 0.1), (0, 0, np.degrees(1.0)))
    composed = load_robot("ur5", axes=[RAIL, TILT, TURN], base=base)
    whole = load_robot(cell, tool_frame="tool0", surface_link="turntable")
    assert (composed.joint_names, composed.surface_link) == (whole.joint_names, "turn")
    for part in ("lower", "upper"):
        np.testing.assert_allclose(getattr(composed, part), getattr(whole, part))
    np.testing.assert_allclose(composed.max_velocity[:3], whole.max_velocity[:3])
    q = random_q(composed, np.random.default_rng(0))
    values = dict(zip(composed.joint_names, q, strict=True))
    expected = tree("turntable", "tool0", values)[:3, 3]
    np.testing.assert_allclose(Kinematics(composed).tool(q)[0], expected, atol=1e-12)
    other = as_yourdfpy(composed, q, meshes=False).get_transform("tool0", "turn")
    np.testing.assert_allclose(other[:3, 3], expected, atol=1e-9)
    rail = Rotation.from_euler("xyz", [0, 0.1, 0.2]).as_matrix()
    np.testing.assert_allclose(composed.base[:3, 3], rail @ [0, 0, 0.1] + [0, -1, 0.3], atol=1e-12)
    # The arm keeps its shapes and names.
    again = link_shapes(pickle.loads(pickle.dumps(composed)))
    alone = link_shapes(load_robot("ur5"))
    assert [solid.owner for solid in again.solids] == [solid.owner for solid in alone.solids]
    moved = {solid.owner: solid.joint for solid in again.solids}
    assert moved["base_link"] == composed.joint_names.index("rail") + 1
    assert moved["wrist_3_link"] == composed.n


def test_two_axes_that_carry_the_base_stand_on_one_another():
    lift = Axis("lift", "prismatic", limits=(0, 1), position=(0, 0, 0.2))
    robot = load_robot("puma560", limits="set-1", axes=[RAIL, lift])
    assert robot.joint_names == ("rail", "lift", *load_robot("puma560").joint_names)
    np.testing.assert_array_equal(robot.upper[:3], [1.5, 1.0, robot.limit_sets["set-1"][2, 1]])
    assert robot.surface_link is None
    zero, up = np.zeros((2, 8))
    up[1] = 0.4
    tool = Kinematics(robot).tool
    turned = np.array([np.cos(0.2) * np.sin(0.1), np.sin(0.2) * np.sin(0.1), np.cos(0.1)])
    np.testing.assert_allclose(tool(up)[0] - tool(zero)[0], 0.4 * turned, atol=1e-12)


def test_axes_are_locked_and_limited_and_leave_names_alone(tmp_path):
    robot = load_robot("ur5", axes=[RAIL, TURN], lock={"turn": 0.5}, limits={"rail": (0.0, 0.2)})
    assert (robot.joint_names[0], robot.n, robot.locked["turn"]) == ("rail", 7, 0.5)
    assert (robot.lower[0], robot.upper[0]) == (0.0, 0.2)
    robot = load_text(tmp_path, arm([joint(1), joint(2)]), axes=[TURN])
    assert (robot.tool_frame, robot.joint_names) == ("l2", ("turn", "j1", "j2"))
    text = arm([joint(1), joint(2)]).replace('"l0"', '"world"').replace('"j1"', '"mount"')
    robot = load_text(tmp_path, text, axes=[Axis("rail", "prismatic", limits=(0, 1))])
    assert robot.joint_names == ("rail", "mount", "j2")
    assert {"world", "world 2", "rail"} <= set(robot.link_names)
    assert robot.root_link == "world"


def test_what_makes_no_sense(approved, cell):
    good = {"name": "rail", "kind": "prismatic", "axis": (1, 0, 0), "limits": (0, 1)}
    assert Axis(**good).axis == (1.0, 0.0, 0.0)
    lines = [f"axis {wrong}: {refused(Axis, **{**good, **wrong})}" for wrong in (
        {"kind": "screw"}, {"name": " "}, {"limits": None}, {"limits": (2, 1)},
        {"limits": None, "limits_deg": (0, 1)}, {"axis": (0, 0, 0)}, {"position": (0, 0)},
        {"carries": "tool"}, {"max_velocity": 0.0},
    )]  # fmt: skip
    many = [Axis(f"a{k}", "revolute") for k in range(21)]
    lines += [f"axes {name}: {refused(load_robot, 'ur5', axes=axes)}" for name, axes in {
        "twice": [RAIL, RAIL], "a joint": [Axis("elbow_joint", "revolute")],
        "a link": [Axis("tool0", "revolute")],
        "many": many, "a word": "rail",
    }.items()]  # fmt: skip
    lines += [f"{name}: {refused(load_robot, 'ur5', **asked)}" for name, asked in {
        "kilometres": {"tcp": ((0, 0, 1e4), (0, 0, 0))},
        "NaN": {"tcp": ((0, 0, np.nan), (0, 0, 0))},
        "a letter": {"tcp": ((0, 0, 0), "z")}, "mirror": {"tcp": np.diag([1, 1, -1, 1])},
        "infinite": {"tcp": np.diag([np.inf, 1, 1, 1])}, "a word": {"base": "floor"},
        "parallel": {"reference_axis": (0, 0, -2)}, "none": {"reference_axis": (0, 0, 0)},
        "all": {"tcp": 7, "base": ((0, 0, 2e4), (0, 0, 0)), "reference_axis": (0, 0, 0)},
    }.items()]  # fmt: skip
    lines += [
        f"{asked}: " + refused(load_robot, cell, **{"tool_frame": "tool0", **asked}) for asked in (
            {"surface_link": "jib"}, {"surface_link": "tool0"}, {"surface_link": "ee_link"},
            {"surface_link": "hall", "tool_frame": "hall"},
            {"surface_link": "jig", "tool_frame": "cradle", "lock": {"turn": 1.0}},
        )
    ]  # fmt: skip
    lines.append("alike: " + refused(replace, load_robot("ur5"), reference_axis=(0, 0, 1)))
    text = "\n".join(lines).replace(cell, "CELL").replace(load_robot("ur5").urdf, "UR5")
    approved("bad_mounting", text)
