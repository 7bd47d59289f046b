"""Tiles of smooth patches, one or several: rectangles of parameters.

The bounds are the affine models of `surfaces.patches.affine_models`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from coverable_arrays import Array, Ints
from surfaces.cell_tiles.tiles import CellTiles, Lines, TileBounds, Tiles
from surfaces.patches import GridCells, Patch
from surfaces.places import Places

LOW, HIGH = 0, 2  # of the corners of a rectangle
CORNERS = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
SIGNS = 2.0 * CORNERS - 1.0


@dataclass(frozen=True, eq=False)
class Rectangles(CellTiles):
    """Tiles of patches; the chart is the number of the patch."""

    grids: Sequence[tuple[GridCells, float]]
    """The cells of each patch, and -1.0 where its normals are turned over."""
    first: Ints
    """(pieces + 1,) the first cell of each."""

    def of_cells(self, which: Ints) -> Tiles:
        """See `CellTiles.of_cells`."""
        chart = np.searchsorted(self.first, which, side="right") - 1
        corners = np.empty((len(which), 4, 2))
        for k in np.unique(chart):
            some = np.flatnonzero(chart == k)
            grid, own = self.grids[k][0], which[some] - self.first[k]
            ranges = zip((grid.u, grid.v), (grid.surface.u_range, grid.surface.v_range),
                         grid.shape, strict=True)  # fmt: skip
            for axis, (centre, limits, count) in enumerate(ranges):
                half = 0.5 * (limits[1] - limits[0]) / count
                ends = np.stack([centre[own] - half, centre[own] + half], axis=1)
                corners[some, :, axis] = ends[:, CORNERS[:, axis]]
        return Tiles(which, chart, corners)

    def centres(self, which: Ints) -> Places:
        """See `CellTiles.centres`."""
        return self.of_cells(which).middles

    def lines(self, start: Places, end: Places, parts: Ints) -> Lines:
        """See `CellTiles.lines`: the shorter way round where a parameter closes."""
        x = start.x.copy()
        for patch, _, some in self._by_patch(end.chart):
            for axis, period in enumerate(patch.periods):
                if period:
                    turns = np.round((end.x[some, axis] - x[some, axis]) / period)
                    x[some, axis] += period * turns
        return super().lines(Places(start.chart, x), end, parts)

    def halves(self, tiles: Tiles) -> Tiles:
        """See `CellTiles.halves`."""
        low, high = tiles.corners[:, LOW], tiles.corners[:, HIGH]
        middle = 0.5 * (low + high)
        long = np.empty((len(low), 2))
        for axis in range(2):
            ends = [middle.copy(), middle.copy()]
            ends[0][:, axis], ends[1][:, axis] = low[:, axis], high[:, axis]
            # By way of the middle: an arc may come back to where it began.
            points = [self._points(tiles.chart, x) for x in (ends[0], middle, ends[1])]
            long[:, axis] = np.linalg.norm(np.diff(points, axis=0), axis=2).sum(axis=0)
        axis, row = np.argmax(long, axis=1), np.arange(len(low))
        lows, highs = np.stack([low, low], axis=1), np.stack([high, high], axis=1)
        highs[row, 0, axis] = lows[row, 1, axis] = middle[row, axis]
        limits = np.stack([lows.reshape(-1, 2), highs.reshape(-1, 2)], axis=1)
        corners = np.stack([limits[:, CORNERS[:, axis], axis] for axis in range(2)], axis=2)
        return Tiles(np.repeat(tiles.cell, 2), np.repeat(tiles.chart, 2), corners)

    def bounds(self, tiles: Tiles) -> TileBounds:
        """See `CellTiles.bounds`."""
        height, count = self.offset.height, len(tiles.cell)
        made = TileBounds(np.empty((count, 4, 2, 3)), np.empty((count, 2)))
        for patch, sign, some in self._by_patch(tiles.chart):
            low, high = tiles.corners[some, LOW], tiles.corners[some, HIGH]
            models = patch.placed_models(low, high, sign).guarded()
            flat = models.centre[:, None] + SIGNS @ models.slopes
            made.corners[some, :, 0] = flat[..., :3] + height * flat[..., 3:]
            made.corners[some, :, 1] = flat[..., 3:]
            made.radii[some, 0] = models.radius[:, 0] + abs(height) * models.radius[:, 1]
            made.radii[some, 1] = models.radius[:, 1]
        return made

    def areas(self, tiles: Tiles) -> Array:
        """See `CellTiles.areas`."""
        found = np.empty(len(tiles.cell))
        for patch, _, some in self._by_patch(tiles.chart):
            low, high = tiles.corners[some, LOW].T, tiles.corners[some, HIGH].T
            found[some] = patch.area(low[0], high[0], low[1], high[1])
        return found

    def _points(self, chart: Ints, x: Array) -> Array:
        """(k, 3) m, points of the surface."""
        found = np.empty((len(x), 3))
        for patch, _, some in self._by_patch(chart):
            found[some] = patch.point(x[some, 0], x[some, 1])
        return found

    def _by_patch(self, chart: Ints) -> list[tuple[Patch, float, Ints]]:
        """Each patch, its sign, and the rows that are on it."""
        return [
            (self.grids[k][0].surface, self.grids[k][1], np.flatnonzero(chart == k))
            for k in np.unique(chart)
        ]
