"""The line between the two bodies that are nearest to each other, as the arm moves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from coverable.arrays import Array
from feasibility.certification.collisions.nearest import NearPair, nearest_along
from feasibility.collisions.problem_bodies import Bodies
from feasibility.viewer import threejs
from feasibility.viewer.cell_meshes import marks
from feasibility.viewer.html_page import Entry
from feasibility.viewer.meshes import tubes
from feasibility.viewer.playback import Playback, key_times
from feasibility.viewer.threejs import Colour, Command
from feasibility.viewer.verdict_scene import Layer
from robots.robot import Robot

ROOT = "/nearest pair"
LINE: Colour = (0.90, 0.00, 0.55)
THICK, END = 0.003, 0.009  # [1] of the reach: radius of the line, and of the marks at its ends


@dataclass(frozen=True, eq=False, slots=True)
class NearestDrawn:
    """The line, how it moves, and what is read beside the slider."""

    layer: Layer
    tracks: list[dict[str, Any]]
    distances: list[float]
    """mm, at each key frame."""
    names: tuple[str, ...]
    """The pair at each key frame."""


def draw_nearest(
    robot: Robot, bodies: Bodies | None, motion: Playback, start: float
) -> NearestDrawn | None:
    """The nearest pair at the key frames of a motion; None where there is no pair.

    Args:
        robot: the arm.
        bodies: all that can collide; None where collisions are not checked.
        motion: what the view plays.
        start: s, where the picture shows it.
    """
    times = key_times(motion)
    found = None if bodies is None else nearest_along(robot, bodies, motion.at(times))
    if found is None:
        return None
    shown = found.which[max(int(np.searchsorted(times, start, side="right")) - 1, 0)]
    commands, tracks = list[Command](), list[dict[str, Any]]()
    size = robot.length_unit
    for number, pair in enumerate(found.pairs):
        path = f"{ROOT}/{number} {threejs.safe_name(' and '.join(pair.names))}"
        commands += _drawn(path, size)
        commands += _placed(path, pair, times, start)
        commands.append(threejs.set_property(path, "visible", bool(number == shown)))
        tracks += _tracks(path, pair, times)
        tracks.append(threejs.shown(path, times, found.which == number))
    names = tuple(" and ".join(found.pairs[k].names) for k in found.which)
    entry = Entry("nearest pair of bodies, and the line between them", LINE, ROOT)
    layer = Layer(tuple(commands), entry)
    return NearestDrawn(layer, tracks, np.round(1e3 * found.distances, 2).tolist(), names)


def _drawn(path: str, size: float) -> list[Command]:
    """A line of 1 m along z, and a mark for each of its ends."""
    vertices, faces = tubes([np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]])], THICK * size)
    commands = [threejs.mesh_object(f"{path}/line", vertices, faces, LINE, lit=False, on_top=True)]
    vertices, faces = marks(np.zeros((1, 3)), END * size)
    for name in ("first", "second"):
        commands.append(
            threejs.mesh_object(f"{path}/{name}", vertices, faces, LINE, lit=False, on_top=True)
        )
    return commands


def _placed(path: str, pair: NearPair, times: Array, start: float) -> list[Command]:
    """Line and marks where they are at one time (s)."""
    from scipy.spatial.transform import Rotation

    flat = pair.points.reshape(-1, 6)
    ends = np.array([np.interp(start, times[pair.rows], x) for x in flat.T]).reshape(1, 2, 3)
    line = np.eye(4)
    turn, length = _turns(ends)
    line[:3, :3] = Rotation.from_quat(turn[0]).as_matrix() @ np.diag([1.0, 1.0, length[0]])
    line[:3, 3] = ends[0, 0]
    placed = [threejs.transform(f"{path}/line", line)]
    for name, end in zip(("first", "second"), ends[0], strict=True):
        place = np.eye(4)
        place[:3, 3] = end
        placed.append(threejs.transform(f"{path}/{name}", place))
    return placed


def _tracks(path: str, pair: NearPair, times: Array) -> list[dict[str, Any]]:
    """How line and marks move."""
    when, (first, second) = times[pair.rows], pair.points.transpose(1, 0, 2)
    turns, lengths = _turns(pair.points)
    scales = np.column_stack([np.ones((len(when), 2)), lengths])
    return [
        threejs.key_frames(f"{path}/line", "position", when, first),
        threejs.key_frames(f"{path}/line", "quaternion", when, turns),
        threejs.key_frames(f"{path}/line", "scale", when, scales),
        threejs.key_frames(f"{path}/first", "position", when, first),
        threejs.key_frames(f"{path}/second", "position", when, second),
    ]


def _turns(ends: Array) -> tuple[Array, Array]:
    """Unit quaternions (r, 4), x y z w, that turn z towards the lines (r, 2, 3) m; lengths (r,) m.

    The half-way rule: z to a unit vector d is (z x d, 1 + z . d), scaled to length 1.
    """
    apart = ends[:, 1] - ends[:, 0]
    lengths = np.maximum(np.linalg.norm(apart, axis=1), 1e-6)  # a scale of 0 has no inverse
    x, y, z = (apart / lengths[:, None]).T
    turns = np.column_stack([-y, x, np.zeros(len(x)), 1.0 + z])
    size = np.linalg.norm(turns, axis=1, keepdims=True)
    return np.where(size > 1e-6, turns / np.maximum(size, 1e-6), [1.0, 0.0, 0.0, 0.0]), lengths
