"""Which mesh files a URDF may name: those that are safe to open.

A mesh is taken only when it is a regular file of a known mesh format whose real path, symbolic
links followed, lies inside one of the allowed folders: the URDF's own, the ROS package around it,
`package_dirs`, and the packages that it asks for by the name in their package.xml (`packages`).

ROS packages by the name in their package.xml, whatever the folders are called that hold them.
"""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Iterable, Iterator, Sequence
from functools import cached_property
from pathlib import Path

from coverable.errors import listed
from coverable.files import FileFault, read_regular
from robots.urdf.elements import BadValue, UrdfError, parse_xml

PACKAGE_LEVELS = 5  # how far above the URDF a package.xml is looked for
DEPTH = 4  # how far below a folder of package_dirs
MOST_FOLDERS = 2_000  # that are looked into for one file
MAX_BYTES = 2**16  # of a package.xml
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,99}", re.ASCII)


def package_around(folder: Path) -> Path | None:
    """The nearest folder at or above `folder` that is a ROS package, so ../meshes works in one."""
    return next((here for here in _above(folder) if os.path.isfile(here / "package.xml")), None)


def packages_seen(base: Path, package_dirs: Iterable[Path]) -> dict[str, Path]:
    """The folders of packages by name: below `package_dirs`, above `base`, and next to it.

    Next to it are the folders in `base`, and those beside the package that `base` belongs to.
    Links to other places are not followed.

    Args:
        base: the folder of a URDF.
        package_dirs: folders that were named for this.
    """
    own, found = package_around(base), dict[str, Path]()
    looked = [folder for top in package_dirs for folder in _below(top, DEPTH)]
    beside = [folder for top in (base, own and own.parent) if top for folder in _below(top, 1)]
    for folder in [*looked, *_above(base), *beside][:MOST_FOLDERS]:
        name = _name_in(folder)
        if name:
            found.setdefault(name, folder)
    return found


def seen_words(names: Sequence[str]) -> str:
    """Which packages were seen, for a message about one that was not.

    Example:
        >>> seen_words(["ur_description"])
        'packages seen: ur_description'
    """
    return f"packages seen: {listed(sorted(names), 8)}" if names else "no package was seen"


def _above(folder: Path) -> list[Path]:
    """A folder and those above it."""
    folder = Path(os.path.abspath(folder))
    return [folder, *folder.parents][:PACKAGE_LEVELS]


def _below(top: Path, depth: int) -> Iterator[Path]:
    """A folder and those below it, by name, level by level; what is in a package is left out."""
    level = [top]
    for left in range(depth, -1, -1):
        yield from level
        if left:
            inner = [here for here in level if not os.path.isfile(here / "package.xml")]
            level = [folder for here in inner for folder in _folders(here)][:MOST_FOLDERS]


def _folders(folder: Path) -> list[Path]:
    """The folders in a folder that are no links, and not hidden."""
    try:
        with os.scandir(folder) as entries:
            names = [
                entry.name
                for _, entry in zip(range(MOST_FOLDERS), entries, strict=False)
                if not entry.name.startswith(".") and entry.is_dir(follow_symlinks=False)
            ]
    except OSError:
        return []
    return [folder / name for name in sorted(names)]


def _name_in(folder: Path) -> str:
    """The name in the package.xml of a folder; empty where there is none that can be read."""
    path = str(folder / "package.xml")
    if not os.path.isfile(path):
        return ""
    try:
        root = parse_xml(read_regular(path, MAX_BYTES, "a package.xml", "it is none"), path)
    except (FileFault, UrdfError):
        return ""
    node = root.first("name") if root.tag == "package" else None
    name = "" if node is None else node.text.strip()
    return name if _NAME.fullmatch(name) else ""


# .gltf and the like pull in other files.
MESH_SUFFIXES = (".stl", ".dae", ".obj", ".ply", ".off", ".glb")
_IN_PACKAGE = ("package://", "model://")
MAX_PATH = 500  # characters; following a path takes time for each of its parts


class MeshFolders:
    """Where meshes may come from, and how a mesh name in the file becomes a path."""

    def __init__(self, base_dir: str, package_dirs: Sequence[str]) -> None:
        """Collect the allowed folders; none are opened."""
        self.tried: dict[str, None] = {}  # allowed paths that were looked at
        self.base = Path(base_dir)
        self.packages = [Path(folder) for folder in package_dirs]
        self.own_package = package_around(self.base)
        allowed = [self.base, self.own_package, *self.packages]
        self.allowed = [Path(os.path.realpath(folder)) for folder in allowed if folder is not None]

    @cached_property
    def seen(self) -> dict[str, Path]:
        """Folders of packages by the name in their package.xml."""
        return packages_seen(self.base, self.packages)

    def candidates(self, name: str) -> Iterator[Path]:
        """Paths that a mesh name may refer to, best first; they need not exist."""
        if name.startswith(_IN_PACKAGE):
            inner = name.split("://", 1)[1].lstrip("/")
            package, _, rest = inner.partition("/")
            yield from (folder / inner for folder in self.packages)
            roots = [*self.packages, self.own_package, self.base]
            yield from (root / rest for root in roots if root is not None and root.name == package)
            yield self.base / inner
            if package in self.seen:
                self.allowed.append(Path(os.path.realpath(self.seen[package])))
                yield self.seen[package] / rest
            return
        if name.startswith("file://"):
            name = name.removeprefix("file://")
        if os.path.isabs(name):
            yield Path(name)
        else:
            yield from (folder / name for folder in [self.base, *self.packages])

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
            self.tried[str(candidate)] = None
            try:
                status = os.stat(real)
            except (OSError, ValueError):
                continue
            if not stat.S_ISREG(status.st_mode):
                raise BadValue("is not a regular file")
            return str(real)
        if outside is not None:
            raise BadValue(
                "lies outside the folders that meshes may come from; add its folder to package_dirs"
            )
        seen = f" ({seen_words(list(self.seen))})" if name.startswith(_IN_PACKAGE) else ""
        raise BadValue(f"is not found; add the folder above its package to package_dirs{seen}")
