"""Which mesh files a URDF may name: those that are safe to open.

A mesh is taken only when it is a regular file of a known mesh format whose real path, symbolic
links followed, lies inside one of the allowed folders: the URDF's own, the ROS package around it,
`package_dirs`, and the packages that it asks for by the name in their package.xml (`packages`).
"""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator, Sequence
from functools import cached_property
from itertools import accumulate
from pathlib import Path

from robots.urdf.packages import package_around, packages_seen, seen_words
from robots.urdf.xml import BadValue

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


def leaves_package(name: str) -> bool:
    """True for a package:// name that climbs out of its package with '..'."""
    if not name.startswith(_IN_PACKAGE):
        return False
    parts = name.split("://", 1)[1].replace("\\", "/").split("/")
    return min(accumulate({"": 0, ".": 0, "..": -1}.get(part, 1) for part in parts)) < 0
