"""A line put into a mesh as edges: where a field is zero, vertices are made."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from surfaces.passes.net import WorkingMesh
from surfaces.passes.triangulation import cut_faces

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SNAP = 0.02  # [1] of an edge: a crossing nearer to its end is put there, or slivers would arise


class CutMesh(NamedTuple):
    """A mesh with the line where a field is zero among its edges."""

    mesh: WorkingMesh
    field: Floats
    """(V,) the field at its vertices, exactly 0 on the line."""
    parent: Ints
    """(F,) the face of the mesh before that each face is a part of."""


def cut_in(mesh: WorkingMesh, field: Floats) -> CutMesh:
    """Cut all faces along the line where the field, linear in each face, is zero.

    Args:
        mesh: the triangles.
        field: (V,) one number for each vertex.
    """
    sides = np.stack([mesh.faces, np.roll(mesh.faces, -1, axis=1)], axis=2)
    edges, of = np.unique(np.sort(sides.reshape(-1, 2), axis=1), axis=0, return_inverse=True)
    field = _snapped(field, edges)
    low, high = field[edges[:, 0]], field[edges[:, 1]]
    crossed = low * high < 0.0
    share = (low / np.where(crossed, low - high, 1.0))[crossed]
    ends = mesh.vertices[edges[crossed]]
    points = ends[:, 0] + share[:, None] * (ends[:, 1] - ends[:, 0])
    number = np.full(len(edges), -1, dtype=np.int64)
    number[crossed] = len(mesh.vertices) + np.arange(len(points))
    faces, parent = cut_faces(mesh.faces, number[of.reshape(-1, 3)])
    made = WorkingMesh(np.concatenate([mesh.vertices, points]), faces)
    return CutMesh(made, np.concatenate([field, np.zeros(len(points))]), parent)


def _snapped(field: Floats, edges: Ints) -> Floats:
    """The field with zeros at vertices next to which it crosses zero."""
    field = field.copy()
    low, high = field[edges[:, 0]], field[edges[:, 1]]
    crossed = low * high < 0.0
    share = np.where(crossed, low / np.where(crossed, low - high, 1.0), 0.5)
    field[edges[crossed & (share < SNAP), 0]] = 0.0
    field[edges[crossed & (share > 1.0 - SNAP), 1]] = 0.0
    return field


def line_edges(cut: CutMesh) -> Ints:
    """(k, 2) the edges of the mesh along which the field is zero, the lower vertex first."""
    faces = cut.mesh.faces
    sides = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
    on = (cut.field[sides] == 0.0).all(axis=1)
    return np.unique(np.sort(sides[on], axis=1), axis=0)
