"""The shapes of a URDF's links for a viewer.

A robot moves the same with or without its picture, so whatever is wrong with a visual is a warning
and the visual is left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robots.urdf.geometry import MAX_SHAPES, Geometry, ShapeFault, plain, read_shape
from robots.urdf.mesh_folders import MeshFolders
from robots.urdf.xml import BadValue, Faults, Node, numbers, shown

Rgba = tuple[float, float, float, float]


@dataclass(frozen=True, eq=False, slots=True)
class Visual:
    """One shape of one link."""

    link: str
    origin: NDArray[np.float64]
    """(4, 4) the shape's frame in the link's frame, m."""
    geometry: Geometry
    rgba: Rgba | None
    """Red, green, blue, opacity in [0, 1]; None where the file gives none."""


def read_visuals(
    robot: Node, folders: MeshFolders, faults: Faults
) -> tuple[tuple[Visual, ...], tuple[ShapeFault, ...]]:
    """Every visual that can be drawn, and the others; these become warnings too, one a reason."""
    colours = {
        material.attributes.get("name", ""): _rgba(material) for material in robot.all("material")
    }
    visuals: list[Visual] = []
    unusable: list[ShapeFault] = []
    problems: dict[str, dict[str, str]] = {}  # reason -> shape -> shape and its first link
    shapes = [
        (link.attributes["name"], node) for link in robot.all("link") for node in link.all("visual")
    ]
    for link, node in shapes[:MAX_SHAPES]:
        try:
            visuals.append(_visual(node, link, folders, colours))
        except BadValue as bad:
            unusable.append(ShapeFault(link, f"line {node.line}: {plain(bad)}"))
            what, _, why = str(bad).rpartition(" :: ")
            case = f"{what} of link {shown(link)} (line {node.line})".strip()
            problems.setdefault(why, {}).setdefault(what, case)
    if len(shapes) > MAX_SHAPES:
        over = dict.fromkeys(link for link, _ in shapes[MAX_SHAPES:])
        unusable += [
            ShapeFault(link, f"there are more than {MAX_SHAPES:,} shapes") for link in over
        ]
        faults.warnings.append(
            f"not drawn: {len(shapes) - MAX_SHAPES:,} shapes over {MAX_SHAPES:,}"
        )
    for why, cases in problems.items():
        more = f" and {len(cases) - 1} more" if len(cases) > 1 else ""
        faults.warnings.append(f"not drawn: {next(iter(cases.values()))}{more}: {why}")
    return tuple(visuals), tuple(unusable)


def _visual(node: Node, link: str, folders: MeshFolders, colours: dict[str, Rgba | None]) -> Visual:
    origin, geometry = read_shape(node, folders)
    material = node.first("material")
    rgba = None
    if material is not None:
        rgba = _rgba(material) or colours.get(material.attributes.get("name", ""))
        if rgba is not None and material.attributes.get("name"):
            colours.setdefault(material.attributes["name"], rgba)
    return Visual(link, origin, geometry, rgba)


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
