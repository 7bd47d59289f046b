"""Keys of surfaces that are triangles: which part of a mesh, and which faces of a STEP file."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from coverable.errors import MISSING
from feasibility.cases.surface_building import SURFACE_NAMES
from feasibility.cases.surface_files import CHOICE
from feasibility.cases.table_reader import Section
from surfaces.meshes.selection import checked_box, checked_cone, checked_plane
from surfaces.meshes.sources import metres_per_unit
from surfaces.meshes.step_surface import checked_choice


def check_key(section: Section, kind: str, key: str, values: dict[str, Any]) -> None:
    """Check what no constructor checks before the file is read.

    Args:
        section: the table of the surface.
        kind: "mesh" or "step".
        key: which of `values`, those of the table.
    """
    value = values.get(key)
    make: Callable[..., object]
    if key == "scale":
        section.make(metres_per_unit, {"scale": value})
    elif kind == "step" and key in CHOICE:
        chosen = {one: values[one] for one in CHOICE if one in values}
        if key == next(iter(chosen)):  # all at once: they may contradict each other
            section.make(checked_choice, chosen)
    elif key == "faces" and (not isinstance(value, list) or not value):
        section.wrong_type(key, value)
    elif isinstance(value, list) and key == "faces":
        bad = (k for k, n in enumerate(value) if not isinstance(n, int) or n is True or n < 0)
        k = next(bad, len(value) - 1)
        section.whole(f"faces[{k}]", value[k], 0)
    elif key == "box" and isinstance(value, list) and len(value) == 2:
        ends = dict(zip(("low", "high"), value, strict=True))
        section.make(checked_box, ends, SURFACE_NAMES)
    elif key == "box":
        section.wrong_type(key, value)
    elif key in ("cut", "facing"):
        part = Section(f"{section.name}.{key}", value, section.faults)
        names = dict.fromkeys(part.keys) | {"within_deg": "half_angle_deg"}
        given = {names[k] or k: part.table.get(k, MISSING) for k in part.keys}
        make = checked_plane if key == "cut" else checked_cone
        part.make(make, given, SURFACE_NAMES)
        part.refuse_others()
