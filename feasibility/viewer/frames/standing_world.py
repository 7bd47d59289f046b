"""Pictures of arms whose surface is carried by a link: the world stands still, the surface moves.

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
from feasibility.viewer import threejs
from feasibility.viewer.html_page import Entry
from robots.kinematics import Kinematics
from robots.robot import Robot

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
