"""Numbers of a case that look as if they were millimetres, or radians: asked, never refused.

A wall of 600 m may be meant. Files of meshes and a TCP far away are refused instead: there a key
says the unit (`surfaces/meshes/sources.py`), or no tool is as long (`robots/poses.py`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from coverable.errors import is_number, shown

# How many times the arm's reach a length may have before its unit is asked for.
FAR = dict.fromkeys(("position", "u", "v", "radius", "ring", "tube", "semi_axes", "flare"), 30.0)
FAR["standoff"] = NEAR = 3.0
TABLES = ("robot", "surface", "task")  # a scene may have a floor of any size
SMALL = ("within_deg", "angle_deg", "step_deg")  # angles that are small by nature
MANY = 4  # so many angles are not all within a turn of radians by chance
ROUND = ((15.0, 0.3), (5.0, 0.06))  # multiples, and how far from them radians are, in degrees


def unit_notes(tables: Mapping[str, Any], reach: float) -> tuple[str, ...]:
    """What the numbers of a case may mean instead, a sentence each.

    Args:
        tables: of the case.
        reach: m, of the arm with its tool.

    Example:
        >>> unit_notes({"task": {"standoff": 20.0, "cone_deg": 0.785}}, 0.95)[0]
        'task.standoff = 20.0 is 20 m, and the arm reaches 0.95 m: millimetres? Then give 0.02'
        >>> unit_notes({"task": {"standoff": 20.0, "cone_deg": 0.785}}, 0.95)[1]
        'task.cone_deg = 0.785 looks like radians and is read as degrees: radians? Then give 44.98'
        >>> unit_notes({"task": {"standoff": 0.02, "cone_deg": 45.0}}, 0.95)
        ()
    """
    notes = []
    tcp = _numbers(((tables.get("robot") or {}).get("tcp") or {}).get("position"))
    alone = max(reach - math.hypot(*tcp), 0.0) or reach
    for path, key, value in _values({name: tables.get(name) for name in TABLES}):
        numbers = _numbers(value)
        largest = max(map(abs, numbers), default=0.0)
        far = NEAR if path.endswith("tcp.position") else FAR.get(key, math.inf)
        if largest > far * alone:
            notes.append(
                f"{path} = {shown(_scaled(value, 1.0))} is {largest:g} m, and the arm reaches "
                f"{alone:.3g} m: "
                f"millimetres? Then give {shown(_scaled(value, 1e-3))}"
            )
        if key.endswith("_deg") and key not in SMALL and _like_radians(numbers, key):
            notes.append(
                f"{path} = {shown(_scaled(value, 1.0))} looks like radians and is read as degrees: "
                f"radians? Then give {shown(_scaled(value, math.degrees(1.0)))}"
            )
    return tuple(notes)


def _values(table: Mapping[str, Any], path: str = "") -> Iterator[tuple[str, str, Any]]:
    """The path, the key and the value of each entry, in tables inside of tables too."""
    for key, value in table.items():
        place = f"{path}.{key}".lstrip(".")
        if isinstance(value, Mapping) and not key.endswith("_deg"):
            yield from _values(value, place)
        elif isinstance(value, (list, tuple)) and any(isinstance(one, Mapping) for one in value):
            yield from _values({str(k): one for k, one in enumerate(value)}, place)
        else:
            yield place, key, value


def _numbers(value: Any) -> list[float]:
    """All numbers of a value."""
    if isinstance(value, Mapping):
        value = list(value.values())
    if isinstance(value, (list, tuple)):
        return [number for one in value for number in _numbers(one)]
    return [float(value)] if is_number(value) else []


def _scaled(value: Any, factor: float) -> Any:
    """The same with all numbers multiplied, to four digits."""
    if isinstance(value, Mapping):
        return {key: _scaled(one, factor) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [_scaled(one, factor) for one in value]
    return float(f"{value * factor:.4g}") if is_number(value) else value


def _like_radians(numbers: list[float], key: str) -> bool:
    """Are they within a turn, and of a size that round angles have in radians?"""
    angles = [abs(number) for number in numbers if number != 0.0]
    most = 0.5 * math.pi if key == "cone_deg" else 2.0 * math.pi
    if not angles or max(angles) > 1.001 * most:
        return False
    return len(numbers) >= MANY or all(map(_is_round, angles))


def _is_round(angle: float) -> bool:
    """Is an angle (rad) a round number of degrees?"""
    degrees = math.degrees(angle)
    return any(
        degrees > 0.5 * step and abs(degrees - step * round(degrees / step)) <= off
        for step, off in ROUND
    )
