"""The [surface] table of a case: which patch, where, and how it is cut into cells."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal, cast

from feasibility.case_faults import Fault, Pair, Section, alternatives, close, shown

if TYPE_CHECKING:
    from surfaces import Patch

Triple = tuple[float, float, float]

ORIGIN: Triple = (0.0, 0.0, 0.0)
DEG = "degrees"
METRES = "metres"
MOST_CELLS = 1_000_000  # the graph of a verdict takes some kilobytes a cell


@dataclass(frozen=True, slots=True)
class Kind:
    """How one kind of surface is written in a case, and built."""

    lengths: Mapping[str, str]
    """Key of each length (m) -> the argument of the constructor."""
    u: tuple[str, str]
    """Key of the first parameter's range, and the argument of the constructor."""
    v: tuple[str, str]


KINDS: Mapping[str, Kind] = MappingProxyType(
    {
        "sphere": Kind({"radius": "radius"}, ("u_deg", "polar_deg"), ("v_deg", "azimuth_deg")),
        "cylinder": Kind({"radius": "radius"}, ("u_deg", "angle_deg"), ("v", "height")),
        "hyperboloid": Kind(
            {"radius": "waist", "flare": "flare"}, ("u_deg", "angle_deg"), ("v", "height")
        ),
        "plane": Kind({}, ("u", "width"), ("v", "length")),
    }
)
LATER_KINDS = ("cone", "torus", "bspline", "piecewise", "mesh")


@dataclass(frozen=True, slots=True)
class SurfacePart:
    """The [surface] table of a case."""

    kind: str
    lengths: Mapping[str, float]
    """The kind's own lengths by key, m."""
    u: Pair
    """Degrees or metres, as the kind's key says."""
    v: Pair
    cells: tuple[int, int]
    side: Literal["inside", "outside"] = "inside"
    position: Triple = ORIGIN
    rpy_deg: Triple = ORIGIN

    def table(self) -> dict[str, Any]:
        """The keys of the [surface] table."""
        kind = KINDS[self.kind]
        return {
            "kind": self.kind,
            **self.lengths,
            kind.u[0]: self.u,
            kind.v[0]: self.v,
            "position": self.position,
            "rpy_deg": self.rpy_deg,
            "side": self.side,
            "cells": self.cells,
        }

    def build(self) -> Patch:
        """Build the surface.

        Raises:
            SurfaceError: the numbers describe no patch; its message speaks of the case's keys.
        """
        import surfaces

        kind = KINDS[self.kind]
        lengths = {kind.lengths[key]: value for key, value in self.lengths.items()}
        try:
            made: Patch = getattr(surfaces, self.kind)(
                **lengths,
                **{kind.u[1]: self.u, kind.v[1]: self.v},
                side=self.side,
                position=self.position,
                rpy_deg=self.rpy_deg,
            )
        except surfaces.SurfaceError as error:
            message = str(error).removeprefix(f"{self.kind}: ")
            for key, argument in (kind.u, kind.v, *kind.lengths.items()):
                message = message.replace(argument, key)
            raise surfaces.SurfaceError(message) from error
        return made


def read_surface(table: Any, faults: list[Fault]) -> SurfacePart | None:
    """Read the [surface] table, and try to build it; None where it has faults."""
    section = Section("surface", table, faults)
    before = len(faults)
    name = _surface_kind(section)
    side = section.choice("side", ("inside", "outside"))
    position = section.numbers("position", 3, "three finite numbers (metres)")
    rpy_deg = section.numbers("rpy_deg", 3, "three finite numbers (degrees)")
    if name is None:  # which other keys belong here is not known
        return None
    kind = KINDS[name]
    lengths = {
        key: section.positive(key, "a finite number > 0 (metres)", required=True)
        for key in kind.lengths
    }
    u, v = (
        section.interval(key, DEG if "_deg" in key else METRES) for key in (kind.u[0], kind.v[0])
    )
    cells = _cells(section)
    section.done(_foreign_keys(name))
    if len(faults) > before or u is None or v is None or cells is None:
        return None
    part = SurfacePart(
        kind=name,
        lengths={key: value for key, value in lengths.items() if value is not None},
        u=u,
        v=v,
        cells=cells,
        side=cast(Literal["inside", "outside"], side or "inside"),
        position=cast("tuple[float, float, float]", position or ORIGIN),
        rpy_deg=cast("tuple[float, float, float]", rpy_deg or ORIGIN),
    )
    try:
        part.build()
    except ValueError as error:
        section.fault("", str(error))
        return None
    return part


def _surface_kind(section: Section) -> str | None:
    """The kind, if it is one that can be built."""
    kinds = tuple(KINDS)
    expected = alternatives([f'"{kind}"' for kind in kinds])
    if not section.wants("kind", expected, required=True):
        return None
    kind = section.table["kind"]
    if kind in LATER_KINDS:
        section.fault("kind", f"{shown(kind)} is not supported yet; use {expected}")
        return None
    if not isinstance(kind, str) or kind not in KINDS:
        guess = close(kind, kinds)
        hint = f"; did you mean {guess}?" if guess else ""
        section.fault("kind", f"must be {expected}, got {shown(kind)}{hint}")
        return None
    return kind


def _cells(section: Section) -> tuple[int, int] | None:
    """Cells along u and v."""
    expected = "two whole numbers, cells along u and along v, such as [9, 10]"
    if not section.wants("cells", expected, required=True):
        return None
    value = section.table["cells"]
    if (
        not isinstance(value, list)
        or len(value) != 2
        or not all(isinstance(n, int) and not isinstance(n, bool) and n >= 0 for n in value)
    ):
        section.wrong("cells", expected)
        return None
    # An empty grid has no cells, but its sides are walked through all the same.
    if max(value[0], 1) * max(value[1], 1) > MOST_CELLS:
        section.fault(
            "cells", f"makes more than {MOST_CELLS:,} cells ({shown(value)}); use a coarser grid"
        )
        return None
    return value[0], value[1]


def _foreign_keys(name: str) -> dict[str, str]:
    """What to say about keys that belong to other kinds of surface."""
    own = KINDS[name]
    hints = dict.fromkeys(
        ("file", "scale", "cell_size"), "belongs to a mesh, which is not supported yet"
    )
    for kind, entry in KINDS.items():
        for key in entry.lengths:
            hints[key] = f"belongs to a {kind}, not to a {name}; leave it out"
    for mine in (own.u[0], own.v[0]):
        letter = mine[0]
        other = letter if mine.endswith("_deg") else f"{letter}_deg"
        unit = DEG if mine.endswith("_deg") else METRES
        hints[other] = f"is not how a {name} is written; write {mine} in {unit}"
    return {key: hint for key, hint in hints.items() if key not in own.lengths}
