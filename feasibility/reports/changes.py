"""Changes of a case in the words of the case file: its keys, its units, and `--set`."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from feasibility.cases.toml import toml_key
from feasibility.sensitivity.quantities import Kind, Quantity, range_of, tilted
from feasibility.sensitivity.thresholds import Change
from feasibility.verdict import Verdict
from robots.robot import Robot

if TYPE_CHECKING:
    from feasibility.cases.case import Case

LIMITS = (Kind.LOWER, Kind.UPPER)


def key(quantity: Quantity) -> str:
    """The key of the case file that holds a quantity.

    Such as 'task.cone_deg', 'robot.limits_deg.joint1', 'surface.position'.
    """
    if quantity.kind in LIMITS:
        unit = "deg" if quantity.unit == "rad" else "m"
        return f"robot.limits_{unit}.{toml_key(joint(quantity))}"
    return {
        Kind.CONE: "task.cone_deg",
        Kind.ROLL: "task.roll_deg",
        Kind.TILT: "task.approach",
        Kind.STANDOFF: "task.standoff",
        Kind.SHIFT: "surface.position",
        Kind.CLEARANCE: "collision.clearance",
        Kind.TOOL_CLEARANCE: "collision.tool_clearance",
        Kind.WITHOUT: "collision.scene" if quantity.obstacle else "collision",
    }[quantity.kind]


def joint(quantity: Quantity) -> str:
    """The joint whose limit a quantity is."""
    return quantity.name.rsplit(" ", 2)[0]


def label(quantity: Quantity) -> str:
    """The key, and which of its numbers: 'robot.limits_deg.joint1 (upper)', '... (-y)'."""
    if quantity.kind is Kind.WITHOUT:
        return f"{key(quantity)} {quantity.name}" if quantity.obstacle else quantity.name
    which = {
        Kind.LOWER: "lower",
        Kind.UPPER: "upper",
        Kind.SHIFT: quantity.name.removeprefix("shift along "),
        Kind.ROLL: "half its range",
        Kind.TILT: quantity.name.removeprefix("approach "),
        Kind.STANDOFF: quantity.name.removesuffix(" standoff"),
    }.get(quantity.kind)
    return f"{key(quantity)} ({which})" if which else key(quantity)


def shown(quantity: Quantity, value: float, feasible: bool | None = None) -> str:
    """A value with the case file's unit: degrees to two digits, or metres to five.

    A feasible limit or cone is rounded to where it allows more, one that is not to where it allows
    less, so that what was found holds for the printed number too.
    """
    if quantity.kind is Kind.WITHOUT:
        return "left out" if value else "there"
    return f"{number(quantity, value, feasible)} {'deg' if quantity.unit == 'rad' else 'm'}"


def number(quantity: Quantity, value: float, feasible: bool | None = None) -> str:
    """The same without its unit."""
    value, digits = (math.degrees(value), 2) if quantity.unit == "rad" else (value, 5)
    if feasible is None or not quantity.monotone:
        return f"{round(value, digits):.10g}"
    up = feasible != (quantity.kind in (Kind.LOWER, Kind.CLEARANCE, Kind.TOOL_CLEARANCE))
    last = round(value * 10.0**digits, 4)  # what conversions leave behind is no reason to round
    return f"{(math.ceil(last) if up else math.floor(last)) / 10.0**digits:.10g}"


def worded(change: Change) -> str:
    """One change: the key, its new value, and the one of now."""
    quantity = change.quantity
    value = shown(quantity, change.value, True)
    if quantity.kind is Kind.WITHOUT:
        return label(quantity)
    if quantity.kind is Kind.SHIFT:
        return f"{label(quantity)} by {value}"
    return f"{label(quantity)} {value} ({shown(quantity, quantity.given)} now)"


def settings(changes: Sequence[Change], verdict: Verdict, case: Case | None = None) -> list[str]:
    """The values of `--set` that make the changes in a case.

    Args:
        changes: of different quantities.
        verdict: of the case as given.
        case: the case; without one, its limits are taken to be given joint by joint, if at all.
    """
    found = []
    ends = {name: (low, high) for name, low, high in _limits(verdict.robot)}
    position = np.array(verdict.cells.surface.position)
    for change in changes:
        quantity, value = change.quantity, number(change.quantity, change.value, True)
        if quantity.kind in LIMITS:
            low, high = ends[joint(quantity)]
            ends[joint(quantity)] = (value, high) if quantity.kind is Kind.LOWER else (low, value)
        elif quantity.kind is Kind.SHIFT:
            position = position + change.value * np.array(quantity.axis)
        elif quantity.kind is Kind.ROLL:
            least, most = range_of(verdict.task, math.radians(float(value)))
            found.append(f"task.roll_deg=[{least:.10g}, {most:.10g}]")
        elif quantity.kind is Kind.TILT:
            b = tilted(verdict.task, quantity.axis, change.value)
            found.append(f"task.approach=[{', '.join(f'{x:.10g}' for x in b)}]")
        elif quantity.kind is Kind.WITHOUT:
            found += _scene_without(quantity.obstacle, case)
        else:
            found.append(f"{key(quantity)}={value}")
    limits = [change.quantity for change in changes if change.quantity.kind in LIMITS]
    if any(change.quantity.kind is Kind.SHIFT for change in changes):
        found.append(f"surface.position=[{', '.join(f'{x:.10g}' for x in position.tolist())}]")
    if limits and (case is None or (not case.robot.limits and _by_name(case))):
        pairs = {key(q): ends[joint(q)] for q in limits}
        return found + [f"{name}=[{low}, {high}]" for name, (low, high) in pairs.items()]
    return found + (_every_limit(verdict.robot, ends) if limits else [])


def _scene_without(name: str, case: Case | None) -> list[str]:
    """The scene of a case without one object; nothing where the case is not known."""
    if case is None or case.collision is None or not name:
        return []
    tables = [one.table() for one in case.collision.scene]
    rows = [_inline(table) for table in tables if table["name"] != name]
    return [f"collision.scene=[{', '.join(rows)}]"]


def _inline(table: Mapping[str, Any]) -> str:
    """A table of plain values as TOML in one line; JSON writes these values alike."""
    pairs = (f"{toml_key(k)} = {json.dumps(value)}" for k, value in table.items())
    return f"{{ {', '.join(pairs)} }}"


def _by_name(case: Case) -> bool:
    """Are the limits of a case given joint by joint, or not at all?"""
    return not isinstance(case.robot.limits_deg, tuple)


def _every_limit(robot: Robot, ends: dict[str, tuple[str, str]]) -> list[str]:
    """All limits, in place of a set by name or of a list."""
    tables: dict[str, list[str]] = {"deg": [], "m": []}
    for name, slides in zip(robot.joint_names, robot.prismatic.tolist(), strict=True):
        low, high = ends[name]
        if "inf" not in (low.strip("-"), high):
            tables["m" if slides else "deg"].append(f"{toml_key(name)} = [{low}, {high}]")
    given = [
        f"robot.limits_{unit}={{ {', '.join(rows)} }}" for unit, rows in tables.items() if rows
    ]
    return ["robot.limits=", *given]


def _limits(robot: Robot) -> list[tuple[str, str, str]]:
    """Name and limits of each joint, in degrees or metres."""
    scale = np.where(robot.prismatic, 1.0, 180.0 / math.pi)
    lower, upper = (np.round(scale * ends, 9).tolist() for ends in (robot.lower, robot.upper))
    return [
        (name, f"{low:.12g}", f"{high:.12g}")
        for name, low, high in zip(robot.joint_names, lower, upper, strict=True)
    ]
