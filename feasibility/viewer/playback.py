"""The motion that a view plays, in even time, and what is read beside its slider.

It is the witness, or one path of the search tree; read are joint values, distance and angle of the
tool, and the clearance.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import networkx as nx
import numpy as np

from coverable.arrays import Array
from coverable.errors import ArgumentError
from feasibility.verdict import Verdict
from feasibility.viewer import threejs
from feasibility.viewer.html_page import Readout
from feasibility.viewer.robot_visuals import ROBOT, joint_paths, joint_placements
from robots.kinematics import Kinematics
from robots.robot import Robot
from surfaces.cells import Cells

if TYPE_CHECKING:
    from feasibility.timing.sampled_trajectory import Trajectory


KEY_FRAMES = 400
SAMPLES = 3_000  # of a trajectory that are drawn, at most
SHORTEST, LONGEST = 6.0, 60.0  # [s]
JOINED = 1e-6  # [rad] or [m]: largest gap between the end of one motion and the start of the next


@dataclass(frozen=True, eq=False, slots=True)
class Playback:
    """Straight lines in joint space, to be played at an even pace."""

    walk: Array
    """(m, n) waypoints, rad or m."""
    seconds: Array
    """(m,) when each waypoint is passed, from 0."""
    points: Array
    """(m, 3) m, the tool point at each waypoint."""
    there_and_back: bool
    """Played to the end and back again, rather than once more from the start."""
    label: str

    def at(self, times: Array) -> Array:
        """Configurations (k, n) at the given times (k,) s."""
        return np.column_stack([np.interp(times, self.seconds, row) for row in self.walk.T])

    def tool_at(self, times: Array) -> Array:
        """Tool points (k, 3) m at the given times (k,) s."""
        return np.column_stack([np.interp(times, self.seconds, row) for row in self.points.T])


def motion_of(verdict: Verdict) -> Playback | None:
    """What the verdict's view plays; None where the arm does not move.

    The witness where there is one, else the path of the search tree along which the tool travels
    furthest.

    Raises:
        ArgumentError: two motions of a tree path do not join, so the verdict contradicts itself.
    """
    if verdict.witness is not None and len(verdict.witness.q) > 1:
        return paced(verdict.robot, verdict.witness.q, False, "covering motion")
    cells = longest_path(verdict.tree, verdict.cells.centres)
    if len(cells) < 2:
        return None
    return paced(verdict.robot, walk_along(verdict.graph, cells), True, "one path of the tree")


def longest_path(tree: nx.DiGraph | None, centres: Array) -> list[int]:
    """Cells from the root of the search tree to the leaf furthest along it; empty without a tree.

    The length of a step is the distance between the centres (N, 3) of its two cells.
    """
    if tree is None:
        return []
    lengths = nx.create_empty_copy(tree)
    steps = ((a, b, float(np.linalg.norm(centres[b] - centres[a]))) for a, b in tree.edges)
    lengths.add_weighted_edges_from(steps)
    return list(nx.dag_longest_path(lengths))


def walk_along(graph: nx.Graph, cells: list[int]) -> Array:
    """The motions of successive edges, each in the direction of travel, as one walk (m, n).

    Raises:
        ArgumentError: an edge has no motion, or a motion does not start at the end of the last one.
    """
    rows: list[Array] = []
    for a, b in itertools.pairwise(cells):
        motion = np.asarray(graph.edges[a, b]["motion"], dtype=float)
        motion = motion if a < b else motion[::-1]
        if rows:
            gap = float(np.abs(rows[-1][-1] - motion[0]).max())
            if not gap <= JOINED:
                raise ArgumentError(
                    f"the motion from cell {a} to cell {b} starts {gap:.3g} rad or m away from "
                    "where the one before it ends; the tree of this verdict is no continuous motion"
                )
            motion = motion[1:]
        rows.append(motion)
    return np.concatenate(rows)


def paced(robot: Robot, walk: Array, there_and_back: bool, label: str) -> Playback:
    """Time a walk (m, n) so that the tool travels evenly.

    Where the tool point rests and only joints move, their motion counts: 1 rad as a twentieth of
    the arm's reach, so that nothing jumps.
    """
    points, _ = Kinematics(robot).tools(walk)
    reach = robot.length_unit
    lever = np.where(robot.prismatic, 1.0, reach / 20.0)  # [m] or [m/rad]
    travel = np.hypot(
        np.linalg.norm(np.diff(points, axis=0), axis=1),
        np.abs(np.diff(walk, axis=0) * lever).max(axis=1),
    )
    travelled = np.concatenate([[0.0], np.cumsum(travel)])
    duration = float(np.clip(travelled[-1] / (0.3 * reach), SHORTEST, LONGEST))
    scale = duration / travelled[-1] if travelled[-1] > 0.0 else 0.0
    return Playback(np.asarray(walk), travelled * scale, points, there_and_back, label)


def timed(robot: Robot, trajectory: Trajectory, label: str) -> Playback:
    """A trajectory as it is timed, or in `LONGEST` seconds if it takes longer."""
    kept = np.unique(np.linspace(0, len(trajectory) - 1, min(len(trajectory), SAMPLES)).astype(int))
    q, time = trajectory.q[kept], trajectory.time[kept] - trajectory.time[0]
    if time[-1] > LONGEST:
        time = time * (LONGEST / time[-1])
    return Playback(q, time, Kinematics(robot).tools(q)[0], False, label)


def key_times(motion: Playback) -> Array:
    """Even times (k,) s of the key frames, at most `KEY_FRAMES` of them."""
    return np.linspace(0.0, float(motion.seconds[-1]), min(KEY_FRAMES, 4 * len(motion.walk)))


def animate(
    robot: Robot,
    motion: Playback,
    *,
    play: bool,
    tracks: Sequence[dict[str, Any]] = (),
    roots: Sequence[str] = (ROBOT,),
) -> threejs.Command:
    """The animation of a motion: one track for each joint's group, and what else moves with it.

    Args:
        robot: the arm.
        motion: what it plays.
        play: at once.
        tracks: of what else moves.
        roots: of all trees of joint groups, see `joint_paths`.
    """
    times = key_times(motion)
    placements = joint_placements(robot, motion.at(times))
    tracks = list(tracks)
    paths = list(zip(*(joint_paths(robot, root)[1:] for root in roots), strict=True))
    for joint, groups in enumerate(paths):
        name, values = "position", placements[:, joint, :3, 3]
        if not robot.prismatic[joint]:
            name, values = "quaternion", quaternions(placements[:, joint, :3, :3])
        tracks += [threejs.key_frames(path, name, times, values) for path in groups]
    return threejs.animation(tracks, play=play, there_and_back=motion.there_and_back)


def quaternions(rotations: Array) -> Array:
    """Unit quaternions (k, 4) as x, y, z, w of rotations (k, 3, 3), without jumps of sign."""
    from scipy.spatial.transform import Rotation

    turns = Rotation.from_matrix(rotations).as_quat()
    flips = np.concatenate([[1.0], np.where((turns[1:] * turns[:-1]).sum(axis=1) < 0, -1.0, 1.0)])
    return turns * np.cumprod(flips)[:, None]


def readout_of(robot: Robot, cells: Cells, motion: Playback) -> Readout:
    """The values of a motion at its key frames, between which the page interpolates.

    The distance is that of the tool point from the surface on its working side (mm), the angle
    the one between the tool axis and the normal there (deg).

    Args:
        robot: the arm.
        cells: what it works on.
        motion: what the view plays.
    """
    times = key_times(motion)
    q = motion.at(times)
    slides = robot.prismatic
    values = q * np.where(slides, 1e3, 180.0 / np.pi)
    units = ["mm" if each else "deg" for each in slides.tolist()]
    names, columns = list(robot.joint_names), list(values.T)
    if len(cells):
        names, units = [*names, "distance", "angle"], [*units, "mm", "deg"]
        columns += [*distance_and_angle(robot, cells, q)]
    rows = zip(names, units, [np.round(column, 2).tolist() for column in columns], strict=True)
    return Readout(tuple(np.round(times, 4).tolist()), tuple(rows), motion.there_and_back)


def with_nearest(readout: Readout, distances: list[float], names: tuple[str, ...]) -> Readout:
    """The same with the distance of the nearest pair of bodies, and who they are.

    Args:
        readout: the other values.
        distances: mm, at each of its times.
        names: the pair at each of its times.
    """
    rows = (*readout.rows, ("clearance", "mm", distances))
    return replace(readout, rows=rows, nearest=names)


def distance_and_angle(robot: Robot, cells: Cells, q: Array) -> Array:
    """(2, k): mm from the surface on its working side, and degrees from the normal there."""
    points, axes = Kinematics(robot).tools(q)
    closest = cells.surface.closest(points)
    side = cells.surface.side_sign
    cosine = -side * (axes * closest.normal).sum(axis=1)  # the tool points at the surface
    angle = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    return np.stack([1e3 * side * closest.height, angle])
