"""Triangles of E-cells: filled patches and marks at their centres."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from surfaces import Cells

FULL_DETAIL = 1_500  # cells; more are drawn without centre marks, and edges as plain lines


def patch(
    cells: Cells, which: NDArray[np.int64], inset: float = 0.0
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64]]:
    """Triangles that fill some cells, smooth where the surface bends.

    Args:
        cells: of a parametric surface.
        which: (k,) flat indices.
        inset: share of its width that a cell is drawn smaller by.

    Returns:
        Vertices (V, 3) m, faces (F, 3) and outward unit normals (V, 3).
    """
    surface = cells.surface
    pieces = int(np.clip(np.ceil(64 / max(*cells.shape, 1)), 2, 32))  # a cell's side, cut up
    if len(cells) > FULL_DETAIL:
        pieces = 1
    t = (np.linspace(0.0, 1.0, pieces + 1) - 0.5) * (1.0 - inset)
    du, dv = (part.reshape(-1) for part in np.meshgrid(t, t, indexing="ij"))
    width_u = (surface.u_range[1] - surface.u_range[0]) / cells.shape[0]
    width_v = (surface.v_range[1] - surface.v_range[0]) / cells.shape[1]
    u = cells.u[which, None] + du * width_u
    v = cells.v[which, None] + dv * width_v
    i, j = (part.reshape(-1) for part in np.meshgrid(*[np.arange(pieces)] * 2, indexing="ij"))
    corner = i * (pieces + 1) + j
    right, up = corner + 1, corner + pieces + 1
    one = np.concatenate(
        [np.column_stack([corner, right, up + 1]), np.column_stack([corner, up + 1, up])]
    )
    starts = np.arange(len(which)) * (pieces + 1) ** 2
    faces = (starts[:, None, None] + one).reshape(-1, 3)
    return surface.point(u, v).reshape(-1, 3), faces, surface.normal(u, v).reshape(-1, 3)


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
