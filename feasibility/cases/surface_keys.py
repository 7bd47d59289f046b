"""The kinds of surface that a case can name, whose keys are whose, and how patches are built."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal

from coverable_errors import MISSING, alternatives, shown
from feasibility.cases.given_files import build_grid, read_given
from feasibility.cases.keys import kinds, own_keys
from feasibility.cases.table_reader import (
    DEG,
    METRES,
    CaseError,
    Section,
    frozen,
    in_file,
    with_example,
)

if TYPE_CHECKING:
    from surfaces.patches import Patch

MOST_CELLS = 1_000_000  # the graph of a verdict takes some kilobytes a cell
NET_KEYS = ("points", "degree", "knots", "weights")
OR_FILE = ', or give file = "net.json" or "net.csv"'

OWN_KEYS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {kind: tuple(own_keys(kind)) for kind in kinds()}
)
"""The keys that each kind has beside those of all surfaces."""
PATCHES: Mapping[str, Mapping[str, str]] = MappingProxyType(
    {
        kind: {key.name: key.argument for key in own_keys(kind).values() if key.name != "file"}
        for kind in kinds()
        if kind not in ("piecewise", "mesh", "step", "poses")
    }
)
"""The keys of each kind of patch, and the arguments of its constructor that they stand for."""
WHOLE = ("degree", "faces", "pieces")
"""Keys whose values hold no real numbers."""


def read_patch(section: Section, kind: str) -> dict[str, Any]:
    """The values of a kind's own keys, as they are written."""
    if kind == "grid":
        return read_given(section, kind)
    values = section.take(*PATCHES[kind])
    file = section.path() if kind == "bspline" else {}
    if file and "points" in values:
        section.fault("points", f"contradicts {section.name}.file; give one of the two")
    return values | file


def read_grid(section: Section) -> tuple[int, int] | Literal["auto"] | None:
    """Cells along u and v, at least one of each, or as many as the footprint needs."""
    written = section.take("cells").get("cells", MISSING)
    if written == "auto":
        return "auto"
    if not isinstance(written, list) or len(written) != 2:
        if section.is_table:
            section.wrong_type("cells", written)
        return None
    before = len(section.faults)
    nu, nv = (section.whole(f"cells[{k}]", count, 1) for k, count in enumerate(written))
    if nu * nv > MOST_CELLS:
        section.fault(
            "cells", f"makes more than {MOST_CELLS:,} cells ({shown(written)}); use a coarser grid"
        )
    return (nu, nv) if len(section.faults) == before else None


def build_patch(
    kind: str, values: Mapping[str, Any], pose: Mapping[str, Any], place: str = "surface"
) -> Patch:
    """Build a patch; a control net is read from its file.

    Args:
        kind: one of `PATCHES`.
        values: of the keys of that kind.
        pose: those of `side`, `position` and `rpy_deg` that are written.
        place: where in the case, for messages.

    Raises:
        CaseError: the values describe no patch; the faults have the case's keys.
    """
    import surfaces

    if kind == "grid":
        return build_grid(values, pose, place)
    file = values.get("file")
    arguments = {
        argument: values.get(key, MISSING)
        for key, argument in PATCHES[kind].items()
        if key in values or own_keys(kind)[key].default is None or key == "points"
    }
    try:
        if file is not None:
            net = surfaces.read_net(file)._asdict()
            # What the case says replaces what the file says.
            arguments.pop("points", None)
            arguments = {key: net[key] for key in NET_KEYS} | arguments
        made: Patch = getattr(surfaces, kind)(**arguments, **pose)
    except surfaces.SurfaceError as error:
        own = {**values, **pose}
        if file is not None and not all(fault.key in own for fault in error.faults):
            raise CaseError(in_file(error, file, place)) from error
        keys = {argument: key for key, argument in PATCHES[kind].items()}
        faults = [
            with_example(fault.renamed(keys), own_keys(kind)).renamed({}, place)
            for fault in error.faults
        ]
        if kind == "bspline" and "points" not in values:
            missing = f"{place}.points"
            faults = [
                f._replace(expected=f.expected + OR_FILE * (f.key == missing)) for f in faults
            ]
        raise CaseError(faults) from error
    return made


def try_patch(
    section: Section, kind: str, values: Mapping[str, Any], pose: Mapping[str, Any]
) -> None:
    """Keep what building a patch would say; where a file would be read, its pose alone."""
    from surfaces import check_pose

    if "file" in values or kind == "grid":
        section.make(check_pose, pose)
    elif section.is_table:
        try:
            build_patch(kind, values, pose, section.name)
        except CaseError as error:
            section.faults += error.faults


def frozen_values(values: Mapping[str, Any]) -> dict[str, Any]:
    """The values of a kind's keys as they are kept."""
    return {key: frozen(value, key in WHOLE) for key, value in values.items()}


def foreign_keys(kind: str) -> dict[str, str]:
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
    several = {"piecewise": "a piecewise surface", "poses": "poses", "step": "STEP faces"}
    return several.get(kind) or f"{'an' if kind[0] in 'aeiou' else 'a'} {kind}"
