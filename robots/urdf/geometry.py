"""The geometry of a <visual> or a <collision>: one shape, and where it is on its link."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coverable.arrays import Array
from coverable.errors import Fault
from robots.mounting.poses import about_fixed_axes
from robots.urdf.mesh_folders import MeshFolders
from robots.urdf.xml import BadValue, Node, Triple, numbers, shown, triple


@dataclass(frozen=True, slots=True)
class MeshFile:
    """A mesh in a file."""

    path: str
    """Absolute, symbolic links resolved; a regular file inside an allowed folder."""
    scale: Triple
    """Factors along x, y, z; never zero, negative ones mirror."""


@dataclass(frozen=True, slots=True)
class Box:
    """A box about its frame's origin."""

    size: Triple
    """Full edge lengths, m."""


@dataclass(frozen=True, slots=True)
class Cylinder:
    """A cylinder along z, its middle at the origin."""

    radius: float
    length: float


@dataclass(frozen=True, slots=True)
class Capsule:
    """A cylinder along z of that length, with a half ball on each end."""

    radius: float
    length: float


@dataclass(frozen=True, slots=True)
class Sphere:
    """A ball about its frame's origin."""

    radius: float


Geometry = MeshFile | Box | Cylinder | Capsule | Sphere


def read_shape(node: Node, folders: MeshFolders) -> tuple[Array, Geometry]:
    """The frame (4, 4) m of a shape in its link's frame, write-protected, and the shape.

    Raises:
        BadValue: there is no shape that can be used; one fault, whose key is the shape.
    """
    shapes = [shape for holder in node.all("geometry") for shape in holder.children]
    if len(shapes) != 1:
        raise _unusable(node.tag, "must hold one <geometry> with one shape")
    origin_node = node.first("origin")
    try:
        xyz = triple(origin_node, "xyz", (0.0, 0.0, 0.0))
        rpy = triple(origin_node, "rpy", (0.0, 0.0, 0.0))
        geometry = _geometry(shapes[0], folders)
    except KeyError as missing:
        raise _unusable(shapes[0].tag, f"has no {missing.args[0]}") from None
    origin = np.eye(4)
    origin[:3, :3] = about_fixed_axes(*rpy)
    origin[:3, 3] = xyz
    origin.flags.writeable = False
    return origin, geometry


def _geometry(shape: Node, folders: MeshFolders) -> Geometry:
    if shape.tag == "mesh":
        name = shape.attributes["filename"]
        x, y, z = triple(shape, "scale", (1.0, 1.0, 1.0))
        if 0.0 in (x, y, z):
            what = "has scale 0; write factors that are not zero"
            raise BadValue(Fault(f"mesh {shown(name)}", what))
        try:
            return MeshFile(folders.resolve(name), (x, y, z))
        except BadValue as bad:
            raise BadValue(Fault(f"mesh {shown(name, 200)}", str(bad))) from None
    if shape.tag == "box":
        a, b, c = (_positive(shape, "size", 3, i) for i in range(3))
        return Box((a, b, c))
    if shape.tag == "sphere":
        return Sphere(_positive(shape, "radius"))
    if shape.tag in ("cylinder", "capsule"):
        radius, length = _positive(shape, "radius"), _positive(shape, "length")
        return (Cylinder if shape.tag == "cylinder" else Capsule)(radius, length)
    raise _unusable(shown(shape.tag)[1:-1], "is no shape of URDF")


def _positive(node: Node, attribute: str, count: int = 1, index: int = 0) -> float:
    value = numbers(node, attribute, count)[index]
    if value <= 0.0:
        raise _unusable(node.tag, f"{attribute} must be above zero")
    return value


def _unusable(tag: str, why: str) -> BadValue:
    return BadValue(Fault(f"a <{tag}>", why))
