"""Meshes in a case: a file, its unit, the part that is to be covered, and how it is cut."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from feasibility.cases.patch_keys import of_file
from feasibility.cases.table_reader import CaseError, Fault, Section, is_number, shown

if TYPE_CHECKING:
    from surfaces.meshes import MeshSurface, TriangleMesh
    from surfaces.meshes.cells import MeshCells

MESH_KEYS = ("file", "scale", "cell_size", "faces", "box", "cut", "facing")
MESH_FILE = "the path of a mesh (STL, OBJ, PLY, OFF or GLB), relative to the case file"
MOST_MESH_CELLS = 20_000  # as `surfaces.clusters` has it
SCALES = (1e-9, 1e9)

Values = Mapping[str, Any]


def read_mesh_keys(section: Section) -> dict[str, Any]:
    """The values of a mesh's own keys; those left out or wrong are missing."""
    file = section.text("file", MESH_FILE, required=True)
    values = {
        "file": None if file is None else os.path.abspath(os.path.expanduser(file)),
        "scale": _scale(section),
        "cell_size": section.positive("cell_size", "a number > 0 (metres), the side of a cell"),
        "faces": _faces(section),
        "box": _box(section),
        "cut": _cut(section),
        "facing": _facing(section),
    }
    if section.is_table and not section.has("side"):
        section.fault(
            "side",
            'is missing; a mesh needs "outside" (the tool works where the faces look to) or '
            '"inside" (behind the faces)',
        )
    return {key: value for key, value in values.items() if value is not None}


def read_count(section: Section) -> int | None:
    """How many cells; None where `cell_size` stands for it."""
    expected = f"one whole number in 1 .. {MOST_MESH_CELLS:,}, such as 200"
    if section.has("cell_size"):
        if section.has("cells"):
            section.fault("cells", "contradicts surface.cell_size; give one of the two")
        return None
    instead = "or cell_size = 0.05 (metres)"
    if not section.wants("cells", f"{expected}, {instead}", required=True):
        return None
    value = section.table["cells"]
    whole = isinstance(value, int) and not isinstance(value, bool)
    if not whole or not 1 <= value <= MOST_MESH_CELLS:
        section.wrong("cells", f"{expected}, {instead}")
        return None
    return int(value)


def build_mesh(values: Values, pose: Mapping[str, Any]) -> MeshSurface:
    """Read the file, take the part that is asked for, and place it.

    Args:
        values: of `MESH_KEYS`.
        pose: `side`, `position` and `rpy_deg`.

    Raises:
        CaseError: the file cannot be used, or nothing is left of it.
    """
    from surfaces import SurfaceError
    from surfaces.meshes import mesh
    from surfaces.meshes.files import read_mesh

    file = values["file"]
    try:
        triangles = read_mesh(file, values.get("scale"))
    except SurfaceError as error:
        raise CaseError(Fault("surface.file", of_file(file, str(error)))) from error
    for key, take in _parts().items():
        if key in values:
            with _faults_of(key):
                triangles = take(triangles, values[key])
    with _faults_of(""):
        return mesh(triangles, **pose)


def cut_mesh(surface: MeshSurface, count: int | None, size: float | None) -> MeshCells:
    """Cut a mesh into cells, by their number or their size (m).

    Raises:
        CaseError: it cannot be cut so.
    """
    with _faults_of("cells" if size is None else "cell_size"):
        return surface.cells(count=count, size=size)


def _parts() -> dict[str, Callable[[TriangleMesh, Any], TriangleMesh]]:
    """What each key takes of a mesh, in the order in which this is done.

    Faces first: they are numbered in the whole mesh.
    """
    from surfaces.meshes import cut_box, cut_plane, faces_within_cone, take_faces

    return {
        "faces": take_faces,
        "box": lambda mesh, box: cut_box(mesh, *box),
        "cut": lambda mesh, cut: cut_plane(mesh, cut["point"], cut["normal"]),
        "facing": lambda mesh, facing: faces_within_cone(
            mesh, facing["direction"], facing["within_deg"]
        ),
    }


@contextmanager
def _faults_of(key: str) -> Iterator[None]:
    """Turn a fault of a surface into one of a key of the case, in the words of the case.

    Raises:
        CaseError: what happens inside is a fault.
    """
    from surfaces import SurfaceError

    try:
        yield
    except SurfaceError as error:
        message = re.sub(r"\bsize\b(?= = )", "cell_size", str(error))
        message = re.sub(r"\bcount\b(?= = )", "cells", message)
        raise CaseError(Fault(f"surface.{key}" if key else "surface", message)) from error


def _scale(section: Section) -> float | None:
    """Metres per unit of the file."""
    expected = f"a number in {SCALES[0]:g} .. {SCALES[1]:g}, metres per unit, 0.001 for millimetres"
    scale = section.number("scale", expected)
    if scale is not None and not SCALES[0] <= scale <= SCALES[1]:
        section.wrong("scale", expected)
        return None
    return scale


def _faces(section: Section) -> tuple[int, ...] | None:
    """Numbers of faces."""
    expected = "an array of whole numbers >= 0, numbers of faces of the mesh after its repair"
    if not section.wants("faces", expected, required=False):
        return None
    value = section.table["faces"]
    if not isinstance(value, list) or not value:
        section.wrong("faces", expected)
        return None
    for k, number in enumerate(value):
        if isinstance(number, bool) or not isinstance(number, int) or not 0 <= number < 2**63:
            section.fault(f"faces[{k}]", f"must be a whole number >= 0, got {shown(number)}")
            return None
    return tuple(value)


def _box(section: Section) -> tuple[tuple[float, ...], ...] | None:
    """Two corners."""
    expected = "[[x0, y0, z0], [x1, y1, z1]] in metres, the least and the greatest coordinates"
    if not section.wants("box", expected, required=False):
        return None
    value = section.table["box"]
    fits = isinstance(value, list) and len(value) == 2
    if not fits or not all(isinstance(c, list) and len(c) == 3 for c in value):
        section.wrong("box", expected)
        return None
    low, high = value
    if not all(map(is_number, (*low, *high))):
        section.wrong("box", expected)
        return None
    if not all(float(a) < float(b) for a, b in zip(low, high, strict=True)):
        section.fault("box", f"must be {expected}, the first below the second, got {shown(value)}")
        return None
    return tuple(map(float, low)), tuple(map(float, high))


def _cut(section: Section) -> dict[str, Any] | None:
    """A plane."""
    if not section.has("cut"):
        return None
    plane = Section(f"{section.name}.cut", section.table["cut"], section.faults)
    before = len(section.faults)
    point = plane.numbers("point", 3, "three finite numbers (metres)", required=True)
    normal = _direction(plane, "normal")
    plane.done()
    if len(section.faults) > before or point is None or normal is None:
        return None
    return {"point": point, "normal": normal}


def _facing(section: Section) -> dict[str, Any] | None:
    """A cone of normals."""
    if not section.has("facing"):
        return None
    cone = Section(f"{section.name}.facing", section.table["facing"], section.faults)
    before = len(section.faults)
    direction = _direction(cone, "direction")
    expected = "a number > 0 and <= 180 (degrees)"
    within = cone.positive("within_deg", expected, required=True)
    if within is not None and within > 180.0:
        cone.wrong("within_deg", expected)
    cone.done()
    if len(section.faults) > before or direction is None or within is None:
        return None
    return {"direction": direction, "within_deg": within}


def _direction(section: Section, key: str) -> tuple[float, ...] | None:
    """Three numbers, not all zero."""
    expected = "three finite numbers that are not all zero, such as [0, 0, 1]"
    found = section.numbers(key, 3, expected, required=True)
    if found is not None and max(map(abs, found)) < 1e-12:
        section.wrong(key, expected)
        return None
    return found
