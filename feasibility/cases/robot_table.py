"""The [robot] table of a case: which arm, with which tool and limits."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any, cast

from feasibility.cases.table_reader import (
    DEG,
    METRES,
    Fault,
    Pair,
    Section,
    Triple,
    is_number,
    is_text,
    printable,
    shown,
)

if TYPE_CHECKING:
    from robots import Robot

URDF_ENDINGS = (".urdf", ".xml", ".xacro")


@dataclass(frozen=True, slots=True)
class RobotPart:
    """The [robot] table of a case."""

    name: str | None = None
    """In the library; None where `urdf` is given."""
    urdf: str | None = None
    """Absolute path of a URDF file."""
    package_dirs: tuple[str, ...] = ()
    """Absolute paths."""
    tool_frame: str | None = None
    approach_axis: Triple | None = None
    lock: Mapping[str, float] = field(default_factory=dict)
    """rad or m."""
    limits: str | None = None
    """Name of a limit set."""
    limits_deg: tuple[Pair, ...] | Mapping[str, Pair] | None = None
    """One pair per free joint, or some joints by name."""
    limits_m: Mapping[str, Pair] | None = None

    def table(self) -> dict[str, Any]:
        """The keys of the [robot] table that say something."""
        values = {entry.name: getattr(self, entry.name) for entry in fields(self)}
        return {key: value for key, value in values.items() if value not in (None, (), {})}

    def build(self) -> Robot:
        """Load the arm.

        Raises:
            RobotError: see `robots.load_robot`; or an angle is given for a sliding joint, or a
                length for a turning one.
        """
        from robots import RobotError, load_robot

        robot = load_robot(
            self.urdf or self.name or "",
            limits=self._limits(),
            tool_frame=self.tool_frame,
            approach_axis=self.approach_axis,
            lock=self.lock or None,
            package_dirs=self.package_dirs,
        )
        kinds = dict(zip(robot.joint_names, robot.joint_kinds, strict=True))
        in_degrees = robot.joint_names if isinstance(self.limits_deg, tuple) else self.limits_deg
        faults = [
            f"limits_deg gives degrees for joint {joint!r}, which slides; use limits_m"
            for joint in in_degrees or ()
            if kinds[joint] == "prismatic"
        ]
        faults += [
            f"limits_m gives metres for joint {joint!r}, which turns; use limits_deg"
            for joint in self.limits_m or ()
            if kinds[joint] != "prismatic"
        ]
        if faults:
            raise RobotError(f"robot {robot.name!r}: " + "; ".join(faults))
        return robot

    def _limits(self) -> str | list[Pair] | dict[str, Pair] | None:
        """What `load_robot` is told about limits, rad or m."""
        if isinstance(self.limits_deg, tuple):
            return [_radians(pair) for pair in self.limits_deg]
        named = {joint: _radians(pair) for joint, pair in (self.limits_deg or {}).items()}
        return self.limits or {**named, **(self.limits_m or {})} or None


def _radians(pair: Pair) -> Pair:
    """Both ends in radians."""
    return math.radians(pair[0]), math.radians(pair[1])


def read_robot(table: Any, faults: list[Fault]) -> RobotPart | None:
    """Read the [robot] table; None where it has faults."""
    section = Section("robot", table, faults)
    before = len(faults)
    name = section.text("name", "the name of a robot; `coverable robots` lists them")
    urdf = section.text("urdf", "the path of a URDF file, relative to the case file")
    if "name" in section.table and "urdf" in section.table:
        section.fault("name", "contradicts robot.urdf; give one of the two")
    elif not section.table.keys() & {"name", "urdf"} and section.is_table:
        section.fault("name", "is missing; expected the name of a robot, or urdf = a URDF file")
    if name is not None and (os.sep in name or name.lower().endswith(URDF_ENDINGS)):
        section.fault("name", f"must be a name, got the path {shown(name)}; write urdf = it")
    part = RobotPart(
        name=name,
        urdf=None if urdf is None else os.path.abspath(os.path.expanduser(urdf)),
        package_dirs=_package_dirs(section),
        tool_frame=section.text("tool_frame", "the name of a link"),
        approach_axis=_axis(section),
        lock=_lock(section),
        limits=section.text("limits", "the name of a limit set of the robot"),
        limits_deg=_limits_deg(section),
        limits_m=_limits_by_name(section, "limits_m", METRES),
    )
    for other in ("limits_deg", "limits_m"):
        if "limits" in section.table and other in section.table:
            section.fault("limits", f"contradicts robot.{other}; give one of the two")
    if isinstance(part.limits_deg, tuple) and part.limits_m is not None:
        section.fault(
            "limits_m",
            "contradicts the list in robot.limits_deg, which is for arms whose joints all turn; "
            "give both by joint name",
        )
    for joint in sorted(_names(section, "lock") & (_names(section, "limits_deg", "limits_m"))):
        section.fault(f"lock.{printable(joint)}", "contradicts the limits given for that joint")
    both = _names(section, "limits_deg") & _names(section, "limits_m")
    for joint in sorted(both):
        section.fault(f"limits_m.{printable(joint)}", "contradicts robot.limits_deg of that joint")
    section.done()
    return part if len(faults) == before else None


def _names(section: Section, *keys: str) -> set[str]:
    """Joints that are named in tables of the section."""
    return {
        str(joint)
        for key in keys
        if isinstance(section.table.get(key), Mapping)
        for joint in section.table[key]
    }


def _package_dirs(section: Section) -> tuple[str, ...]:
    """Folders, made absolute."""
    expected = 'an array of folders, such as ["meshes"], relative to the case file'
    if not section.wants("package_dirs", expected, required=False):
        return ()
    value = section.table["package_dirs"]
    if not isinstance(value, list) or not all(map(is_text, value)):
        section.wrong("package_dirs", expected)
        return ()
    return tuple(os.path.abspath(os.path.expanduser(folder)) for folder in value)


def _axis(section: Section) -> tuple[float, float, float] | None:
    """The approach axis: three numbers, not all zero."""
    expected = "three finite numbers that are not all zero, such as [0, 0, 1]"
    axis = section.numbers("approach_axis", 3, expected)
    if axis is not None and sum(value * value for value in axis) ** 0.5 <= 1e-9:
        section.wrong("approach_axis", expected)
        return None
    return cast("tuple[float, float, float] | None", axis)


def _lock(section: Section) -> dict[str, float]:
    """Joints held at a value."""
    expected = "a table of joints and values (rad or m), such as { joint7 = 0.0 }"
    if not section.wants("lock", expected, required=False):
        return {}
    value = section.table["lock"]
    if not isinstance(value, Mapping):
        section.wrong("lock", expected)
        return {}
    for joint, held in value.items():
        if not is_number(held):
            section.fault(
                f"lock.{printable(joint)}", f"must be a finite number (rad or m), got {shown(held)}"
            )
    return {joint: float(held) for joint, held in value.items() if is_number(held)}


def _limits_deg(section: Section) -> tuple[Pair, ...] | dict[str, Pair] | None:
    """Limits of all joints in order, or of some by name."""
    if isinstance(section.table.get("limits_deg"), Mapping):
        return _limits_by_name(section, "limits_deg", DEG)
    expected = "an array of [low, high] in degrees, one per joint, or a table by joint name"
    if not section.wants("limits_deg", expected, required=False):
        return None
    value = section.table["limits_deg"]
    if not isinstance(value, list) or not value:
        section.wrong("limits_deg", expected)
        return None
    pairs = [section.pair(f"limits_deg[{i}]", pair, DEG) for i, pair in enumerate(value)]
    return tuple(pair for pair in pairs if pair is not None)


def _limits_by_name(section: Section, key: str, unit: str) -> dict[str, Pair] | None:
    """Limits of some joints by name."""
    expected = f"a table of joints and [low, high] in {unit}, such as {{ joint4 = [-1, 1] }}"
    if not section.wants(key, expected, required=False):
        return None
    value = section.table[key]
    if not isinstance(value, Mapping):
        section.wrong(key, expected)
        return None
    pairs = {
        joint: section.pair(f"{key}.{printable(joint)}", pair, unit)
        for joint, pair in value.items()
    }
    return {joint: pair for joint, pair in pairs.items() if pair is not None} or None
