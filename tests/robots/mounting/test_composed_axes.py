"""Axes that are composed with an arm: the same as a URDF that has them."""

import pickle
import re

import numpy as np
import pytest
from arm_urdfs import arm, joint, load_text
from two_trees import Tree, cell_text, random_values, write

from robots import Axis, Kinematics, RobotError, load_robot
from robots.shapes import link_shapes

RAIL = Axis(
    "rail", "prismatic", (1, 0, 0), limits=(-1.0, 1.5), position=(0, -1, 0.3),
    rpy_deg=tuple(np.degrees([0, 0.1, 0.2])), max_velocity=0.7,
)  # fmt: skip
TILT = Axis(
    "tilt", "revolute", (0, 1, 0.1), limits=(-1.0, 1.2), position=(0.7, 0, 0.4),
    rpy_deg=tuple(np.degrees([0.2, 0, 0])), carries="surface", max_velocity=1.1,
)  # fmt: skip
TURN = Axis("turn", "revolute", (0, 0, -1), position=(0, 0, 0.2), carries="surface", max_velocity=2)
BASE = ((0, 0, 0.1), (0, 0, np.degrees(1.0)))


@pytest.fixture(scope="module")
def composed():
    return load_robot("ur5", axes=[RAIL, TILT, TURN], base=BASE)


def test_a_composed_cell_is_the_cell_that_one_urdf_describes(composed, tmp_path):
    path = write(tmp_path, cell_text())
    whole = load_robot(path, tool_frame="tool0", surface_link="turntable")
    assert composed.joint_names == whole.joint_names
    assert composed.surface_link == "turn"
    for key in ("lower", "upper"):
        np.testing.assert_allclose(getattr(composed, key), getattr(whole, key))
    np.testing.assert_allclose(composed.max_velocity[:3], whole.max_velocity[:3])
    tree, q = Tree(path), random_values(composed, np.random.default_rng(0))
    values = dict(zip(composed.joint_names, q, strict=True))
    point, _ = Kinematics(composed).tool(q)
    np.testing.assert_allclose(
        point, tree.relative("turntable", "tool0", values)[:3, 3], atol=1e-12
    )


def test_two_axes_that_carry_the_base_stand_on_one_another():
    lift = Axis("lift", "prismatic", limits=(0, 1), position=(0, 0, 0.2))
    robot = load_robot("puma560", limits="set-1", axes=[RAIL, lift])
    assert robot.joint_names[:2] == ("rail", "lift")
    assert robot.joint_names[2:] == load_robot("puma560").joint_names
    np.testing.assert_array_equal(robot.upper[:3], [1.5, 1.0, robot.limit_sets["set-1"][2, 1]])
    assert robot.surface_link is None
    zero, up = np.zeros(8), np.zeros(8)
    up[1] = 0.4
    tool = Kinematics(robot).tool
    along = tool(up)[0] - tool(zero)[0]  # the lift stands on the rail, which is turned
    turned = np.array([np.cos(0.2) * np.sin(0.1), np.sin(0.2) * np.sin(0.1), np.cos(0.1)])
    np.testing.assert_allclose(along, 0.4 * turned, atol=1e-12)


def test_the_arm_keeps_its_shapes_names_and_pickles(composed):
    alone, again = link_shapes(load_robot("ur5")), link_shapes(pickle.loads(pickle.dumps(composed)))
    assert [solid.owner for solid in again.solids] == [solid.owner for solid in alone.solids]
    moved = {solid.owner: solid.joint for solid in again.solids}
    names = composed.joint_names
    assert moved["base_link"] == names.index("rail") + 1
    assert moved["wrist_3_link"] == len(names)
    np.testing.assert_allclose(composed.base[:3, 3], base_by_hand(), atol=1e-12)


def base_by_hand():
    from scipy.spatial.transform import Rotation

    turned = Rotation.from_euler("xyz", [0, 0.1, 0.2]).as_matrix()
    return turned @ [0, 0, 0.1] + [0, -1, 0.3]


def test_an_axis_can_be_locked_and_limited():
    robot = load_robot("ur5", axes=[RAIL, TURN], lock={"turn": 0.5}, limits={"rail": (0.0, 0.2)})
    assert robot.joint_names[0] == "rail"
    assert robot.n == 7
    assert (robot.lower[0], robot.upper[0]) == (0.0, 0.2)
    assert robot.locked["turn"] == 0.5


def test_an_arm_with_one_leaf_needs_no_tool_frame_beside_a_table(tmp_path):
    robot = load_text(tmp_path, arm([joint(1), joint(2)]), axes=[TURN])
    assert robot.tool_frame == "l2"
    assert robot.joint_names == ("turn", "j1", "j2")


def test_names_of_the_urdf_are_left_alone(tmp_path):
    text = arm([joint(1), joint(2)]).replace('"l0"', '"world"').replace('"j1"', '"mount"')
    robot = load_text(tmp_path, text, axes=[Axis("rail", "prismatic", limits=(0, 1))])
    assert robot.joint_names == ("rail", "mount", "j2")
    assert {"world", "world 2", "rail"} <= set(robot.link_names)
    assert robot.root_link == "world"


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"kind": "screw"}, "type must be 'revolute' or 'prismatic'"),
        ({"name": " "}, "name must be a word"),
        ({"limits": None}, "limits is missing; it must be a pair"),
        ({"limits": (2, 1)}, "limits must be a pair .* wrong way round"),
        ({"limits": None, "limits_deg": (0, 1)}, "limits_deg is for an axis that turns"),
        ({"axis": (0, 0, 0)}, "axis must be three finite numbers that are not all zero"),
        ({"position": (0, 0)}, "position must be three finite numbers"),
        ({"carries": "tool"}, "carries must be 'base' or 'surface'"),
        ({"max_velocity": 0.0}, r"max_velocity must be a finite number > 0 \(m/s\)"),
    ],
)
def test_axes_that_make_no_sense(wrong, message):
    good = {"name": "rail", "kind": "prismatic", "axis": (1, 0, 0), "limits": (0, 1)}
    assert Axis(**good).axis == (1.0, 0.0, 0.0)
    with pytest.raises(RobotError, match=message):
        Axis(**{**good, **wrong})


@pytest.mark.parametrize(
    ("axes", "message"),
    [
        ([RAIL, RAIL], "two axes are called 'rail'"),
        ([Axis("elbow_joint", "revolute")], "'elbow_joint' is the name of a joint already"),
        ([Axis("tool0", "revolute")], "'tool0' is the name of a link already"),
        ([Axis("universe", "revolute")], "'universe' is Pinocchio's"),
        ([Axis(f"a{k}", "revolute") for k in range(21)], "got 21 axes; at most 20"),
        ("rail", "axes must be a list of Axis"),
    ],
)
def test_axes_that_do_not_fit_the_arm(axes, message):
    with pytest.raises(RobotError, match=re.escape(message)):
        load_robot("ur5", axes=axes)
