"""Tiles of meshes: triangles on the faces.

The normal over a face is v / |v|, where v mixes for each place, by its weights, the corners' own
normals and those of a crease (`surfaces.meshes.normals`):

    v = sum of w_c ((1 - t) own_c + t crease_c),    0 <= t <= 1.

Over a triangle with the corners i, and t between t_0 and t_1, v lies in the hull of the mixtures at
i with t_0 and with t_1. Vectors within a right angle of an axis by some angle form a convex cone;
so whichever of those corners is furthest from the axis bounds the turn of all v / |v|.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from coverable_arrays import Array, Ints
from surfaces.cell_tiles.tiles import CellTiles, Lines, TileBounds, Tiles, spaced
from surfaces.meshes import MeshSurface
from surfaces.meshes.cells import MeshCells
from surfaces.places import Places

ROUNDING = 1.0 + 1e-12
RIGHT = np.sqrt(2.0)  # the chord of a right angle
WHOLE = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])


@dataclass(frozen=True, eq=False)
class FaceTriangles(CellTiles):
    """Tiles of a mesh; the chart is the face."""

    cells: MeshCells

    def of_cells(self, which: Ints) -> Tiles:
        """See `CellTiles.of_cells`: the faces."""
        wanted = np.zeros(len(self.cells), dtype=bool)
        wanted[which] = True
        faces = np.flatnonzero(wanted[self.cells.labels])
        corners = np.broadcast_to(WHOLE, (len(faces), 3, 2)).copy()
        return Tiles(self.cells.labels[faces], faces, corners)

    def centres(self, which: Ints) -> Places:
        """See `CellTiles.centres`."""
        figures = self.cells.figures
        return Places(figures.faces[which], figures.weights[which, 1:])

    @cached_property
    def touching(self) -> tuple[Ints, Ints]:
        """See `CellTiles.touching`: faces that share an edge."""
        pairs = self._surface.mesh.edges.faces
        both = np.concatenate([pairs, pairs[:, ::-1]])
        both = both[np.argsort(both[:, 0], kind="stable")]
        count = len(self._surface.mesh.faces)
        return np.searchsorted(both[:, 0], np.arange(count + 1)), both[:, 1]

    def lines(self, start: Places, end: Places, parts: Ints) -> Lines:
        """See `CellTiles.lines`: also from one face to the next, over the edge between them."""
        crossing = start.chart != end.chart
        path = self.offset.paths(start, end)
        over, landed = path.place(1), path.place(2)
        line, share, first = spaced(np.where(crossing, 2 * parts, parts))
        x = start.x[line] + share[:, None] * (end.x - start.x)[line]
        chart = end.chart[line].copy()
        bent = crossing[line]
        before, after = bent & (share <= 0.5), bent & (share > 0.5)
        to = 2.0 * share[before, None]
        rows = line[before]
        x[before] = (1.0 - to) * start.x[rows] + to * over.x[rows]
        chart[before] = start.chart[rows]
        fro = 2.0 * share[after, None] - 1.0
        rows = line[after]
        x[after] = (1.0 - fro) * landed.x[rows] + fro * end.x[rows]
        return Lines(Places(chart, x), first)

    def halves(self, tiles: Tiles) -> Tiles:
        """See `CellTiles.halves`: from the middle of the longest side to the corner across."""
        points = self._points(tiles)
        sides = np.linalg.norm(np.roll(points, -1, axis=1) - points, axis=2)
        row, start = np.arange(len(sides)), np.argmax(sides, axis=1)
        a, b, c = (tiles.corners[row, (start + k) % 3] for k in range(3))
        middle = 0.5 * (a + b)
        both = np.stack([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)], 1)
        return Tiles(np.repeat(tiles.cell, 2), np.repeat(tiles.chart, 2), both.reshape(-1, 3, 2))

    def bounds(self, tiles: Tiles) -> TileBounds:
        """See `CellTiles.bounds`."""
        normal = self.offset.at(tiles.middles)[1]
        turned = np.linalg.norm(self._corner_normals(tiles) - normal[:, None], axis=2)
        turn = turned.max(axis=1) * ROUNDING
        turn = np.where(turn < RIGHT, turn, np.inf)
        height = self.offset.height
        points = self._points(tiles) + height * normal[:, None]
        corners = np.stack([points, np.broadcast_to(normal[:, None], points.shape)], axis=2)
        return TileBounds(corners[:, [0, 1, 2, 2]], np.stack([abs(height) * turn, turn], axis=1))

    def areas(self, tiles: Tiles) -> Array:
        """See `CellTiles.areas`."""
        points = self._points(tiles)
        crossed = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
        return np.asarray(0.5 * np.linalg.norm(crossed, axis=1))

    @property
    def _surface(self) -> MeshSurface:
        return self.cells.surface

    def _points(self, tiles: Tiles) -> Array:
        """(k, 3, 3) m, the corners."""
        x = tiles.corners.reshape(-1, 2)
        weights = np.column_stack([1.0 - x.sum(axis=1), x])
        return self._surface.points_at(np.repeat(tiles.chart, 3), weights).reshape(-1, 3, 3)

    def _corner_normals(self, tiles: Tiles) -> Array:
        """(k, 6, 3) the unit normals whose hull holds all that are mixed over each tile."""
        surface, count = self._surface, len(tiles.chart)
        face = np.repeat(tiles.chart, 3)
        x = tiles.corners.reshape(-1, 2)
        weights = np.column_stack([1.0 - x.sum(axis=1), x])
        own = np.einsum("kc,kci->ki", weights, surface.corner_normals[face])
        crease = np.einsum("kc,kci->ki", weights, surface.crease_normals[face])
        share = surface.crease_share(face, weights).reshape(count, 3)
        made = []
        for t in (share.min(axis=1), share.max(axis=1)):
            t = np.repeat(t, 3)[:, None]
            v = (1.0 - t) * own + t * crease
            made.append((v / np.linalg.norm(v, axis=1, keepdims=True)).reshape(count, 3, 3))
        return np.concatenate(made, axis=1) @ surface.rotation.T
