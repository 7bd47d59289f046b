"""An arm as yourdfpy has it, for notebooks and libraries that expect a `yourdfpy.URDF`."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array
from robots.errors import RobotError
from robots.joint_selection import numbers
from robots.poses import about_fixed_axes
from robots.robot import Robot
from robots.urdf.axes import free_name
from robots.urdf.checked_urdf import check_urdf
from robots.urdf.joints import JointInfo
from robots.urdf.link_shapes import Box, Capsule, Cylinder, Geometry, LinkShape, Sphere

if TYPE_CHECKING:
    import yourdfpy


def as_yourdfpy(robot: Robot, q: ArrayLike | None = None, *, meshes: bool = True) -> yourdfpy.URDF:
    """An arm as a `yourdfpy.URDF` at a configuration, such as notebooks show and export.

    Its links are those of the URDF and of the robot's `axes`, its root is the world, and held
    joints are where they are held.

    Args:
        robot: read from a URDF.
        q: (n,) rad or m; by default the robot's start, or else each joint at zero or at the limit
            next to it.
        meshes: whether yourdfpy reads the files of meshes, by trimesh. Leave them out where a
            stranger made them: nothing has checked what is in them.

    Raises:
        RobotError: the robot was built in memory, its file cannot be read any more, or `q` is no
            configuration of it.

    Example:
        >>> from coverable import load_robot
        >>> arm = as_yourdfpy(load_robot("ur5"), [0, -1, 1, 0, 0, 0], meshes=False)
        >>> arm.get_transform("tool0", "base_link")[:3, 3].round(2)
        array([0.62, 0.19, 0.35])
    """
    from yourdfpy import urdf as parts

    if robot.urdf is None:
        raise RobotError("it was built in memory and has no URDF", f"robot {robot.name!r}")
    start = np.clip(0.0, robot.lower, robot.upper) if robot.start is None else robot.start
    given = numbers(start if q is None else q, f"robot {robot.name!r}: q", (robot.n,))
    values = {**robot.locked, **dict(zip(robot.joint_names, given.tolist(), strict=True))}
    arguments = dict(robot.xacro_args)
    tree = check_urdf(robot.urdf, robot.package_dirs, robot.axes, _mount(robot), arguments)
    joints = [_joint(joint, parts) for joint in tree.joints]
    world = tree.root
    if not robot.axes:
        world = free_name("world", set(tree.links))
        joints.insert(0, parts.Joint(world, "fixed", world, tree.root, robot.base))
    visuals: dict[str, list[Any]] = {link: [] for link in dict.fromkeys((world, *tree.links))}
    for shape in tree.visuals:
        visuals[shape.link] += _visuals(shape, parts)
    links = [parts.Link(link, visuals=some) for link, some in visuals.items()]
    made = parts.URDF(
        parts.Robot(tree.name, links, joints),
        load_meshes=meshes,
        filename_handler=lambda fname: fname,  # absolute already
    )
    made.update_cfg({joint.name: values[joint.name] for joint in tree.joints if joint.moves})
    return made


def _mount(robot: Robot) -> Array:
    """(4, 4) m, the URDF's root link in the world, or on the last axis that carries it."""
    carriers = [axis.name for axis in robot.axes if axis.carries == "base"]
    if not carriers:
        return robot.base
    places = {frame.name: frame.placement for frame in robot.model.frames}
    return np.array(places[carriers[-1]].actInv(places[robot.root_link]).homogeneous)


def _joint(joint: JointInfo, parts: Any) -> Any:
    place = np.eye(4)
    place[:3, :3], place[:3, 3] = about_fixed_axes(*joint.rpy), joint.xyz
    low, high = (float(end) if np.isfinite(end) else None for end in joint.limits)
    limit = parts.Limit(velocity=joint.max_velocity, lower=low, upper=high)
    ends = joint.parent, joint.child
    return parts.Joint(joint.name, joint.kind, *ends, place, np.array(joint.axis), limit=limit)


def _visuals(shape: LinkShape, parts: Any) -> Iterator[Any]:
    """One visual; three of a capsule, which yourdfpy does not know."""
    colour = None if shape.rgba is None else parts.Material(color=parts.Color(np.array(shape.rgba)))
    for height, geometry in _parts(shape.geometry, parts):
        place = shape.origin.copy()
        place[:3, 3] += height * place[:3, 2]
        yield parts.Visual(origin=place, geometry=geometry, material=colour)


def _parts(shape: Geometry, parts: Any) -> Iterator[tuple[float, Any]]:
    """Geometries of yourdfpy, each with its height (m) along z."""
    if isinstance(shape, Box):
        yield 0.0, parts.Geometry(box=parts.Box(np.array(shape.size)))
    elif isinstance(shape, Sphere):
        yield 0.0, parts.Geometry(sphere=parts.Sphere(shape.radius))
    elif isinstance(shape, (Cylinder, Capsule)):
        yield 0.0, parts.Geometry(cylinder=parts.Cylinder(shape.radius, shape.length))
        if isinstance(shape, Capsule):
            for end in (-0.5, 0.5):
                ball = parts.Geometry(sphere=parts.Sphere(shape.radius))
                yield end * shape.length, ball
    else:
        yield 0.0, parts.Geometry(mesh=parts.Mesh(shape.path, np.array(shape.scale)))
