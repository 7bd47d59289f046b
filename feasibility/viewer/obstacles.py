"""What can collide, as it is drawn: objects, tool, the search's convex bodies, the nearest pair."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from coverable.arrays import Array
from feasibility.certification.collisions.nearest import NearPair, nearest_along
from feasibility.collisions.problem_bodies import Bodies
from feasibility.collisions.words import TOOL
from feasibility.viewer import threejs
from feasibility.viewer.cell_meshes import marks
from feasibility.viewer.html_page import Entry
from feasibility.viewer.meshes import (
    CREASE,
    Mesh,
    as_mesh,
    mesh_command,
    moved,
    solid_mesh,
    thinned,
    tubes,
)
from feasibility.viewer.playback import Playback, key_times
from feasibility.viewer.robot_visuals import joint_paths
from feasibility.viewer.threejs import Colour, Command
from feasibility.viewer.verdict_scene import Layer, hidden
from robots.robot import Robot
from robots.shapes.bodies import HalfSpace, Polytope, Solid, Triangles

HULLS = "/hulls"  # a tree of joints beside that of the arm
SCENE: Colour = (0.66, 0.54, 0.40)
EDGES: Colour = (0.36, 0.28, 0.20)
TOOLS: Colour = (0.25, 0.25, 0.28)
CONVEX: Colour = (0.10, 0.55, 0.55)
SEEN_THROUGH, SHEER = 0.3, 0.2  # opacities of objects; of half spaces and convex bodies
MOST_ENTRIES = 8  # objects of the scene with a line of the legend each
TRIANGLES = 30_000  # of the whole scene; more are thinned
WIDE = 1.1  # [1] of the reach: half the width of the square that stands for a half space


def scene_layers(bodies: Bodies, robot: Robot) -> list[Layer]:
    """The objects of the scene, half transparent; each has a switch where they are not many."""
    scene = sorted(bodies.scene, key=lambda one: one.joint > 0)
    meshes = thinned([_mesh_of(one, robot) for one in scene], TRIANGLES)
    groups = joint_paths(robot)
    parts, carried = list[Layer](), list[Layer]()
    for number, (one, mesh) in enumerate(zip(scene, meshes, strict=True)):
        if not len(mesh.faces):
            continue
        name = threejs.safe_name(one.owner)
        path = f"{groups[one.joint] if one.joint else ''}/scene/{number} {name}"
        lines = threejs.segments(f"{path}/edges", _edges(mesh), EDGES)
        drawn = (mesh_command(f"{path}/body", mesh), lines)
        (carried if one.joint else parts).append(Layer(drawn, Entry(one.owner, SCENE, path)))
    if len(parts) > MOST_ENTRIES:
        every = tuple(command for part in parts for command in part.commands)
        parts = [Layer(every, Entry(f"scene ({len(parts)} objects)", SCENE, "/scene"))]
    return parts + carried


def tool_layers(bodies: Bodies, robot: Robot) -> list[Layer]:
    """The shapes that are mounted on the flange."""
    solids = [solid for solid in bodies.solids if solid.owner == TOOL]
    if not solids:
        return []
    path = f"{joint_paths(robot)[solids[0].joint]}/mounted tool"
    commands = tuple(
        mesh_command(f"{path}/{number}", moved(_shape(solid.geometry, TOOLS, 1.0), solid.placement))
        for number, solid in enumerate(solids)
    )
    return [Layer(commands, Entry("mounted tool", TOOLS, path))]


def hull_layers(bodies: Bodies, robot: Robot) -> list[Layer]:
    """The convex bodies that the search takes for the links and the tool, off at first."""
    scene = {one.owner for one in bodies.scene}
    paths = joint_paths(robot, HULLS)
    commands = []
    for number, body in enumerate(bodies.polytopes):
        mesh = None if body.owner in scene else _hull(body)
        if mesh is not None:
            path = f"{paths[body.joint]}/body {number} of {threejs.safe_name(body.owner)}"
            commands.append(mesh_command(path, mesh))
    if not commands:
        return []
    label = f"convex bodies of the search ({len(commands)})"
    return [hidden(Layer(tuple(commands), Entry(label, CONVEX, HULLS)))]


def points_of(scene: Sequence[Solid], robot: Robot) -> Array:
    """(k, 3) m of objects of the scene at rest within reach of the arm's root."""
    still = (one for one in scene if not one.joint)
    solid = [one for one in still if not isinstance(one.geometry, HalfSpace)]
    points = [_mesh_of(one, robot).vertices for one in solid]
    every = np.concatenate([np.empty((0, 3)), *points])
    return every[np.linalg.norm(every, axis=1) <= robot.length_unit]


def _mesh_of(one: Solid, robot: Robot) -> Mesh:
    """An object in the root frame; of a half space, a square of its plane beneath the root."""
    if not isinstance(one.geometry, HalfSpace):
        return moved(_shape(one.geometry, SCENE, SEEN_THROUGH), one.placement)
    x, y, _ = np.linalg.inv(one.placement)[:3, 3]
    wide = WIDE * robot.length_unit
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * wide + [x, y, 0.0]
    square = Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]), SCENE, SHEER)
    return moved(square, one.placement)


def _shape(geometry: Any, colour: Colour, opacity: float) -> Mesh:
    """A shape in its own frame."""
    if isinstance(geometry, Triangles):
        return Mesh(geometry.vertices, geometry.faces, colour, opacity)
    return solid_mesh(geometry, colour, opacity)


def _hull(body: Polytope) -> Mesh | None:
    """A convex body in its joint's frame; None where it is too thin to be drawn."""
    import trimesh

    points = body.vertices
    if body.radius > 0.0:
        ball = trimesh.creation.icosphere(subdivisions=2, radius=body.radius)
        points = (points[:, None] + ball.vertices).reshape(-1, 3)
    try:
        return as_mesh(trimesh.convex.convex_hull(points), CONVEX, SHEER)
    except (ValueError, trimesh.convex.QhullError):
        return None


def _edges(mesh: Mesh) -> Array:
    """(2 k, 3) m, ends of the edges that a mesh is folded at, and of its border."""
    import trimesh

    body = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    folded = body.face_adjacency_edges[body.face_adjacency_angles > CREASE]
    alone = trimesh.grouping.group_rows(body.edges_sorted, require_count=1)
    return mesh.vertices[np.concatenate([folded, body.edges_sorted[alone]]).reshape(-1)]


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
