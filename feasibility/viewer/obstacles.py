"""What can collide, as it is drawn: objects of the scene, the tool, the search's convex bodies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from coverable.arrays import Array
from feasibility.collisions.problem_bodies import Bodies, Seat
from feasibility.collisions.scene import Obstacle
from feasibility.collisions.shapes import HalfSpace
from feasibility.collisions.words import TOOL
from feasibility.viewer import threejs
from feasibility.viewer.html_page import Entry
from feasibility.viewer.meshes import CREASE, Mesh, as_mesh, moved, shaded, solid_mesh, thinned
from feasibility.viewer.robot_visuals import joint_paths
from feasibility.viewer.threejs import Colour, Command
from feasibility.viewer.verdict_scene import Layer, hidden
from robots.robot import Robot
from robots.shapes.bodies import Polytope, Triangles

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
    seats = [*(Seat(one, 0) for one in bodies.scene), *bodies.carried]
    meshes = thinned([_mesh_of(seat.obstacle, robot) for seat in seats], TRIANGLES)
    groups = joint_paths(robot)
    parts = []
    for number, (seat, mesh) in enumerate(zip(seats, meshes, strict=True)):
        if not len(mesh.faces):
            continue
        name = threejs.safe_name(seat.obstacle.name)
        path = f"{groups[seat.joint] if seat.joint else ''}/scene/{number} {name}"
        lines = threejs.segments(f"{path}/edges", _edges(mesh), EDGES)
        drawn = (_command(f"{path}/body", mesh), lines)
        parts.append(Layer(drawn, Entry(seat.obstacle.name, SCENE, path)))
    if len(parts) <= MOST_ENTRIES:
        return parts
    every = tuple(command for part in parts for command in part.commands)
    return [Layer(every, Entry(f"scene ({len(parts)} objects)", SCENE, "/scene"))]


def tool_layers(bodies: Bodies, robot: Robot) -> list[Layer]:
    """The shapes that are mounted on the flange."""
    solids = [solid for solid in bodies.solids if solid.owner == TOOL]
    if not solids:
        return []
    path = f"{joint_paths(robot)[solids[0].joint]}/mounted tool"
    commands = tuple(
        _command(f"{path}/{number}", moved(_shape(solid.geometry, TOOLS, 1.0), solid.placement))
        for number, solid in enumerate(solids)
    )
    return [Layer(commands, Entry("mounted tool", TOOLS, path))]


def hull_layers(bodies: Bodies, robot: Robot) -> list[Layer]:
    """The convex bodies that the search takes for the links and the tool, off at first."""
    scene = {one.name for one in bodies.scene} | {one.obstacle.name for one in bodies.carried}
    paths = joint_paths(robot, HULLS)
    commands = []
    for number, body in enumerate(bodies.polytopes):
        mesh = None if body.owner in scene else _hull(body)
        if mesh is not None:
            path = f"{paths[body.joint]}/body {number} of {threejs.safe_name(body.owner)}"
            commands.append(_command(path, mesh))
    if not commands:
        return []
    label = f"convex bodies of the search ({len(commands)})"
    return [hidden(Layer(tuple(commands), Entry(label, CONVEX, HULLS)))]


def points_of(scene: Sequence[Obstacle], robot: Robot) -> Array:
    """(k, 3) m of objects of the scene within reach of the arm's root."""
    solid = [one for one in scene if not isinstance(one.geometry, HalfSpace)]
    points = [_mesh_of(one, robot).vertices for one in solid]
    every = np.concatenate([np.empty((0, 3)), *points])
    return every[np.linalg.norm(every, axis=1) <= robot.length_unit]


def _mesh_of(one: Obstacle, robot: Robot) -> Mesh:
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


def _command(path: str, mesh: Mesh) -> Command:
    """The command that draws a mesh with its creases."""
    split, normals = shaded(mesh)
    return threejs.mesh_object(
        path, split.vertices, split.faces, mesh.colour, normals=normals, opacity=mesh.opacity
    )


def _edges(mesh: Mesh) -> Array:
    """(2 k, 3) m, ends of the edges that a mesh is folded at, and of its border."""
    import trimesh

    body = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    folded = body.face_adjacency_edges[body.face_adjacency_angles > CREASE]
    alone = trimesh.grouping.group_rows(body.edges_sorted, require_count=1)
    return mesh.vertices[np.concatenate([folded, body.edges_sorted[alone]]).reshape(-1)]
