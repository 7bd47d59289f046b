"""The files that a URDF or an SRDF names, and those that these name in turn."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from coverable.files import Remembered
from robots.urdf.checked_urdf import check_urdf
from robots.urdf.elements import is_xacro


class _Named(NamedTuple):
    files: tuple[str, ...]


_known = Remembered[_Named](most=64)


def files_named_by(
    path: str,
    package_dirs: Sequence[str] = (),
    xacro_args: Mapping[str, Any] = {},
    *,
    meshes: bool,
) -> tuple[str, ...]:
    """Paths that reading a URDF or an SRDF looks at, without the file itself.

    They need not exist: what is looked for and not found counts once it is there.

    Args:
        path: the file; only a .xacro file leads to others, besides meshes.
        package_dirs, xacro_args: as in `check_urdf`.
        meshes: with those of a URDF's links.

    Raises:
        UrdfError: the file cannot be read.
    """
    path, read = os.path.abspath(path), tuple[str, ...]()
    if is_xacro(path):
        from robots.urdf.xacro_files import expanded

        read = expanded(path, tuple(package_dirs), xacro_args).files
    found = dict.fromkeys(read)
    if meshes:
        key = path, tuple(package_dirs), repr(xacro_args)

        def named() -> _Named:
            checked = check_urdf(path, package_dirs, xacro_args=xacro_args)
            return _Named((path, *read, *checked.mesh_paths))

        found |= dict.fromkeys(_known.get(key, named).files)
    found.pop(path, None)
    return tuple(found)
