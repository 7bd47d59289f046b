"""Better triangles on the same surface: edges between faces in one plane are flipped."""

from __future__ import annotations

import numpy as np

from coverable.arrays import Array, Ints, Mask
from surfaces.passes.welded_triangles import WorkingMesh, twin_sides

IN_ONE_PLANE = 1e-6  # [1] of the edge: corners this far off the other face's plane are in it
HAIR = 1e-9  # [rad] beyond pi, so that four corners on a circle are left alone
MOST_ROUNDS = 200


def delaunay(mesh: WorkingMesh) -> WorkingMesh:
    """Flip edges in a plane whose two opposite angles are over 180 degrees together.

    Lawson's flips, many at a time: those of one round share no face. The surface stays what it is.
    """
    faces = mesh.faces.copy()
    for _ in range(MOST_ROUNDS):
        pairs = _to_flip(mesh.vertices, faces)
        if not len(pairs):
            break
        one, other, a, b, c, d = pairs.T
        faces[one] = np.column_stack([c, a, d])
        faces[other] = np.column_stack([d, b, c])
    return WorkingMesh(mesh.vertices, faces)


def _to_flip(vertices: Array, faces: Ints) -> Ints:
    """Rows of two faces that share no face with other rows, and their corners a, b, c, d.

    The faces are (a, b, c) and (b, a, d), the edge a b is to become c d.
    """
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    opposite = np.roll(faces, -2, axis=1).ravel()
    one, other = twin_sides(faces).T
    a, b, c, d = start[one], end[one], opposite[one], opposite[other]
    pa, pb, pc, pd = vertices[a], vertices[b], vertices[c], vertices[d]
    angles = _angle(pa - pc, pb - pc) + _angle(pa - pd, pb - pd)
    some = np.flatnonzero((angles > np.pi + HAIR) & (start[other] == b))
    normal = np.cross(pb[some] - pa[some], pc[some] - pa[some])
    height = np.abs(((pd[some] - pa[some]) * normal).sum(axis=1))
    lengths = np.linalg.norm(pb[some] - pa[some], axis=1)
    flat = height <= IN_ONE_PLANE * np.linalg.norm(normal, axis=1) * lengths
    some = some[flat]
    some = some[np.argsort(-angles[some], kind="stable")]
    rows = np.column_stack([one[some] // 3, other[some] // 3, a[some], b[some], c[some], d[some]])
    return rows[_apart(rows[:, :2], len(faces))]


def _angle(x: Array, y: Array) -> Array:
    """(k,) rad between vectors (k, 3)."""
    sine = np.linalg.norm(np.cross(x, y), axis=1)
    return np.asarray(np.arctan2(sine, (x * y).sum(axis=1)))


def _apart(pairs: Ints, count: int) -> Mask:
    """(k,) rows whose faces are in no row before them."""
    first = np.full(count, len(pairs))
    np.minimum.at(first, pairs.ravel(), np.repeat(np.arange(len(pairs)), 2))
    return np.asarray((first[pairs] == np.arange(len(pairs))[:, None]).all(axis=1))
