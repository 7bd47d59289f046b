"""The [surface] table of a case and its pieces: which surface, where, and how it is cut."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal

from coverable.errors import MISSING, Fault, alternatives, close, shown
from feasibility.cases.keys import kinds, own_keys
from feasibility.cases.surface_building import (
    AUTO,
    FILES,
    MOST_CELLS,
    MOST_MESH_CELLS,
    Footprint,
    build_patch,
    cut_surface,
)
from feasibility.cases.table_reader import (
    DEG,
    METRES,
    ORIGIN,
    CaseError,
    Section,
    Triple,
    frozen,
    is_text,
)

if TYPE_CHECKING:
    from surfaces.cells import Cells
    from surfaces.surface import Surface

OWN_KEYS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {kind: tuple(own_keys(kind)) for kind in kinds()}
)
"""The keys that each kind has beside those of all surfaces."""
MESHES = ("mesh", "step")  # kinds whose surface is triangles
GRIDLESS = (*MESHES, "piecewise", "poses")
PATCHES = tuple(kind for kind in OWN_KEYS if kind not in GRIDLESS)
WHOLE = ("degree", "faces", "pieces")  # keys whose values hold no real numbers
MOST_PIECES = 200  # as `surfaces.piecewise` has it
UNITS = ("m", "mm")
OWN_FORMULA = (
    "a surface of your own formula g(u, v) is given by points of it, as a grid, by triangles, as a "
    "mesh, or in Python by coverable.parametric(g, u, v)"
)
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
NO_CELLS = {
    "piecewise": "is given for each piece; write cells = [3, 4] in each of surface.pieces",
    "poses": "is not needed: each pose is a cell; leave it out",
}
NAMES = {"piecewise": "a piecewise surface", "poses": "poses", "step": "STEP faces"}


@dataclass(frozen=True, slots=True)
class SurfacePart:
    """The [surface] table of a case, or one of its `pieces`."""

    kind: str
    values: Mapping[str, Any]
    """The kind's own keys, in the units of the case; arrays as tuples, paths absolute."""
    cells: tuple[int, int] | int | Literal["auto"] | None
    """Along u and v of a patch; of a mesh their number, or None where `cell_size` is given; "auto"
    for as many as the footprint needs; None for pieces, which have their own, and for poses,
    each of which is one."""
    side: Literal["inside", "outside"] | None = "inside"
    """None of a piece, which has that of the whole."""
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
        return AUTO in (self.cells, *(piece.cells for piece in self.values.get("pieces", ())))

    @property
    def counts(self) -> list[int]:
        """The number of cells along u and v, or of all cells of a mesh; empty if not known yet."""
        if self.cells is None or self.cells == AUTO:
            return []
        return [self.cells] if isinstance(self.cells, int) else list(self.cells)

    def table(self) -> dict[str, Any]:
        """The keys of the table; what is None is not written."""
        rest = {item.name: getattr(self, item.name) for item in fields(self)[2:]}
        rest |= {"cells": rest.pop("cells")}
        own = {key: _written(self.values.get(key)) for key in OWN_KEYS[self.kind]}
        return {"kind": self.kind, **own, **rest}

    @property
    def pose(self) -> dict[str, Any]:
        """The arguments of a constructor that every surface has."""
        side = {} if self.side is None else {"side": self.side}
        return {**side, "position": self.position, "rpy_deg": self.rpy_deg}

    def _made(self) -> Any:
        """The surface, of poses their cells."""
        if self.kind in PATCHES and self.kind != "grid":
            return build_patch(self.kind, self.values, self.pose)
        from feasibility.cases.surface_files import built

        return built(self.kind, self.values, self.pose)

    def build(self) -> Surface:
        """Build the surface; its file, if it has one, is read.

        Raises:
            CaseError: the numbers or the file describe no surface.
        """
        made = self._made()
        return made.surface if self.kind == "poses" else made

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
        made = self._made()
        if smoothing is not None and self.kind in MESHES:
            from feasibility.cases.surface_files import smooth_mesh

            made = smooth_mesh(made, smoothing)
        return cut_surface(made, self.cells, self.values, footprint)


def read_surface(table: Any, faults: list[Fault]) -> SurfacePart | None:
    """Read the [surface] table; None where it has faults.

    Patches that need no file are built to try them; files are read, and pieces joined, by
    `SurfacePart.build` only.
    """
    return _read(Section("surface", table, faults), tuple(OWN_KEYS), whole=True)


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
    if kind not in FILES or kind == "step":
        return None
    plain: dict[str, Any] = {"kind": kind, "file": table.get("file"), "side": "outside"}
    if kind != "poses":
        plain["cells"] = 1 if kind == "mesh" else [1, 1]
    if kind in ("grid", "poses"):
        plain["units"] = table["units"] if table.get("units") in UNITS else "m"
    # The likely size of a part is nothing to go by where its scale is wrong.
    scales = [table["scale"], 1.0] if kind == "mesh" and "scale" in table else [None]
    tried = (read_surface(plain | ({} if s is None else {"scale": s}), []) for s in scales)
    return next(filter(None, tried), None)


def _read(section: Section, known: tuple[str, ...], whole: bool) -> SurfacePart | None:
    """One table; None where it has faults."""
    from surfaces.arguments import check_pose

    before = len(section.faults)
    kind = _kind(section, known)
    pose = section.take(*(("side",) if whole else ()), "position", "rpy_deg")
    if kind is None:  # which other keys belong here is not known
        if whole:
            section.make(check_pose, pose)
        return None
    section.of_kind(kind)
    frame = section.text("frame") if whole else None
    values = {**section.take(*OWN_KEYS[kind])}
    for key in [key for key in own_keys(kind) if key in values or key in ("file", "pieces")]:
        _check(section, kind, key, values)
    cells = None if kind in NO_CELLS else _count(section, kind)
    hints = _foreign(kind) | ({"cells": NO_CELLS[kind]} if kind in NO_CELLS else {})
    if not whole:
        hints["side"] = "is that of all pieces; write it as surface.side, and leave it out here"
    section.refuse_others(hints)
    if whole and kind in SIDES and section.is_table and not section.has("side"):
        needs, outside, inside = SIDES[kind]
        words = f'"outside" (the tool works {outside}) or "inside" ({inside})'
        section.fault("side", f"is missing; {needs} {words}")
    if kind in PATCHES and kind != "grid" and "file" not in values and section.is_table:
        try:
            build_patch(kind, values, pose, section.name)
        except CaseError as error:
            section.faults += error.faults
    else:
        section.make(check_pose, pose)
    if len(section.faults) > before:
        return None
    kept = {key: frozen(value, key in WHOLE) for key, value in values.items()}
    side = pose.pop("side", "inside") if whole else None
    return SurfacePart(kind, kept, cells, side, **frozen(pose), frame=frame)


def _kind(section: Section, known: tuple[str, ...]) -> str | None:
    """The kind of surface; None after a fault."""
    written = section.table.get("kind")
    unlike = is_text(written) and written not in known and not close(written, known)
    if unlike and known == tuple(OWN_KEYS):
        listed = alternatives([repr(kind) for kind in known])
        section.fault("kind", f"must be {listed}, got {shown(written)}; {OWN_FORMULA}")
        return None
    return section.word("kind", known, required=True)


def _check(section: Section, kind: str, key: str, values: dict[str, Any]) -> None:
    """Check what no constructor checks before a file is read."""
    value = values.get(key)
    if key == "file":
        required = kind != "bspline"
        values.pop(key, None)
        values |= section.path(required=required)
        if required and kind not in MESHES:
            values |= {"units": section.word("units", UNITS, required=True)}
        if kind == "bspline" and "file" in values and "points" in values:
            section.fault("points", f"contradicts {section.name}.file; give one of the two")
    elif key in ("cell_size", "gap"):
        section.positive(key, value)
    elif key == "neighbours" and isinstance(value, str) and value != "order":
        section.wrong_type(key, value)
    elif key == "neighbours" and value != "order":
        section.positive(key, value)
    elif key == "pieces":
        values[key] = _pieces(section, values.get(key, MISSING))
    elif kind in MESHES:
        from feasibility.cases.mesh_reading import check_key

        check_key(section, kind, key, values)


def _pieces(section: Section, entries: Any) -> tuple[SurfacePart, ...]:
    """The patches of a piecewise surface; what needs no file is built to try it."""
    if not isinstance(entries, list) or not 1 <= len(entries) <= MOST_PIECES:
        if section.is_table:
            section.wrong_type("pieces", entries)
        return ()
    read = partial(_read, known=PATCHES, whole=False)
    tables = [
        Section(f"{section.name}.pieces[{k}]", entry, section.faults)
        for k, entry in enumerate(entries)
    ]
    pieces = tuple(piece for piece in map(read, tables) if piece is not None)
    if sum(math.prod(piece.counts) for piece in pieces if piece.counts) > MOST_CELLS:
        section.fault("pieces", f"make more than {MOST_CELLS:,} cells; use coarser grids")
    return pieces


def _count(section: Section, kind: str) -> tuple[int, int] | int | Literal["auto"] | None:
    """How many cells, along u and v of a patch; None where `cell_size` is, or after a fault."""
    written = section.take("cells").get("cells", MISSING)
    if kind in MESHES and section.has("cell_size"):
        if written is not MISSING:
            section.fault("cells", "contradicts surface.cell_size; give one of the two")
        return None
    if written == AUTO:
        return "auto"
    if kind in MESHES and written is MISSING:
        section.fault("cells", "is missing; give their number, or cell_size = 0.05 (metres)")
        return None
    if kind in MESHES:
        return section.whole("cells", written, 1, MOST_MESH_CELLS, "'auto'")
    if not isinstance(written, list) or len(written) != 2:
        if section.is_table:
            section.wrong_type("cells", written)
        return None
    before = len(section.faults)
    nu, nv = (section.whole(f"cells[{k}]", count, 1) for k, count in enumerate(written))
    if nu * nv > MOST_CELLS:
        what = f"makes more than {MOST_CELLS:,} cells ({shown(written)}); use a coarser grid"
        section.fault("cells", what)
    return (nu, nv) if len(section.faults) == before else None


def _foreign(kind: str) -> dict[str, str]:
    """What to say about keys that belong to other kinds of surface."""
    owners: dict[str, list[str]] = {}
    for other, keys in OWN_KEYS.items():
        for key in keys:
            owners.setdefault(key, []).append(_a(other))
    hints = {
        key: f"belongs to {alternatives(names)}, not to {_a(kind)}; leave it out"
        for key, names in owners.items()
    }
    for mine in {"u", "v", "u_deg", "v_deg"} & {*OWN_KEYS[kind]}:
        in_degrees = mine.endswith("_deg")
        unit = DEG if in_degrees else "the numbers of the knots" if kind == "bspline" else METRES
        other = mine[0] if in_degrees else f"{mine}_deg"
        hints[other] = f"is not how {_a(kind)} is written; write {mine} in {unit}"
    return {key: hint for key, hint in hints.items() if key not in OWN_KEYS[kind]}


def _a(kind: str) -> str:
    """The kind with its article."""
    return NAMES.get(kind) or f"{'an' if kind[0] in 'aeiou' else 'a'} {kind}"


def _written(value: Any) -> Any:
    """A value as TOML has it."""
    if isinstance(value, SurfacePart):
        return {key: own for key, own in value.table().items() if own is not None}
    return tuple(map(_written, value)) if isinstance(value, tuple) else value
