"""Changes of a case in the words of the case file: its keys, its units, and `--set`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from feasibility.cases.toml import toml_key
from feasibility.cases.toml_edits import inline
from feasibility.sensitivity.quantities import Kind, Quantity, range_of, tilted
from feasibility.sensitivity.thresholds import Change
from feasibility.verdict import Verdict
from robots.robot import Robot

if TYPE_CHECKING:
    from feasibility.cases.case import Case

LIMITS = (Kind.LOWER, Kind.UPPER)


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
        return quantity.label
    if quantity.kind is Kind.SHIFT:
        return f"{quantity.label} by {value}"
    return f"{quantity.label} {value} ({shown(quantity, quantity.given)} now)"


def settings(changes: Sequence[Change], verdict: Verdict, case: Case | None = None) -> list[str]:
    """The values of `--set` that make the changes in a case.

    Args:
        changes: of different quantities.
        verdict: of the case as given.
        case: the case; without one, its limits are taken to be given joint by joint, if at all.
    """
    found = []
    ends = _limits(verdict.robot)
    position = np.array(verdict.cells.surface.position)
    for change in changes:
        quantity, value = change.quantity, number(change.quantity, change.value, True)
        if quantity.kind in LIMITS:
            low, high = ends[quantity.joint]
            ends[quantity.joint] = (value, high) if quantity.kind is Kind.LOWER else (low, value)
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
            found.append(f"{quantity.key}={value}")
    limits = [change.quantity for change in changes if change.quantity.kind in LIMITS]
    if any(change.quantity.kind is Kind.SHIFT for change in changes):
        found.append(f"surface.position=[{', '.join(f'{x:.10g}' for x in position.tolist())}]")
    if limits and (case is None or (not case.robot.limits and _by_name(case))):
        pairs = {q.key: ends[q.joint] for q in limits}
        return found + [f"{name}=[{low}, {high}]" for name, (low, high) in pairs.items()]
    return found + (_every_limit(verdict.robot, ends) if limits else [])


def _scene_without(name: str, case: Case | None) -> list[str]:
    """The scene of a case without one object; nothing where the case is not known."""
    if case is None or case.collision is None or not name:
        return []
    rows = [inline(one) for one in case.collision.scene if one["name"] != name]
    return [f"collision.scene=[{', '.join(rows)}]"]


def _by_name(case: Case) -> bool:
    """Are the limits of a case given joint by joint, or not at all?"""
    return not isinstance(case.robot.limits_deg, tuple)


def _every_limit(robot: Robot, ends: list[tuple[str, str]]) -> list[str]:
    """All limits, in place of a set by name or of a list."""
    tables: dict[str, list[str]] = {"deg": [], "m": []}
    slides = robot.prismatic.tolist()
    for name, slide, (low, high) in zip(robot.joint_names, slides, ends, strict=True):
        if "inf" not in (low.strip("-"), high):
            tables["m" if slide else "deg"].append(f"{toml_key(name)} = [{low}, {high}]")
    given = [
        f"robot.limits_{unit}={{ {', '.join(rows)} }}" for unit, rows in tables.items() if rows
    ]
    return ["robot.limits=", *given]


def _limits(robot: Robot) -> list[tuple[str, str]]:
    """The limits of each joint, in degrees or metres."""
    scale = np.where(robot.prismatic, 1.0, 180.0 / math.pi)
    pairs = np.round(np.stack([robot.lower, robot.upper], axis=1) * scale[:, None], 9).tolist()
    return [(f"{low:.12g}", f"{high:.12g}") for low, high in pairs]
