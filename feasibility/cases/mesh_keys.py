"""Triangles in a case, a mesh or STEP faces: the file, which part of it, and how it is cut."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Literal

from coverable_errors import MISSING, Fault
from feasibility.cases.keys import own_keys
from feasibility.cases.table_reader import (
    SURFACE_NAMES,
    CaseError,
    Section,
    in_file,
    shown_path,
    surface_faults,
)

if TYPE_CHECKING:
    from surfaces.meshes import MeshSurface, TriangleMesh
    from surfaces.meshes.cells import MeshCells

CHOICE = ("faces", "colour", "deviation")
"""Keys of a STEP file that say what of it is read."""
MOST_MESH_CELLS = 20_000  # as `surfaces.meshes.cells` has it
Values = Mapping[str, Any]


def read_mesh_keys(section: Section, kind: str) -> dict[str, Any]:
    """The values of the own keys of a mesh or of STEP faces, as they are written."""
    values = section.take(*own_keys(kind))
    values.pop("file", None)
    values |= section.path(required=True)
    if kind == "step":
        _check_choice(section, values)
    else:
        _check_mesh(section, values)
    if "cell_size" in values:
        section.positive("cell_size", values["cell_size"])
    _check_parts(section, values)
    return values


def read_count(section: Section) -> int | Literal["auto"] | None:
    """How many cells, or as many as the footprint needs; None where `cell_size` is given."""
    written = section.take("cells")
    if section.has("cell_size"):
        if written:
            section.fault("cells", "contradicts surface.cell_size; give one of the two")
        return None
    if not written:
        section.fault("cells", "is missing; give their number, or cell_size = 0.05 (metres)")
        return None
    if written["cells"] == "auto":
        return "auto"
    return section.whole("cells", written["cells"], 1, MOST_MESH_CELLS, "'auto'")


def build_mesh(values: Values, pose: Mapping[str, Any]) -> MeshSurface:
    """Read the file, take the part that the keys select, and place it.

    Args:
        values: of the keys that only a mesh has.
        pose: `side`, `position` and `rpy_deg`.

    Raises:
        CaseError: the file cannot be used, or nothing is left of it.
    """
    from surfaces import SurfaceError
    from surfaces.meshes import mesh, read_mesh, take_faces

    file = values["file"]
    try:
        triangles = read_mesh(file, values.get("scale"))
    except SurfaceError as error:
        raise CaseError(in_file(error, file, "surface")) from error
    if "faces" in values:
        with surface_faults("faces"):
            triangles = take_faces(triangles, values["faces"])
    with surface_faults():
        return mesh(_part(triangles, values), **pose)


def build_step(values: Values, pose: Mapping[str, Any]) -> MeshSurface:
    """Read the file, cut the chosen faces into triangles, take a part of them, and place it.

    Args:
        values: of the keys that only STEP faces have.
        pose: `side`, `position` and `rpy_deg`.

    Raises:
        CaseError: the file cannot be used, it has no such faces, or nothing is left of them.
    """
    from surfaces import SurfaceError, mesh, step_triangles

    file, choice = values["file"], {key: values[key] for key in CHOICE if key in values}
    if "facing" in values and not {"faces", "colour"} & set(choice):
        choice["faces"] = "all"
    try:
        triangles = step_triangles(file, **choice)
    except SurfaceError as error:
        own = [fault for fault in error.faults if fault.key.partition("[")[0] in CHOICE]
        faults = [fault._replace(place=shown_path(file)).renamed({}, "surface") for fault in own]
        raise CaseError(faults or in_file(error, file, "surface")) from error
    with surface_faults():
        return mesh(_part(triangles, values), **pose)


def smooth_mesh(surface: MeshSurface, smoothing: tuple[float, float] | None) -> MeshSurface:
    """A copy smoothed over a length for a tolerance (m), or the mesh itself.

    Raises:
        CaseError: it cannot be smoothed so.
    """
    from surfaces import SurfaceError
    from surfaces.meshes import smoothed

    try:
        return surface if smoothing is None else smoothed(surface, *smoothing)
    except SurfaceError as error:
        raise CaseError(Fault("task.smooth", str(error))) from error


def cut_mesh(surface: MeshSurface, count: int | None, size: float | None) -> MeshCells:
    """Cut a mesh into cells, by their number or their size (m).

    Raises:
        CaseError: it cannot be cut so.
    """
    with surface_faults("cells" if size is None else "cell_size"):
        return surface.cells(count=count, size=size)


def _part(triangles: TriangleMesh, values: Values) -> TriangleMesh:
    """What box, cut and facing leave of triangles, in this order.

    Raises:
        CaseError: nothing.
    """
    from surfaces.meshes import cut_box, cut_plane, faces_within_cone

    parts: dict[str, Callable[[Any], TriangleMesh]] = {
        "box": lambda box: cut_box(triangles, *box),
        "cut": lambda cut: cut_plane(triangles, cut["point"], cut["normal"]),
        "facing": lambda facing: faces_within_cone(
            triangles, facing["direction"], facing["within_deg"]
        ),
    }
    for key, take in parts.items():
        if key in values:
            with surface_faults(key):
                triangles = take(values[key])
    return triangles


def _check_mesh(section: Section, values: Values) -> None:
    """The unit, and numbers of faces; which there are, the file says."""
    from surfaces.meshes import metres_per_unit

    if "scale" in values:
        section.make(metres_per_unit, {"scale": values["scale"]})
    faces = values.get("faces", [0])
    if not isinstance(faces, list) or not faces:
        section.wrong_type("faces", faces)
        return
    before = len(section.faults)
    for k, number in enumerate(faces):
        section.whole(f"faces[{k}]", number, 0)
        if len(section.faults) > before:
            return


def _check_choice(section: Section, values: Values) -> None:
    """Which faces of a STEP file are meant, and how closely triangles follow them."""
    from surfaces import checked_choice

    section.make(checked_choice, {key: values.get(key) for key in CHOICE if key in values})


def _check_parts(section: Section, values: Values) -> None:
    """The box, the plane and the cone of normals that take a part of the mesh."""
    from surfaces.meshes import checked_box, checked_cone, checked_plane

    if "box" in values:
        box = values["box"]
        if isinstance(box, list) and len(box) == 2:
            section.make(checked_box, dict(zip(("low", "high"), box, strict=True)), SURFACE_NAMES)
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
            part.make(check, given, SURFACE_NAMES)
            part.refuse_others()
