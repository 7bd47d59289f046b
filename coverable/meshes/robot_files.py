"""The mesh files of a robot's links: each read once, within caps on bytes, triangles and time.

They are not trusted. Only the file itself is opened: textures and materials that it names are not.
Those of COLLADA (.dae) are read together, by a process of their own.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

from coverable.errors import CoverableError
from coverable.files import read_regular
from coverable.meshes.collada import MOST_TRIANGLES, read_collada
from coverable.meshes.mesh_file import read_parts
from coverable.meshes.raw_mesh import MeshError, RawMesh

MOST_BYTES = 256 << 20  # of .dae files that are read together; the last may exceed it
MOST_SECONDS = 8.0  # of processor time, for a picture
KEPT = 3  # arms
_LAST: dict[tuple[bytes, ...], list[list[RawMesh] | MeshError]] = {}
"""The .dae files that were read last, and what is in them: arms are loaded again and again."""


class MeshFiles:
    """Reads the mesh files of one robot."""

    def __init__(
        self,
        paths: Iterable[str] = (),
        clock: Callable[[], float] = time.thread_time,
        most_seconds: float = MOST_SECONDS,
    ) -> None:
        """Start with nothing read.

        Args:
            paths: of files that will be asked for: .dae files are read together.
            clock: processor time, s.
            most_seconds: processor time after which no other file is opened.
        """
        self._paths = tuple(dict.fromkeys(paths))
        self._clock = clock
        self._most_seconds = most_seconds
        self._started = clock()
        self._read: dict[str, list[RawMesh] | MeshError] = {}
        self._triangles = 0

    def parts(self, path: str) -> list[RawMesh]:
        """The parts of a mesh file.

        Args:
            path: of a file that may be opened.

        Raises:
            MeshError: it is no mesh, or with it the robot has too many triangles.
        """
        if path not in self._read:
            self._first_read(path)
        found = self._read[path]
        if isinstance(found, MeshError):
            raise MeshError(found.faults)
        self.count(sum(len(part.faces) for part in found))
        return found

    def count(self, triangles: int) -> None:
        """Count triangles that will be used.

        Raises:
            MeshError: they are too many.
        """
        if self._triangles + triangles > MOST_TRIANGLES:
            raise MeshError(
                f"the robot's shapes have more than {MOST_TRIANGLES:,} triangles; thin its meshes"
            )
        self._triangles += triangles

    def _first_read(self, path: str) -> None:
        """Read a file in its own unit, or find what is wrong with it."""
        file = Path(path)
        if self._clock() - self._started > self._most_seconds:
            took = f"reading took more than {self._most_seconds:g} s"
            self._read[path] = MeshError(f"{took}; thin the robot's meshes")
        elif file.suffix.lower() == ".dae":
            self._read_collada(path)
        else:
            try:
                self._read[path] = _usable(file, read_parts(file, largest_file(file)))
            except CoverableError as fault:
                self._read[path] = _refused(file, fault)

    def _read_collada(self, path: str) -> None:
        """Read a .dae file, and with it the others that will be asked for."""
        given, size = dict[str, bytes](), 0
        for one in dict.fromkeys((path, *self._paths)):
            file = Path(one)
            if one in self._read or file.suffix.lower() != ".dae" or size > MOST_BYTES:
                continue
            try:
                given[one] = read_regular(file, largest_file(file), "a mesh of a robot")
                size += len(given[one])
            except CoverableError as fault:
                self._read[one] = _refused(file, fault)
        for one, found in zip(given, _read_once(tuple(given.values())), strict=True):
            file = Path(one)
            if isinstance(found, MeshError):
                self._read[one] = _refused(file, found)
            else:
                self._read[one] = _usable(file, found)


def _read_once(files: tuple[bytes, ...]) -> list[list[RawMesh] | MeshError]:
    """`read_collada`; what is wrong with files may be a matter of time, and is looked at anew."""
    known = _LAST.get(files)
    if known is not None:
        return known
    found = read_collada(files)
    if not any(isinstance(one, MeshError) for one in found):
        if len(_LAST) >= KEPT:
            del _LAST[next(iter(_LAST))]
        _LAST[files] = found
    return found


def largest_file(file: Path) -> int:
    """bytes that a mesh of a robot may have; those that are text take longer to read."""
    return 64 << 20 if file.suffix.lower() in (".stl", ".glb", ".dae") else 12 << 20


def _refused(file: Path, fault: CoverableError) -> MeshError:
    return MeshError(f"{file.name}: {fault}")


def _usable(file: Path, found: list[RawMesh]) -> list[RawMesh] | MeshError:
    """The parts of a file that have triangles, or what is wrong with it."""
    parts = [part for part in found if len(part.faces)]
    if not parts:
        return _refused(file, MeshError("holds no triangles"))
    if not all(np.isfinite(part.vertices).all() for part in parts):
        return _refused(file, MeshError("has a vertex that is not finite"))
    return parts
