"""The shapes of a URDF's links for a viewer, with mesh files that are safe to open.

A robot moves the same with or without its picture, so whatever is wrong with a visual is a warning
and the visual is left out. A mesh is listed only when it is a regular file of a known mesh format
whose real path, symbolic links followed, lies inside one of the allowed folders: the URDF's own,
the ROS package around it, and `package_dirs`.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from robots.urdf.xml import BadValue, Faults, Node, Triple, numbers, shown, triple

# .gltf and the like pull in other files.
MESH_SUFFIXES = (".stl", ".dae", ".obj", ".ply", ".off", ".glb")
MAX_MESH_BYTES = 256 * 2**20
MAX_VISUALS = 2000
MAX_PATH = 500  # characters; following a path takes time for each of its parts
PACKAGE_LEVELS = 5  # how far above the URDF a package.xml is looked for

Rgba = tuple[float, float, float, float]


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


@dataclass(frozen=True, eq=False, slots=True)
class Visual:
    """One shape of one link."""

    link: str
    origin: NDArray[np.float64]
    """(4, 4) the shape's frame in the link's frame, m."""
    geometry: Geometry
    rgba: Rgba | None
    """Red, green, blue, opacity in [0, 1]; None where the file gives none."""


class MeshFolders:
    """Where meshes may come from, and how a mesh name in the file becomes a path."""

    def __init__(self, base_dir: str | None, package_dirs: Sequence[str]) -> None:
        """Collect the allowed folders; none are opened."""
        self.base = Path(base_dir) if base_dir is not None else None
        self.packages = [Path(folder) for folder in package_dirs]
        self.own_package = _package_around(self.base) if self.base else None
        allowed = [self.base, self.own_package, *self.packages]
        self.allowed = [Path(os.path.realpath(folder)) for folder in allowed if folder is not None]

    def candidates(self, name: str) -> list[Path]:
        """Paths that a mesh name may refer to, best first; they need not exist."""
        if name.startswith(("package://", "model://")):
            inner = name.split("://", 1)[1].lstrip("/")
            package, _, rest = inner.partition("/")
            paths = [folder / inner for folder in self.packages]
            roots = [*self.packages, self.own_package, self.base]
            paths += [root / rest for root in roots if root is not None and root.name == package]
            if self.base is not None:
                paths.append(self.base / inner)
            return paths
        if name.startswith("file://"):
            name = name.removeprefix("file://")
        if os.path.isabs(name):
            return [Path(name)]
        return [folder / name for folder in [self.base, *self.packages] if folder is not None]

    def resolve(self, name: str) -> str:
        """The file that a mesh name refers to.

        Raises:
            BadValue: there is none that may be opened, and why.
        """
        if not name or not name.isprintable() or len(name) > MAX_PATH:
            raise BadValue("has no usable name")
        if "://" in name and not name.startswith(("package://", "model://", "file://")):
            raise BadValue("is not a file; download it and name the file")
        if not name.lower().endswith(MESH_SUFFIXES):
            raise BadValue(f"is not one of {' '.join(MESH_SUFFIXES)}")
        outside = None
        for candidate in self.candidates(name):
            real = Path(os.path.realpath(candidate))
            if not any(real.is_relative_to(folder) for folder in self.allowed):
                outside = outside or real
                continue
            try:
                status = os.stat(real)
            except (OSError, ValueError):
                continue
            if not stat.S_ISREG(status.st_mode):
                raise BadValue("is not a regular file")
            if status.st_size > MAX_MESH_BYTES:
                raise BadValue(f"has {status.st_size:,} bytes, over {MAX_MESH_BYTES:,}")
            return str(real)
        if outside is not None:
            raise BadValue(
                "lies outside the folders that meshes may come from; add its folder to package_dirs"
            )
        raise BadValue("is not found; add the folder above its package to package_dirs")


def _package_around(folder: Path) -> Path | None:
    """The nearest folder at or above `folder` that is a ROS package, so ../meshes works in one."""
    folder = Path(os.path.abspath(folder))
    around = [folder, *folder.parents][:PACKAGE_LEVELS]
    return next((here for here in around if os.path.isfile(here / "package.xml")), None)


def leaves_package(name: str) -> bool:
    """True for a package:// name that climbs out of its package with '..'."""
    if not name.startswith(("package://", "model://")):
        return False
    parts = name.split("://", 1)[1].replace("\\", "/").split("/")
    return min(accumulate({"": 0, ".": 0, "..": -1}.get(part, 1) for part in parts)) < 0


def read_visuals(robot: Node, folders: MeshFolders, faults: Faults) -> tuple[Visual, ...]:
    """Every visual that can be drawn; the others become warnings, one a reason."""
    colours = {
        material.attributes.get("name", ""): _rgba(material) for material in robot.all("material")
    }
    visuals: list[Visual] = []
    problems: dict[str, dict[str, str]] = {}  # reason -> shape -> shape and its first link
    shapes = [
        (link.attributes["name"], node) for link in robot.all("link") for node in link.all("visual")
    ]
    for link, node in shapes[:MAX_VISUALS]:
        try:
            visuals.append(_visual(node, link, folders, colours))
        except BadValue as bad:
            what, _, why = str(bad).rpartition(" :: ")
            case = f"{what} of link {shown(link)} (line {node.line})".strip()
            problems.setdefault(why, {}).setdefault(what, case)
    if len(shapes) > MAX_VISUALS:
        faults.warnings.append(
            f"not drawn: {len(shapes) - MAX_VISUALS:,} shapes over {MAX_VISUALS:,}"
        )
    for why, cases in problems.items():
        more = f" and {len(cases) - 1} more" if len(cases) > 1 else ""
        faults.warnings.append(f"not drawn: {next(iter(cases.values()))}{more}: {why}")
    return tuple(visuals)


def _visual(node: Node, link: str, folders: MeshFolders, colours: dict[str, Rgba | None]) -> Visual:
    shapes = [shape for holder in node.all("geometry") for shape in holder.children]
    if len(shapes) != 1:
        raise BadValue("a <visual> :: must hold one <geometry> with one shape")
    origin_node = node.first("origin")
    try:
        xyz = triple(origin_node, "xyz", (0.0, 0.0, 0.0))
        rpy = triple(origin_node, "rpy", (0.0, 0.0, 0.0))
        geometry = _geometry(shapes[0], folders)
    except KeyError as missing:
        raise BadValue(f"a <{shapes[0].tag}> :: has no {missing.args[0]}") from None
    origin = np.eye(4)
    origin[:3, :3] = Rotation.from_euler("xyz", rpy).as_matrix()  # about fixed axes
    origin[:3, 3] = xyz
    origin.flags.writeable = False
    material = node.first("material")
    rgba = None
    if material is not None:
        rgba = _rgba(material) or colours.get(material.attributes.get("name", ""))
        if rgba is not None and material.attributes.get("name"):
            colours.setdefault(material.attributes["name"], rgba)
    return Visual(link, origin, geometry, rgba)


def _geometry(shape: Node, folders: MeshFolders) -> Geometry:
    if shape.tag == "mesh":
        name = shape.attributes["filename"]
        x, y, z = triple(shape, "scale", (1.0, 1.0, 1.0))
        if 0.0 in (x, y, z):
            raise BadValue(f"mesh {shown(name)} :: has scale 0; write factors that are not zero")
        try:
            return MeshFile(folders.resolve(name), (x, y, z))
        except BadValue as bad:
            raise BadValue(f"mesh {shown(name, 200)} :: {bad}") from None
    if shape.tag == "box":
        a, b, c = (_positive(shape, "size", 3, i) for i in range(3))
        return Box((a, b, c))
    if shape.tag == "sphere":
        return Sphere(_positive(shape, "radius"))
    if shape.tag in ("cylinder", "capsule"):
        radius, length = _positive(shape, "radius"), _positive(shape, "length")
        return (Cylinder if shape.tag == "cylinder" else Capsule)(radius, length)
    raise BadValue(f"a <{shown(shape.tag)[1:-1]}> :: is no shape of URDF")


def _positive(node: Node, attribute: str, count: int = 1, index: int = 0) -> float:
    value = numbers(node, attribute, count)[index]
    if value <= 0.0:
        raise BadValue(f"a <{node.tag}> :: {attribute} must be above zero")
    return value


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
