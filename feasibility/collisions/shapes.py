"""Shapes of scene and tool, their numbers checked before anything else sees them.

coal and qhull crash on shapes that are flat or not finite, so no other shapes exist. Triangles come
from files and arrays that are not trusted: they are checked and welded.
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from coverable.arrays import Array, Ints
from coverable.errors import Checks, CoverableError, Fault, shown
from coverable.files import shown_name
from robots.shapes.bodies import Geometry, HalfSpace, Triangles
from robots.shapes.solids import solid_faces
from robots.urdf.link_shapes import Box, Capsule, Cylinder, Sphere

MOST_FACES = 500_000
SMALLEST_EXTENT, LARGEST_EXTENT = 1e-6, 1e4  # [m], of the widest side
_AREA = 1e-14  # [1], of the widest side squared: a face below is none

PLACEHOLDER = Triangles(
    np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), np.array([[0, 1, 2]]), False
)


def read_triangles(path: str | os.PathLike[str], scale: float | None = None) -> Triangles:
    """The triangles of a mesh file, in metres.

    Unlike a surface that is to be covered, an object may have holes, and edges with any number of
    faces: then it is no solid, but a sheet.

    Args:
        path: STL, OBJ, PLY, OFF or GLB, of at most 500,000 faces.
        scale: metres per unit of the file; None for metres, where a width above 20 m or below 1 mm
            is refused as a likely wrong unit. Any given scale is taken.

    Raises:
        ArgumentError: no such file, not a mesh, damaged, too large, flat to a line, or of an
            unlikely size.
    """
    from coverable.meshes.mesh_file import read_raw
    from surfaces.meshes.sources import metres_per_unit, refuse_unlikely_unit

    checks = Checks()
    name = shown_name(path)
    made = PLACEHOLDER
    try:
        unit = metres_per_unit(scale)
        raw = read_raw(path)
        with np.errstate(over="ignore"):  # infinite coordinates are refused next
            made = object_triangles(checks, raw.vertices * unit, raw.faces)
        if scale is None and not checks.faults:
            refuse_unlikely_unit(float(np.ptp(made.vertices, axis=0).max()))
    except CoverableError as error:
        checks.faults += error.faults
    checks.faults = [
        Fault("scale" if fault.key == "scale" else "file", fault.fault, name, fault.expected)
        for fault in checks.faults
    ]
    checks.done()
    return made


def object_triangles(checks: Checks, vertices: Any, faces: Any) -> Triangles:
    """Triangles that nothing chokes on: welded, without faces that have no area.

    They are `closed` where they bound a solid, see `solid_faces`; faces that look inwards are
    then turned over.
    """
    before = len(checks.faults)
    points, corners = _arrays(checks, vertices, faces)
    if len(checks.faults) > before:
        return PLACEHOLDER
    points, same = np.unique(points, axis=0, return_inverse=True)
    corners = same.reshape(-1)[corners]
    with np.errstate(over="ignore"):
        wide = float(np.ptp(points[corners].reshape(-1, 3), axis=0).max())
    if not SMALLEST_EXTENT <= wide <= LARGEST_EXTENT:
        expected = f"must be {SMALLEST_EXTENT:g} .. {LARGEST_EXTENT:g} m wide"
        checks.keep(Fault("faces", f"are {wide:.3g} m wide", expected=expected))
        return PLACEHOLDER
    sides = points[corners[:, 1:]] - points[corners[:, :1]]
    areas = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    corners = corners[areas > _AREA * wide**2]
    if not len(corners):
        expected = "must be triangles with an area"
        checks.keep(Fault("faces", "all of them are flat to a line", expected=expected))
        return PLACEHOLDER
    used, corners = np.unique(corners, return_inverse=True)
    points, corners = points[used], corners.reshape(-1, 3)
    solid = solid_faces(points, corners)
    return Triangles(points, corners if solid is None else solid, solid is not None)


def _arrays(checks: Checks, vertices: Any, faces: Any) -> tuple[Array, Ints]:
    """Both as arrays; anything after a fault."""
    before = len(checks.faults)
    try:
        points = np.asarray(vertices, dtype=float)
    except (TypeError, ValueError):
        points = np.empty((0, 0))
    if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
        checks.keep(Fault("vertices", "are not k x 3 finite numbers (metres)"))
    given = np.asarray(faces)
    if given.ndim != 2 or given.shape[1] != 3 or given.dtype.kind not in "iu":
        checks.keep(Fault("faces", "are not m x 3 whole numbers, the indices of vertices"))
    elif not 1 <= len(given) <= MOST_FACES:
        expected = f"must be 1 .. {MOST_FACES:,}"
        checks.keep(Fault("faces", f"are {len(given):,}; thin the mesh", expected=expected))
    elif len(checks.faults) == before and not 0 <= given.min() <= given.max() < len(points):
        checks.keep(Fault("faces", f"name a vertex that is not among the {len(points):,}"))
    return points, given


SMALLEST_SIDE, LARGEST_SIDE = 1e-6, 1e4  # [m]
FARTHEST = 1e4  # [m], from the origin of the world
ORIGIN = (0.0, 0.0, 0.0)


def checked_shape(checks: Checks, geometry: Any) -> Geometry:
    """The shape with its numbers as plain floats; faults are kept under the numbers' names."""
    if isinstance(geometry, HalfSpace):
        return geometry
    if isinstance(geometry, Box):
        expected = "must be three edge lengths > 0 (metres)"
        size = checks.numbers("size", geometry.size, 3, expected) or [1.0, 1.0, 1.0]
        x, y, z = (_side(checks, f"size[{k}]", length) for k, length in enumerate(size))
        return Box((x, y, z))
    if isinstance(geometry, Sphere):
        return Sphere(_side(checks, "radius", geometry.radius))
    if isinstance(geometry, (Cylinder, Capsule)):
        radius = _side(checks, "radius", geometry.radius)
        return type(geometry)(radius, _side(checks, "length", geometry.length))
    if isinstance(geometry, Triangles):
        return object_triangles(checks, geometry.vertices, geometry.faces)
    checks.wrong("geometry", geometry, "must be a Box, Cylinder, Capsule, Sphere or Triangles")
    return Sphere(1.0)


def _side(checks: Checks, key: str, value: object) -> float:
    """m, a length of a shape that an arm can meet."""
    before = len(checks.faults)
    length = checks.positive(key, value)
    if len(checks.faults) > before or SMALLEST_SIDE <= length <= LARGEST_SIDE:
        return length
    expected = f"must lie in {SMALLEST_SIDE:g} .. {LARGEST_SIDE:g} (metres)"
    remedy = "; a floor, wall or ceiling is a halfspace" if length > LARGEST_SIDE else ""
    checks.keep(Fault(key, f"got {shown(value)}{remedy}", expected=expected))
    return 1.0
