"""The triangles of a mesh surface: from a file, or from an object in hand, in metres."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from coverable.errors import shown
from coverable.files import shown_name
from coverable.meshes.mesh_file import read_raw
from coverable.meshes.raw_mesh import MeshError
from surfaces.arguments import Checks
from surfaces.meshes.cleaning import clean
from surfaces.meshes.triangle_mesh import TriangleMesh
from surfaces.surface import SurfaceError

# [m] Parts outside are taken only where the scale was given: no arm reaches around them.
LARGEST_PART, SMALLEST_PART = 20.0, 1e-3
WIDE_PART = 5.0  # [m]: worth a note


def read_mesh(path: str | os.PathLike[str], scale: float | None = None) -> TriangleMesh:
    """Read a mesh file and clean it; see `surfaces.meshes.repair.clean` for what is repaired.

    Args:
        path: a file of one of the formats, at most 512 MB and 2,000,000 faces.
        scale: metres per unit of the file, such as 0.001 for millimetres. Without it the unit is
            taken as the metre, and a part above 20 m or below 1 mm is refused: that is nearly
            always a wrong unit, and the answer would only be that the arm cannot reach. Any given
            scale, 1.0 too, is taken.

    Raises:
        SurfaceError: no such file, not a mesh, damaged, too large, or not a surface; with the
            file's name, the place and what would do.
    """
    name = shown_name(path)
    try:
        unit = metres_per_unit(scale)
        raw = read_raw(path)
        with np.errstate(over="ignore"):  # infinite coordinates are refused next
            vertices = raw.vertices * unit
        mesh = clean(vertices, raw.faces, history=raw.notes)
        if scale is not None:
            return mesh
        return with_likely_unit(mesh)
    except (MeshError, SurfaceError) as error:
        raise SurfaceError(error.faults, name) from error


def metres_per_unit(scale: float | None, name: str = "") -> float:
    """The scale as a number, 1 where none is given; `name` says of what.

    Raises:
        SurfaceError: it is no number, or not within 1e-9 .. 1e9.
    """
    if scale is None:
        return 1.0
    checks = Checks(name)
    expected = "must be a number in 1e-09 .. 1e+09 (metres per unit; 0.001 for millimetres)"
    unit = checks.number("scale", scale, expected, 1e-9, 1e9)
    checks.done()
    return unit


def with_likely_unit(mesh: TriangleMesh, what: str = "the file", unit: float = 1.0) -> TriangleMesh:
    """Refuse a part of unlikely size, and note one that is wider than most arms reach.

    Args:
        mesh: in metres, if the unit is right.
        what: has the triangles, for the message.
        unit: metres per unit that was assumed.

    Raises:
        SurfaceError: the part is wider than 20 m, or narrower than 1 mm.
    """
    wide = float(mesh.extent.max())
    refuse_unlikely_unit(wide, what, unit)
    if wide <= WIDE_PART:
        return mesh
    note = (
        f"the part is {wide:.4g} m wide, wider than most arms reach; if its unit is not the metre, "
        "give scale"
    )
    return TriangleMesh(mesh.vertices, mesh.faces, (*mesh.history, note))


def refuse_unlikely_unit(wide: float, what: str = "the file", unit: float = 1.0) -> None:
    """Refuse a part of unlikely size.

    Args:
        wide: m, its longest side, if the unit is right.
        what: has the triangles, for the message.
        unit: metres per unit that was assumed.

    Raises:
        SurfaceError: the part is wider than 20 m, or narrower than 1 mm.
    """
    if wide > LARGEST_PART:
        others = (
            f"if {what} is in millimetres give scale = 0.001 ({wide * 0.001:.3g} m), if in inches "
            f"scale = 0.0254 ({wide * 0.0254:.3g} m), and "
        )
        advice = f"{others if unit == 1.0 else ''}if it is that wide scale = {unit}"
        raise SurfaceError(f"the part is {wide:.4g} m wide; {advice}")
    if wide < SMALLEST_PART:
        reason, larger = "it was scaled from millimetres to metres twice", 1000.0
        if unit < 1.0:
            reason, larger = f"{what} is in metres", 1.0
        raise SurfaceError(
            f"the part is {wide:.3g} m wide; if {reason} give scale = {larger:g} "
            f"({wide / unit * larger:.3g} m), and if it is that small scale = {unit}"
        )


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
