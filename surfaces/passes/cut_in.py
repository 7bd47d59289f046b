"""A line put into a mesh as edges: where a field is zero, vertices are made."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from surfaces.passes.cutting import cut_edges, edges_of
from surfaces.passes.net import WorkingMesh

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
    edges = edges_of(mesh.faces)
    field = _snapped(field, edges.ends)
    low, high = field[edges.ends].T
    crossed = low * high < 0.0
    share = (low / np.where(crossed, low - high, 1.0))[crossed]
    ends = mesh.vertices[edges.ends[crossed]]
    points = ends[:, 0] + share[:, None] * (ends[:, 1] - ends[:, 0])
    made, parent = cut_edges(mesh, edges, crossed, points)
    return CutMesh(made, np.concatenate([field, np.zeros(len(points))]), parent)


def with_denser_line(cut: CutMesh) -> CutMesh:
    """The same with a vertex more in the middle of each edge of the line.

    Distances from vertices s apart on a line are too long by s^2 / (8 d) at the distance d.
    """
    edges = edges_of(cut.mesh.faces)
    on = (cut.field[edges.ends] == 0.0).all(axis=1)
    middles = cut.mesh.vertices[edges.ends[on]].mean(axis=1)
    made, parent = cut_edges(cut.mesh, edges, on, middles)
    field = np.concatenate([cut.field, np.zeros(len(middles))])
    return CutMesh(made, field, cut.parent[parent])


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
    ends = edges_of(cut.mesh.faces).ends
    return ends[(cut.field[ends] == 0.0).all(axis=1)]
