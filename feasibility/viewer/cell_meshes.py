"""Shapes for drawing E-cells: filled patches, borders, marks at their centres, the sides of a cut.

The triangles of a mesh are thinned if too many: vertices that lie close together are merged, but
only where they touch the same cells. So the drawn cells keep their neighbours, and their borders
are lines between corners of the mesh.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from coverable.arrays import Array, Ints, Mask
from feasibility.cut_tree import Cut, Leaf
from feasibility.cut_words import place_of
from feasibility.verdict import Verdict
from feasibility.viewer.meshes import merge_vertices
from feasibility.viewer.threejs import Colour
from surfaces.cells import Cells, CellTriangles
from surfaces.meshes.cells.mesh_cells import MeshCells
from surfaces.meshes.normals import sharp_edges
from surfaces.meshes.triangle_mesh import half_edge_ends
from surfaces.passes.welded_triangles import WorkingMesh, border_edges, twin_sides

FULL_DETAIL = 1_500  # cells; more are drawn without centre marks, and edges as plain lines
BUDGET = 30_000  # triangles
COARSER = 1.25  # from one spacing to the next
WIDEST = 1.0  # [1] of a cell's width, beyond which no vertices are merged


def patch(cells: Cells, which: Ints, inset: float = 0.0) -> CellTriangles:
    """Triangles that fill some cells, as fine as their number allows; see `Cells.triangles`."""
    if isinstance(cells, MeshCells):
        return display_mesh_of(cells).fill(which, cells.centres, inset)
    along = max(*cells.shape, 1) if len(cells.shape) > 1 else np.sqrt(len(cells))
    pieces = int(np.clip(np.ceil(64 / along), 2, 32))  # a cell's side, cut up
    return cells.triangles(which, 1 if len(cells) > FULL_DETAIL else pieces, inset)


def borders(cells: Cells) -> Array:
    """(k, 2, 3) m, ends of short lines along the borders of all cells; see `Cells.borders`."""
    if isinstance(cells, MeshCells):
        return display_mesh_of(cells).borders()
    return cells.borders(8 if len(cells) <= FULL_DETAIL else 1)


def marks(centres: Array, radius: float) -> tuple[Array, Ints]:
    """A small octahedron at each centre: vertices and faces."""
    corners = radius * np.concatenate([np.eye(3), -np.eye(3)])
    one = np.array(
        [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]]
    )
    vertices = (centres[:, None] + corners).reshape(-1, 3)
    faces = (6 * np.arange(len(centres))[:, None, None] + one).reshape(-1, 3)
    return vertices, faces


def cell_size(cells: Cells) -> float:
    """A typical width of a cell, m."""
    return float(np.sqrt(cells.areas.mean())) if len(cells) else 0.0


class DisplayMesh(NamedTuple):
    """Triangles to draw, and the cell of each."""

    mesh: WorkingMesh
    labels: Ints
    """(F,) cell of each face."""

    def fill(self, which: Ints, centres: Array, inset: float = 0.0) -> CellTriangles:
        """The triangles of some cells (k,), shrunk towards their centres by a share `inset`."""
        mine = np.isin(self.labels, which)
        labels, corner = np.repeat(self.labels[mine], 3), self.mesh.faces[mine].ravel()
        # Cells that shrink part at their common vertices.
        key = corner if inset == 0.0 else labels * len(self.mesh.vertices) + corner
        _, first, faces = np.unique(key, return_index=True, return_inverse=True)
        vertices = self.mesh.vertices[corner[first]]
        vertices = vertices + inset * (centres[labels[first]] - vertices)
        return CellTriangles(vertices, faces.reshape(-1, 3).astype(np.int64))

    def borders(self) -> Array:
        """(k, 2, 3) m: edges between triangles of different cells, and on the mesh's border."""
        faces, sides = self.mesh.faces, twin_sides(self.mesh.faces)
        apart = sides[self.labels[sides[:, 0] // 3] != self.labels[sides[:, 1] // 3], 0]
        ends = np.concatenate([half_edge_ends(faces, apart), border_edges(faces)])
        return np.asarray(self.mesh.vertices[ends])


_display_meshes: WeakKeyDictionary[MeshCells, DisplayMesh] = WeakKeyDictionary()


def display_mesh_of(cells: MeshCells) -> DisplayMesh:
    """The triangles of the cells of a mesh, thinned to `BUDGET`; kept for as long as the cells."""
    if cells not in _display_meshes:
        _display_meshes[cells] = make_display_mesh(cells)
    return _display_meshes[cells]


def make_display_mesh(cells: MeshCells, budget: int = BUDGET) -> DisplayMesh:
    """The triangles of the cells of a mesh, at most about `budget` of them.

    More are left where cells are so many that each would be drawn by too few.
    """
    surface = cells.surface.wall  # not a smoothed copy of it
    vertices, faces, labels = surface.mesh.vertices, surface.mesh.faces, cells.labels
    if len(faces) > budget:
        faces, labels = _thinned(cells, budget)
    placed = vertices @ surface.rotation.T + surface.position
    return DisplayMesh(WorkingMesh(placed, faces).compact(), labels)


def _thinned(cells: MeshCells, budget: int) -> tuple[Ints, Ints]:
    """Merge vertices at a wider and wider spacing, until few enough faces (F, 3) are left.

    Returns:
        The faces, and the cell (F,) of each.
    """
    mesh = cells.surface.wall.mesh
    on_edge = np.zeros(len(mesh.vertices), dtype=bool)
    on_edge[mesh.edges.border_vertices] = True
    on_edge[mesh.edges.vertices[sharp_edges(mesh)]] = True
    kinds = _kinds(mesh.faces, cells.labels, on_edge)
    widest = WIDEST * np.sqrt(cells.areas.mean())
    spacing = min(3.0 * cells.surface.mean_edge_length * np.sqrt(len(mesh.faces) / budget), widest)
    merged = merge_vertices(mesh.vertices, mesh.faces, spacing, kinds)
    while len(merged.faces) > budget and spacing * COARSER <= widest:
        spacing *= COARSER
        merged = merge_vertices(mesh.vertices, mesh.faces, spacing, kinds)
    # Cells that have shrunk to nothing are drawn as they are.
    labels = cells.labels[merged.kept]
    gone = ~np.isin(cells.labels, labels)
    return (
        np.concatenate([merged.faces, mesh.faces[gone]]),
        np.concatenate([labels, cells.labels[gone]]),
    )


def _kinds(faces: Ints, labels: Ints, on_edge: Mask) -> Ints:
    """(V,) equal for vertices that may be merged: in one cell, or on one border of two cells.

    Those on the border of the mesh or on a crease stay there.
    """
    count = int(labels.max()) + 1
    touching = np.unique(faces.ravel() * count + np.repeat(labels, 3))
    vertex, cell = np.divmod(touching, count)
    first = np.searchsorted(vertex, np.arange(len(on_edge)))
    number = np.diff(np.append(first, len(vertex)))
    low, high = cell[first], cell[first + number - 1]
    kind = 2 * (low * count + high) + on_edge
    alone = number > 2  # where borders meet
    kind[alone] = -1 - np.flatnonzero(alone)
    return np.unique(kind, return_inverse=True)[1].reshape(-1).astype(np.int64)


BELOW, ABOVE, BOTH = range(3)
COLOURS: tuple[Colour, ...] = ((0.00, 0.45, 0.70), (0.90, 0.60, 0.00), (0.72, 0.75, 0.78))
LOST: Colour = (0.84, 0.12, 0.12)


@dataclass(frozen=True, eq=False, slots=True)
class Sides:
    """Where the cells are reached."""

    labels: Ints
    """(N,) `BELOW`, `ABOVE`, `BOTH`; -1 where no motion was found that reaches the cell."""
    lost: tuple[int, ...]
    """Cells that are proved uncoverable in one of the proof's regions each."""
    names: tuple[str, str, str]
    """What the labels mean, with the number of cells."""
    lost_name: str
    """The same for `lost`."""


def sides_of(verdict: Verdict) -> Sides | None:
    """The sides of the first cut of a verdict's proof; None without a cut or known motions.

    All of a motion is on one side. So each of the components found is, and the cells that it
    covers are reached there.
    """
    proof = verdict.proof
    if proof is None or not isinstance(proof.root, Cut) or verdict.postures is None:
        return None
    cut = proof.root
    reached = np.zeros((2, len(verdict.cells)), dtype=bool)
    for q, cells in zip(verdict.postures, verdict.components, strict=True):
        (_, above), *_ = proof.path_to(q)[0]
        reached[int(above), cells] = True
    labels = np.full(len(verdict.cells), -1, dtype=np.int64)
    labels[reached[0]] = BELOW
    labels[reached[1]] = ABOVE
    labels[reached.all(axis=0)] = BOTH
    counts = [int((labels == k).sum()) for k in range(3)]
    place = place_of(cut, verdict.robot)
    # Empty entries are left out.
    upper = "above it only" if counts[BELOW] else f"above {place} only"
    words = (f"below {place} only", upper, "on both sides")
    named = [f"{word} ({count})" for word, count in zip(words, counts, strict=True)]
    lost = tuple(dict.fromkeys(leaf.cell for leaf in proof.leaves()))
    return Sides(labels, lost, (named[0], named[1], named[2]), _lost_name(verdict, cut, lost))


def _lost_name(verdict: Verdict, cut: Cut, lost: tuple[int, ...]) -> str:
    """Which cells are lost, and on which side where there are two sides only."""
    below, above = cut.below, cut.above
    if isinstance(below, Leaf) and isinstance(above, Leaf) and len(lost) == 2:
        cells = [list(verdict.cells.unravel(cell)) for cell in lost]
        return f"proved: {cells[0]} not below, {cells[1]} not above"
    return f"proved: lost in one region or another ({len(lost)})"
