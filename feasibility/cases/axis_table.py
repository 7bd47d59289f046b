"""The entries of `robot.axis`: axes that arm or surface are mounted on and that the URDF lacks."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from coverable.errors import MISSING, is_number
from feasibility.cases.table_reader import Section, frozen

if TYPE_CHECKING:
    from robots.urdf.axes import Axis

KEYS = {"kind": "type", "limits": "limits_m", "max_velocity": "max_velocity_m"}
"""Keys of arguments that are called otherwise in Python, of an axis that slides."""


def axis_of(values: Mapping[str, Any]) -> Axis:
    """The axis of an entry as it is written.

    Raises:
        RobotError: with everything that is wrong with it.
    """
    from robots.urdf.axes import Axis

    kept = {key: values[key] for key in ("name", "carries", "axis", "position", "rpy_deg")
            if key in values}  # fmt: skip
    slides = values.get("type") == "prismatic"
    kept["limits" if slides else "limits_deg"] = values.get("limits_m" if slides else "limits_deg")
    speed: Any = values.get("max_velocity_m" if slides else "max_velocity_deg")
    kept["max_velocity"] = math.radians(speed) if is_number(speed) and not slides else speed
    return Axis(kind=values.get("type", MISSING), **kept)


def read_axes(section: Section) -> tuple[Mapping[str, Any], ...]:
    """The entries of `robot.axis` without faults."""
    entries = section.take("axis").get("axis", [])
    if not isinstance(entries, list):
        section.wrong_type("axis", entries)
        return ()
    found = [_read(section, k, entry) for k, entry in enumerate(entries)]
    return tuple(axis for axis in found if axis is not None)


def _read(section: Section, k: int, entry: Any) -> dict[str, Any] | None:
    """One entry; None where it has faults."""
    before = len(section.faults)
    found = Section(f"{section.name}.axis[{k}]", entry, section.faults)
    values = found.take(*found.keys)
    slides = values.get("type") == "prismatic"
    unit, other = ("m", "deg") if slides else ("deg", "m")
    for key in ("limits", "max_velocity"):
        if f"{key}_{other}" in values:
            says = "slides" if slides else "turns"
            found.fault(f"{key}_{other}", f"is of no use for an axis that {says}; use {key}_{unit}")
    found.refuse_others()
    keys = {argument: key.replace("_m", f"_{unit}") for argument, key in KEYS.items()}
    found.make(axis_of, {"values": {"name": MISSING, "carries": MISSING} | values}, keys)
    return None if len(section.faults) > before else dict(frozen(values))
