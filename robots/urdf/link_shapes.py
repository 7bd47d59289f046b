"""The shapes of a URDF's links: visuals for pictures, collision shapes for collisions.

A shape that cannot be used is listed with its link and the reason. A robot moves the same with or
without its picture, so a bad visual is a warning too; whoever checks collisions decides what stands
in for a bad collision shape.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from coverable.arrays import Array
from coverable.errors import Fault, listed, worded
from robots.urdf.geometry import Geometry, read_shape
from robots.urdf.mesh_folders import MeshFolders
from robots.urdf.xml import BadValue, Faults, Node, numbers, shown

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
    robot: Node, folders: MeshFolders, faults: Faults
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
    visuals, unusable = _read(nodes, folders, colour)
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


def read_collisions(robot: Node, folders: MeshFolders, faults: Faults) -> CollisionShapes:
    """Every collision shape, what is wrong with others, and the links that are meant to have none.

    A <link> with the attribute collision="none" is left without collision shapes on purpose, so
    that its visuals do not stand in for them. The attribute is ours; other readers pass over it.
    """
    links = robot.all("link")
    without = [link for link in links if _is_without(link, faults)]
    nodes = [(link, node) for link in links for node in link.all("collision")]
    shapes, unusable = _read(nodes, folders)
    return CollisionShapes(shapes, unusable, tuple(link.attributes["name"] for link in without))


def _read(
    nodes: Sequence[tuple[Node, Node]],
    folders: MeshFolders,
    colour: Callable[[Node], Rgba | None] = lambda node: None,
) -> tuple[tuple[LinkShape, ...], tuple[ShapeFault, ...]]:
    """The shapes of some nodes, each with its link, and what is wrong with the others."""
    shapes, unusable = list[LinkShape](), list[ShapeFault]()
    for link, node in nodes[:MAX_SHAPES]:
        name = link.attributes["name"]
        try:
            shapes.append(LinkShape(name, *read_shape(node, folders), colour(node)))
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
        red, green, blue, alpha = numbers(colour, "rgba", 4)
    except BadValue:
        return None
    return tuple(min(max(part, 0.0), 1.0) for part in (red, green, blue, alpha))  # type: ignore[return-value]
