"""Triangles that share their vertices; their edges, and cuts where points are put on these."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints, Mask
from surfaces.meshes.triangle_mesh import doubled_areas, half_edge_ends, half_edges


def renumbered(numbers: Ints) -> tuple[Ints, Ints]:
    """The numbers, at least 0, that occur, in order; and for each its place among them.

    As `np.unique` says it, without sorting.
    """
    there = np.zeros(int(numbers.max(initial=-1)) + 1, bool)
    there[numbers] = True
    return np.flatnonzero(there), (np.cumsum(there) - 1)[numbers]


class WorkingMesh(NamedTuple):
    """A surface as triangles to measure on."""

    vertices: Array
    """(V, 3) m, in the root frame."""
    faces: Ints
    """(F, 3) counterclockwise seen from outside."""

    @property
    def corners(self) -> Array:
        """(F, 3, 3) m."""
        return np.asarray(self.vertices[self.faces])

    @property
    def longest_edges(self) -> Array:
        """(F,) m, of each face."""
        corners = self.corners
        sides = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
        return np.asarray(sides.max(axis=1))

    @property
    def doubled_areas(self) -> Array:
        """(F, 3) m^2: outward normals, as long as twice the areas."""
        return doubled_areas(self.vertices, self.faces)

    @property
    def areas(self) -> Array:
        """(F,) m^2."""
        return np.asarray(0.5 * np.linalg.norm(self.doubled_areas, axis=1))

    def compact(self) -> WorkingMesh:
        """Without vertices of no face."""
        used, faces = renumbered(self.faces)
        return WorkingMesh(self.vertices[used], faces)


class FaceEdges(NamedTuple):
    """The edges of F faces, each once."""

    ends: Ints
    """(E, 2) vertices, the lower number first."""
    of: Ints
    """(F, 3) the edge on the side from each corner to the next."""


class CutFaces(NamedTuple):
    """Faces cut in parts."""

    mesh: WorkingMesh
    parent: Ints
    """(F,) the face before that each face is a part of."""


def edges_of(faces: Ints) -> FaceEdges:
    """The edges of faces (F, 3), sorted."""
    halves = half_edges(faces)
    ends = np.sort(half_edge_ends(faces, halves.order[halves.starts]), axis=1)
    return FaceEdges(ends, halves.edges.reshape(-1, 3))


def border_edges(faces: Ints) -> Ints:
    """(B, 2) directed edges, as their faces run along them, that have one face only."""
    return half_edge_ends(faces, half_edges(faces).of_count(1)[:, 0])


def twin_sides(faces: Ints) -> Ints:
    """(M, 2) sides on one edge, 3 f + k for that from corner k of face f; of three, two pairs."""
    halves = half_edges(faces)
    same = np.flatnonzero(np.diff(halves.edges[halves.order]) == 0)
    return np.column_stack([halves.order[same], halves.order[same + 1]])


def cut_at_middles(mesh: WorkingMesh, edges: FaceEdges, some: Mask) -> CutFaces:
    """Cut faces at the middles of some of the edges (E,)."""
    return cut_edges(mesh, edges, some, mesh.vertices[edges.ends[some]].mean(axis=1))


def cut_edges(mesh: WorkingMesh, edges: FaceEdges, some: Mask, points: Array) -> CutFaces:
    """Put a point (k, 3) m on each of some edges (E,), and cut the faces there."""
    number = np.full(len(edges.ends), -1, dtype=np.int64)
    number[some] = len(mesh.vertices) + np.arange(len(points))
    faces, parent = _cut_faces(mesh.faces, number[edges.of])
    return CutFaces(WorkingMesh(np.concatenate([mesh.vertices, points]), faces), parent)


def _cut_faces(faces: Ints, cut: Ints) -> tuple[Ints, Ints]:
    """Faces (k, 3) cut where `cut` (k, 3) names a vertex on the side from each corner to the next.

    Returns:
        The triangles (m, 3), and the face (m,) that each is a part of; -1 in `cut` is no vertex.
    """
    uncut = np.flatnonzero((cut < 0).all(axis=1))
    made, parents = [faces[uncut]], [uncut]
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
