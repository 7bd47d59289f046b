"""Frames in the picture, and a world that stands still while the part moves."""

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from feasibility import Task
from feasibility.collisions import Collision, Obstacle
from feasibility.viewer.frames import carried, root_in_world
from feasibility.viewer.frames.standing_world import GROUP
from feasibility.viewer.playback import paced
from feasibility.viewer.robot import joint_paths
from feasibility.viewer.threejs import numbers_of
from feasibility.viewer.viewer import compose
from robots import Axis, Kinematics, load_robot
from surfaces import plane

TURN = (-180, 180)
TABLE = Axis("table", "revolute", limits_deg=TURN, carries="surface", position=(0.6, 0.1, 0.2))
NOZZLE = ((0.02, 0, 0.12), (0, 30, 0))
SHELF = Obstacle.box("shelf", (0.4, 0.3, 0.02), position=(0.5, -0.2, 0.9))


@pytest.fixture(scope="module")
def robot():
    return load_robot("ur5", tcp=NOZZLE, base=((0, 0, 0.3), (0, 0, 90)), axes=[TABLE])


@pytest.fixture(scope="module")
def drawn(robot):
    walk = np.linspace(np.zeros(7), [2.0, 0.4, -0.6, 0.9, 0.1, 0.3, 0.2], 12)
    cells = plane((-0.2, 0.2), (-0.1, 0.1)).cells(2, 2)
    task = Task(0.05, 30, collision=Collision(scene=(SHELF,)))
    motion = paced(robot, walk, False, "a motion")
    return compose(robot, cells, "", "", [], motion, resting=walk[0], play=False, task=task)


def place_of(view, path):
    """(4, 4) where the commands leave the group at a path, with those that it stands in."""
    places = {
        command["path"]: np.reshape(command["matrix"], (4, 4)).T
        for command in view.commands
        if command["type"] == "set_transform"
    }
    place, names = np.eye(4), path.strip("/").split("/")
    for k in range(len(names)):
        place = place @ places.get("/" + "/".join(names[: k + 1]), np.eye(4))
    return place


def object_at(view, end):
    """The path of the one object whose path ends so, and its points (k, 3) in the world."""
    (found,) = [
        command
        for command in view.commands
        if command["type"] == "set_object" and command["path"].endswith(end)
    ]
    data = found["object"]["geometries"][0]["data"]["attributes"]["position"]
    points = numbers_of(data).reshape(-1, 3)
    place = place_of(view, found["path"])
    return found["path"], points @ place[:3, :3].T + place[:3, 3]


def test_the_frames_are_where_they_are(robot, drawn):
    q = np.zeros(7)
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, Kinematics(robot).configuration(q))
    world = data.oMf[robot.world_frame_id]
    for name, number in (
        ("TCP", robot.tool_frame_id),
        ("base", robot.model.getFrameId(robot.root_link, pin.FrameType.BODY)),
        ("surface frame", robot.model.getFrameId("table", pin.FrameType.BODY)),
    ):
        expected = world.actInv(data.oMf[number])
        _, points = object_at(drawn, f"/frame of the {name}")
        np.testing.assert_allclose(points[0], expected.translation, atol=4e-5)
        axes = (points[1::2] - points[0]) / np.linalg.norm(points[1::2] - points[0], axis=1)[
            :, None
        ]
        np.testing.assert_allclose(axes.T, expected.rotation, atol=2e-3)
    path, points = object_at(drawn, "/root frame")
    assert path == "/root frame"  # of the world: it does not move with the surface
    np.testing.assert_allclose(points[0], 0.0, atol=1e-9)


def test_the_shelf_stands_where_it_is_in_the_world(drawn):
    path, points = object_at(drawn, "shelf/body")
    assert path.startswith(GROUP)
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    np.testing.assert_allclose(middle, (0.5, -0.2, 0.9), atol=1e-4)


def test_the_world_stands_still_while_the_motion_plays(robot, drawn):
    (played,) = [c for c in drawn.commands if c["type"] == "set_animation"]
    tracks = {}
    for one in played["animations"]:
        (keys,) = one["clip"]["tracks"]
        if keys["type"] == "bool":
            continue
        values = np.frombuffer(keys["values"].data, "<f4").astype(float)
        times = np.frombuffer(keys["times"].data, "<f4")
        tracks[one["path"], keys["name"]] = values.reshape(len(times), -1)
    turns = Rotation.from_quat(tracks[GROUP, ".quaternion"]).as_matrix()
    table = GROUP + joint_paths(robot)[1]
    spin = Rotation.from_quat(tracks[table, ".quaternion"]).as_matrix()
    # What the table's joint carries, seen from the table, is the world.
    still = turns @ spin
    np.testing.assert_allclose(still, np.broadcast_to(still[0], still.shape), atol=1e-5)
    assert np.ptp(turns, axis=0).max() > 0.5


def test_an_arm_over_a_part_at_rest_is_drawn_as_ever():
    ur5 = load_robot("ur5")
    np.testing.assert_array_equal(root_in_world(ur5, np.ones((2, 6))), [np.eye(4)] * 2)
    assert carried(ur5, [{"path": "/a"}], [], np.zeros(6)) == ([{"path": "/a"}], [])
