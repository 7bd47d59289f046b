"""The arm in a view moves like Pinocchio's, the world stands still, its server lets nobody in."""

import socket
import sys
import urllib.error
import urllib.request
from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import pinocchio as pin
import pytest
from page_outline import points_of, tracks_of
from referee import unit
from scipy.spatial.transform import Rotation

import coverable
from coverable import Axis, Collision, Obstacle, check, load_case, load_robot, plane, view
from feasibility.viewer import playback as motion
from feasibility.viewer.live_server import LiveView
from feasibility.viewer.obstacles import LINE
from feasibility.viewer.robot_visuals import joint_paths
from feasibility.viewer.stage import GROUP
from feasibility.viewer.viewer import compose, show
from robots.kinematics import Kinematics

GUARD_S = 1800.0


@pytest.fixture(scope="module")
def verdict():
    return check(*load_case("paper/4a", ["surface.cells=[4, 5]"]).build())


@pytest.fixture(scope="module")
def drawn(verdict):
    return view(verdict, "paper/4a")


def placed(commands):
    """Path -> (4, 4) where a command leaves the group there."""
    return {c["path"]: np.reshape(c["matrix"], (4, 4)).T
            for c in commands if c["type"] == "set_transform"}  # fmt: skip


def place_of(commands, path):
    places, place, names = placed(commands), np.eye(4), path.strip("/").split("/")
    for k in range(len(names)):
        place = place @ places.get("/" + "/".join(names[: k + 1]), np.eye(4))
    return place


def object_at(commands, end):
    """The path of the one object whose path ends so, and its points in the world."""
    (found,) = [c for c in commands if c["type"] == "set_object" and c["path"].endswith(end)]
    place = place_of(commands, found["path"])
    return found["path"], points_of(found) @ place[:3, :3].T + place[:3, 3]


@pytest.mark.parametrize("name", ["puma", "rail"])
def test_key_frames_place_every_joint_where_pinocchio_does(drawn, name):
    commands, robot, played = drawn.commands, drawn.robot, drawn.motion
    if name == "rail":  # a slide before joints that turn
        rail = Axis("rail", "prismatic", (1, 0, 0), limits=(-2.0, 4.0))
        robot = load_robot("ur5", axes=[rail])
        walk = np.linspace(np.zeros(7), [1.5, 2.0, 0.4, -0.6, 0.9, 0.1, 0.3], 9)
        played = motion.paced(robot, walk, False, "test")
        cells = plane((0, 0.2), (0, 0.2)).cells(2, 2)
        commands = compose(robot, cells, "", "", [], played, resting=walk[0]).commands
    tracks, rest = tracks_of(commands), placed(commands)
    data, paths = robot.model.createData(), joint_paths(robot)[1:]
    turns = {path: keys for (path, kind), keys in tracks.items() if kind == ".quaternion"}
    for times, values in turns.values():
        rows = values.reshape(-1, 4)
        assert len(times) <= 400
        assert ((rows[1:] * rows[:-1]).sum(axis=1) > 0).all(), "no jump of sign"
    for k, time in enumerate(times):
        pin.forwardKinematics(
            robot.model, data, Kinematics(robot).configuration(played.at(np.array([time]))[0])
        )
        place = np.eye(4)
        for joint, path in enumerate(paths):
            step = rest[path].copy()
            if (path, ".quaternion") in tracks:
                quaternion = tracks[path, ".quaternion"][1].reshape(-1, 4)[k]
                step[:3, :3] = Rotation.from_quat(quaternion).as_matrix()
            if (path, ".position") in tracks:
                step[:3, 3] = tracks[path, ".position"][1].reshape(-1, 3)[k]
            place = place @ step
            assert np.allclose(place, data.oMi[joint + 1].homogeneous, atol=2e-5)


def test_the_readout_is_what_pinocchio_says(verdict, drawn):
    shown, robot, surface = drawn.readout, verdict.robot, verdict.cells.surface
    assert [row[:2] for row in shown.rows[6:]] == [("distance", "mm"), ("angle", "deg")]
    columns, data = np.array([row[2] for row in shown.rows]), robot.model.createData()
    for k in range(0, len(shown.times), 7):
        q = drawn.motion.at(np.array([shown.times[k]]))[0]
        assert np.allclose(columns[:6, k], np.degrees(q), atol=0.06)
        pin.framesForwardKinematics(robot.model, data, q)
        tool = data.oMf[robot.tool_frame_id]
        away = tool.translation - surface.position
        distance = 1.0 - np.linalg.norm(away)  # inside a dome of 1 m
        angle = np.degrees(np.arccos(tool.rotation @ robot.approach_axis @ away / (1 - distance)))
        assert np.allclose(columns[6:, k], [1e3 * distance, angle], atol=0.1)


@pytest.fixture(scope="module")
def table():
    """An arm whose part stands on a turning table, with a shelf of the world: arm, view."""
    axis = Axis("table", "revolute", limits_deg=(-180, 180), carries="surface",
                position=(0.6, 0.1, 0.2))  # fmt: skip
    nozzle = ((0.02, 0, 0.12), (0, 30, 0))
    robot = load_robot("ur5", tcp=nozzle, base=((0, 0, 0.3), (0, 0, 90)), axes=[axis])
    walk = np.linspace(np.zeros(7), [2.0, 0.4, -0.6, 0.9, 0.1, 0.3, 0.2], 12)
    shelf = Obstacle.box("shelf", (0.4, 0.3, 0.02), position=(0.5, -0.2, 0.9))
    played = motion.paced(robot, walk, False, "a motion")
    cells = plane((-0.2, 0.2), (-0.1, 0.1)).cells(2, 2)
    task = coverable.Task(0.05, 30, collision=Collision(scene=(shelf,)))
    drawn = compose(robot, cells, "", "", [], played, resting=walk[0], play=False, task=task)
    return robot, drawn.commands


def test_the_frames_are_where_they_are(table):
    robot, commands = table
    data = robot.model.createData()
    zero = Kinematics(robot).configuration(np.zeros(7))
    pin.framesForwardKinematics(robot.model, data, zero)
    for name, number in (
        ("TCP", robot.tool_frame_id),
        ("base", robot.model.getFrameId(robot.root_link, pin.FrameType.BODY)),
        ("surface frame", robot.model.getFrameId("table", pin.FrameType.BODY)),
    ):
        expected = data.oMf[robot.world_frame_id].actInv(data.oMf[number])
        _, points = object_at(commands, f"/frame of the {name}")
        np.testing.assert_allclose(points[0], expected.translation, atol=4e-5)
        axes = unit(points[1::2] - points[0])
        np.testing.assert_allclose(axes.T, expected.rotation, atol=2e-3)
    path, points = object_at(commands, "/root frame")
    assert path == "/root frame"  # of the world: it does not move with the surface
    np.testing.assert_allclose(points[0], 0.0, atol=1e-9)


def test_the_world_stands_still_while_the_motion_plays(table):
    robot, commands = table
    path, points = object_at(commands, "shelf/body")
    assert path.startswith(GROUP)
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    np.testing.assert_allclose(middle, (0.5, -0.2, 0.9), atol=1e-4)
    tracks = tracks_of(commands)

    def turns(where):
        return Rotation.from_quat(tracks[where, ".quaternion"][1].reshape(-1, 4)).as_matrix()

    world = turns(GROUP)
    still = world @ turns(GROUP + joint_paths(robot)[1])  # seen from what the table carries
    np.testing.assert_allclose(still, np.broadcast_to(still[0], still.shape), atol=1e-5)
    assert np.ptp(world, axis=0).max() > 0.5


def test_bodies_move_with_the_arm_and_the_nearest_pair_has_its_distance(verdict):
    scene = (Obstacle.box("shelf", (0.4, 0.3, 0.02), (0.3, -0.6, 0.5), (0.0, 0.0, 30.0)),
             *(Obstacle.capsule(f"pin {k}", 0.05, 0.4, (k, 9, 9)) for k in range(8)),
             Obstacle.sphere("held", 0.01, frame="link6"))  # fmt: skip
    ball = coverable.ToolShape.sphere(0.01, (0.0, 0.0, -0.02))
    asked = Collision(surface=False, scene=scene, tool=(ball,))
    drawn = view(replace(verdict, task=replace(verdict.task, collision=asked)), play=False, at=0.5)
    commands, places = drawn.commands, placed(drawn.commands)
    _, shelf = object_at(commands, "shelf/body")
    _, pin = object_at(commands, "pin 4/body")
    ends = np.add([4, 9, 9], np.outer([-1, 1], [0.05, 0.05, 0.25]))
    np.testing.assert_allclose([pin.min(axis=0), pin.max(axis=0)], ends, atol=1e-4)
    entries = {one.label: one.path for one in drawn.legend.entries}
    assert entries["scene (9 objects)"] == "/scene"
    assert entries["held"].startswith("/robot/")  # /scene does not hide it
    own = (shelf - scene[0].placement[:3, 3]) @ scene[0].placement[:3, :3]
    np.testing.assert_allclose(np.abs(own), np.tile([0.2, 0.15, 0.01], (len(own), 1)), atol=2e-5)
    joints = [path for path in places if path.startswith("/robot")]
    assert len(joints) == 6
    for path in joints:
        np.testing.assert_array_equal(places[path], places[path.replace("/robot", "/hulls", 1)])
    *_, (name, unit, values) = drawn.readout.rows
    assert (name, unit, len(values)) == ("clearance", "mm", len(drawn.readout.times))
    times = np.array(drawn.readout.times)
    (shown,) = [c["path"] for c in commands if c.get("property") == "visible" and c["value"]
                and "/nearest pair/" in c["path"]]  # fmt: skip
    frame = int(np.searchsorted(times, drawn.start, side="right")) - 1
    assert shown.endswith(drawn.readout.nearest[frame])
    first, second = (places[f"{shown}/{end}"][:3, 3] for end in ("first", "second"))
    line, image = places[f"{shown}/line"], drawn.image()
    assert (np.abs(image - LINE).max(axis=2) < 0.02).sum() > 5, "seen through all before it"
    np.testing.assert_allclose(line @ [0.0, 0.0, 0.0, 1.0], [*first, 1.0], atol=1e-9)
    np.testing.assert_allclose(line @ [0.0, 0.0, 1.0, 1.0], [*second, 1.0], atol=1e-9)
    between = np.interp(drawn.start, times, values)
    assert 1e3 * np.linalg.norm(second - first) == pytest.approx(between, abs=5.0)
    for (path, kind), (_, visible) in tracks_of(commands).items():
        if kind == ".visible":
            assert visible == [path.endswith(f" {name}") for name in drawn.readout.nearest]


def test_a_browser_that_goes_away_is_no_fault(capfd):
    with LiveView("page" * 1_000_000) as live:
        with socket.create_connection(("127.0.0.1", live.port), timeout=GUARD_S) as browser:
            browser.sendall(f"GET {live.url} HTTP/1.1\r\n".encode())
        with socket.create_connection(("127.0.0.1", live.port), timeout=GUARD_S) as browser:
            path, host = live.url.split(str(live.port))[1], f"127.0.0.1:{live.port}"
            browser.sendall(f"GET {path} HTTP/1.1\r\nHost: {host}\r\n\r\n".encode())
            assert browser.recv(15) == b"HTTP/1.1 200 OK"
        with urllib.request.urlopen(live.url, timeout=GUARD_S) as answer:
            assert len(answer.read()) == 4_000_000
    assert capfd.readouterr().err == ""


def test_show_opens_a_window_waits_in_scripts_and_is_the_view_in_notebooks(verdict, monkeypatch):
    opened = []
    monkeypatch.setattr("webbrowser.open", lambda url: opened.append(url) or True)
    with show(verdict, block=False), urllib.request.urlopen(opened[0], timeout=GUARD_S) as answer:
        assert answer.read().decode() == view(verdict).html()
    monkeypatch.setattr(LiveView, "wait", Mock(side_effect=KeyboardInterrupt))
    monkeypatch.delattr(sys, "ps1", raising=False)
    live = show(verdict)
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", live.port), timeout=GUARD_S)

    class IPython:
        get_ipython = staticmethod(lambda: type("Shell", (), {"kernel": object()}))

    monkeypatch.setitem(sys.modules, "IPython", IPython)
    monkeypatch.setattr("webbrowser.open", pytest.fail)
    shown = show(verdict)
    monkeypatch.delitem(sys.modules, "IPython")  # matplotlib would ask it more
    assert "<iframe srcdoc=" in shown._repr_mimebundle_()["text/html"]
