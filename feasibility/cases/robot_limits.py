"""The joint limits of a [robot] table."""

from __future__ import annotations

from collections.abc import Mapping

from coverable.errors import printable
from feasibility.cases.table_reader import DEG, Pair, Section


def read_limits_deg(section: Section) -> tuple[Pair, ...] | dict[str, Pair] | None:
    """Limits of all joints in order, or of some by name."""
    value = section.table.get("limits_deg")
    if value is None or isinstance(value, Mapping):
        return read_limits_by_name(section, "limits_deg", DEG)
    section.has("limits_deg")
    if not isinstance(value, list) or not value:
        section.wrong_type("limits_deg", value)
        return None
    return tuple(section.interval(f"limits_deg[{i}]", pair, DEG) for i, pair in enumerate(value))


def read_limits_by_name(section: Section, key: str, unit: str) -> dict[str, Pair] | None:
    """Limits of some joints by name."""
    value = section.take(key).get(key)
    if value is not None and not isinstance(value, Mapping):
        section.wrong_type(key, value)
        return None
    pairs = {
        joint: section.interval(f"{key}.{printable(joint)}", pair, unit)
        for joint, pair in (value or {}).items()
    }
    return pairs or None
