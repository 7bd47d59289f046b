"""What can be changed on the page of a case, and the case with those changes.

The page has its numbers as people say them, in millimetres and degrees. A number that is as it was
leaves its key of the case as it was written.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from feasibility.cases.case import Case
from feasibility.cases.toml import as_read
from feasibility.cases.toml_edits import inline
from robots.robot import Robot

DIGITS = 9  # of a number of the page, which hides what conversions leave behind
STEP = 0.5  # mm or degrees
FURTHEST = 1e3  # [mm] that things can be moved by sliders where the arm has no bounded reach
TOOL = 500.0  # [mm] that the tool centre point can be moved
WIDENED, WIDENED_MM = 90.0, 500.0  # [deg], [mm] by which a limit can be widened with its slider
LONGEST_STANDOFF = 100.0  # [mm]
PLACE, TURN = ("x", "y", "z"), ("roll", "pitch", "yaw")
SURFACE, BASE, TCP = "placement of the surface", "base of the arm", "tool centre point"
TASK, LIMITS = "tool", "joint limits"

Path = tuple[str | int, ...]
Values = dict[tuple[str, str], Any]
"""By the group and the name of a dial: mm or degrees, of a joint its two limits."""


class Dial(NamedTuple):
    """A slider of the page."""

    group: str
    name: str
    unit: str
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class Controls:
    """The controls of one case.

    Example:
        >>> from coverable import load_case
        >>> case = load_case("paper/4a")
        >>> controls = Controls(case, case.robot.build())
        >>> controls.values[TASK, "standoff"], controls.values[LIMITS, "joint5"]
        (5.0, (-180.0, 180.0))
        >>> moved = controls.changed({(SURFACE, "z"): 20.5, (TASK, "cone"): 30})
        >>> moved.surface.position, moved.task.cone_deg
        ((0.0, 0.0, 0.0205), 30.0)
    """

    case: Case
    robot: Robot

    @cached_property
    def poses(self) -> dict[str, Path]:
        """What can be moved: by its group, where in the tables of the case its pose stands."""
        found: dict[str, Path] = {SURFACE: ("surface",), BASE: ("robot", "base")}
        found[TCP] = ("robot", "tcp")
        for number, axis in enumerate(self.case.robot.axis):
            found[f"axis {axis['name']}"] = ("robot", "axis", number)
        scene = () if self.case.collision is None else self.case.collision.scene
        for number, one in enumerate(scene):
            found[f"object {one['name']}"] = ("collision", "scene", number)
        return found

    @cached_property
    def in_root_frame(self) -> list[str]:
        """Those of them whose poses are in the frame that the picture is drawn in."""
        carried = {axis["carries"] for axis in self.case.robot.axis}
        tables, found = self.case.to_tables(), [SURFACE]
        for group, path in self.poses.items():
            free = group == BASE and "base" not in carried
            if group.startswith("object "):
                free = "frame" not in _part_of(tables, path)
            found += [group] * (free and self.robot.surface_link is None)
        return found

    @cached_property
    def values(self) -> Values:
        """All values as the case has them."""
        tables, robot, found = as_read(self.case.to_tables()), self.robot, Values()
        for group, path in self.poses.items():
            part = _part_of(tables, path)
            for key, names, unit in (("position", PLACE, 1e3), ("rpy_deg", TURN, 1.0)):
                numbers = part.get(key) or (0.0, 0.0, 0.0)
                pairs = zip(names, numbers, strict=True)
                found |= {(group, name): _rounded(unit * number) for name, number in pairs}
        found[TASK, "cone"] = self.case.task.cone_deg
        found[TASK, "standoff"] = _rounded(1e3 * self.case.task.standoff)
        for name, slides, *ends in zip(
            robot.joint_names, robot.prismatic, robot.lower, robot.upper, strict=True
        ):
            pair = tuple(_rounded(1e3 * end if slides else math.degrees(end)) for end in ends)
            found[LIMITS, name] = pair if all(map(math.isfinite, pair)) else (-360.0, 360.0)
        return found

    @cached_property
    def dials(self) -> list[Dial]:
        """Every slider, in the order of the page."""
        values, robot, found = self.values, self.robot, list[Dial]()
        far = math.ceil(1e3 * robot.reach / 50.0) * 50.0 if np.isfinite(robot.reach) else FURTHEST
        for group in self.poses:
            by = TOOL if group == TCP else far
            for name in (*PLACE, *TURN):
                value = values[group, name]
                low, high = (value - by, value + by) if name in PLACE else (-180.0, 180.0)
                low, high = min(round(low), value), max(round(high), value)
                found.append(Dial(group, name, "mm" if name in PLACE else "deg", low, high))
        cone, standoff = values[TASK, "cone"], values[TASK, "standoff"]
        steepest = 180.0 if cone > 90.0 else 90.0
        found.append(Dial(TASK, "cone", "deg", 0.0, steepest))
        found.append(Dial(TASK, "standoff", "mm", 0.0, max(LONGEST_STANDOFF, 2.0 * standoff)))
        for name, slides in zip(robot.joint_names, robot.prismatic.tolist(), strict=True):
            (low, high), by = values[LIMITS, name], WIDENED_MM if slides else WIDENED
            ends = 10.0 * math.floor((low - by) / 10.0), 10.0 * math.ceil((high + by) / 10.0)
            found.append(Dial(LIMITS, name, "mm" if slides else "deg", *ends))
        first = [dial for dial in found if dial.group in (SURFACE, TASK, LIMITS)]
        return first + [dial for dial in found if dial not in first]

    def changed(self, given: Values) -> Case:
        """The case with values of the page; those that are left out stay as they are.

        Raises:
            CaseError: with everything that is wrong.
        """
        values = self.values | given
        new = {dial for dial, value in self.values.items() if values[dial] != value}
        tables: dict[str, Any] = as_read(self.case.to_tables())
        written = list[tuple[Any, Any]]()  # tables and keys
        for group, path in self.poses.items():
            for key, names, unit in (("position", PLACE, 1e3), ("rpy_deg", TURN, 1.0)):
                if new & {(group, name) for name in names}:
                    numbers = [_plain(values[group, name], unit) for name in names]
                    _part_of(tables, path, make=True)[key] = numbers
                    written.append((path[0], (*path, key)[1]))
        for name, key, unit in (("cone", "cone_deg", 1.0), ("standoff", "standoff", 1e3)):
            if (TASK, name) in new:
                tables["task"][key] = _plain(values[TASK, name], unit)
                written.append(("task", key))
        settings = [
            f"{table}.{key}={inline(tables[table][key])}" for table, key in dict.fromkeys(written)
        ]
        if any(group == LIMITS for group, _ in new):
            settings += self._limits(values, new)
        return self.case.with_overrides(settings) if settings else self.case

    def _limits(self, values: Values, new: set[tuple[str, str]]) -> list[str]:
        """The limits of all joints by name, in place of those of the case."""
        tables: dict[str, dict[str, Any]] = {"limits_deg": {}, "limits_m": {}}
        for name, slides, low in zip(
            self.robot.joint_names, self.robot.prismatic, self.robot.lower, strict=True
        ):
            if (LIMITS, name) in new or math.isfinite(low):
                key, unit = ("limits_m", 1e3) if slides else ("limits_deg", 1.0)
                tables[key][name] = [_plain(end, unit) for end in values[LIMITS, name]]
        given = [f"robot.{key}={inline(pairs)}" for key, pairs in tables.items() if pairs]
        return ["robot.limits=", "robot.limits_deg=", "robot.limits_m=", *given]


def _part_of(tables: Any, path: Path, make: bool = False) -> Any:
    """The table at a path; where there is none an empty one, which can be put there."""
    for key in path:
        if isinstance(key, str) and make:
            tables.setdefault(key, {})
        tables = tables.get(key, {}) if isinstance(key, str) else tables[key]
    return tables


def _rounded(value: float) -> float:
    """A number as people would write it."""
    return round(float(value), DIGITS) + 0.0


def _plain(value: float, unit: float) -> float:
    """A number divided by its unit, without what conversions leave behind."""
    return float(f"{value / unit:.12g}")
