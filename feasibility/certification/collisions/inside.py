"""Is one body inside another? Meshes are only their triangles to coal, and have no inside there."""

from __future__ import annotations

import numpy as np

from coverable.arrays import Array
from feasibility.certification.collisions.judged_shapes import Body
from robots.shapes.bodies import Triangles


def one_inside_other(a: Body, b: Body, rotation: Array, point: Array) -> bool:
    """Is a shell of one body inside the other, b at a pose (3, 3), (3,) m in the frame of a?

    Their boundaries must not touch. Only closed meshes are tested; coal knows of the inside of
    primitives and convex hulls.
    """
    return _any_inside(a, _points(b) @ rotation.T + point) or _any_inside(
        b, (_points(a) - point) @ rotation
    )


def _any_inside(body: Body, points: Array) -> bool:
    """Is one of the points (k, 3) inside a mesh, whose shells are oriented as it is closed?"""
    mesh = body.solid_mesh
    if mesh is None:
        return False
    corners, own = mesh.vertices[mesh.faces], body.placement
    seen = (points - own[:3, 3]) @ own[:3, :3]
    return any(abs(winding(corners, point)) > 0.5 for point in seen)


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


def _points(body: Body) -> Array:
    """(k, 3) m, a point of each shell of a mesh; of a primitive its centre."""
    if not isinstance(body.shape, Triangles):
        return body.centre[None]
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    faces, count = body.shape.faces, len(body.shape.vertices)
    links = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]]])
    graph = coo_array((np.ones(len(links)), (links[:, 0], links[:, 1])), shape=(count, count))
    shells = connected_components(graph, directed=False)[1]
    first = np.unique(shells, return_index=True)[1]
    used = np.intersect1d(first, faces)  # a vertex without a triangle is no shell
    return body.shape.vertices[used] @ body.placement[:3, :3].T + body.placement[:3, 3]
