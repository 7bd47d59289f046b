"""Which faces of a triangle mesh touch, and how far it is from one to the next."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from surfaces.adjacency import components
from surfaces.meshes.triangle_mesh import doubled_areas, edge_partners

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
        SurfaceError: an edge has more than two faces, or both run along it in one direction.
    """
    partner = edge_partners(faces)
    across = np.where(partner >= 0, partner // 3, NONE)
    corners = vertices[faces]
    centre = corners.mean(axis=1)
    double = doubled_areas(vertices, faces)
    length = np.linalg.norm(double, axis=1)
    normal = double / np.where(length > 0.0, length, 1.0)[:, None]
    following = np.roll(corners, -1, axis=1)
    edge = np.linalg.norm(following - corners, axis=2)
    middles = (corners + following) / 2.0
    half = np.linalg.norm(middles - centre[:, None], axis=2)
    # The edge is the same seen from either side, so each side adds its own half.
    step = np.where(across >= 0, half + half.ravel()[partner], 0.0)
    owner, k = np.nonzero(across >= 0)
    piece = components(np.column_stack([owner, across[owner, k]]), len(faces))
    return FaceGraph(across, step, edge, centre, normal, length / 2.0, piece)
