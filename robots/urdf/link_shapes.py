"""The shapes of a URDF's links: visuals for pictures, collision shapes for collisions.

A shape that cannot be used is listed with its link and the reason. A robot moves the same with or
without its picture, so a bad visual is a warning too; whoever checks collisions decides what stands
in for a bad collision shape.

The geometry of a <visual> or a <collision>: one shape, and where it is on its link.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from coverable.arrays import Array
from coverable.errors import Fault, listed, worded
from robots.poses import about_fixed_axes
from robots.urdf.elements import BadValue, Faults, Node, Triple, numbers, shown, triple


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
Resolve = Callable[[str], str]
"""The file that a mesh name refers to, see `MeshFolders.resolve`."""


def mesh_paths(shapes: Iterable[LinkShape]) -> list[str]:
    """The mesh files of shapes."""
    return [shape.geometry.path for shape in shapes if isinstance(shape.geometry, MeshFile)]


def read_shape(node: Node, resolve: Resolve) -> tuple[Array, Geometry]:
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
        geometry = _geometry(shapes[0], resolve)
    except KeyError as missing:
        raise _unusable(shapes[0].tag, f"has no {missing.args[0]}") from None
    origin = np.eye(4)
    origin[:3, :3] = about_fixed_axes(*rpy)
    origin[:3, 3] = xyz
    origin.flags.writeable = False
    return origin, geometry


def _geometry(shape: Node, resolve: Resolve) -> Geometry:
    if shape.tag == "mesh":
        name = shape.attributes["filename"]
        x, y, z = triple(shape, "scale", (1.0, 1.0, 1.0))
        if 0.0 in (x, y, z):
            what = "has scale 0; write factors that are not zero"
            raise BadValue(Fault(f"mesh {shown(name)}", what))
        try:
            return MeshFile(resolve(name), (x, y, z))
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


MAX_SHAPES = 2000

Rgba = tuple[float, float, float, float]


@dataclass(frozen=True, eq=False, slots=True)
class LinkShape:
    """One <visual> or <collision> of one link."""

    link: str
    origin: Array
    """(4, 4) the shape's frame in the link's frame, m."""
    geometry: Geometry
    rgba: Rgba | None = None
    """Red, green, blue, opacity in [0, 1]; None where the file gives none."""


@dataclass(frozen=True, slots=True)
class ShapeFault:
    """A shape of a link that cannot be used."""

    link: str
    line: int
    """Of the file; 0 where no single shape is meant."""
    fault: Fault
    """Which shape (`key`), and what is wrong with it."""

    @property
    def why(self) -> str:
        """The fault as a sentence."""
        return f"line {self.line}: {worded(self.fault)}" if self.line else worded(self.fault)


@dataclass(frozen=True, eq=False, slots=True)
class CollisionShapes:
    """What a URDF says about the bodies of its links."""

    shapes: tuple[LinkShape, ...]
    faults: tuple[ShapeFault, ...]
    without: tuple[str, ...]
    """Links that are marked as without collision shapes: `<link name="..." collision="none">`."""


def read_visuals(
    robot: Node, resolve: Resolve, faults: Faults
) -> tuple[tuple[LinkShape, ...], tuple[ShapeFault, ...]]:
    """Every visual that can be drawn, and the others; these become warnings too, one a reason."""
    colours = {
        material.attributes.get("name", ""): _rgba(material) for material in robot.all("material")
    }

    def colour(node: Node) -> Rgba | None:
        material = node.first("material")
        if material is None:
            return None
        name = material.attributes.get("name", "")
        rgba = _rgba(material) or colours.get(name)
        if rgba is not None and name:
            colours.setdefault(name, rgba)
        return rgba

    nodes = [(link, node) for link in robot.all("link") for node in link.all("visual")]
    visuals, unusable = _read(nodes, resolve, colour)
    if len(nodes) > MAX_SHAPES:
        faults.warnings.append(f"not drawn: {len(nodes) - MAX_SHAPES:,} shapes over {MAX_SHAPES:,}")
    problems: dict[str, dict[str, str]] = {}  # reason -> shape -> shape and its first link
    for bad in unusable:
        if bad.line:
            what = bad.fault.key
            first = f"{what} of link {shown(bad.link)} (line {bad.line})".strip()
            problems.setdefault(bad.fault.fault, {}).setdefault(what, first)
    for why, cases in problems.items():
        faults.warnings.append(f"not drawn: {listed([*cases.values()], 1)}: {why}")
    return visuals, unusable


def read_collisions(robot: Node, resolve: Resolve, faults: Faults) -> CollisionShapes:
    """Every collision shape, what is wrong with others, and the links that are meant to have none.

    A <link> with the attribute collision="none" is left without collision shapes on purpose, so
    that its visuals do not stand in for them. The attribute is ours; other readers pass over it.
    """
    links = robot.all("link")
    without = [link for link in links if _is_without(link, faults)]
    nodes = [(link, node) for link in links for node in link.all("collision")]
    shapes, unusable = _read(nodes, resolve)
    return CollisionShapes(shapes, unusable, tuple(link.attributes["name"] for link in without))


def _read(
    nodes: Sequence[tuple[Node, Node]],
    resolve: Resolve,
    colour: Callable[[Node], Rgba | None] = lambda node: None,
) -> tuple[tuple[LinkShape, ...], tuple[ShapeFault, ...]]:
    """The shapes of some nodes, each with its link, and what is wrong with the others."""
    shapes, unusable = list[LinkShape](), list[ShapeFault]()
    for link, node in nodes[:MAX_SHAPES]:
        name = link.attributes["name"]
        try:
            shapes.append(LinkShape(name, *read_shape(node, resolve), colour(node)))
        except BadValue as bad:
            unusable.append(ShapeFault(name, node.line, bad.faults[0]))
    too_many = Fault("", f"there are more than {MAX_SHAPES:,} shapes")
    over = dict.fromkeys(link.attributes["name"] for link, _ in nodes[MAX_SHAPES:])
    unusable += [ShapeFault(name, 0, too_many) for name in over]
    return tuple(shapes), tuple(unusable)


def _is_without(link: Node, faults: Faults) -> bool:
    """Is a link marked as without collision shapes? A mark that is not understood is noted."""
    mark = link.attributes.get("collision")
    if mark is None:
        return False
    shapes = link.all("collision")
    if mark == "none" and not shapes:
        return True
    known = "it has collision shapes" if mark == "none" else 'the one value is "none"'
    name = shown(link.attributes["name"])
    faults.warn(link, f"link {name}: collision={shown(mark)} is ignored: {known}")
    return False


def _rgba(material: Node) -> Rgba | None:
    """The colour of a <material>; None when it has none that can be read."""
    colour = material.first("color")
    if colour is None or "rgba" not in colour.attributes:
        return None
    try:
        given = numbers(colour, "rgba", 4)
    except BadValue:
        return None
    red, green, blue, alpha = (min(max(part, 0.0), 1.0) for part in given)
    return red, green, blue, alpha
