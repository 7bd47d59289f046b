"""Triangles of untrusted files, checked before native libraries see them; which bound a solid."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from hashlib import sha256
from pathlib import Path

import numpy as np

from coverable.arrays import Array, Ints, Mask
from coverable.files import FileFault, read_regular
from coverable.meshes.raw_mesh import MeshError, distinct, joined
from coverable.meshes.robot_files import MeshFiles, largest_file
from robots.errors import RobotError
from robots.shapes.bodies import Triangles
from robots.urdf.link_shapes import MeshFile

LARGEST = 1e4  # [m] a coordinate beyond it is no link's
MOST_SECONDS = 60.0  # of processor time for all files of a robot
MOST_KNOWN = 256  # contents that are kept

VOLUME = 1e-9  # [1], of the widest side cubed: triangles around less bound no solid


_known: dict[tuple[bytes, str, tuple[float, float, float]], Triangles] = {}


def checked_triangles(vertices: Array, faces: Ints, what: str = "the mesh") -> Triangles:
    """Triangles that a native library may see.

    Vertices (k, 3) that are equal are joined, and triangles that name a vertex twice are dropped.
    Those of a solid look outwards.

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
    each, number = distinct(points)
    kept = number[corners]
    a, b, c = kept.T
    kept = kept[(a != b) & (b != c) & (c != a)]
    p, q, r = (each[kept[:, k]] for k in range(3))
    if not np.linalg.norm(np.cross(q - p, r - p), axis=1).any():
        raise RobotError(f"{what} has no triangle with an area")
    solid = solid_faces(each, kept)
    kept = kept if solid is None else solid
    each.flags.writeable = kept.flags.writeable = False
    return Triangles(each, kept, closed=solid is not None)


def solid_faces(vertices: Array, faces: Ints) -> Ints | None:
    """The triangles of a solid, looking outwards; None where they are a sheet.

    They bound a solid where each edge has two of them and they enclose a volume; vertices that are
    equal have been joined. Where they do not agree about the outer side, as in careless files, each
    piece is turned to look outwards; where no reversal makes them agree, they are a sheet.
    """
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    upwards = edges[:, 0] < edges[:, 1]
    edges.sort(axis=1)
    number = edges[:, 0] * (int(faces.max()) + 1) + edges[:, 1]
    order = np.argsort(number, kind="stable")
    first, second = order[::2], order[1::2]
    if len(order) % 2 or (number[first] != number[second]).any():
        return None
    if (number[first[1:]] == number[first[:-1]]).any():
        return None
    a, b, c = (vertices[faces[:, k]] - vertices[faces[0, 0]] for k in range(3))
    volumes = np.asarray(np.einsum("ki,ki->k", a, np.cross(b, c)) / 6.0)
    agree = upwards[first] != upwards[second]
    if not agree.all():
        sides = np.column_stack([first, second]) % len(faces)
        turns = _turned(sides, agree, volumes)
        if turns is None:
            return None
        faces = np.where(turns[:, None] < 0, faces[:, ::-1], faces)
        volumes = volumes * turns
    volume = float(volumes.sum())
    wide = float(np.ptp(vertices[faces].reshape(-1, 3), axis=0).max())
    if not abs(volume) > VOLUME * wide**3:
        return None
    return faces[:, ::-1] if volume < 0.0 else faces


def _turned(sides: Ints, agree: Mask, volumes: Array) -> Array | None:
    """(m,) 1 for a triangle to be kept, -1 for one to be turned over; None where nothing helps.

    Each is two nodes of a graph, kept and turned over, and the two at each edge (e, 2) join those
    that agree: a piece is two components, mirror images. That of more volume is taken; a piece with
    one side is one component.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    (a, b), count = sides.T, len(volumes)
    other = np.where(agree, b, b + count)
    first, second = np.append(a, a + count), np.append(other, (other + count) % (2 * count))
    joined = coo_array((np.ones(len(first)), (first, second)), shape=(2 * count, 2 * count))
    nodes = connected_components(joined, directed=False)[1]
    kept, turned = nodes[:count], nodes[count:]
    if (kept == turned).any():
        return None
    whole = np.bincount(nodes, np.append(volumes, -volumes))
    better = np.where(whole[kept] == whole[turned], kept < turned, whole[kept] > whole[turned])
    return np.where(better, 1.0, -1.0)


def mesh_reader(paths: Iterable[str]) -> Callable[[MeshFile], Triangles]:
    """Reads the meshes of one robot's links; each content is read and checked once a process.

    What it gives are triangles, scaled, m; the same object for the same content. It raises a
    RobotError where a file cannot be read, or its triangles cannot be used. The paths are those
    that will be asked for; see `MeshFiles`.
    """
    files = MeshFiles(paths, most_seconds=MOST_SECONDS)

    def read(mesh: MeshFile) -> Triangles:
        file = Path(mesh.path)
        try:
            data = read_regular(file, largest_file(file), "a mesh of a robot")
            key = (sha256(data).digest(), file.suffix.lower(), mesh.scale)
            if key not in _known:
                whole = joined(files.parts(mesh.path))
                with np.errstate(over="ignore"):  # infinite coordinates are refused next
                    made = checked_triangles(whole.vertices * mesh.scale, whole.faces, file.name)
                if len(_known) >= MOST_KNOWN:
                    _known.clear()
                _known[key] = made
            return _known[key]
        except FileFault as fault:
            raise RobotError(fault.faults, file.name) from fault
        except MeshError as fault:
            raise RobotError(fault.faults) from fault

    return read
