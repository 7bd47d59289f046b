"""The rows of a result file that tell why: causes, the certificate, pairs that were left out."""

from __future__ import annotations

from typing import Any

import numpy as np

from coverable.errors import shown
from feasibility.results.archive import Fields
from feasibility.results.plain import plain
from feasibility.verdict import Cause, CauseKind, Certificate
from robots.shapes.link_pairs import LeftOut


def cause_row(cause: Cause) -> dict[str, Any]:
    """Why a cell is missed, as JSON holds it."""
    return {
        "cell": int(cause.cell),
        "kind": str(cause.kind),
        "proved": bool(cause.proved),
        "detail": cause.detail,
        "pair": plain(cause.pair),
        "clearance": plain(cause.clearance),
    }


def read_causes(fields: Fields, count: int) -> tuple[Cause, ...]:
    """Why cells are missed."""
    causes = []
    for k, entry in enumerate(fields.get("causes", list, "an array")):
        if not isinstance(entry, dict):
            raise fields.archive.error(f"meta.json: causes[{k}] is {shown(entry)}, not an object")
        row = Fields(fields.archive, entry, f"causes[{k}].")
        cell, kind = row.cell("cell", count), row.member("kind", CauseKind)
        proved, detail = row.flag("proved"), row.text("detail")
        causes.append(
            Cause(cell, kind, proved, detail, _pair(row, "pair"), _maybe(row, "clearance"))
        )
    return tuple(causes)


def read_certificate(fields: Fields) -> Certificate | None:
    """The certificate; an infinite margin was written as null."""
    if fields.entries.get("certificate") is None:
        return None
    row = fields.table("certificate")
    margin = _maybe(row, "min_limit_margin")
    clear = ("min_clearance", "measured_clearance")
    maybe = (*clear, "max_roll", "max_speed", "min_singular_value")
    known: dict[str, Any] = {key: _maybe(row, key) for key in maybe}
    return Certificate(
        waypoints=row.get("waypoints", int, "a whole number"),
        max_position_error=row.number("max_position_error"),
        max_angle=row.number("max_angle"),
        min_limit_margin=np.inf if margin is None else margin,
        nearest_pair=_pair(row, "nearest_pair"),
        **known,
        stops_in_place=_count(row, "stops_in_place"),
        corners=_count(row, "corners"),
    )


def read_left_out(fields: Fields) -> tuple[LeftOut, ...]:
    """The pairs that were left out."""
    from robots.shapes.link_pairs import LeftOut

    found = []
    given = fields.entries.get("pairs_left_out")
    for k, entry in enumerate(() if given is None else fields.get("pairs_left_out", list, "rows")):
        if not isinstance(entry, dict):
            raise fields.archive.error(f"meta.json: pairs_left_out[{k}] is not an object")
        row = Fields(fields.archive, entry, f"pairs_left_out[{k}].")
        first, second, why = (row.text(key) for key in ("first", "second", "why"))
        found.append(LeftOut(first, second, why, _maybe(row, "rate")))
    return tuple(found)


def _maybe(row: Fields, key: str) -> float | None:
    """A number that may be missing or null; files of earlier versions say nothing of collisions."""
    return None if row.entries.get(key) is None else row.number(key)


def _count(row: Fields, key: str) -> int | None:
    """A whole number that may be missing or null."""
    return None if row.entries.get(key) is None else row.get(key, int, "a whole number")


def read_names(row: Fields, key: str) -> tuple[str, ...]:
    """Names of bodies that may be missing or null."""
    if row.entries.get(key) is None:
        return ()
    names = row.get(key, list, "an array of names")
    if not all(isinstance(name, str) for name in names):
        raise row.archive.error(f"meta.json: {row.path}{key} is {shown(names)}, not names")
    return tuple(names)


def _pair(row: Fields, key: str) -> tuple[str, str] | None:
    """Two names of bodies, or None."""
    names = read_names(row, key)
    if len(names) not in (0, 2):
        raise row.archive.error(f"meta.json: {row.path}{key} is {shown(names)}, not two names")
    return (names[0], names[1]) if names else None
