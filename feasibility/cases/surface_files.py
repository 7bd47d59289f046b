"""Surfaces of files and of pieces: grids of points, poses, meshes, STEP faces, joined patches."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from coverable.errors import Fault
from feasibility.cases.surface_building import Values, build_patch, faults_of
from feasibility.cases.table_reader import CaseError

CHOICE = ("faces", "colour", "deviation")  # keys of STEP files that say what of them is read


def _grid(values: Values, pose: Values, place: str) -> Any:
    from surfaces.fitted.grid_file import read_grid
    from surfaces.fitted.point_grid import grid

    with faults_of(place, file=values["file"]):
        return grid(read_grid(values["file"], values["units"]), **pose)


def _poses(values: Values, pose: Values, place: str) -> Any:
    from surfaces.toolpaths.given import poses
    from surfaces.toolpaths.pose_file import read_poses

    with faults_of(place, file=values["file"], own=("neighbours",)):
        points = read_poses(values["file"], values["units"])._asdict()
        return poses(**points, neighbours=values.get("neighbours", "order"), **pose)


def _mesh(values: Values, pose: Values, place: str) -> Any:
    from surfaces.meshes.selection import take_faces
    from surfaces.meshes.sources import read_mesh

    with faults_of(place, file=values["file"]):
        triangles = read_mesh(values["file"], values.get("scale"))
    if "faces" in values:
        with faults_of(place, "faces"):
            triangles = take_faces(triangles, values["faces"])
    return _part(triangles, values, pose, place)


def _step(values: Values, pose: Values, place: str) -> Any:
    from surfaces.meshes.step_surface import step_triangles

    choice = {key: values[key] for key in CHOICE if key in values}
    if "facing" in values and not {"faces", "colour"} & set(choice):
        choice["faces"] = "all"
    with faults_of(place, file=values["file"], own=CHOICE):
        triangles = step_triangles(values["file"], **choice)
    return _part(triangles, values, pose, place)


def _part(triangles: Any, values: Values, pose: Values, place: str) -> Any:
    """The mesh of what box, cut and facing leave of triangles, in this order."""
    from surfaces.meshes.mesh_surface import mesh
    from surfaces.meshes.selection import cut_box, cut_plane, faces_within_cone

    parts: dict[str, Callable[[Any], Any]] = {
        "box": lambda box: cut_box(triangles, *box),
        "cut": lambda cut: cut_plane(triangles, cut["point"], cut["normal"]),
        "facing": lambda at: faces_within_cone(triangles, at["direction"], at["within_deg"]),
    }
    for key, take in parts.items():
        if key in values:
            with faults_of(place, key):
                triangles = take(values[key])
    with faults_of(place):
        return mesh(triangles, **pose)


def smooth_mesh(surface: Any, smoothing: tuple[float, float]) -> Any:
    """A copy of a mesh, smoothed over a length for a tolerance (m).

    Raises:
        CaseError: it cannot be smoothed so.
    """
    from surfaces.meshes.smoothing import smoothed
    from surfaces.surface import SurfaceError

    try:
        return smoothed(surface, *smoothing)
    except SurfaceError as error:
        raise CaseError(Fault("task.smooth", str(error))) from error


def _pieces(values: Values, pose: Values, place: str) -> Any:
    from surfaces.piecewise.piecewise_surface import piecewise

    patches = [
        built(piece.kind, piece.values, piece.pose, f"{place}.pieces[{k}]")
        for k, piece in enumerate(values["pieces"])
    ]
    with faults_of(place):
        return piecewise(patches, gap=values.get("gap"), **pose)


def built(kind: str, values: Values, pose: Values, place: str = "surface") -> Any:
    """Build a surface of any kind; arguments as of `build_patch`; of poses their cells.

    Raises:
        CaseError: the values describe no surface, or the file cannot be used.
    """
    make = {"grid": _grid, "poses": _poses, "mesh": _mesh, "step": _step, "piecewise": _pieces}
    if kind in make:
        return make[kind](values, pose, place)
    return build_patch(kind, values, pose, place)
