"""The triangles of a mesh as they are drawn: joined at their corners, and thinned if too many.

Thinning merges vertices that lie close together, but only where they touch the same cells: so the
drawn cells still meet in the same order, and their borders are lines between corners of the mesh.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from surfaces import Triangles
from surfaces.meshes.cells import MeshCells

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

BUDGET = 30_000  # triangles
COARSER = 1.25  # from one spacing to the next
WIDEST = 0.3  # [1] of a cell's width, beyond which no vertices are merged
DEGREE = 57.0  # [1/rad] normals that agree to about a degree are one


@dataclass(frozen=True, eq=False, slots=True)
class Skin:
    """Triangles to draw, and the cell of each."""

    vertices: Array
    """(V, 3) m, in the root frame; all are vertices of the mesh."""
    normals: Array
    """(V, 3) outward unit normals."""
    faces: Ints
    """(F, 3)"""
    labels: Ints
    """(F,) cell of each face."""
    places: Ints
    """(V,) equal for vertices that share a place, where normals differ."""
    cone_chord: NDArray[np.bool_]
    """(V,) vertices on the border of the mesh."""

    def __post_init__(self) -> None:
        """Write-protect the arrays."""
        for field in fields(self):
            getattr(self, field.name).flags.writeable = False

    def fill(self, which: Ints, centres: Array, inset: float = 0.0) -> Triangles:
        """The triangles of some cells (k,), drawn towards their centres by a share of the way."""
        mine = np.isin(self.labels, which)
        labels = np.repeat(self.labels[mine], 3)
        corner = self.faces[mine].ravel()
        # Cells that shrink part at their common vertices.
        key = corner if inset == 0.0 else labels * len(self.vertices) + corner
        _, first, faces = np.unique(key, return_index=True, return_inverse=True)
        vertices = self.vertices[corner[first]]
        return Triangles(
            vertices=vertices + inset * (centres[labels[first]] - vertices),
            faces=faces.reshape(-1, 3).astype(np.int64),
            normals=self.normals[corner[first]],
        )

    def borders(self) -> Array:
        """(k, 2, 3) m: edges between triangles of different cells, and those of the mesh's rim."""
        halves = np.stack([self.faces, np.roll(self.faces, -1, axis=1)], axis=2).reshape(-1, 2)
        ends = np.sort(self.places[halves], axis=1)
        key = ends[:, 0] * (int(self.places.max()) + 1) + ends[:, 1]
        order = np.argsort(key, kind="stable")
        starts = np.flatnonzero(np.diff(key[order], prepend=-1))
        owner = np.repeat(self.labels, 3)[order]
        apart = np.minimum.reduceat(owner, starts) != np.maximum.reduceat(owner, starts)
        single = np.diff(np.append(starts, len(key))) == 1
        drawn = halves[order[starts]]
        return self.vertices[drawn[apart | (single & self.cone_chord[drawn].all(axis=1))]]


_skins: WeakKeyDictionary[MeshCells, Skin] = WeakKeyDictionary()


class _Merged(NamedTuple):
    """Faces after merging vertices: their corners, and their cells."""

    faces: Ints
    labels: Ints


def skin_of(cells: MeshCells) -> Skin:
    """The triangles of the cells of a mesh, thinned to `BUDGET`; kept for as long as the cells."""
    if cells not in _skins:
        _skins[cells] = make_skin(cells)
    return _skins[cells]


def make_skin(cells: MeshCells, budget: int = BUDGET) -> Skin:
    """The triangles of the cells of a mesh, at most about `budget` of them.

    More are left where cells are so many that each would be drawn by too few.
    """
    mesh, surface = cells.surface.mesh, cells.surface
    cone_chord = np.zeros(len(mesh.vertices), dtype=bool)
    cone_chord[mesh.edges.border_vertices] = True
    merged = _Merged(mesh.faces, cells.labels)
    if len(mesh.faces) > budget:
        merged = _thinned(cells, cone_chord, budget)
        normals = np.zeros_like(mesh.vertices)
        for k in range(3):
            np.add.at(normals, mesh.faces[:, k], surface.corner_normals[:, k])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
        corner_normals = normals[merged.faces]
    else:
        corner_normals = surface.corner_normals
    # Corners of one vertex with one normal become one; creases keep two.
    corner, flat = merged.faces.ravel(), corner_normals.reshape(-1, 3)
    rounded = np.rint(DEGREE * flat).astype(np.int64) + 64
    key = (((corner << 7) + rounded[:, 0] << 7) + rounded[:, 1] << 7) + rounded[:, 2]
    _, first, faces = np.unique(key, return_index=True, return_inverse=True)
    return Skin(
        vertices=mesh.vertices[corner[first]] @ surface.rotation.T + surface.position,
        normals=flat[first] @ surface.rotation.T,
        faces=faces.reshape(-1, 3).astype(np.int64),
        labels=np.array(merged.labels),
        places=corner[first],
        cone_chord=cone_chord[corner[first]],
    )


def _thinned(cells: MeshCells, cone_chord: NDArray[np.bool_], budget: int) -> _Merged:
    """Merge vertices at a wider and wider spacing, until few enough faces are left."""
    mesh = cells.surface.mesh
    kinds = _kinds(mesh.faces, cells.labels, cone_chord)
    widest = WIDEST * np.sqrt(cells.areas.mean())
    spacing = min(cells.surface.mean_edge_length * np.sqrt(len(mesh.faces) / budget), widest)
    merged = _merged(cells, kinds, spacing)
    while len(merged.faces) > budget and spacing * COARSER <= widest:
        spacing *= COARSER
        merged = _merged(cells, kinds, spacing)
    # Cells that have shrunk to nothing are drawn as they are.
    gone = ~np.isin(cells.labels, merged.labels)
    return _Merged(
        np.concatenate([merged.faces, mesh.faces[gone]]),
        np.concatenate([merged.labels, cells.labels[gone]]),
    )


def _kinds(faces: Ints, labels: Ints, cone_chord: NDArray[np.bool_]) -> Ints:
    """(V,) equal for vertices that may be merged: in one cell, or on one border of two cells."""
    count = int(labels.max()) + 1
    touching = np.unique(faces.ravel() * count + np.repeat(labels, 3))
    vertex, cell = np.divmod(touching, count)
    first = np.searchsorted(vertex, np.arange(len(cone_chord)))
    number = np.diff(np.append(first, len(vertex)))
    low, high = cell[first], cell[first + number - 1]
    kind = 2 * (low * count + high) + cone_chord
    alone = number > 2  # where borders meet
    kind[alone] = -1 - np.flatnonzero(alone)
    return np.unique(kind, return_inverse=True)[1].reshape(-1).astype(np.int64)


def _merged(cells: MeshCells, kinds: Ints, spacing: float) -> _Merged:
    """Merge vertices of one kind in one box of a grid into that which is nearest to their mean."""
    points, faces = cells.surface.mesh.vertices, cells.surface.mesh.faces
    boxes = np.floor((points - points.min(axis=0)) / spacing).astype(np.int64)
    box = (boxes[:, 0] << 42) + (boxes[:, 1] << 21) + boxes[:, 2]
    box = np.unique(box, return_inverse=True)[1].reshape(-1)
    _, group, size = np.unique(
        box * (int(kinds.max()) + 1) + kinds, return_inverse=True, return_counts=True
    )
    group = group.reshape(-1)
    mean = np.column_stack([np.bincount(group, axis) / size for axis in points.T])
    off = np.linalg.norm(points - mean[group], axis=1)
    order = np.lexsort((off, group))
    chosen = order[np.concatenate([[0], np.cumsum(size)[:-1]])]
    corners = chosen[group][faces]
    whole = np.flatnonzero((corners != np.roll(corners, 1, axis=1)).all(axis=1))
    ordered = np.sort(corners[whole], axis=1)
    key = ordered[:, 0] * len(points) + ordered[:, 1]
    key = np.unique(key, return_inverse=True)[1].reshape(-1) * len(points) + ordered[:, 2]
    kept = whole[np.sort(np.unique(key, return_index=True)[1])]
    return _Merged(corners[kept], cells.labels[kept])
