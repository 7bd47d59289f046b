"""The triangles of a mesh surface: from a file, or from an object in hand, in metres."""

from __future__ import annotations

from typing import Any

import numpy as np

from coverable_errors import shown
from surfaces.meshes.files import metres_per_unit, read_mesh, with_likely_unit
from surfaces.meshes.repair import clean
from surfaces.meshes.triangle_mesh import TriangleMesh
from surfaces.surface import SurfaceError


def triangles_of(source: Any, scale: float | None) -> TriangleMesh:
    """The clean triangles of a source, in metres.

    Args:
        source: a path, a `TriangleMesh`, or anything with `vertices` and `faces`.
        scale: metres per unit; None to go by the `units` of an object, else by the metre.

    Raises:
        SurfaceError: it is no surface, or of so unlikely a size that its unit has to be given.
    """
    if not (hasattr(source, "vertices") and hasattr(source, "faces")):
        return read_mesh(source, scale)
    unit = metres_per_unit(scale, "the mesh")
    if isinstance(source, TriangleMesh):
        if scale is None:
            return source
        return TriangleMesh(unit * source.vertices, source.faces, source.history)
    named = getattr(source, "units", None)
    if scale is None and isinstance(named, str) and named.strip().lower() not in ("", "none"):
        unit = _metres_per(named)
    found = clean(unit * np.asarray(source.vertices), source.faces)
    return found if scale is not None else with_likely_unit(found, "the mesh", unit)


def _metres_per(name: str) -> float:
    """Metres in a unit, as trimesh calls it.

    Raises:
        SurfaceError: it knows no such unit, or no part is measured in it.
    """
    from trimesh.units import unit_conversion

    try:
        metres = float(f"{unit_conversion(name, 'meters'):.12g}")
    except ValueError as error:
        advice = 'write "mm", "in" or "m", or give scale, the metres per unit'
        raise SurfaceError(f"the mesh: its units are {shown(name)}; {advice}") from error
    return metres_per_unit(metres, f"the mesh in {name}")
