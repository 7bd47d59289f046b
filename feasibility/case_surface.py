"""The [surface] table of a case: which surface, where, and how it is cut into cells."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, cast

from feasibility.case_faults import BuildError, Fault, Section, alternatives, close, shown
from feasibility.case_mesh import MESH_KEYS, build_mesh, cut_mesh, read_count, read_mesh_keys
from feasibility.case_patches import (
    DEG,
    METRES,
    PATCHES,
    build_patch,
    patch_keys,
    read_grid,
    read_patch,
)

if TYPE_CHECKING:
    from surfaces import Cells, Patch, Surface
    from surfaces.mesh import MeshSurface

Triple = tuple[float, float, float]

ORIGIN: Triple = (0.0, 0.0, 0.0)
OWN_KEYS: Mapping[str, tuple[str, ...]] = {
    **{kind: patch_keys(kind) for kind in PATCHES},
    "mesh": MESH_KEYS,
}
LATER_KINDS = ("piecewise",)
CHARTED = ("sphere", "cylinder", "hyperboloid", "plane")
"""The kinds that the greedy search knows."""


@dataclass(frozen=True, slots=True)
class SurfacePart:
    """The [surface] table of a case."""

    kind: str
    values: Mapping[str, Any]
    """The kind's own keys, in the units of the case; arrays as tuples, paths absolute."""
    cells: tuple[int, int] | int | None
    """Along u and v of a patch; of a mesh their number, or None where `cell_size` is given."""
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
            **{key: self.values.get(key) for key in OWN_KEYS[self.kind]},
            "position": self.position,
            "rpy_deg": self.rpy_deg,
            "side": self.side,
            "cells": self.cells,
        }

    def build(self) -> Surface:
        """Build the surface; its file, if it has one, is read.

        Raises:
            BuildError: the numbers or the file describe no surface.
        """
        pose = {"side": self.side, "position": self.position, "rpy_deg": self.rpy_deg}
        if self.kind == "mesh":
            return build_mesh(self.values, pose)
        return build_patch(self.kind, self.values, pose)

    def cut(self) -> Cells:
        """Build the surface and cut it into its cells.

        Raises:
            BuildError: there is no such surface, or it cannot be cut so.
        """
        surface = self.build()
        if self.kind == "mesh":
            count = cast("int | None", self.cells)
            return cut_mesh(cast("MeshSurface", surface), count, self.values.get("cell_size"))
        return cast("Patch", surface).cells(*cast("tuple[int, int]", self.cells))


def read_surface(table: Any, faults: list[Fault]) -> SurfacePart | None:
    """Read the [surface] table; None where it has faults.

    What needs no file is built to try it; files are read by `SurfacePart.build` only.
    """
    section = Section("surface", table, faults)
    before = len(faults)
    kind = _kind(section)
    side = section.choice("side", ("inside", "outside"))
    position = section.numbers("position", 3, "three finite numbers (metres)")
    rpy_deg = section.numbers("rpy_deg", 3, "three finite numbers (degrees)")
    if kind is None:  # which other keys belong here is not known
        return None
    values = read_mesh_keys(section) if kind == "mesh" else read_patch(section, kind)
    cells = read_count(section) if kind == "mesh" else read_grid(section)
    section.done(_foreign_keys(kind))
    if len(faults) > before:
        return None
    part = SurfacePart(
        kind=kind,
        values=values,
        cells=cells,
        side=cast(Literal["inside", "outside"], side or "inside"),
        position=cast("tuple[float, float, float]", position or ORIGIN),
        rpy_deg=cast("tuple[float, float, float]", rpy_deg or ORIGIN),
    )
    if "file" not in values:
        faults += faults_of_building(part)
    return part if len(faults) == before else None


def faults_of_building(part: SurfacePart) -> list[Fault]:
    """What building the surface would say."""
    try:
        part.build()
    except BuildError as error:
        return [error.fault]
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


def _kind(section: Section) -> str | None:
    """The kind, if it is one that can be built."""
    kinds = tuple(OWN_KEYS)
    expected = alternatives([f'"{kind}"' for kind in kinds])
    if not section.wants("kind", expected, required=True):
        return None
    kind = section.table["kind"]
    if kind in LATER_KINDS:
        section.fault("kind", f"{shown(kind)} is not supported yet; use {expected}")
        return None
    if not isinstance(kind, str) or kind not in OWN_KEYS:
        guess = close(kind, kinds)
        hint = f"; did you mean {guess}?" if guess else ""
        section.fault("kind", f"must be {expected}, got {shown(kind)}{hint}")
        return None
    return kind


def _foreign_keys(kind: str) -> dict[str, str]:
    """What to say about keys that belong to other kinds of surface."""
    owners: dict[str, list[str]] = {}
    for other, keys in OWN_KEYS.items():
        for key in keys:
            owners.setdefault(key, []).append(_a(other))
    hints = {
        key: f"belongs to {alternatives(names)}, not to {_a(kind)}; leave it out"
        for key, names in owners.items()
    }
    for mine in ("u", "v", "u_deg", "v_deg"):
        if mine in OWN_KEYS[kind]:
            letter = mine[0]
            other = letter if mine.endswith("_deg") else f"{letter}_deg"
            unit = DEG if mine.endswith("_deg") else METRES
            unit = "the numbers of the knots" if kind == "bspline" else unit
            hints[other] = f"is not how {_a(kind)} is written; write {mine} in {unit}"
    return {key: hint for key, hint in hints.items() if key not in OWN_KEYS[kind]}


def _a(kind: str) -> str:
    """The kind with its article."""
    return f"{'an' if kind[0] in 'aeiou' else 'a'} {kind}"
