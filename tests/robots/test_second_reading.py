"""A second reader of the same files: yourdfpy places the tool where Pinocchio does."""

import numpy as np
import pytest
import yourdfpy

from robots import Kinematics, load_robot

NAMES = ("puma560", "ur5", "panda", "kinova", "xarm7", "z1", "tiago", "baxter_left")


@pytest.mark.parametrize("name", NAMES)
def test_yourdfpy_places_the_tool_alike(name):
    robot = load_robot(name)
    other = yourdfpy.URDF.load(robot.urdf, load_meshes=False, build_scene_graph=True)
    held = {joint: value for joint, value in robot.locked.items() if joint in other.joint_map}
    kinematics = Kinematics(robot)
    rng = np.random.default_rng(5)
    low, high = np.maximum(robot.lower, -3.0), np.minimum(robot.upper, 3.0)
    for _ in range(20):
        q = rng.uniform(low, high)
        other.update_cfg(held | dict(zip(robot.joint_names, q.tolist(), strict=True)))
        placement = other.get_transform(robot.tool_frame, other.base_link)
        point, axis = kinematics.tool(q)
        np.testing.assert_allclose(placement[:3, 3], point, atol=1e-9)
        np.testing.assert_allclose(placement[:3, :3] @ robot.approach_axis, axis, atol=1e-9)
