"""What is a solid, of links and of objects alike: closed triangles around a volume."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Faces = NDArray[np.int64]

VOLUME = 1e-9  # [1], of the widest side cubed: triangles around less bound no solid


def solid_faces(vertices: Array, faces: Faces) -> Faces | None:
    """The triangles of a solid, looking outwards; None where they are a sheet.

    They bound a solid where each edge has two of them and they enclose a volume. Where they do not
    agree about the outer side, as in careless files, each piece is turned to look outwards; where
    no turning makes them agree, they are a sheet.

    Args:
        vertices: (k, 3) m, equal ones joined.
        faces: (m, 3) indices of vertices, m >= 1.
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
    volumes = _volumes(vertices, faces)
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


def _volumes(vertices: Array, faces: Faces) -> Array:
    """(m,) m^3, signed, between each triangle and one of the corners."""
    corners = vertices[faces]
    a, b, c = (corners[:, k] - corners[0, 0] for k in range(3))
    return np.asarray(np.einsum("ki,ki->k", a, np.cross(b, c)) / 6.0)


def _turned(sides: Faces, agree: NDArray[np.bool_], volumes: Array) -> Array | None:
    """(m,) 1 for a triangle to be kept, -1 for one to be turned over; None where nothing helps.

    Args:
        sides: (e, 2) the two triangles at each edge.
        agree: (e,) whether they do.
        volumes: (m,) of the triangles as they are.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import breadth_first_order, connected_components

    count = len(volumes)
    kept = {}
    for (a, b), same in zip(sides.tolist(), agree.tolist(), strict=True):
        kept[a, b] = kept[b, a] = 1.0 if same else -1.0
    graph = coo_array((np.ones(len(sides)), sides.T), shape=(count, count)).tocsr()
    turns = np.ones(count)
    pieces, piece = connected_components(graph, directed=False)
    for k in range(pieces):
        start = int(np.argmax(piece == k))
        order, before = breadth_first_order(graph, start, directed=False)
        for face in order[1:].tolist():
            turns[face] = turns[before[face]] * kept[int(before[face]), face]
        if volumes[order] @ turns[order] < 0.0:
            turns[order] *= -1.0
    if ((turns[sides[:, 0]] == turns[sides[:, 1]]) != agree).any():
        return None
    return turns
