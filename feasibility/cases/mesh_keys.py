"""Meshes in a case: a file, its unit, the part that is to be covered, and how it is cut."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from coverable_errors import MISSING
from feasibility.cases.table_reader import CaseError, Section, in_file

if TYPE_CHECKING:
    from surfaces.meshes import MeshSurface, TriangleMesh
    from surfaces.meshes.cells import MeshCells

MOST_MESH_CELLS = 20_000  # as `surfaces.meshes.cells` has it
NAMES = {
    "low": "box[0]",
    "high": "box[1]",
    "half_angle_deg": "within_deg",
    "count": "cells",
    "size": "cell_size",
}
"""Keys of arguments that are called otherwise in Python."""

Values = Mapping[str, Any]


def read_mesh_keys(section: Section) -> dict[str, Any]:
    """The values of a mesh's own keys, as they are written."""
    from surfaces.meshes.files import metres_per_unit

    values = section.take("scale", "cell_size", "faces", "box", "cut", "facing")
    file = section.text("file", required=True)
    if file is not None:
        values["file"] = os.path.abspath(os.path.expanduser(file))
    if "scale" in values:
        section.make(metres_per_unit, {"scale": values["scale"]})
    if "cell_size" in values:
        section.positive("cell_size", values["cell_size"])
    if "faces" in values:
        _check_faces(section, values["faces"])
    _check_parts(section, values)
    if section.is_table and not section.has("side"):
        section.fault(
            "side",
            'is missing; a mesh needs "outside" (the tool works where the faces look to) or '
            '"inside" (behind the faces)',
        )
    return values


def read_count(section: Section) -> int | None:
    """How many cells; None where `cell_size` stands for it."""
    written = section.take("cells")
    if section.has("cell_size"):
        if written:
            section.fault("cells", "contradicts surface.cell_size; give one of the two")
        return None
    if not written:
        section.fault("cells", "is missing; give their number, or cell_size = 0.05 (metres)")
        return None
    return section.whole("cells", written["cells"], 1, MOST_MESH_CELLS)


def build_mesh(values: Values, pose: Mapping[str, Any]) -> MeshSurface:
    """Read the file, take the part that the keys select, and place it.

    Args:
        values: of the keys that only a mesh has.
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
        raise CaseError(in_file(error, file, "surface")) from error
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

    Faces first: they are numbered in the mesh of the file.
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
    """Turn faults of a surface into faults of the case; `key` is whose those without one are.

    Raises:
        CaseError: what happens inside is a fault.
    """
    from surfaces import SurfaceError

    try:
        yield
    except SurfaceError as error:
        faults = (fault._replace(key=fault.key or key) for fault in error.faults)
        raise CaseError([fault.renamed(NAMES, "surface") for fault in faults]) from error


def _check_faces(section: Section, value: Any) -> None:
    """Numbers of faces; which there are, the file says."""
    if not isinstance(value, list) or not value:
        section.wrong_type("faces", value)
        return
    before = len(section.faults)
    for k, number in enumerate(value):
        section.whole(f"faces[{k}]", number, 0)
        if len(section.faults) > before:
            return


def _check_parts(section: Section, values: Values) -> None:
    """The box, the plane and the cone of normals that take a part of the mesh."""
    from surfaces.meshes import checked_box, checked_cone, checked_plane

    if "box" in values:
        box = values["box"]
        if isinstance(box, list) and len(box) == 2:
            section.make(checked_box, dict(zip(("low", "high"), box, strict=True)), NAMES)
        else:
            section.wrong_type("box", box)
    for key, check, arguments in (
        ("cut", checked_plane, {"point": "point", "normal": "normal"}),
        ("facing", checked_cone, {"direction": "direction", "within_deg": "half_angle_deg"}),
    ):
        if key in values:
            part = Section(f"{section.name}.{key}", values[key], section.faults)
            written = part.take(*arguments)
            given = {name: written.get(k, MISSING) for k, name in arguments.items()}
            part.make(check, given, NAMES)
            part.refuse_others()
