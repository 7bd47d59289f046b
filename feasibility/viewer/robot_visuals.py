"""The arm as it is drawn: its visuals in a tree of joints, and how that tree moves.

Each joint is a group inside the group of the joint before it, as in the arm itself. The page then
turns every joint about its own axis between two key frames, and the links keep their shape.
"""

from __future__ import annotations

from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from coverable.arrays import Array
from coverable.errors import listed
from coverable.meshes.raw_mesh import MeshError
from coverable.meshes.robot_files import MeshFiles
from feasibility.viewer import threejs
from feasibility.viewer.meshes import (
    GREY,
    Mesh,
    as_mesh,
    drawn,
    mesh_command,
    moved,
    solid_mesh,
    thinned,
)
from robots.errors import RobotError
from robots.kinematics import Kinematics
from robots.robot import Robot
from robots.urdf.link_shapes import LinkShape, MeshFile, mesh_paths

ROBOT = "/robot"
TRIANGLES = 60_000  # of a whole robot; more are thinned
SKELETON: threejs.Colour = (0.55, 0.58, 0.62)


@dataclass(frozen=True, slots=True)
class Drawing:
    """What the page needs to draw one robot."""

    commands: tuple[threejs.Command, ...]
    lowest: float
    """m, smallest z of what does not move, at most 0."""
    notes: tuple[str, ...]
    """What could not be drawn as the URDF says, one sentence each."""


def joint_paths(robot: Robot, root: str = ROBOT) -> tuple[str, ...]:
    """The n + 1 groups of the scene tree: what is fixed to the root, then each joint's."""
    paths = [root]
    for name in robot.joint_names:
        paths.append(f"{paths[-1]}/joint {threejs.safe_name(name)}")
    return tuple(paths)


def home(robot: Robot) -> Array:
    """(n,) of an arm without work: at zero, or at the limit next to it."""
    return np.clip(np.zeros(robot.n), robot.lower, robot.upper)


def joint_placements(robot: Robot, walk: ArrayLike) -> Array:
    """Each joint's frame in the frame of the joint before it, by Pinocchio.

    Args:
        robot: the arm.
        walk: (k, n) configurations.

    Returns:
        (k, n, 4, 4) homogeneous matrices.
    """
    kinematics = Kinematics(robot)
    data = robot.model.createData()
    rows = np.asarray(walk, dtype=float).reshape(-1, robot.n)
    placements = np.empty((len(rows), robot.n, 4, 4))
    for row, q in enumerate(rows):
        pin.forwardKinematics(robot.model, data, kinematics.configuration(q))
        placements[row] = [data.liMi[joint].homogeneous for joint in range(1, robot.n + 1)]
    return placements


def pose(robot: Robot, q: ArrayLike, root: str = ROBOT) -> list[threejs.Command]:
    """Commands that put the drawn arm, or another tree of joints, into configuration q (n,)."""
    placements = joint_placements(robot, q)[0]
    paths = joint_paths(robot, root)[1:]
    return [threejs.transform(path, place) for path, place in zip(paths, placements, strict=True)]


_drawings: WeakKeyDictionary[Robot, Drawing] = WeakKeyDictionary()


def draw(robot: Robot) -> Drawing:
    """Every visual of the URDF, on locked joints and off the chain too.

    Where a mesh cannot be had, a link that is left without a shape is drawn as a capsule; so is
    every link of a robot whose URDF cannot be read or has no visuals. Files are read once for each
    robot, however often it is drawn.
    """
    if robot not in _drawings:
        _drawings[robot] = _draw(robot)
    return _drawings[robot]


def _draw(robot: Robot) -> Drawing:
    visuals, notes = _visuals(robot)
    files = MeshFiles(mesh_paths(visuals))
    missing: dict[str, list[str]] = {}  # what is wrong -> links
    parts: dict[tuple[int, str], list[Mesh]] = {}
    for visual in visuals:
        frame = robot.model.frames[robot.model.getFrameId(visual.link, pin.FrameType.BODY)]
        try:
            meshes = _meshes(visual, files)
        except MeshError as error:
            missing.setdefault(str(error), []).append(visual.link)
            continue
        place = frame.placement.homogeneous @ visual.origin
        key = (int(frame.parentJoint), visual.link)
        parts.setdefault(key, []).extend(moved(mesh, place) for mesh in meshes)
    for fault, links in missing.items():
        notes.append(f"not drawn: a shape of link {listed(links, 1)}: {fault}")
    if notes or not parts:
        for joint in set(range(robot.n + 1)) - {joint for joint, _ in parts}:
            parts[joint, "capsule"] = [_capsule(robot, joint)]
    return _drawing(robot, parts, notes)


def _drawing(robot: Robot, parts: dict[tuple[int, str], list[Mesh]], notes: list[str]) -> Drawing:
    """Thin and name the parts of all links."""
    owned = [(key, mesh) for key, group in parts.items() for mesh in _joined(group)]
    fewer = thinned([mesh for _, mesh in owned], TRIANGLES)
    paths = joint_paths(robot)
    commands, lowest = [], 0.0
    world = robot.model.frames[robot.world_frame_id]
    upwards = world.placement.inverse().homogeneous[2]  # heights in the world
    for number, (((joint, link), _), mesh) in enumerate(zip(owned, fewer, strict=True)):
        if len(mesh.faces) == 0:
            continue
        if joint == world.parentJoint:
            heights = mesh.vertices @ upwards[:3] + upwards[3]
            lowest = min(lowest, float(heights.min()))
        path = f"{paths[joint]}/link {threejs.safe_name(link)}/part {number}"
        commands.append(mesh_command(path, mesh))
    return Drawing(tuple(commands), lowest, tuple(notes))


def _visuals(robot: Robot) -> tuple[list[LinkShape], list[str]]:
    """The checked visuals of the robot's URDF, and what is wrong with the others."""
    if robot.urdf is None:
        return [], []
    from robots.urdf.checked_urdf import check_urdf

    try:
        checked = check_urdf(
            robot.urdf, robot.package_dirs, robot.axes, xacro_args=dict(robot.xacro_args)
        )
    except (RobotError, OSError) as error:
        return [], [f"not drawn: {robot.urdf} cannot be read: {error}"]
    bodies = {frame.name for frame in robot.model.frames if frame.type == pin.FrameType.BODY}
    notes = [warning for warning in checked.warnings if warning.startswith("not drawn")]
    return [visual for visual in checked.visuals if visual.link in bodies], notes


def _meshes(visual: LinkShape, files: MeshFiles) -> list[Mesh]:
    """The triangles of one visual, in the visual's own frame.

    Raises:
        MeshError: its file cannot be read, or it is more than can be drawn.
    """
    red, green, blue, opacity = visual.rgba or (*GREY, 1.0)
    colour = None if visual.rgba is None else (red, green, blue)
    geometry = visual.geometry
    if isinstance(geometry, MeshFile):
        return [
            drawn(part, np.asarray(geometry.scale), colour) for part in files.parts(geometry.path)
        ]
    mesh = solid_mesh(geometry, colour or GREY, opacity)
    files.count(len(mesh.faces))
    return [mesh]


def _joined(meshes: list[Mesh]) -> list[Mesh]:
    """One mesh for each colour."""
    from trimesh.util import append_faces

    groups: dict[tuple[threejs.Colour, float], list[Mesh]] = {}
    for mesh in meshes:
        groups.setdefault((mesh.colour, mesh.opacity), []).append(mesh)
    joined = []
    for looks, group in groups.items():
        shape = append_faces([mesh.vertices for mesh in group], [mesh.faces for mesh in group])
        joined.append(Mesh(np.asarray(shape[0], float), np.asarray(shape[1], np.int64), *looks))
    return joined


def _capsule(robot: Robot, joint: int) -> Mesh:
    """A link without a picture: a ball on its joint, a rod to the next joint or to the tool."""
    import trimesh

    model = robot.model
    if joint < robot.n:
        end = model.jointPlacements[joint + 1].translation
    else:
        end = model.frames[robot.tool_frame_id].placement.translation
    radius = 0.03 * min(max(robot.reach, 0.2), 10.0)  # [m]
    body = trimesh.creation.icosphere(subdivisions=3, radius=1.3 * radius)
    if np.linalg.norm(end) > 1e-6:
        rod = np.array([np.zeros(3), end])
        body += trimesh.creation.cylinder(radius=radius, segment=rod, sections=32)
    return as_mesh(body, SKELETON)
