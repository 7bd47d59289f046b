"""Surfaces with parameters u and v in a case: the keys of each kind, and how they are read."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

from feasibility.cases.table_reader import DEG, METRES, CaseError, Fault, Pair, Section, shown
from feasibility.safe_files import shown_path

if TYPE_CHECKING:
    from surfaces.patches import Patch

MOST_CELLS = 1_000_000  # the graph of a verdict takes some kilobytes a cell
STEEPEST = 1e6  # of a cone
MOST_NUMBERS = 120_000  # in one table of numbers
NET_KEYS = ("points", "degree", "knots", "weights")
NET_FILE = "the path of a control net (.json or .csv), relative to the case file"

Reader = Callable[[Section, str], Any]


class Key(NamedTuple):
    """One key of a kind of surface."""

    argument: str
    """Of the kind's constructor."""
    read: Reader
    """Gives the value of the key, or None where it is left out or wrong; then it keeps a fault."""


def _length(section: Section, key: str) -> float | None:
    """A length."""
    return section.positive(key, "a finite number > 0 (metres)", required=True)


def _degrees(section: Section, key: str) -> Pair | None:
    """A range of angles."""
    return section.interval(key, DEG)


def _metres(section: Section, key: str) -> Pair | None:
    """A range of lengths."""
    return section.interval(key, METRES)


def _slope(section: Section, key: str) -> float | None:
    """How fast a radius grows."""
    expected = f"a number in {-STEEPEST:g} .. {STEEPEST:g} (metres of radius for a metre of height)"
    slope = section.number(key, expected, required=True)
    if slope is not None and abs(slope) > STEEPEST:
        section.wrong(key, expected)
        return None
    return slope


def _semi_axes(section: Section, key: str) -> tuple[float, ...] | None:
    """Three lengths."""
    expected = "three finite numbers > 0 (metres), along x, y and z"
    axes = section.numbers(key, 3, expected, required=True)
    if axes is not None and min(axes) <= 0.0:
        section.wrong(key, expected)
        return None
    return axes


def _profile(section: Section, key: str) -> Any:
    """Points (r, z)."""
    expected = "points [r, z] in metres, such as [[0.2, 0.0], [0.3, 0.2]]"
    if not section.wants(key, expected, required=True):
        return None
    return _table(section, key, section.table[key], (None, 2), expected)


def _points(section: Section, key: str) -> Any:
    """A control net; `file` may stand for it."""
    expected = "rows of points [x, y, z] in metres"
    if section.has("file"):
        if section.has(key):
            section.fault(key, f"contradicts {section.name}.file; give one of the two")
        return None
    expected_here = f'{expected}, or file = "net.json" or "net.csv"'
    if not section.wants(key, expected_here, required=True):
        return None
    return _table(section, key, section.table[key], (None, None, 3), expected)


def _degree(section: Section, key: str) -> tuple[int, int] | None:
    """Two degrees."""
    expected = "two whole numbers in 1 .. 9, along u and along v, such as [3, 3]"
    if not section.wants(key, expected, required=False):
        return None
    value = section.table[key]
    if not _two_whole(value) or not all(1 <= degree <= 9 for degree in value):
        section.wrong(key, expected)
        return None
    return value[0], value[1]


def _knots(section: Section, key: str) -> Any:
    """Two knot vectors."""
    expected = "two arrays of numbers that never fall, of u and of v"
    if not section.wants(key, expected, required=False):
        return None
    value = section.table[key]
    if not isinstance(value, list) or len(value) != 2:
        section.wrong(key, expected)
        return None
    lines = [_table(section, f"{key}[{k}]", value[k], (None,), expected) for k in (0, 1)]
    return None if None in lines else tuple(lines)


def _weights(section: Section, key: str) -> Any:
    """A number for each point."""
    expected = "one number > 0 for each point, in rows"
    if not section.wants(key, expected, required=False):
        return None
    return _table(section, key, section.table[key], (None, None), expected)


def _knot_range(section: Section, key: str) -> Pair | None:
    """A part of the range of the knots."""
    if not section.has(key):
        return None
    return section.pair(key, section.table[key], "the numbers of the knots")


PATCHES: Mapping[str, Mapping[str, Key]] = MappingProxyType(
    {
        "sphere": {
            "radius": Key("radius", _length),
            "u_deg": Key("polar_deg", _degrees),
            "v_deg": Key("azimuth_deg", _degrees),
        },
        "cylinder": {
            "radius": Key("radius", _length),
            "u_deg": Key("angle_deg", _degrees),
            "v": Key("height", _metres),
        },
        "hyperboloid": {
            "radius": Key("waist", _length),
            "flare": Key("flare", _length),
            "u_deg": Key("angle_deg", _degrees),
            "v": Key("height", _metres),
        },
        "plane": {"u": Key("width", _metres), "v": Key("length", _metres)},
        "cone": {
            "radius": Key("radius", _length),
            "slope": Key("slope", _slope),
            "u_deg": Key("angle_deg", _degrees),
            "v": Key("height", _metres),
        },
        "torus": {
            "ring": Key("ring", _length),
            "tube": Key("tube", _length),
            "u_deg": Key("u_deg", _degrees),
            "v_deg": Key("v_deg", _degrees),
        },
        "ellipsoid": {
            "semi_axes": Key("semi_axes", _semi_axes),
            "u_deg": Key("polar_deg", _degrees),
            "v_deg": Key("azimuth_deg", _degrees),
        },
        "revolution": {
            "profile": Key("profile", _profile),
            "v_deg": Key("angle_deg", _degrees),
        },
        "bspline": {
            "points": Key("points", _points),
            "degree": Key("degree", _degree),
            "knots": Key("knots", _knots),
            "weights": Key("weights", _weights),
            "u": Key("u", _knot_range),
            "v": Key("v", _knot_range),
        },
    }
)


def patch_keys(kind: str) -> tuple[str, ...]:
    """The keys that belong to a kind of patch."""
    return (*(("file",) if kind == "bspline" else ()), *PATCHES[kind])


def read_patch(section: Section, kind: str) -> dict[str, Any]:
    """The values of a kind's own keys; those left out or wrong are missing."""
    values: dict[str, Any] = {}
    if kind == "bspline":
        file = section.text("file", NET_FILE)
        values["file"] = None if file is None else os.path.abspath(os.path.expanduser(file))
    for key, entry in PATCHES[kind].items():
        values[key] = entry.read(section, key)
    return {key: value for key, value in values.items() if value is not None}


def read_grid(section: Section) -> tuple[int, int] | None:
    """Cells along u and v."""
    expected = "two whole numbers, cells along u and along v, such as [9, 10]"
    if not section.wants("cells", expected, required=True):
        return None
    value = section.table["cells"]
    if not _two_whole(value) or not all(number >= 0 for number in value):
        section.wrong("cells", expected)
        return None
    # An empty grid has no cells, but its sides are walked through all the same.
    if max(value[0], 1) * max(value[1], 1) > MOST_CELLS:
        section.fault(
            "cells", f"makes more than {MOST_CELLS:,} cells ({shown(value)}); use a coarser grid"
        )
        return None
    return value[0], value[1]


def build_patch(
    kind: str, values: Mapping[str, Any], pose: Mapping[str, Any], place: str = "surface"
) -> Patch:
    """Build a patch; a control net is read from its file.

    Args:
        kind: one of `PATCHES`.
        values: of the keys of that kind.
        pose: `side`, `position` and `rpy_deg`.
        place: where in the case, for messages.

    Raises:
        CaseError: the values describe no patch; its message speaks of the case's keys.
    """
    import surfaces

    file = values.get("file")
    keys = PATCHES[kind]
    arguments = {keys[key].argument: value for key, value in values.items() if key in keys}
    try:
        if file is not None:
            net = surfaces.read_net(file)._asdict()
            # What the case says replaces what the file says.
            arguments = {key: net[key] for key in NET_KEYS} | arguments
        made: Patch = getattr(surfaces, kind)(**arguments, **pose)
    except surfaces.SurfaceError as error:
        message = str(error).removeprefix(f"{kind}: ")
        if file is not None:
            raise CaseError(Fault(f"{place}.file", of_file(file, message))) from error
        for key, entry in keys.items():
            if entry.argument != key:
                message = re.sub(rf"\b{entry.argument}\b", key, message)
        raise CaseError(Fault(place, message)) from error
    return made


def of_file(file: str, message: str) -> str:
    """A message about a file, with its whole path in front."""
    name = repr(os.path.basename(file)[:100])
    return f"{shown_path(file)}: {message.removeprefix(f'{name}: ')}"


def _two_whole(value: Any) -> bool:
    """Whether the value is an array of two whole numbers."""
    if not isinstance(value, list) or len(value) != 2:
        return False
    return all(isinstance(number, int) and not isinstance(number, bool) for number in value)


def _table(
    section: Section, key: str, value: Any, shape: tuple[int | None, ...], expected: str
) -> Any:
    """Rows of numbers as tuples, each fault kept with its place."""
    from surfaces import table

    texts: list[str] = []
    found = table(key, value, shape, expected, MOST_NUMBERS, texts)
    for text in texts:
        place, _, message = text.partition(" ")
        section.fault(place, message)
    return None if found is None else _tuples(found.tolist())


def _tuples(value: Any) -> Any:
    """Lists in lists as tuples in tuples."""
    return tuple(map(_tuples, value)) if isinstance(value, list) else value
