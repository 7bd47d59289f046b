"""Ground, root frame and camera of a picture."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array
from feasibility.viewer import robot_visuals, threejs
from feasibility.viewer.frames.standing_world import in_world
from feasibility.viewer.frames.triads import triad
from feasibility.viewer.html_page import Camera
from feasibility.viewer.threejs import Command
from robots.robot import Robot
from surfaces.cells import Cells

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
        threejs.set_property("/Background", "top_color", [1.0, 1.0, 1.0]),
        threejs.set_property("/Background", "bottom_color", [0.93, 0.95, 0.97]),
        threejs.set_property("/Grid", "visible", False),
        threejs.set_property("/Axes", "visible", False),
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
