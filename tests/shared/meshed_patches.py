"""Patches as meshes, cut into the very cells of the patch."""

from __future__ import annotations

import numpy as np
from mesh_patches import of_patch

from surfaces import mesh
from surfaces.meshes import TriangleMesh
from surfaces.meshes.cells import MeshCells
from surfaces.patches import GridCells


def in_cells_of(cells: GridCells, parts: int) -> MeshCells:
    """The patch of some cells as triangles, `parts` x `parts` rectangles of two in each cell."""
    patch, (nu, nv) = cells.surface, (parts * count for count in cells.shape)
    i, j = np.indices((nu, nv)) // parts
    label = (i * cells.shape[1] + j).ravel()
    surface = mesh(TriangleMesh(*of_patch(patch, nu, nv)), side=patch.side)
    return MeshCells.of(surface, np.repeat(label, 2))
