"""Is one body inside another? Meshes are only their triangles to coal, and have no inside there."""

from __future__ import annotations

from functools import lru_cache
from typing import TypeGuard

import numpy as np

from coverable_arrays import Array
from feasibility.certification.collisions.mesh_pieces import MeshPart
from feasibility.certification.collisions.pieces import Piece

KEPT = 64  # meshes whose answers are remembered


def one_inside_other(a: Piece, b: Piece, rotation: Array, point: Array) -> bool:
    """Is a shell of one body inside the other, b at a pose (3, 3), (3,) m in the frame of a?

    Their boundaries must not touch. Only closed meshes are tested; coal knows of the inside of
    primitives.
    """
    if _is_closed(a) and _any_inside(a, _points(b) @ rotation.T + point):
        return True
    return _is_closed(b) and _any_inside(b, (_points(a) - point) @ rotation)


def _is_closed(body: Piece) -> TypeGuard[MeshPart]:
    """Is it a closed mesh?"""
    return isinstance(body, MeshPart) and body.closed


def _any_inside(body: MeshPart, points: Array) -> bool:
    """Is one of the points (k, 3) inside the mesh, whose shells are oriented as it is closed?"""
    triangles = body.vertices[body.faces]
    return any(abs(winding(triangles, point)) > 0.5 for point in points)


def winding(triangles: Array, point: Array) -> float:
    """How often triangles (k, 3, 3) wind around a point (3,): their solid angles over 4 pi.

    Van Oosterom and Strackee, 1983: tan(w / 2) = det[a b c] / (abc + (a.b) c + (b.c) a + (c.a) b).
    """
    a, b, c = (triangles[:, k] - point for k in range(3))
    la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
    above = np.einsum("ki,ki->k", a, np.cross(b, c))
    below = la * lb * lc
    below += (a * b).sum(1) * lc + (b * c).sum(1) * la + (c * a).sum(1) * lb
    return float(2.0 * np.arctan2(above, below).sum() / (4.0 * np.pi))


@lru_cache(maxsize=KEPT)
def _points(body: Piece) -> Array:
    """(k, 3) a point of each shell of a mesh; of a primitive its centre."""
    if not isinstance(body, MeshPart):
        return body.centre[None]
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    faces, count = body.faces, len(body.vertices)
    links = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]]])
    graph = coo_array((np.ones(len(links)), (links[:, 0], links[:, 1])), shape=(count, count))
    shells = connected_components(graph, directed=False)[1]
    return body.vertices[np.unique(shells, return_index=True)[1]]
