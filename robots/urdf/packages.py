"""ROS packages by the name in their package.xml, whatever the folders are called that hold them."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from coverable.errors import listed
from coverable.files import FileFault, read_regular
from robots.urdf.xml import UrdfError, parse_xml

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
