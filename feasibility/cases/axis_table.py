"""The entries of `robot.axis`: axes that arm or surface are mounted on and that the URDF lacks."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, Literal

from coverable.errors import MISSING, is_number
from feasibility.cases.table_reader import ORIGIN, Pair, Section, Triple, frozen

if TYPE_CHECKING:
    from robots.urdf.axes import Axis

KEYS = {"kind": "type", "limits": "limits_m", "max_velocity": "max_velocity_m"}
"""Keys of arguments that are called otherwise in Python, of an axis that slides."""


@dataclass(frozen=True, slots=True)
class AxisPart:
    """One entry of `robot.axis`; its fields are its keys."""

    name: str
    type: Literal["revolute", "prismatic"]
    carries: Literal["base", "surface"]
    axis: Triple = (0.0, 0.0, 1.0)
    limits_deg: Pair | None = None
    limits_m: Pair | None = None
    position: Triple = ORIGIN
    """m"""
    rpy_deg: Triple = ORIGIN
    max_velocity_deg: float | None = None
    """deg/s"""
    max_velocity_m: float | None = None
    """m/s"""

    def table(self) -> dict[str, Any]:
        """The keys that say something."""
        values = {entry.name: getattr(self, entry.name) for entry in fields(self)}
        return {key: value for key, value in values.items() if value is not None}

    def build(self) -> Axis:
        """The axis, in rad and m."""
        return _axis(self.table())


def _axis(values: Mapping[str, Any]) -> Axis:
    """The axis of some values as they are written.

    Raises:
        RobotError: with everything that is wrong with them.
    """
    from robots.urdf.axes import Axis

    kept = {key: values[key] for key in ("name", "carries", "axis", "position", "rpy_deg")
            if key in values}  # fmt: skip
    slides = values.get("type") == "prismatic"
    kept["limits" if slides else "limits_deg"] = values.get("limits_m" if slides else "limits_deg")
    speed: Any = values.get("max_velocity_m" if slides else "max_velocity_deg")
    kept["max_velocity"] = math.radians(speed) if is_number(speed) and not slides else speed
    return Axis(kind=values.get("type", MISSING), **kept)


def read_axes(section: Section) -> tuple[AxisPart, ...]:
    """The entries of `robot.axis` without faults."""
    entries = section.take("axis").get("axis", [])
    if not isinstance(entries, list):
        section.wrong_type("axis", entries)
        return ()
    found = [_read(section, k, entry) for k, entry in enumerate(entries)]
    return tuple(axis for axis in found if axis is not None)


def _read(section: Section, k: int, entry: Any) -> AxisPart | None:
    """One entry; None where it has faults."""
    before = len(section.faults)
    found = Section(f"{section.name}.axis[{k}]", entry, section.faults)
    values = found.take(*(item.name for item in fields(AxisPart)))
    slides = values.get("type") == "prismatic"
    unit, other = ("m", "deg") if slides else ("deg", "m")
    for key in ("limits", "max_velocity"):
        if f"{key}_{other}" in values:
            says = "slides" if slides else "turns"
            found.fault(f"{key}_{other}", f"is of no use for an axis that {says}; use {key}_{unit}")
    found.refuse_others()
    keys = {argument: key.replace("_m", f"_{unit}") for argument, key in KEYS.items()}
    found.make(_axis, {"values": {"name": MISSING, "carries": MISSING} | values}, keys)
    return None if len(section.faults) > before else AxisPart(**frozen(values))
