"""Shapes for drawing E-cells: filled patches, borders, and marks at their centres."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from feasibility.viewer.decimated_mesh import display_mesh_of
from surfaces import Cells, Triangles
from surfaces.meshes.cells import MeshCells

FULL_DETAIL = 1_500  # cells; more are drawn without centre marks, and edges as plain lines


def patch(cells: Cells, which: NDArray[np.int64], inset: float = 0.0) -> Triangles:
    """Triangles that fill some cells, as fine as their number allows; see `Cells.triangles`."""
    if isinstance(cells, MeshCells):
        return display_mesh_of(cells).fill(which, cells.centres, inset)
    along = max(*cells.shape, 1) if len(cells.shape) > 1 else np.sqrt(len(cells))
    pieces = int(np.clip(np.ceil(64 / along), 2, 32))  # a cell's side, cut up
    return cells.triangles(which, 1 if len(cells) > FULL_DETAIL else pieces, inset)


def borders(cells: Cells) -> NDArray[np.float64]:
    """(k, 2, 3) m, ends of short lines along the borders of all cells; see `Cells.borders`."""
    if isinstance(cells, MeshCells):
        return display_mesh_of(cells).borders()
    return cells.borders(8 if len(cells) <= FULL_DETAIL else 1)


def marks(
    centres: NDArray[np.float64], radius: float
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
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
