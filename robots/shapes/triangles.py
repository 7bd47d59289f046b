"""Triangles from untrusted files, checked before a native library sees them."""

from __future__ import annotations

from hashlib import sha256
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from coverable_files import FileFault, read_regular
from coverable_meshes import MeshError, MeshFiles
from robots.errors import RobotError
from robots.shapes.bodies import Triangles
from robots.shapes.solids import solid_faces
from robots.urdf import MeshFile

LARGEST = 1e4  # [m] a coordinate beyond it is no link's
LARGEST_FILE = 256 << 20  # bytes
MOST_SECONDS = 60.0  # of processor time for all files of a robot
MOST_KNOWN = 256  # contents that are kept

_known: dict[tuple[bytes, str, tuple[float, float, float]], Triangles] = {}


def checked_triangles(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], what: str = "the mesh"
) -> Triangles:
    """Triangles that a native library may see.

    Vertices that are equal are joined, and triangles that name a vertex twice are dropped. Those
    of a solid look outwards.

    Args:
        vertices: (k, 3) m.
        faces: (m, 3) indices of vertices.
        what: has the triangles, for the message.

    Raises:
        RobotError: a number is not finite or beyond 10 km, an index names no vertex, or no triangle
            has an area.
    """
    points, corners = np.asarray(vertices, dtype=float), np.asarray(faces, dtype=np.int64)
    faults = []
    if points.ndim != 2 or points.shape[1:] != (3,) or not np.isfinite(points).all():
        faults.append(f"{what} has vertices that are not three finite numbers")
    elif len(points) and np.abs(points).max() > LARGEST:
        wide = np.abs(points).max()
        faults.append(
            f"{what} reaches {wide:.4g} m from its frame, more than {LARGEST:g} m; if it is in "
            'millimetres, write scale="0.001 0.001 0.001"'
        )
    if corners.ndim != 2 or corners.shape[1:] != (3,) or len(corners) == 0:
        faults.append(f"{what} has no triangles")
    elif not 0 <= corners.min() <= corners.max() < len(points):
        faults.append(f"{what} names a vertex that it does not have; it is damaged")
    if faults:
        raise RobotError(faults)
    joined, number = _joined(points)
    kept = number[corners]
    a, b, c = kept.T
    kept = kept[(a != b) & (b != c) & (c != a)]
    p, q, r = (joined[kept[:, k]] for k in range(3))
    if not np.linalg.norm(np.cross(q - p, r - p), axis=1).any():
        raise RobotError(f"{what} has no triangle with an area")
    solid = solid_faces(joined, kept)
    kept = kept if solid is None else solid
    joined.flags.writeable = kept.flags.writeable = False
    return Triangles(joined, kept, closed=solid is not None)


def _joined(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Each point once, and where each of those given is; ten times as fast as `np.unique`."""
    order = np.lexsort(points.T)
    sorted_points = points[order]
    is_new = np.ones(len(points), dtype=bool)
    is_new[1:] = (sorted_points[1:] != sorted_points[:-1]).any(axis=1)
    number = np.empty(len(points), dtype=np.int64)
    number[order] = np.cumsum(is_new) - 1
    return sorted_points[is_new], number


class MeshBodies:
    """The meshes of one robot's links; each content is read and checked once a process."""

    def __init__(self) -> None:
        """Start with nothing read."""
        self._files = MeshFiles(most_seconds=MOST_SECONDS)
        self._digests: dict[str, bytes] = {}

    def read(self, mesh: MeshFile) -> Triangles:
        """The triangles of a mesh file, scaled, m; the same object for the same content.

        Raises:
            RobotError: the file cannot be read, or its triangles cannot be used.
        """
        try:
            if mesh.path not in self._digests:
                data = read_regular(mesh.path, LARGEST_FILE, "a mesh of a robot")
                self._digests[mesh.path] = sha256(data).digest()
            key = (self._digests[mesh.path], Path(mesh.path).suffix.lower(), mesh.scale)
            if key not in _known:
                read = self._first_read(mesh)
                if len(_known) >= MOST_KNOWN:
                    _known.clear()
                _known[key] = read
            return _known[key]
        except FileFault as fault:
            raise RobotError(fault.faults, Path(mesh.path).name) from fault
        except MeshError as fault:
            raise RobotError(fault.faults) from fault

    def _first_read(self, mesh: MeshFile) -> Triangles:
        parts = self._files.parts(mesh.path)
        starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
        with np.errstate(over="ignore"):  # infinite coordinates are refused next
            vertices = np.concatenate([part.vertices for part in parts]) * mesh.scale
        faces = [part.faces + start for part, start in zip(parts, starts, strict=False)]
        return checked_triangles(vertices, np.concatenate(faces), Path(mesh.path).name)
