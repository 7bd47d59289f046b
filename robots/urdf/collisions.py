"""The shapes of a URDF's links for questions about collisions.

None is left out without a word: a shape that cannot be used is listed with its link and the reason,
and whoever asks about collisions decides what stands in for it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robots.urdf.geometry import MAX_SHAPES, Geometry, ShapeFault, plain, read_shape
from robots.urdf.mesh_folders import MeshFolders
from robots.urdf.xml import BadValue, Faults, Node, shown


@dataclass(frozen=True, eq=False, slots=True)
class CollisionShape:
    """One <collision> of one link."""

    link: str
    origin: NDArray[np.float64]
    """(4, 4) the shape's frame in the link's frame, m."""
    geometry: Geometry


@dataclass(frozen=True, eq=False, slots=True)
class CollisionShapes:
    """What a URDF says about the bodies of its links."""

    shapes: tuple[CollisionShape, ...]
    faults: tuple[ShapeFault, ...]
    without: tuple[str, ...]
    """Links that are marked as without collision shapes: `<link name="..." collision="none">`."""


def read_collisions(robot: Node, folders: MeshFolders, faults: Faults) -> CollisionShapes:
    """Every collision shape, what is wrong with others, and the links that are meant to have none.

    A <link> with the attribute collision="none" is left without collision shapes on purpose, so
    that its visuals do not stand in for them. The attribute is ours; other readers pass over it.
    """
    shapes: list[CollisionShape] = []
    unusable: list[ShapeFault] = []
    without: list[str] = []
    for link in robot.all("link"):
        name = link.attributes["name"]
        nodes = link.all("collision")
        if _is_without(link, name, nodes, faults):
            without.append(name)
            continue
        for node in nodes:
            if len(shapes) + len(unusable) >= MAX_SHAPES:
                unusable.append(ShapeFault(name, f"there are more than {MAX_SHAPES:,} shapes"))
                break
            try:
                shapes.append(CollisionShape(name, *read_shape(node, folders)))
            except BadValue as bad:
                unusable.append(ShapeFault(name, f"line {node.line}: {plain(bad)}"))
    return CollisionShapes(tuple(shapes), tuple(unusable), tuple(without))


def _is_without(link: Node, name: str, nodes: list[Node], faults: Faults) -> bool:
    """Is a link marked as without collision shapes? A mark that is not understood is noted."""
    mark = link.attributes.get("collision")
    if mark is None:
        return False
    if mark == "none" and not nodes:
        return True
    known = "it has collision shapes" if mark == "none" else 'the one value is "none"'
    faults.warn(link, f"link {shown(name)}: collision={shown(mark)} is ignored: {known}")
    return False
