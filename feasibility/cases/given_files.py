"""Surfaces that are files of points: a grid, and poses."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from feasibility.cases.table_reader import CaseError, Section, in_file

if TYPE_CHECKING:
    from surfaces import PoseCells
    from surfaces.patches import Patch

KINDS = ("grid", "poses")
UNITS = ("m", "mm")
FACES = "where the faces look to", "behind the faces"
SIDES = {
    "mesh": ("a mesh needs", *FACES),
    "step": ("STEP faces need", *FACES),
    "grid": (
        "a grid needs",
        "on the side of (u direction) x (v direction), rows being u; with rows along x and columns "
        "along y that is +z",
        "on the other",
    ),
    "poses": ("poses need", "on the side the normals point to", "on the other"),
}
"""Kinds of surface that have no usual side, and what their sides mean."""


def read_given(section: Section, kind: str) -> dict[str, Any]:
    """The values of the keys of a grid or of poses, as they are written."""
    values: dict[str, Any] = {**section.path(required=True)}
    units = section.word("units", UNITS, required=True)
    if units is not None:
        values["units"] = units
    if kind == "poses":
        values |= section.take("neighbours")
        neighbours = values.get("neighbours", "order")
        if neighbours != "order":
            if isinstance(neighbours, str):
                section.wrong_type("neighbours", neighbours)
            else:
                section.positive("neighbours", neighbours)
    return values


def check_side(section: Section, kind: str) -> None:
    """Keep a fault where the side is not given and there is no usual one."""
    if kind in SIDES and section.is_table and not section.has("side"):
        needs, outside, inside = SIDES[kind]
        words = f'"outside" (the tool works {outside}) or "inside" ({inside})'
        section.fault("side", f"is missing; {needs} {words}")


def build_grid(values: Mapping[str, Any], pose: Mapping[str, Any], place: str) -> Patch:
    """Read the points, and make the patch through them.

    Raises:
        CaseError: the file cannot be used.
    """
    from surfaces import SurfaceError, grid, read_grid

    file = values["file"]
    try:
        return grid(read_grid(file, values["units"]), **pose)
    except SurfaceError as error:
        raise CaseError(in_file(error, file, place)) from error


def build_poses(values: Mapping[str, Any], pose: Mapping[str, Any]) -> PoseCells:
    """Read the poses, and make cells of them.

    Raises:
        CaseError: the file cannot be used, or the neighbours do not suit it.
    """
    from surfaces import SurfaceError, poses, read_poses

    file, neighbours = values["file"], values.get("neighbours", "order")
    try:
        return poses(**read_poses(file, values["units"])._asdict(), neighbours=neighbours, **pose)
    except SurfaceError as error:
        own = [fault for fault in error.faults if fault.key == "neighbours"]
        of_file = SurfaceError([f for f in error.faults if f.key != "neighbours"] or own)
        faults = [] if len(own) == len(error.faults) else in_file(of_file, file, "surface")
        raise CaseError([fault.renamed({}, "surface") for fault in own] + faults) from error
