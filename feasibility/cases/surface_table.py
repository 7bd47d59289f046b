"""The [surface] table of a case: which surface or pieces, where, and how it is cut into cells."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, cast

from coverable_errors import Fault, alternatives, close, shown
from feasibility.cases.automatic_cells import (
    AUTO,
    Footprint,
    automatic_count,
    grid_of,
)
from feasibility.cases.given_files import KINDS, UNITS, build_poses, check_side, read_given
from feasibility.cases.mesh_keys import (
    build_mesh,
    build_step,
    cut_mesh,
    read_count,
    read_mesh_keys,
    smooth_mesh,
)
from feasibility.cases.surface_keys import (
    OWN_KEYS,
    PATCHES,
    build_patch,
    foreign_keys,
    frozen_values,
    read_grid,
    read_patch,
    try_patch,
)
from feasibility.cases.surface_pieces import PiecePart, build_pieces, cut_pieces, read_pieces
from feasibility.cases.table_reader import ORIGIN, CaseError, Section, Triple, frozen, is_text

if TYPE_CHECKING:
    from surfaces import Cells, Surface
    from surfaces.meshes import MeshSurface
    from surfaces.patches import Patch
    from surfaces.piecewise import Piecewise

OWN_FORMULA = (
    "a surface of your own formula g(u, v) is given by points of it, as a grid, by triangles, as a "
    "mesh, or in Python by surfaces.parametric(g, u, v)"
)
MESHES = ("mesh", "step")  # kinds whose surface is triangles


@dataclass(frozen=True, slots=True)
class SurfacePart:
    """The [surface] table of a case."""

    kind: str
    values: Mapping[str, Any]
    """The kind's own keys, in the units of the case; arrays as tuples, paths absolute."""
    cells: tuple[int, int] | int | Literal["auto"] | None
    """Along u and v of a patch; of a mesh their number, or None where `cell_size` is given; "auto"
    for as many as the footprint needs; None for pieces, which have their own, and for poses,
    each of which is one."""
    side: Literal["inside", "outside"] = "inside"
    position: Triple = ORIGIN
    rpy_deg: Triple = ORIGIN
    frame: str | None = None
    """The link that carries it; None for the world, or the last axis that carries the surface."""

    @property
    def label(self) -> str:
        """What the surface is called in notes: its file's name, or its kind."""
        file = self.values.get("file")
        return self.kind if file is None else os.path.basename(file)

    @property
    def is_grid(self) -> bool:
        """Whether the cells lie in rows and columns."""
        return isinstance(self.cells, tuple) or (self.cells == AUTO and self.kind in PATCHES)

    @property
    def automatic(self) -> bool:
        """Whether the number of cells depends on the footprint."""
        pieces = cast("tuple[PiecePart, ...]", self.values.get("pieces", ()))
        return self.cells == AUTO or any(piece.cells == AUTO for piece in pieces)

    @property
    def counts(self) -> list[int]:
        """The number of cells along u and v, or of all cells of a mesh; empty if not known yet."""
        if self.cells is None or self.cells == AUTO:
            return []
        return [self.cells] if isinstance(self.cells, int) else list(self.cells)

    def table(self) -> dict[str, Any]:
        """The keys of the [surface] table; what is None is not written."""
        return {
            "kind": self.kind,
            **{key: _written(self.values.get(key)) for key in OWN_KEYS[self.kind]},
            "position": self.position,
            "rpy_deg": self.rpy_deg,
            "frame": self.frame,
            "side": self.side,
            "cells": self.cells,
        }

    @property
    def pose(self) -> dict[str, Any]:
        """The arguments of a constructor that every surface has."""
        return {"side": self.side, "position": self.position, "rpy_deg": self.rpy_deg}

    def build(self) -> Surface:
        """Build the surface; its file, if it has one, is read.

        Raises:
            CaseError: the numbers or the file describe no surface.
        """
        if self.kind == "mesh":
            return build_mesh(self.values, self.pose)
        if self.kind == "step":
            return build_step(self.values, self.pose)
        if self.kind == "piecewise":
            return build_pieces(self.values, self.pose)
        if self.kind == "poses":
            return build_poses(self.values, self.pose).surface
        return build_patch(self.kind, self.values, self.pose)

    def cut(
        self,
        footprint: Footprint | None = None,
        smoothing: tuple[float, float] | None = None,
    ) -> Cells:
        """Build the surface and cut it into its cells.

        Args:
            footprint: m, of the tool, where the cells are to be fine enough for it.
            smoothing: length and tolerance, m, where a mesh is to be smoothed before.

        Raises:
            CaseError: there is no such surface, or it cannot be cut so.
        """
        if self.kind == "poses":
            return build_poses(self.values, self.pose)
        surface = self.build()
        if self.kind in MESHES:
            return self._cut_mesh(smooth_mesh(cast("MeshSurface", surface), smoothing), footprint)
        if self.kind == "piecewise":
            return cut_pieces(cast("Piecewise", surface), self.values, footprint)
        patch, cells = cast("Patch", surface), cast("tuple[int, int]", self.cells)
        return patch.cells(*grid_of(patch, cells, footprint))

    def _cut_mesh(self, surface: MeshSurface, footprint: Footprint | None) -> Cells:
        """Cut a mesh into its cells."""
        count = self.cells
        if count == AUTO and footprint is not None:
            count = automatic_count(surface, footprint)
        return cut_mesh(surface, cast("int | None", count), self.values.get("cell_size"))


def read_surface(table: Any, faults: list[Fault]) -> SurfacePart | None:
    """Read the [surface] table; None where it has faults.

    Patches that need no file are built to try them; files are read, and pieces joined, by
    `SurfacePart.build` only.
    """
    from surfaces import check_pose

    before = len(faults)
    section = Section("surface", table, faults)
    kind = _kind(section)
    pose = section.take("side", "position", "rpy_deg")
    if kind is None:  # which other keys belong here is not known
        section.make(check_pose, pose)
        return None
    section.of_kind(kind)
    frame = section.text("frame")
    values, cells = _values(section, kind)
    hints = foreign_keys(kind)
    if kind == "piecewise":
        hints["cells"] = "is given for each piece; write cells = [3, 4] in each of surface.pieces"
    if kind == "poses":
        hints["cells"] = "is not needed: each pose is a cell; leave it out"
    section.refuse_others(hints)
    check_side(section, kind)
    if kind in PATCHES:
        try_patch(section, kind, values, pose)
    else:
        section.make(check_pose, pose)
    if len(faults) > before:
        return None
    return SurfacePart(kind, frozen_values(values), cells, frame=frame, **frozen(pose))


def _kind(section: Section) -> str | None:
    """The kind of surface; None after a fault."""
    written, kinds = section.table.get("kind"), tuple(OWN_KEYS)
    if is_text(written) and written not in kinds and not close(written, kinds):
        listed = alternatives([repr(kind) for kind in kinds])
        section.fault("kind", f"must be {listed}, got {shown(written)}; {OWN_FORMULA}")
        return None
    return section.word("kind", kinds, required=True)


def faults_of_building(part: SurfacePart) -> list[Fault]:
    """What building the surface would say."""
    try:
        part.build()
    except CaseError as error:
        return list(error.faults)
    return []


def named_file(table: Any) -> SurfacePart | None:
    """The surface in the file that a faulty table names, if it names one."""
    kind = table.get("kind") if isinstance(table, Mapping) else None
    if kind not in ("mesh", "bspline", *KINDS):
        return None
    plain: dict[str, Any] = {"kind": kind, "file": table.get("file"), "side": "outside"}
    if kind != "poses":
        plain["cells"] = 1 if kind == "mesh" else [1, 1]
    if kind in KINDS:
        plain["units"] = table["units"] if table.get("units") in UNITS else "m"
    if table["kind"] == "mesh" and "scale" in table:
        plain["scale"] = table["scale"]
    known = read_surface(plain, [])
    # The likely size of a part is nothing to go by where its scale is wrong.
    return known if known or "scale" not in plain else read_surface(plain | {"scale": 1.0}, [])


def _values(
    section: Section, kind: str
) -> tuple[dict[str, Any], tuple[int, int] | int | Literal["auto"] | None]:
    """What the kind's own keys say, and how many cells there are."""
    if kind in MESHES:
        return read_mesh_keys(section, kind), read_count(section)
    if kind == "piecewise":
        return read_pieces(section), None
    if kind == "poses":
        return read_given(section, kind), None
    return read_patch(section, kind), read_grid(section)


def _written(value: Any) -> Any:
    """A value as TOML has it."""
    if isinstance(value, PiecePart):
        return value.table()
    return tuple(map(_written, value)) if isinstance(value, tuple) else value
