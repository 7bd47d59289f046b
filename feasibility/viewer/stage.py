"""Ground, frames and camera; a world that stands still where a link carries the surface.

Search and drawing take the surface's link for the root frame. So all that is drawn in it goes into
one group of the scene tree, and the group is moved as the root frame moves in the world.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from coverable.arrays import Array
from feasibility.viewer import robot_visuals, threejs
from feasibility.viewer.html_page import Camera, Entry
from feasibility.viewer.meshes import tubes
from feasibility.viewer.robot_visuals import SKELETON, joint_paths
from feasibility.viewer.threejs import Command
from robots.kinematics import Kinematics
from robots.robot import Robot
from robots.shapes.links import tool_line
from surfaces.cells import Cells

GROUP = "/with the surface"


def root_in_world(robot: Robot, walk: ArrayLike) -> Array:
    """(k, 4, 4) the root frame in the world at configurations (k, n)."""
    rows = np.asarray(walk, dtype=float).reshape(-1, robot.n)
    if robot.surface_link is None:
        return np.broadcast_to(np.eye(4), (len(rows), 4, 4))
    kinematics, data = Kinematics(robot), robot.model.createData()
    found = np.empty((len(rows), 4, 4))
    for row, q in enumerate(rows):
        pin.forwardKinematics(robot.model, data, kinematics.configuration(q))
        place = pin.updateFramePlacement(robot.model, data, robot.world_frame_id)
        found[row] = place.inverse().homogeneous
    return found


def in_world(points: Array, place: Array) -> Array:
    """Points (..., 3) m of the root frame, which is at `place` (4, 4), in the world."""
    return points @ place[:3, :3].T + place[:3, 3]


def world_tracks(robot: Robot, times: Array, walk: Array) -> list[dict[str, Any]]:
    """How the group of the surface moves while the arm passes `walk` (k, n) at `times` (k,) s."""
    from feasibility.viewer.playback import quaternions

    if robot.surface_link is None:
        return []
    places = root_in_world(robot, walk)
    turns = quaternions(places[:, :3, :3])
    return [
        threejs.key_frames(GROUP, "position", times, places[:, :3, 3]),
        threejs.key_frames(GROUP, "quaternion", times, turns),
    ]


def carried(
    robot: Robot, commands: Iterable[threejs.Command], entries: Iterable[Entry], q: Array
) -> tuple[list[threejs.Command], list[Entry]]:
    """What is drawn in the root frame, and its lines of the legend, put where the root frame is.

    Args:
        robot: the arm.
        commands: of the root frame.
        entries: of the legend.
        q: (n,) the configuration that is shown at first.
    """
    commands, entries = list(commands), list(entries)
    if robot.surface_link is None:
        return commands, entries
    place = threejs.transform(GROUP, root_in_world(robot, q)[0])
    moved = [
        entry if entry.path is None else replace(entry, path=GROUP + entry.path)
        for entry in entries
    ]
    return [place, *map(_grouped, commands)], moved


def _grouped(command: threejs.Command) -> threejs.Command:
    """A command for what is now in the group."""
    if command["type"] != "set_animation":
        return {**command, "path": GROUP + command["path"]}
    tracks = [
        one if one["path"] == GROUP else {**one, "path": GROUP + one["path"]}
        for one in command["animations"]
    ]
    return {**command, "animations": tracks}


AXES = ((0.85, 0.1, 0.1), (0.1, 0.65, 0.1), (0.1, 0.2, 0.9))
THIN = 0.003  # [1] of the reach: radius of the line from flange to TCP
SMALL = 0.1  # [1] of the reach: length of an axis


def triad(path: str, place: Array, length: float) -> threejs.Command:
    """The axes of a frame.

    Args:
        path: where in the scene tree.
        place: (4, 4) m, the frame in the group that it belongs to.
        length: m, of an axis.
    """
    ends = place[:3, 3] + length * place[:3, :3].T
    points = np.stack([np.broadcast_to(place[:3, 3], (3, 3)), ends], axis=1).reshape(-1, 3)
    return threejs.segments(path, points, (0, 0, 0), colours=np.repeat(AXES, 2, axis=0))


def triads(robot: Robot) -> list[threejs.Command]:
    """The frames of the TCP, of the arm's base, and of the link that carries the surface.

    And a line from the flange to the TCP, where a tool may have no shape of its own.
    """
    import pinocchio as pin

    model, body = robot.model, pin.FrameType.BODY
    base = model.getFrameId(robot.root_link or robot.link_names[0], body)
    shown = {"TCP": robot.tool_frame_id, "base": base}
    if robot.surface_link is not None:
        shown["surface frame"] = model.getFrameId(robot.surface_link, body)
    paths = joint_paths(robot)
    drawn = []
    for name, number in shown.items():
        frame = model.frames[number]
        path = f"{paths[int(frame.parentJoint)]}/frame of the {name}"
        drawn.append(triad(path, frame.placement.homogeneous, SMALL * max(robot.length_unit, 0.2)))
    line = tool_line(robot)
    if (line.ends[0] == line.ends[1]).all():
        return drawn
    rod = tubes([line.ends], THIN * max(robot.length_unit, 0.2))
    path = f"{paths[line.joint]}/flange to TCP"
    return [*drawn, threejs.mesh_object(path, *rod, SKELETON)]


BACKDROP = (
    threejs.set_property("/Background", "top_color", [1.0, 1.0, 1.0]),
    threejs.set_property("/Background", "bottom_color", [0.93, 0.95, 0.97]),
    threejs.set_property("/Grid", "visible", False),
    threejs.set_property("/Axes", "visible", False),
)
THICKNESS = 0.12  # [1] of the reach: by how much links may stand out beyond their joints
STILL = np.eye(4)
FRAMED = 0.34  # [rad]: half the angle that arm and surface fill, of a lens of 42 degrees


def ground(robot: Robot, cells: Cells, floor: float, place: Array = STILL) -> list[Command]:
    """Background, a ground grid at the height of the lowest thing, and the world's axes.

    Args:
        robot: the arm.
        cells: what it works on.
        floor: m, height of the ground.
        place: (4, 4) m, the root frame in the world.
    """
    box = in_world(_extent(cells), place)
    size = max(robot.length_unit, 0.2)
    spacing = _round_below(size / 5.0)
    extent = np.abs(box[:, :2]).max(initial=size)
    half = spacing * np.ceil(extent / spacing)
    lines = np.arange(-half, half + spacing / 2.0, spacing)
    z = min(floor, float(box[:, 2].min(initial=0.0)))
    ends = [[(x, -half, z), (x, half, z), (-half, x, z), (half, x, z)] for x in lines]
    return [
        *BACKDROP,
        threejs.segments("/ground", np.reshape(ends, (-1, 3)), (0.78, 0.80, 0.83)),
        triad("/root frame", np.eye(4), 0.25 * size),
    ]


def _round_below(value: float) -> float:
    """The largest of 1, 2.5 and 5 times a power of ten that is at most `value`."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(max(step * power for step in (1.0, 2.5, 5.0) if step * power <= value))


def camera_on(
    robot: Robot,
    cells: Cells,
    q: Array,
    floor: float,
    around: Array | None = None,
    place: Array = STILL,
) -> Camera:
    """Look at arm and surface from the tool's side, a little from above.

    Args:
        robot: the arm.
        cells: what it works on.
        q: (n,) its configuration.
        floor: m, height of the ground.
        around: (k, 3) m, what else is to be in the picture.
        place: (4, 4) m, the root frame in the world.
    """
    # Links are thick, and reach beyond their joints.
    thick = THICKNESS * robot.reach if np.isfinite(robot.reach) else 0.0
    round_joints = np.vstack([np.eye(3), -np.eye(3)]) * thick
    links = (joint_points(robot, q)[:, None] + round_joints).reshape(-1, 3)
    foot = round_joints * [1.0, 1.0, 0.0] + [0.0, 0.0, floor]
    seen = [_extent(cells), links] if around is None else [_extent(cells), links, around]
    points = np.concatenate([in_world(np.concatenate(seen), place), foot])
    toward = np.zeros(3)
    if len(cells):
        toward = place[:3, :3] @ (cells.surface.side_sign * cells.normals.mean(axis=0))
    heading = np.arctan2(toward[1], toward[0]) if np.hypot(*toward[:2]) > 0.1 else -np.pi / 3.0
    heading, height = heading + np.radians(25.0), np.radians(24.0)
    level = np.cos(height)
    direction = np.array([np.cos(heading) * level, np.sin(heading) * level, np.sin(height)])
    return framing(points, direction)


def framing(points: Array, direction: Array, near: float = 1.0) -> Camera:
    """A camera that has points (k, 3) m in its picture.

    Args:
        points: what is to be seen.
        direction: (3,) unit, from the points to the camera.
        near: 1 where a ball around all points fills `FRAMED`; less comes nearer.
    """
    target = (points.min(axis=0) + points.max(axis=0)) / 2.0
    radius = max(float(np.linalg.norm(points - target, axis=1).max()), 0.1)
    eye = target + near * radius / np.sin(FRAMED) * direction
    return Camera(tuple(target.tolist()), tuple(eye.tolist()))


def joint_points(robot: Robot, walk: ArrayLike) -> Array:
    """The joints (m n, 3) m of the arm at configurations (m, n) or (n,)."""
    placements = robot_visuals.joint_placements(robot, walk)
    place, points = np.eye(4), []
    for step in placements.transpose(1, 0, 2, 3):
        place = place @ step
        points.append(place[:, :3, 3])
    return np.concatenate(points)


def _extent(cells: Cells) -> Array:
    """Points (k, 3) m of the surface and the arm's base."""
    if len(cells) == 0:
        return np.zeros((1, 3))
    return np.concatenate([np.zeros((1, 3)), cells.centres, cells.borders(1).reshape(-1, 3)])
