"""What can be changed on the page of a case, and the case with those changes.

The page has its numbers as people say them, in millimetres and degrees. A number that is as it was
leaves its key of the case as it was written.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from coverable.errors import Fault, is_number, printable, shown
from feasibility.cases.case import Case
from feasibility.cases.table_reader import CaseError
from feasibility.cases.toml import toml_key
from robots.robot import Robot

DIGITS = 9  # of a number of the page, which hides what conversions leave behind
STEP = 0.5  # mm or degrees, of one press of an arrow key
FURTHEST = 1e3  # [mm] that a surface can be moved by sliders where the arm has no bounded reach
WIDENED = 90.0  # [deg] by which a limit can be widened with its slider
WIDENED_MM = 500.0
LONGEST_STANDOFF = 100.0  # [mm]
KEYS = {
    "position": ("surface.position", 1e3),
    "rpy_deg": ("surface.rpy_deg", 1.0),
    "standoff": ("task.standoff", 1e3),
    "cone_deg": ("task.cone_deg", 1.0),
}
"""Keys of the case, and units of the page in those of the case."""

Values = dict[str, Any]
"""`position` (3 mm), `rpy_deg` (3), `standoff` (mm), `cone_deg`, and `limits`: by joint a pair of
degrees or millimetres, or None where the joint turns freely."""


@dataclass(frozen=True, eq=False, slots=True)
class Controls:
    """The controls of one case.

    Example:
        >>> from coverable import load_case
        >>> case = load_case("paper/4a")
        >>> controls = Controls(case, case.robot.build())
        >>> controls.values["standoff"], controls.values["limits"]["joint5"]
        (5.0, [-180.0, 180.0])
        >>> moved = controls.changed({"position": [0, 0, 20.5], "cone_deg": 30})
        >>> moved.surface.position, moved.task.cone_deg
        ((0.0, 0.0, 0.0205), 30.0)
    """

    case: Case
    robot: Robot

    @property
    def values(self) -> Values:
        """All values as the case has them."""
        robot, pairs = self.robot, dict[str, Any]()
        for name, slides, *pair in zip(
            robot.joint_names, robot.prismatic, robot.lower, robot.upper, strict=True
        ):
            ends = [_rounded(1e3 * end if slides else math.degrees(end)) for end in pair]
            pairs[name] = ends if all(map(math.isfinite, ends)) else None
        return {
            "position": [_rounded(1e3 * value) for value in self.case.surface.position],
            "rpy_deg": list(self.case.surface.rpy_deg),
            "standoff": _rounded(1e3 * self.case.task.standoff),
            "cone_deg": self.case.task.cone_deg,
            "limits": pairs,
        }

    def described(self) -> dict[str, Any]:
        """What the page needs to draw sliders: values, and the range of each."""
        values, robot = self.values, self.robot
        far = math.ceil(1e3 * robot.reach / 50.0) * 50.0 if np.isfinite(robot.reach) else FURTHEST
        cone, high = values["cone_deg"], 180.0 if values["cone_deg"] > 90.0 else 90.0
        joints = []
        for name, slides in zip(robot.joint_names, robot.prismatic, strict=True):
            low, up = values["limits"][name] or (-360.0, 360.0)
            by = WIDENED_MM if slides else WIDENED
            ends = [10.0 * math.floor((low - by) / 10.0), 10.0 * math.ceil((up + by) / 10.0)]
            joints.append({"name": name, "unit": "mm" if slides else "deg", "range": ends})
        return {
            "values": values,
            "step": STEP,
            "ranges": {
                "position": [[round(v) - far, round(v) + far] for v in values["position"]],
                "rpy_deg": [[min(-180.0, v), max(180.0, v)] for v in values["rpy_deg"]],
                "standoff": [0.0, max(LONGEST_STANDOFF, 2.0 * values["standoff"])],
                "cone_deg": [0.0, max(high, cone)],
            },
            "joints": joints,
        }

    def changed(self, given: object) -> Case:
        """The case with values of the page; those that are left out stay as they are.

        Args:
            given: values as in `values`, from elsewhere: nothing is known of them.

        Raises:
            CaseError: with everything that is wrong.
        """
        values, before = _checked(given, self.case.name), self.values
        if "limits" in values:
            values["limits"] = {**before["limits"], **values["limits"]}
        new = {key: value for key, value in values.items() if value != before[key]}
        settings = [
            f"{name}={_toml(new[key], unit)}" for key, (name, unit) in KEYS.items() if key in new
        ]
        if "limits" in new:
            settings += self._limit_settings(new["limits"])
        return self.case.with_overrides(settings) if settings else self.case

    def _limit_settings(self, limits: Mapping[str, list[float] | None]) -> list[str]:
        """The limits of all joints by name, in place of those of the case."""
        joints = dict(zip(self.robot.joint_names, self.robot.prismatic, strict=True))
        unknown = [name for name in limits if name not in joints]
        freed = [name for name in limits if limits[name] is None and self.values["limits"][name]]
        faults = [
            Fault(f"limits.{printable(name)}", f"is no joint of {self.robot.name}")
            for name in unknown
        ]
        faults += [Fault(f"limits.{printable(name)}", "must be two numbers") for name in freed]
        if faults:
            raise CaseError(faults, self.case.name)
        tables: dict[str, list[str]] = {"limits_deg": [], "limits_m": []}
        for name, pair in limits.items():
            if pair is not None:
                key, unit = ("limits_m", 1e3) if joints[name] else ("limits_deg", 1.0)
                tables[key].append(f"{toml_key(name)} = {_toml(pair, unit)}")
        written = {key: f"{{ {', '.join(rows)} }}" if rows else "" for key, rows in tables.items()}
        return ["robot.limits=", *(f"robot.{key}={text}" for key, text in written.items())]


def _checked(given: object, name: str) -> Values:
    """The values, where each is a number or as many numbers as it should be.

    Raises:
        CaseError: some are not.
    """
    if not isinstance(given, Mapping):
        raise CaseError(f"values must be an object, got {shown(given)}", name)
    faults, values = list[Fault](), Values()

    def kept(key: str, value: object, count: int) -> Any:
        numbers = [value] if count == 1 else value
        if isinstance(numbers, list) and len(numbers) == count and all(map(is_number, numbers)):
            plain = [float(one) for one in numbers]
            return plain[0] if count == 1 else plain
        expected = "a number" if count == 1 else f"{count} numbers"
        faults.append(Fault(key, f"must be {expected}, got {shown(value)}"))
        return None

    counts = {"position": 3, "rpy_deg": 3, "standoff": 1, "cone_deg": 1}
    for key, value in given.items():
        if key in counts:
            values[key] = kept(key, value, counts[key])
        elif key == "limits" and isinstance(value, Mapping):
            values[key] = {
                joint: None if pair is None else kept(f"limits.{printable(str(joint))}", pair, 2)
                for joint, pair in value.items()
            }
        else:
            faults.append(Fault(printable(str(key)), "is nothing that the page can change"))
    if faults:
        raise CaseError(faults, name)
    return values


def _rounded(value: float) -> float:
    """A number as people would write it."""
    return round(float(value), DIGITS) + 0.0


def _toml(value: Any, unit: float) -> str:
    """Numbers divided by their unit as TOML, without what conversions leave behind."""
    if isinstance(value, list):
        return f"[{', '.join(_toml(one, unit) for one in value)}]"
    return json.dumps(float(f"{value / unit:.12g}"))
