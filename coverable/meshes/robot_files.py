"""The mesh files of a robot's links: each read once, within caps on bytes, triangles and time.

They are not trusted. Only the file itself is opened: textures and materials that it names are not.
"""

from __future__ import annotations

import io
import logging
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from coverable.errors import CoverableError
from coverable.files import read_regular, reason
from coverable.meshes.collada_limits import check_collada
from coverable.meshes.mesh_file import read_parts
from coverable.meshes.raw_mesh import MeshError, RawMesh

MOST_TRIANGLES = 1_500_000  # of a robot, each use of a file counted
MOST_SECONDS = 8.0  # of processor time, for a picture


class MeshFiles:
    """Reads the mesh files of one robot."""

    def __init__(
        self,
        clock: Callable[[], float] = time.thread_time,
        most_seconds: float = MOST_SECONDS,
    ) -> None:
        """Start with nothing read.

        Args:
            clock: processor time, s.
            most_seconds: processor time after which no other file is opened.
        """
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
            self._read[path] = self._first_read(Path(path))
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

    def _first_read(self, file: Path) -> list[RawMesh] | MeshError:
        """The parts of a file in its own unit, or what is wrong with it."""
        if self._clock() - self._started > self._most_seconds:
            took = f"reading took more than {self._most_seconds:g} s"
            return MeshError(f"{took}; thin the robot's meshes")
        try:
            return read_parts_of(file)
        except MeshError as error:
            return error


def largest_file(file: Path) -> int:
    """bytes that a mesh of a robot may have; those that are text take longer to read."""
    return 64 << 20 if file.suffix.lower() in (".stl", ".glb", ".dae") else 12 << 20


def read_parts_of(file: Path) -> list[RawMesh]:
    """Read every part of a mesh file.

    Args:
        file: STL, OBJ, PLY, OFF, GLB or DAE.

    Raises:
        MeshError: the file is missing, damaged, too large, or holds no finite triangles.
    """
    try:
        if file.suffix.lower() == ".dae":
            parts = _collada(read_regular(file, largest_file(file), "a mesh of a robot"))
        else:
            parts = read_parts(file, largest_file(file))
    except CoverableError as fault:
        raise MeshError(f"{file.name}: {fault}") from fault
    parts = [part for part in parts if len(part.faces)]
    if not parts:
        raise MeshError(f"{file.name}: holds no triangles")
    if not all(np.isfinite(part.vertices).all() for part in parts):
        raise MeshError(f"{file.name}: has a vertex that is not finite")
    return parts


def _collada(data: bytes) -> list[RawMesh]:
    """A .dae by trimesh, after a look at what would become of it."""
    import trimesh

    check_collada(data)
    log = logging.getLogger("trimesh")
    before = log.level
    log.setLevel(logging.CRITICAL)  # it prints tracebacks about textures
    try:
        # From memory: trimesh cannot know where other files would lie.
        parts = trimesh.load_scene(io.BytesIO(data), file_type="dae").dump()
    except Exception as error:
        raise MeshError(f"cannot be read as a mesh: {reason(error)}") from error
    finally:
        log.setLevel(before)
    return [
        RawMesh(np.asarray(one.vertices, float), np.asarray(one.faces, np.int64), (), _rgba(one))
        for one in parts
        if isinstance(one, trimesh.Trimesh)
    ]


def _rgba(part: Any) -> tuple[float, ...] | None:
    """The colour that a part of trimesh brings along."""
    visual = part.visual
    if visual.kind == "texture":
        rgba = visual.material.main_color
    elif visual.kind in ("vertex", "face"):
        rgba = visual.main_color
    else:
        return None
    return tuple(float(value) / 255.0 for value in rgba)
