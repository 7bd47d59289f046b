"""Piecewise surfaces in a case: patches joined along their seams, each with its own cells."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

from coverable_errors import MISSING
from feasibility.cases.patch_keys import (
    MOST_CELLS,
    PATCHES,
    build_patch,
    frozen_values,
    read_grid,
    read_patch,
    try_patch,
)
from feasibility.cases.surface_kinds import OWN_KEYS, foreign_keys
from feasibility.cases.table_reader import ORIGIN, CaseError, Section, Triple, frozen

if TYPE_CHECKING:
    from surfaces.patches import Patch
    from surfaces.piecewise import PieceCells, Piecewise

MOST_PIECES = 200  # as `surfaces.piecewise` has it


@dataclass(frozen=True, slots=True)
class PiecePart:
    """One entry of `surface.pieces`."""

    kind: str
    values: Mapping[str, Any]
    """The kind's own keys, as in `SurfacePart`."""
    cells: tuple[int, int]
    position: Triple = ORIGIN
    """m, in the frame of the surface."""
    rpy_deg: Triple = ORIGIN

    def table(self) -> dict[str, Any]:
        """The entry as a table."""
        own = {key: self.values[key] for key in OWN_KEYS[self.kind] if key in self.values}
        pose = {"position": self.position, "rpy_deg": self.rpy_deg}
        return {"kind": self.kind, **own, **pose, "cells": self.cells}

    def build(self, place: str) -> Patch:
        """Build the patch; a control net is read from its file.

        Args:
            place: of the entry in the case, for messages.

        Raises:
            CaseError: the values describe no patch.
        """
        pose = {"position": self.position, "rpy_deg": self.rpy_deg}
        return build_patch(self.kind, self.values, pose, place)


def read_pieces(section: Section) -> dict[str, Any]:
    """The values of the keys of a piecewise surface.

    What needs no file is built to try it.
    """
    values = section.take("pieces", "gap")
    if "gap" in values:
        section.positive("gap", values["gap"])
    entries = values.get("pieces", MISSING)
    if not isinstance(entries, list) or not 1 <= len(entries) <= MOST_PIECES:
        if section.is_table:
            tables = f"1 to {MOST_PIECES} tables [[{section.name}.pieces]], a patch each"
            section.wrong("pieces", entries, f"must be {tables}")
        return values
    found = [_piece(section, k, entry) for k, entry in enumerate(entries)]
    pieces = values["pieces"] = tuple(piece for piece in found if piece is not None)
    if sum(piece.cells[0] * piece.cells[1] for piece in pieces) > MOST_CELLS:
        section.fault("pieces", f"make more than {MOST_CELLS:,} cells; use coarser grids")
    return values


def build_pieces(values: Mapping[str, Any], pose: Mapping[str, Any]) -> Piecewise:
    """Build the pieces and join them.

    Args:
        values: `pieces`, and perhaps `gap`.
        pose: `side`, `position` and `rpy_deg`.

    Raises:
        CaseError: a piece cannot be built, or they cannot be joined.
    """
    from surfaces import SurfaceError
    from surfaces.piecewise import piecewise

    patches = [
        piece.build(f"surface.pieces[{k}]")
        for k, piece in enumerate(cast("tuple[PiecePart, ...]", values["pieces"]))
    ]
    try:
        return piecewise(patches, gap=values.get("gap"), **pose)
    except SurfaceError as error:
        raise CaseError([fault.renamed({}, "surface") for fault in error.faults]) from error


def cut_pieces(surface: Piecewise, values: Mapping[str, Any]) -> PieceCells:
    """Cut each piece into its grid.

    Raises:
        CaseError: they cannot be cut so.
    """
    from surfaces import SurfaceError

    try:
        return surface.cells([piece.cells for piece in values["pieces"]])
    except SurfaceError as error:
        raise CaseError([fault._replace(key="surface.pieces") for fault in error.faults]) from error


def _piece(section: Section, k: int, entry: Any) -> PiecePart | None:
    """One entry; None where it has faults."""
    place = f"{section.name}.pieces[{k}]"
    piece = Section(place, entry, section.faults)
    before = len(section.faults)
    kind = piece.word("kind", tuple(PATCHES), required=True)
    pose = piece.take("position", "rpy_deg")
    if kind is None:  # which other keys belong here is not known
        return None
    values = read_patch(piece, kind)
    cells = read_grid(piece)
    own_side = f"is that of all pieces; write it as {section.name}.side, and leave it out here"
    piece.refuse_others({**foreign_keys(kind), "side": own_side})
    try_patch(piece, kind, values, pose)
    if len(section.faults) > before or cells is None:
        return None
    return PiecePart(kind, frozen_values(values), cells, **frozen(pose))
