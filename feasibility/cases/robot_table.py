"""The [robot] table of a case: which arm, with which tool and limits."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from coverable.errors import Fault, is_number, printable, shown
from feasibility.cases.robot_limits import read_limits_by_name, read_limits_deg
from feasibility.cases.table_reader import (
    METRES,
    ORIGIN,
    Pair,
    Section,
    Triple,
    absolute,
    frozen,
    is_text,
)

if TYPE_CHECKING:
    from robots.errors import RobotError
    from robots.robot import Robot

POSES = ("tcp", "base")
AS_GIVEN = ("tool_frame", "approach_axis", "reference_axis", "package_dirs", *POSES)
"""Keys that `load_robot` takes as they are."""
UNITS = {
    "limits_deg": ("degrees", "slides", "limits_m"),
    "limits_m": ("metres", "turns", "limits_deg"),
    "start_deg": ("degrees", "slides", "start"),
}
"""The unit of a key, the joints that it is not for, and the key for these."""
URDF_ENDINGS = (".urdf", ".xml", ".xacro")


class PosePart(NamedTuple):
    """A pose as a case has it."""

    position: Triple = ORIGIN
    """m"""
    rpy_deg: Triple = ORIGIN


@dataclass(frozen=True, slots=True)
class RobotPart:
    """The [robot] table of a case."""

    name: str | None = None
    """In the library; None where `urdf` is given."""
    urdf: str | None = None
    """Absolute path of a URDF or .xacro file."""
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
    tcp: PosePart | None = None
    """In the frame of `tool_frame`."""
    base: PosePart | None = None
    """Of the URDF's root link in the world."""
    reference_axis: Triple | None = None
    axis: tuple[Mapping[str, Any], ...] = ()
    """From the world outwards, as they are written."""
    start: tuple[float, ...] | None = None
    """rad or m, in the order of the free joints."""
    start_deg: tuple[float, ...] | None = None
    """The same in degrees, where all joints turn."""
    xacro_args: Mapping[str, Any] = field(default_factory=dict)
    """Arguments of a .xacro file: texts, numbers and truth values."""

    def table(self) -> dict[str, Any]:
        """The keys of the [robot] table that say something."""
        values = {entry.name: getattr(self, entry.name) for entry in fields(self)}
        for key in POSES:
            values[key] = None if values[key] is None else values[key]._asdict()
        values["axis"] = tuple(map(dict, self.axis))
        return {key: value for key, value in values.items() if value not in (None, (), {})}

    def build(self, surface_link: str | None = None) -> Robot:
        """Load the arm.

        Args:
            surface_link: the link that carries the surface, if one does.

        Raises:
            RobotError: see `robots.load_robot`; or an angle is given for a sliding joint, or a
                length for a turning one.
        """
        from robots.errors import RobotError
        from robots.library import load_robot

        source, axes = self.urdf or self.name or "", []
        if self.axis:
            from feasibility.cases.axis_table import axis_of

            axes = list(map(axis_of, self.axis))
        try:
            robot = load_robot(
                source,
                limits=self._limits(),
                lock=self.lock or None,
                axes=axes,
                surface_link=surface_link,
                xacro_args=self.xacro_args or None,
                **{key: getattr(self, key) for key in AS_GIVEN},
            )
        except RobotError as error:
            units = self._wrong_units(error.joint_kinds)
            raise RobotError((*error.faults, *units), error.source) from error
        kinds = dict(zip(robot.joint_names, robot.joint_kinds, strict=True))
        if faults := self._wrong_units(kinds, robot.joint_names):
            raise RobotError(faults, f"robot {robot.name!r}")
        start = self.start if self.start_deg is None else tuple(map(math.radians, self.start_deg))
        return robot if start is None else _starting_at(robot, start, self.start_deg is not None)

    def _wrong_units(self, kinds: Mapping[str, str], in_order: Iterable[str] = ()) -> list[Fault]:
        """Degrees for joints that slide, metres for joints that turn.

        Args:
            kinds: of joints, by name; others are left aside.
            in_order: the joints that a list is for.
        """
        faults = []
        for key, (unit, wrong, remedy) in UNITS.items():
            given = getattr(self, key) or ()
            for joint in given if isinstance(given, Mapping) else in_order if given else ():
                if joint in kinds and (kinds[joint] == "prismatic") == (wrong == "slides"):
                    text = f"gives {unit} for joint {joint!r}, which {wrong}; use {remedy}"
                    faults.append(Fault(key, text))
        return faults

    def _limits(self) -> str | list[Pair] | dict[str, Pair] | None:
        """The limits as `load_robot` takes them, rad or m."""
        if isinstance(self.limits_deg, tuple):
            return [_radians(pair) for pair in self.limits_deg]
        named = {joint: _radians(pair) for joint, pair in (self.limits_deg or {}).items()}
        return self.limits or {**named, **(self.limits_m or {})} or None


def in_robot_table(error: RobotError) -> list[Fault]:
    """What loading an arm says, as faults of the [robot] table, and of `surface.frame`."""
    named = [
        fault._replace(key="surface.frame")
        if fault.key == "surface_link"
        else fault.renamed({}, "robot")
        for fault in error.faults
    ]
    return [
        fault._replace(place=": ".join(part for part in (error.source, fault.place) if part))
        for fault in named
    ]


def _starting_at(robot: Robot, start: tuple[float, ...], in_degrees: bool) -> Robot:
    """The arm with a start.

    Raises:
        RobotError: it does not fit the joints, or lies outside of their limits.
    """
    from robots.errors import RobotError

    key, source = "start_deg" if in_degrees else "start", f"robot {robot.name!r}"
    if len(start) != robot.n:
        what = f"has {len(start)} values; expected one for each of {', '.join(robot.joint_names)}"
        raise RobotError([Fault(key, what)], source)
    try:
        return replace(robot, start=np.array(start))
    except RobotError as error:
        faults = [Fault(key, fault.message.removeprefix("start ")) for fault in error.faults]
        raise RobotError(faults, source) from error


def is_urdf(name: str) -> bool:
    """Is this the path of a URDF or xacro file, not the name of an arm?"""
    return os.sep in name or name.lower().endswith(URDF_ENDINGS)


def _radians(pair: Pair) -> Pair:
    """Both ends in radians."""
    return math.radians(pair[0]), math.radians(pair[1])


def read_robot(table: Any, faults: list[Fault]) -> RobotPart | None:
    """Read the [robot] table; None where it has faults. No URDF is read for it."""
    before = len(faults)
    part = _part(Section("robot", table, faults))
    return part if len(faults) == before else None


def faults_of_loading(table: Any) -> list[Fault]:
    """What loading the arm of a table says, without those of its values that cannot be read."""
    from robots.errors import RobotError

    part = _part(Section("robot", table, []))
    if (part.name is None) == (part.urdf is None):
        return []
    try:
        part.build()
    except RobotError as error:
        return in_robot_table(error)
    return []


def _part(section: Section) -> RobotPart:
    """What a [robot] table says; what is wrong with it is added to the section's faults."""
    name, urdf = section.text("name"), section.text("urdf")
    if "name" in section.table and "urdf" in section.table:
        section.fault("name", "contradicts robot.urdf; give one of the two")
    elif not section.table.keys() & {"name", "urdf"} and section.is_table:
        section.fault("name", "is missing; expected the name of a robot, or urdf = a URDF file")
    if name is not None and is_urdf(name):
        section.fault("name", f"must be a name, got the path {shown(name)}; write urdf = it")
        name = None
    part = RobotPart(
        name=name,
        urdf=None if urdf is None else absolute(urdf),
        package_dirs=_package_dirs(section),
        tool_frame=section.text("tool_frame"),
        limits=section.text("limits"),
        limits_deg=read_limits_deg(section),
        limits_m=read_limits_by_name(section, "limits_m", METRES),
        axis=_axes(section),
        start=_values(section, "start"),
        start_deg=_values(section, "start_deg"),
        **_axes_poses_and_lock(section),
    )
    _refuse_contradictions(section)
    section.refuse_others()
    return part


def _axes(section: Section) -> tuple[Mapping[str, Any], ...]:
    """Those that arm or surface are mounted on, without faults."""
    if not section.has("axis"):
        return ()
    from feasibility.cases.axis_table import read_axes

    return read_axes(section)


def _axes_poses_and_lock(section: Section) -> dict[str, Any]:
    """The axes and poses of the tool and the base, and the held joints, without what is wrong."""
    from robots.arguments import check_arguments

    values = section.take("approach_axis", "reference_axis", "lock", "xacro_args")
    if not isinstance(values.get("lock", {}), Mapping):
        section.wrong_type("lock", values.pop("lock"))
    for key in POSES:
        if section.has(key):
            values[key] = _pose(Section(f"robot.{key}", section.table[key], section.faults))
    before = len(section.faults)
    section.make(check_arguments, values)
    if len(section.faults) > before:
        wrong = {fault.key.removeprefix("robot.") for fault in section.faults[before:]}
        lock = values.get("lock", {})
        values["lock"] = {joint: value for joint, value in lock.items() if is_number(value)}
        if any(key.startswith("xacro_args") for key in wrong):
            del values["xacro_args"]
        for key in ("approach_axis", "reference_axis", *POSES):
            if wrong & {key, f"{key}.position", f"{key}.rpy_deg"}:
                values.pop(key, None)
    exact = "xacro_args"  # 1 and 1.0 are two texts
    kept = {key: frozen(value, key == exact) for key, value in values.items() if key not in POSES}
    return kept | {key: PosePart(*frozen(values[key])) for key in POSES if key in values}


def _pose(section: Section) -> PosePart:
    """A pose as it is written; its keys are checked, its numbers not."""
    values = section.take("position", "rpy_deg")
    section.refuse_others()
    return PosePart(**values)


def _refuse_contradictions(section: Section) -> None:
    """Limits that are given twice, or for a joint that is held."""
    table = section.table
    for other in ("limits_deg", "limits_m"):
        if "limits" in table and other in table:
            section.fault("limits", f"contradicts robot.{other}; give one of the two")
    if isinstance(table.get("limits_deg"), list) and "limits_m" in table:
        section.fault(
            "limits_m",
            "contradicts the list in robot.limits_deg, which is for arms whose joints all turn; "
            "give both by joint name",
        )
    if "xacro_args" in table and not str(table.get("urdf")).lower().endswith(".xacro"):
        section.fault("xacro_args", "is for a .xacro file in robot.urdf; leave it out")
    if "start" in table and "start_deg" in table:
        section.fault("start", "contradicts robot.start_deg; give one of the two")
    in_degrees, in_metres = _names(table.get("limits_deg")), _names(table.get("limits_m"))
    for joint in sorted(_names(table.get("lock")) & (in_degrees | in_metres)):
        section.fault(f"lock.{printable(joint)}", "contradicts the limits given for that joint")
    for joint in sorted(in_degrees & in_metres):
        section.fault(f"limits_m.{printable(joint)}", "contradicts robot.limits_deg of that joint")


def _values(section: Section, key: str) -> tuple[float, ...] | None:
    """A list of finite numbers; None where it is not written, or wrong."""
    if not section.has(key):
        return None
    value = section.table[key]
    count = len(value) if isinstance(value, list) else 0
    found = section.numbers(key, value, count, f"must be {section.keys[key].type}")
    return tuple(found) if found else None


def _names(value: Any) -> set[str]:
    """Joints that a table names."""
    return set(value) if isinstance(value, Mapping) else set()


def _package_dirs(section: Section) -> tuple[str, ...]:
    """Folders, made absolute."""
    value = section.take("package_dirs").get("package_dirs", [])
    if not isinstance(value, list) or not all(map(is_text, value)):
        section.wrong_type("package_dirs", value)
        return ()
    return tuple(map(absolute, value))
