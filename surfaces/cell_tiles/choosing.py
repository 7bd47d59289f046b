"""The tiles of any cells."""

from __future__ import annotations

import numpy as np

from surfaces.cell_tiles.rectangles import Rectangles
from surfaces.cell_tiles.tiles import CellTiles, offset_of
from surfaces.cells import Cells
from surfaces.patches import GridCells


def cell_tiles(cells: Cells, height: float) -> CellTiles | None:
    """What cuts cells into tiles; None where there is no surface between them.

    Args:
        cells: the cells.
        height: m, of the offset surface along the outward normal.

    Example:
        >>> from surfaces import plane
        >>> cells = plane((0.0, 0.4), (0.0, 0.2)).cells(2, 1)
        >>> tiles = cell_tiles(cells, 0.01)
        >>> halves = tiles.halves(tiles.of_cells(np.arange(2)))
        >>> tiles.areas(halves).round(6).tolist()
        [0.02, 0.02, 0.02, 0.02]
    """
    if isinstance(cells, GridCells):
        first = np.array([0, len(cells)])
        return Rectangles(cells, offset_of(cells, height), [(cells, 1.0)], first)
    # Loaded where they are needed: most questions are about one patch.
    from surfaces.cell_tiles.triangles import FaceTriangles
    from surfaces.meshes.cells import MeshCells
    from surfaces.piecewise import PieceCells

    if isinstance(cells, PieceCells):
        grids = list(zip(cells.grids, cells.surface.signs, strict=True))
        return Rectangles(cells, offset_of(cells, height), grids, cells.first)
    if isinstance(cells, MeshCells):
        return FaceTriangles(cells, offset_of(cells, height))
    return None
