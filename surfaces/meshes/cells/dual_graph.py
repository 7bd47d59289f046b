"""Which faces of a triangle mesh touch, and how far it is from one to the next."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from surfaces.surface import SurfaceError

NONE = -1  # where an edge has no face on its other side


class FaceGraph(NamedTuple):
    """Faces as nodes, joined across the edges they share. Edge k of a face is from its vertex k."""

    across: NDArray[np.int64]
    """(F, 3) the face on the other side of each edge, or -1 at the border of the mesh."""
    step: NDArray[np.float64]
    """(F, 3) m, from a face's centre over the middle of the edge to the other's centre; 0 at
    the border."""
    edge: NDArray[np.float64]
    """(F, 3) m, lengths of the edges."""
    centre: NDArray[np.float64]
    """(F, 3) m, the mean of each face's vertices."""
    normal: NDArray[np.float64]
    """(F, 3) unit normals; zero for a face without area."""
    area: NDArray[np.float64]
    """(F,) m^2."""
    piece: NDArray[np.int64]
    """(F,) which connected piece each face belongs to, counted from 0 in the order of faces."""


def face_graph(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> FaceGraph:
    """The graph of the faces of a clean mesh.

    Args:
        vertices: (V, 3) m.
        faces: (F, 3) vertex indices, counter-clockwise seen from outside.

    Raises:
        SurfaceError: three faces meet at an edge, or two that run along it in the same direction.
    """
    partner = edge_partners(faces, len(vertices))
    across = np.where(partner >= 0, partner // 3, NONE)
    corners = vertices[faces]
    centre = corners.mean(axis=1)
    double = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(double, axis=1)
    normal = double / np.where(length > 0.0, length, 1.0)[:, None]
    following = np.roll(corners, -1, axis=1)
    edge = np.linalg.norm(following - corners, axis=2)
    middles = (corners + following) / 2.0
    half = np.linalg.norm(middles - centre[:, None], axis=2)
    # The edge is the same seen from either side, so each side adds its own half.
    step = np.where(across >= 0, half + half.ravel()[partner], 0.0)
    return FaceGraph(across, step, edge, centre, normal, length / 2.0, pieces(across))


def edge_partners(faces: NDArray[np.int64], n_vertices: int) -> NDArray[np.int64]:
    """(F, 3) the same edge on its other side, as 3 * face + edge; -1 at the border of the mesh.

    Raises:
        SurfaceError: three faces meet at an edge, or two that run along it in the same direction.
    """
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    key = np.minimum(start, end) * np.int64(n_vertices) + np.maximum(start, end)
    order = np.argsort(key)
    ordered = key[order]
    same = ordered[1:] == ordered[:-1]
    first, second = order[:-1][same], order[1:][same]
    crowded = same[1:] & same[:-1]
    if crowded.any() or (start[first] == start[second]).any():
        raise SurfaceError(
            "the mesh is not an oriented surface: an edge has more than two faces, or two that "
            "turn opposite ways; clean it first"
        )
    partner = np.full(len(key), NONE, dtype=np.int64)
    partner[first], partner[second] = second, first
    return partner.reshape(-1, 3)


def pieces(across: NDArray[np.int64]) -> NDArray[np.int64]:
    """(F,) the connected piece of each face, counted from 0 in the order of their first faces."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    count = len(across)
    joined = across >= 0
    rows = np.repeat(np.arange(count), 3)[joined.ravel()]
    links = coo_array((np.ones(len(rows), np.int8), (rows, across[joined])), shape=(count, count))
    _, found = connected_components(links.tocsr(), directed=False)
    _, first, inverse = np.unique(found, return_index=True, return_inverse=True)
    rank = np.empty(len(first), dtype=np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    return rank[inverse]


def sum_by(
    labels: NDArray[np.int64], values: NDArray[np.float64], count: int
) -> NDArray[np.float64]:
    """(count, ...) sums of the rows of `values` (F,) or (F, C) that have the same label."""
    if values.ndim == 1:
        return np.bincount(labels, weights=values, minlength=count).astype(float)
    return np.column_stack([sum_by(labels, column, count) for column in values.T])
