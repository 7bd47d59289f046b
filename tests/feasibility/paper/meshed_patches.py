"""Patches as meshes, cut into the very cells of the patch."""

from __future__ import annotations

import numpy as np

from surfaces import mesh
from surfaces.meshes import TriangleMesh
from surfaces.meshes.cells import MeshCells
from surfaces.patches import GridCells


def in_cells_of(cells: GridCells, parts: int) -> MeshCells:
    """The patch of some cells as triangles, `parts` x `parts` rectangles of two in each cell."""
    patch, (nu, nv) = cells.surface, (parts * count for count in cells.shape)
    u, v = np.meshgrid(
        np.linspace(*patch.u_range, nu + 1), np.linspace(*patch.v_range, nv + 1), indexing="ij"
    )
    i, j = np.meshgrid(np.arange(nu), np.arange(nv), indexing="ij")
    corner = (i * (nv + 1) + j).ravel()
    up = corner + nv + 1
    faces = np.concatenate(
        [np.column_stack([corner, up, up + 1]), np.column_stack([corner, up + 1, corner + 1])]
    )
    points = patch.point(u, v).reshape(-1, 3)
    middles = points[faces].mean(axis=1)
    outward = np.cross(points[faces[:, 1]] - points[faces[:, 0]],
                       points[faces[:, 2]] - points[faces[:, 0]])  # fmt: skip
    if (outward * patch.closest(middles).normal).sum() < 0.0:
        faces = faces[:, ::-1]
    label = ((i // parts) * cells.shape[1] + j // parts).ravel()
    surface = mesh(TriangleMesh(points, faces), side=patch.side)
    return MeshCells.of(surface, np.concatenate([label, label]))
