"""xacro files into URDF, through the package xacro of the extra `coverable[xacro]`.

A xacro file is a program: it includes files, evaluates Python and may never end. It runs in a
process of its own (`xacro_child`), without environment, with caps on memory, processor time and
output, and reads nothing but the folders that its meshes may come from too.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from coverable.errors import Fault
from coverable.files import Remembered
from coverable.processes import Limits, folder_of, run_apart
from robots.urdf.elements import MAX_BYTES, UrdfError, read_bytes
from robots.urdf.mesh_folders import MeshFolders, seen_words

EXTRA = "needs the extra: pip install 'coverable[xacro]'"
CHILD = Path(__file__).with_name("xacro_child.py")


class Caps(NamedTuple):
    """What expanding one file may use; the xacro of a humanoid takes 2 s and 100 MB."""

    seconds: int = 20
    """Of processor time."""
    waiting: float = 300.0
    """s, for a machine that is busy with other things."""
    memory: int = 2**30
    """bytes of address space"""
    bytes: int = MAX_BYTES
    """The largest file that is read, and the largest URDF that is made."""


CAPS = Caps()
LISTED = 2**22  # bytes that the names of the files may take


class Expansion(NamedTuple):
    """What a xacro file stands for."""

    text: bytes
    """A URDF, as UTF-8."""
    files: tuple[str, ...]
    """Absolute paths that were looked at: the file, what it includes, and folders with patterns."""


_known = Remembered[Expansion](most=16)


def expanded(
    path: str, package_dirs: Sequence[str] = (), args: Mapping[str, Any] = {}, caps: Caps = CAPS
) -> Expansion:
    """Expand a xacro file into the text of a URDF; again only where a file has changed.

    Args:
        path: the file.
        package_dirs: folders that hold the packages of $(find ...); with them, the file's own
            folder, the ROS package around it and the packages it asks for by the name in their
            package.xml (`robots.urdf.mesh_folders`), all that the file may read.
        args: its arguments: texts, numbers and truth values.
        caps: of the process.

    Raises:
        UrdfError: the extra is missing; the file cannot be read, or expanded within the caps.
    """
    read_bytes(path)
    library = [folder_of(package) for package in ("xacro", "yaml")]
    if None in library:
        raise UrdfError(EXTRA, path)
    path = os.path.abspath(path)
    base = os.path.dirname(path)
    mesh_folders = MeshFolders(base, [os.path.abspath(folder) for folder in package_dirs])
    roots = [*mesh_folders.packages, *filter(None, (mesh_folders.own_package, mesh_folders.base))]
    job = {
        "path": path,
        "library": library,
        "folders": [os.path.join(str(folder), "") for folder in mesh_folders.allowed],
        "packages": [str(folder) for folder in (*mesh_folders.packages, base)],
        "roots": [str(folder) for folder in roots],
        "seen": {name: str(folder) for name, folder in mesh_folders.seen.items()},
        "unseen": seen_words(list(mesh_folders.seen)),
        "args": {name: _text(value) for name, value in args.items()},
        "bytes": caps.bytes,
    }
    given = json.dumps(job)
    return _known.get((given, caps), lambda: _expanded(given, path, caps))


def _expanded(job: str, path: str, caps: Caps) -> Expansion:
    """What the process makes of a job."""
    kind, _, answer = _run(job, path, caps).partition(b"\n")
    listed, _, text = answer.partition(b"\n")
    try:
        said = json.loads(answer if kind == b"fault" else listed)
    except ValueError:
        said = None
    if kind == b"urdf" and isinstance(said, list) and all(isinstance(file, str) for file in said):
        return Expansion(text, tuple(said))
    said = said if isinstance(said, dict) else {}
    what = str(said.get("fault", "cannot be expanded: its process broke off"))
    raise UrdfError(Fault("", what, str(said.get("place", ""))), path)


def _run(job: str, path: str, caps: Caps) -> bytes:
    """What the process writes about a job.

    Raises:
        UrdfError: it took too long.
    """
    limits = Limits(caps.memory, caps.seconds, caps.bytes + LISTED)
    ended = run_apart(CHILD, job.encode(), caps.waiting, limits)
    if ended.too_late:
        raise UrdfError(f"could not be expanded within {caps.waiting:g} s", path)
    if ended.too_slow:
        raise UrdfError(
            f"takes more than {caps.seconds} s of processor time to expand; does a macro or an "
            "expression grow without bound?",
            path,
        )
    return ended.written


def _text(value: Any) -> str:
    """An argument as the command line of xacro would have it."""
    return str(value).lower() if isinstance(value, bool) else str(value)
