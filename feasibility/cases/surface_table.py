"""The [surface] table of a case: which surface, where, and how it is cut into cells."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, cast

from coverable_errors import Fault
from feasibility.cases.mesh_keys import build_mesh, cut_mesh, read_count, read_mesh_keys
from feasibility.cases.patch_keys import (
    PATCHES,
    build_patch,
    frozen_values,
    read_grid,
    read_patch,
    try_patch,
)
from feasibility.cases.piecewise_keys import PiecePart, build_pieces, cut_pieces, read_pieces
from feasibility.cases.surface_kinds import OWN_KEYS, foreign_keys
from feasibility.cases.table_reader import ORIGIN, CaseError, Section, Triple, frozen

if TYPE_CHECKING:
    from surfaces import Cells, Surface
    from surfaces.meshes import MeshSurface
    from surfaces.patches import Patch
    from surfaces.piecewise import Piecewise


@dataclass(frozen=True, slots=True)
class SurfacePart:
    """The [surface] table of a case."""

    kind: str
    values: Mapping[str, Any]
    """The kind's own keys, in the units of the case; arrays as tuples, paths absolute."""
    cells: tuple[int, int] | int | None
    """Along u and v of a patch; of a mesh their number, or None where `cell_size` is given; None
    for pieces, which have their own."""
    side: Literal["inside", "outside"] = "inside"
    position: Triple = ORIGIN
    rpy_deg: Triple = ORIGIN

    @property
    def label(self) -> str:
        """What the surface is called in notes: its file's name, or its kind."""
        file = self.values.get("file")
        return self.kind if file is None else os.path.basename(file)

    @property
    def counts(self) -> list[int]:
        """The number of cells along u and v, or of all cells of a mesh; empty if not known yet."""
        cells = self.cells
        return [] if cells is None else [cells] if isinstance(cells, int) else list(cells)

    def table(self) -> dict[str, Any]:
        """The keys of the [surface] table; what is None is not written."""
        return {
            "kind": self.kind,
            **{key: _written(self.values.get(key)) for key in OWN_KEYS[self.kind]},
            "position": self.position,
            "rpy_deg": self.rpy_deg,
            "side": self.side,
            "cells": self.cells,
        }

    def build(self) -> Surface:
        """Build the surface; its file, if it has one, is read.

        Raises:
            CaseError: the numbers or the file describe no surface.
        """
        pose = {"side": self.side, "position": self.position, "rpy_deg": self.rpy_deg}
        if self.kind == "mesh":
            return build_mesh(self.values, pose)
        if self.kind == "piecewise":
            return build_pieces(self.values, pose)
        return build_patch(self.kind, self.values, pose)

    def cut(self) -> Cells:
        """Build the surface and cut it into its cells.

        Raises:
            CaseError: there is no such surface, or it cannot be cut so.
        """
        surface = self.build()
        if self.kind == "mesh":
            count = cast("int | None", self.cells)
            return cut_mesh(cast("MeshSurface", surface), count, self.values.get("cell_size"))
        if self.kind == "piecewise":
            return cut_pieces(cast("Piecewise", surface), self.values)
        return cast("Patch", surface).cells(*cast("tuple[int, int]", self.cells))


def read_surface(table: Any, faults: list[Fault]) -> SurfacePart | None:
    """Read the [surface] table; None where it has faults.

    Patches that need no file are built to try them; files are read, and pieces joined, by
    `SurfacePart.build` only.
    """
    from surfaces import check_pose

    section = Section("surface", table, faults)
    before = len(faults)
    kind = section.word("kind", tuple(OWN_KEYS), required=True)
    pose = section.take("side", "position", "rpy_deg")
    if kind is None:  # which other keys belong here is not known
        section.make(check_pose, pose)
        return None
    values, cells = _values(section, kind)
    section.refuse_others(_hints(kind))
    if kind in PATCHES:
        try_patch(section, kind, values, pose)
    else:
        section.make(check_pose, pose)
    if len(faults) > before:
        return None
    return SurfacePart(kind, frozen_values(values), cells, **frozen(pose))


def faults_of_building(part: SurfacePart) -> list[Fault]:
    """What building the surface would say."""
    try:
        part.build()
    except CaseError as error:
        return list(error.faults)
    return []


def named_file(table: Any) -> SurfacePart | None:
    """The surface in the file that a faulty table names, if it names one."""
    if not isinstance(table, Mapping) or table.get("kind") not in ("mesh", "bspline"):
        return None
    plain: dict[str, Any] = {"kind": table["kind"], "file": table.get("file"), "side": "outside"}
    plain["cells"] = 1 if table["kind"] == "mesh" else [1, 1]
    if table["kind"] == "mesh" and "scale" in table:
        plain["scale"] = table["scale"]
    return read_surface(plain, [])


def _values(section: Section, kind: str) -> tuple[dict[str, Any], tuple[int, int] | int | None]:
    """What the kind's own keys say, and how many cells there are."""
    if kind == "mesh":
        return read_mesh_keys(section), read_count(section)
    if kind == "piecewise":
        return read_pieces(section), None
    return read_patch(section, kind), read_grid(section)


def _hints(kind: str) -> dict[str, str]:
    """What to say about keys that belong elsewhere."""
    hints = foreign_keys(kind)
    if kind == "piecewise":
        hints["cells"] = "is given for each piece; write cells = [3, 4] in each of surface.pieces"
    return hints


def _written(value: Any) -> Any:
    """A value as TOML has it."""
    if isinstance(value, PiecePart):
        return value.table()
    return tuple(map(_written, value)) if isinstance(value, tuple) else value
