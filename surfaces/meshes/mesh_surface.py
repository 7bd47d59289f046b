"""MeshSurface: a triangle mesh as a surface that can be cut into cells."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

from numpy.typing import ArrayLike

from surfaces.arguments import ORIGIN, Checks
from surfaces.meshes.cells.mesh_cells import MeshCells
from surfaces.meshes.normals import corner_normals
from surfaces.meshes.sources import triangles_of
from surfaces.meshes.triangle_mesh import TriangleMesh
from surfaces.meshes.triangle_surface import TriangleSurface
from surfaces.surface import Side


@dataclass(frozen=True, eq=False, repr=False)
class MeshSurface(TriangleSurface):
    """Triangles with normals interpolated between their corners; outward is where faces look."""

    def cells(self, count: int | None = None, size: float | None = None) -> MeshCells:
        """Cut the mesh into connected cells of even area.

        Args:
            count: how many cells; or
            size: m, the side of a square that has a cell's area.

        Returns:
            The cells. Their `surface` is this one, its triangles split until they are small enough
            for the cells, and its normals blended at creases.

        Raises:
            SurfaceError: not exactly one of the two is given, or it makes no sense.
        """
        return MeshCells.cut(self, count, size)


def mesh(
    source: str | os.PathLike[str] | TriangleMesh | Any,
    scale: float | None = None,
    side: Side = "outside",
    position: ArrayLike = ORIGIN,
    rpy_deg: ArrayLike = ORIGIN,
) -> MeshSurface:
    """A surface from a mesh file, or from triangles in hand.

    Args:
        source: path of an STL, OBJ, PLY, OFF or GLB file; or a `TriangleMesh`; or anything with
            `vertices` and `faces`, such as a `trimesh.Trimesh`. The files and the last kind are
            checked and repaired, see `surfaces.meshes.repair.clean`.
        scale: metres per unit of the source. Without it the unit is the one in the `units` of a
            `trimesh.Trimesh`, else the metre, and a part above 20 m or below 1 mm is refused, but
            for a `TriangleMesh`, which is in metres; see `surfaces.meshes.read_mesh`.
        side: 'outside' for a tool on the side that the faces look to, 'inside' for the other.
        position: (3,) m, origin of the mesh's frame in the root frame.
        rpy_deg: (3,) fixed-axis roll, pitch, yaw of the mesh's frame.

    Raises:
        SurfaceError: the numbers make no pose or scale, or the mesh is no surface; with the reason.

    Example:
        >>> square = mesh(TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]],
        ...                            [[0, 1, 2], [0, 2, 3]]))
        >>> len(square.cells(count=9))
        9
    """
    check = Checks("mesh")
    pose = check.pose(side, position, rpy_deg)
    check.done()
    triangles = triangles_of(source, scale)
    normals = corner_normals(triangles)
    return MeshSurface(mesh=triangles, corner_normals=normals, crease_normals=normals, **pose)
