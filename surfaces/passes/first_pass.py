"""The field that passes are the level lines of: distance from a first pass, or from a plane."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints, Mask
from surfaces.adjacency import components
from surfaces.passes.beyond_ends import FirstPass, carried_on, slopes
from surfaces.passes.unreached import Reached, exact_distances, reached, refuse_parts
from surfaces.passes.welded_triangles import (
    WorkingMesh,
    cut_at_middles,
    cut_edges,
    edges_of,
    twin_sides,
)

SNAP = 0.02  # [1] of an edge: a crossing nearer to its end is put there, or slivers would arise
HALVINGS = 2  # of the edges along the first pass: distances are taken from their vertices


class Field(NamedTuple):
    """One number for each vertex of a mesh; passes are where it has one value."""

    mesh: WorkingMesh
    values: Array
    """(V,) m; grows across the passes."""
    parent: Ints
    """(F,) the face, before the first pass was cut into them, that each face is a part of."""
    extent: tuple[float, float] | None = None
    """m, the least and the greatest value, where the vertices alone do not show them."""
    mended: Ints | None = None
    """Vertices whose values come from their neighbours, see `unreached`; None for none."""

    @property
    def touched(self) -> Mask:
        """(F,) faces with a corner whose value comes from its neighbours."""
        mended = np.isin(self.mesh.faces, [] if self.mended is None else self.mended)
        return np.asarray(mended.any(axis=1))

    @property
    def torn(self) -> Mask:
        """(F,) faces over which the values jump, where the surface closes round."""
        values = self.values[self.mesh.faces]
        spread = float(np.ptp(self.values))
        return np.asarray(np.ptp(values, axis=1) > 0.5 * spread)

    @property
    def slopes(self) -> Array:
        """(F,) length of the gradient in each face: 1 for the distance from something."""
        return slopes(self.mesh, self.values)


class CutMesh(NamedTuple):
    """A mesh with the line where a field is zero among its edges."""

    mesh: WorkingMesh
    field: Array
    """(V,) the field at its vertices, exactly 0 on the line."""
    parent: Ints
    """(F,) the face of the mesh before that each face is a part of."""


def plane_field(mesh: WorkingMesh, middle: Array, across: Array) -> Field:
    """Distance (m) from the plane through `middle` (3,) m square to `across` (3,) unit."""
    return Field(mesh, (mesh.vertices - middle) @ across, np.arange(len(mesh.faces)))


def distance_field(mesh: WorkingMesh, middle: Array, across: Array) -> Field:
    """Distance on the surface from a first pass, exact for the mesh, negative on one side of it.

    The first pass is the section of the surface with the plane through `middle` (3,) m square to
    `across` (3,) unit; the part of it that runs through the middle. On either side of it every
    point of the level k P is exactly P from the level (k - 1) P, because its shortest path to the
    first pass crosses that level. Beyond its ends the first pass goes on straight, off the surface
    (`beyond_ends`).

    Where the first pass does not part the surface in two (along a closed tube), the plane does, and
    values jump where the two sides meet.

    Raises:
        SurfaceError: there are parts of the surface that the distance does not reach.
    """
    cut = _cut_in(mesh, (mesh.vertices - middle) @ across)
    for _ in range(HALVINGS):
        cut = _with_denser_line(cut)
    first, edges = _through(cut, middle)
    distances, mended = _from_carried_on(cut.mesh, first, edges)
    values = distances * _sides(cut, edges)
    field = Field(cut.mesh, values, cut.parent, mended=mended if len(mended) else None)
    if not field.torn.any():
        return field
    # The plane is cut into the far side too, so there are vertices about where the two sides meet.
    furthest = float(np.abs(values).max())
    return field._replace(extent=(-furthest, furthest))


def _through(cut: CutMesh, middle: Array) -> tuple[Ints, Ints]:
    """Vertices and edges of the line's connected part that runs nearest to the middle."""
    edges = _line_edges(cut)
    used, of = np.unique(edges, return_inverse=True)
    part = components(of.reshape(-1, 2), len(used))
    nearest = np.linalg.norm(cut.mesh.vertices[used] - middle, axis=1).argmin()
    own = part == part[nearest]
    return used[own], edges[own[of.reshape(-1, 2)[:, 0]]]


def _from_carried_on(mesh: WorkingMesh, first: Ints, edges: Ints) -> Reached:
    """(V,) m, length of the shortest path on the triangles to the first pass, carried on."""
    refuse_parts(mesh, first)
    found, nearest = exact_distances(mesh, first)
    distances, mended = reached(mesh, found)
    known = FirstPass(mesh, edges, distances, nearest)

    def from_vertex(vertex: int) -> Array:
        found, _ = exact_distances(mesh, np.array([vertex]))
        return reached(mesh, found).distances

    carried = carried_on(known, from_vertex)
    carried[mended] = np.inf  # their neighbours' values may be others now
    return reached(mesh, carried)


def _sides(cut: CutMesh, edges: Ints) -> Array:
    """(V,) -1.0 or 1.0, the side of the first pass, or of its plane where it has only one side."""
    faces, count = cut.mesh.faces, len(cut.mesh.vertices)
    known, key = edges_of(faces), np.array([count, 1])
    wall = np.isin(known.ends @ key, edges @ key)[known.of]  # (F, 3) sides on the first pass
    twins = twin_sides(faces)
    part = components(twins[~wall.ravel()[twins[:, 0]]] // 3, len(faces))
    # The faces next to the line show on which side of it a part lies.
    beside = np.nonzero(wall)[0]
    above = cut.field[faces[beside]].sum(axis=1)
    below = np.unique(part[beside[above < 0.0]])
    if len(np.intersect1d(below, part[beside[above > 0.0]])):
        return np.where(cut.field < 0.0, -1.0, 1.0)
    found = np.ones(count)
    found[faces[np.isin(part, below)]] = -1.0
    return found


def _cut_in(mesh: WorkingMesh, field: Array) -> CutMesh:
    """Cut all faces along the line where the field (V,), linear in each face, is zero."""
    edges = edges_of(mesh.faces)
    field = _snapped(field, edges.ends)
    low, high = field[edges.ends].T
    crossed = low * high < 0.0
    share = (low / np.where(crossed, low - high, 1.0))[crossed]
    ends = mesh.vertices[edges.ends[crossed]]
    points = ends[:, 0] + share[:, None] * (ends[:, 1] - ends[:, 0])
    made, parent = cut_edges(mesh, edges, crossed, points)
    return CutMesh(made, np.concatenate([field, np.zeros(len(points))]), parent)


def _with_denser_line(cut: CutMesh) -> CutMesh:
    """The same with a vertex more in the middle of each edge of the line.

    Distances from vertices s apart on a line are too long by s^2 / (8 d) at the distance d.
    """
    edges = edges_of(cut.mesh.faces)
    on = (cut.field[edges.ends] == 0.0).all(axis=1)
    made, parent = cut_at_middles(cut.mesh, edges, on)
    field = np.concatenate([cut.field, np.zeros(np.count_nonzero(on))])
    return CutMesh(made, field, cut.parent[parent])


def _snapped(field: Array, edges: Ints) -> Array:
    """The field with zeros at vertices next to which it crosses zero."""
    field = field.copy()
    low, high = field[edges[:, 0]], field[edges[:, 1]]
    crossed = low * high < 0.0
    share = np.where(crossed, low / np.where(crossed, low - high, 1.0), 0.5)
    field[edges[crossed & (share < SNAP), 0]] = 0.0
    field[edges[crossed & (share > 1.0 - SNAP), 1]] = 0.0
    return field


def _line_edges(cut: CutMesh) -> Ints:
    """(k, 2) the edges of the mesh along which the field is zero, the lower vertex first."""
    ends = edges_of(cut.mesh.faces).ends
    return ends[(cut.field[ends] == 0.0).all(axis=1)]
