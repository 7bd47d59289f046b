"""Triangles cut where points are put on their edges."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from surfaces.passes.net import WorkingMesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class Edges(NamedTuple):
    """The edges of F faces, each once."""

    ends: Ints
    """(E, 2) vertices, the lower number first."""
    of: Ints
    """(F, 3) the edge on the side from each corner to the next."""


class Cut(NamedTuple):
    """Faces cut in parts."""

    mesh: WorkingMesh
    parent: Ints
    """(F,) the face before that each face is a part of."""


def edges_of(faces: Ints) -> Edges:
    """The edges of faces (F, 3)."""
    sides = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
    ends, of = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True)
    return Edges(ends, of.reshape(-1, 3))


def cut_edges(mesh: WorkingMesh, edges: Edges, some: NDArray[np.bool_], points: Floats) -> Cut:
    """Put a point (k, 3) m on each of some edges (E,), and cut the faces there."""
    number = np.full(len(edges.ends), -1, dtype=np.int64)
    number[some] = len(mesh.vertices) + np.arange(len(points))
    faces, parent = _cut_faces(mesh.faces, number[edges.of])
    return Cut(WorkingMesh(np.concatenate([mesh.vertices, points]), faces), parent)


def _cut_faces(faces: Ints, cut: Ints) -> tuple[Ints, Ints]:
    """Faces (k, 3) cut where `cut` (k, 3) names a vertex on the side from each corner to the next.

    Returns:
        The triangles (m, 3), and the face (m,) that each is a part of; -1 in `cut` is no vertex.
    """
    whole = np.flatnonzero((cut < 0).all(axis=1))
    made, parents = [faces[whole]], [whole]
    for pattern in range(1, 8):
        wanted = np.array([pattern >> k & 1 for k in range(3)], dtype=bool)
        some = ((cut >= 0) == wanted).all(axis=1)
        if not some.any():
            continue
        f, m = faces[some], cut[some]
        count = int(wanted.sum())
        if count == 3:
            triangles = [
                (f[:, 0], m[:, 0], m[:, 2]),
                (m[:, 0], f[:, 1], m[:, 1]),
                (m[:, 2], m[:, 1], f[:, 2]),
                (m[:, 0], m[:, 1], m[:, 2]),
            ]
        else:
            # Turned so that the cut sides are the first, or the first two.
            turn = next(k for k in range(3) if wanted[k] and (count == 1 or wanted[(k + 1) % 3]))
            a, b, c = (f[:, (turn + k) % 3] for k in range(3))
            p, q = m[:, turn], m[:, (turn + 1) % 3]
            triangles = [(a, p, c), (p, b, c)] if count == 1 else [(p, b, q), (a, p, q), (a, q, c)]
        made += [np.column_stack(each) for each in triangles]
        parents += [np.flatnonzero(some)] * len(triangles)
    return np.concatenate(made), np.concatenate(parents)
