"""The field that passes are the level lines of: distance from a first pass, or from a plane."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from surfaces.adjacency import components
from surfaces.passes.beyond_ends import FirstPass, carried_on, slopes
from surfaces.passes.cut_in import CutMesh, cut_in, line_edges, with_denser_line
from surfaces.passes.net import WorkingMesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


HALVINGS = 2  # of the edges along the first pass: distances are taken from their vertices


class Field(NamedTuple):
    """One number for each vertex of a mesh; passes are where it has one value."""

    mesh: WorkingMesh
    values: Floats
    """(V,) m; grows across the passes."""
    parent: Ints
    """(F,) the face, before the first pass was cut into them, that each face is a part of."""
    extent: tuple[float, float] | None = None
    """m, the least and the greatest value, where the vertices alone do not show them."""

    @property
    def torn(self) -> NDArray[np.bool_]:
        """(F,) faces over which the values jump, where the surface closes round."""
        values = self.values[self.mesh.faces]
        spread = float(np.ptp(self.values))
        return np.asarray(np.ptp(values, axis=1) > 0.5 * spread)

    @property
    def slopes(self) -> Floats:
        """(F,) length of the gradient in each face: 1 for the distance from something."""
        return slopes(self.mesh, self.values)


def plane_field(mesh: WorkingMesh, middle: Floats, across: Floats) -> Field:
    """Distance (m) from the plane through `middle` (3,) m square to `across` (3,) unit."""
    return Field(mesh, (mesh.vertices - middle) @ across, np.arange(len(mesh.faces)))


def distance_field(mesh: WorkingMesh, middle: Floats, across: Floats) -> Field:
    """Distance on the surface from a first pass, exact for the mesh, negative on one side of it.

    The first pass is the section of the surface with the plane through `middle` (3,) m square to
    `across` (3,) unit; the part of it that runs through the middle. On either side of it every
    point of the level k P is exactly P from the level (k - 1) P, because its shortest way to the
    first pass crosses that level. Beyond its ends the first pass goes on straight, off the surface
    (`beyond_ends`).

    Where the first pass does not part the surface in two (along a closed tube), the plane does, and
    values jump where the two sides meet.
    """
    cut = cut_in(mesh, (mesh.vertices - middle) @ across)
    for _ in range(HALVINGS):
        cut = with_denser_line(cut)
    first, edges = _through(cut, middle)
    values = _from_carried_on(cut.mesh, first, edges) * _sides(cut, edges)
    field = Field(cut.mesh, values, cut.parent)
    if not field.torn.any():
        return field
    # The plane is cut into the far side too, so there are vertices about where the two sides meet.
    furthest = float(np.abs(values).max())
    return field._replace(extent=(-furthest, furthest))


def _through(cut: CutMesh, middle: Floats) -> tuple[Ints, Ints]:
    """Vertices and edges of the line's connected part that runs nearest to the middle."""
    edges = line_edges(cut)
    used, of = np.unique(edges, return_inverse=True)
    part = components(of.reshape(-1, 2), len(used))
    nearest = np.linalg.norm(cut.mesh.vertices[used] - middle, axis=1).argmin()
    own = part == part[nearest]
    return used[own], edges[own[of.reshape(-1, 2)[:, 0]]]


def _from_carried_on(mesh: WorkingMesh, first: Ints, edges: Ints) -> Floats:
    """(V,) m, length of the shortest way on the triangles to the first pass, carried on."""
    from pygeodesic.geodesic import PyGeodesicAlgorithmExact

    algorithm = PyGeodesicAlgorithmExact(mesh.vertices, mesh.faces.astype(np.int32))
    distances, nearest = algorithm.geodesicDistances(first.astype(np.int32), None)
    known = FirstPass(mesh, edges, np.asarray(distances, dtype=float), first[nearest])

    def from_vertex(vertex: int) -> Floats:
        return np.asarray(algorithm.geodesicDistances(np.array([vertex], np.int32), None)[0], float)

    return carried_on(known, from_vertex)


def _sides(cut: CutMesh, edges: Ints) -> Floats:
    """(V,) -1.0 or 1.0, the side of the first pass, or of its plane where it has only one side."""
    faces = cut.mesh.faces
    count = len(cut.mesh.vertices)
    sides = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
    keys = np.sort(sides, axis=1) @ np.array([count, 1])
    wall = np.isin(keys, edges @ np.array([count, 1]))
    owner = np.repeat(np.arange(len(faces)), 3)[~wall]
    order = np.argsort(keys[~wall], kind="stable")
    same = np.flatnonzero(np.diff(keys[~wall][order]) == 0)
    part = components(
        np.column_stack([owner[order[same]], owner[order[same + 1]]]).astype(np.int64), len(faces)
    )
    # Which side of the line a part lies on, told by its faces next to the line.
    beside = np.repeat(np.arange(len(faces)), 3)[wall]
    above = cut.field[faces[beside]].sum(axis=1)
    below = np.unique(part[beside[above < 0.0]])
    if len(np.intersect1d(below, part[beside[above > 0.0]])):
        return np.where(cut.field < 0.0, -1.0, 1.0)
    found = np.ones(count)
    found[faces[np.isin(part, below)]] = -1.0
    return found
