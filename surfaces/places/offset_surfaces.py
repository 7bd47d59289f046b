"""The offset surface of any surface, to find the place under a tool."""

from __future__ import annotations

from functools import lru_cache

from surfaces.patches.patch import Patch
from surfaces.places.patch_places import PatchPlaces
from surfaces.places.places import OffsetSurface
from surfaces.surface import Surface, SurfaceError


@lru_cache(maxsize=4)  # surfaces are values; one motion after the other is judged over them
def offset_surface(surface: Surface, height: float, directed: bool = False) -> OffsetSurface:
    """The surface's parallel at a signed height (m) along its outward normal.

    `directed` where its u directions are wanted, too.

    Raises:
        SurfaceError: the surface is of a kind that is not known here.

    Example:
        >>> import numpy as np
        >>> from coverable import sphere
        >>> dome = offset_surface(sphere(1.0, (10, 90), (0, 180)), -0.25)
        >>> point = np.array([[0.0, 0.5, 0.5]])
        >>> places = dome.nearest(point, point, 0.01)
        >>> np.linalg.norm(dome.at(places)[0], axis=1).round(6).tolist()
        [0.75]
    """
    if isinstance(surface, Patch):
        return PatchPlaces(height, directed, surface)
    # Loaded where they are needed: most questions are about one patch.
    from surfaces.meshes.mesh_surface import MeshSurface
    from surfaces.piecewise.piecewise_surface import Piecewise
    from surfaces.places.mesh_places import MeshPlaces
    from surfaces.places.piece_places import PiecePlaces
    from surfaces.places.pose_places import PosePlaces
    from surfaces.toolpaths.pose_surface import PoseSurface

    if isinstance(surface, Piecewise):
        return PiecePlaces(height, directed, surface)
    if isinstance(surface, MeshSurface):
        return MeshPlaces(height, directed, surface)
    if isinstance(surface, PoseSurface):
        return PosePlaces(height, directed, surface)
    raise SurfaceError(f"a surface of kind {surface.kind} has no places to follow")
