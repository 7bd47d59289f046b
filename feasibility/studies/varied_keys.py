"""The [vary] table of a study: which keys of the case take which values."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from coverable.errors import LARGEST_WHOLE, Fault, alternatives, close, is_number, printable, shown
from feasibility.cases.case import TABLES
from feasibility.cases.robot_table import is_urdf
from feasibility.cases.table_reader import Section, is_text

POSES = {"position": ("x", "y", "z"), "rpy_deg": ("roll", "pitch", "yaw")}
OWN = ("robots", "sampler", "count", "seed")
SAMPLERS = ("sobol",)
MOST_VALUES = 100_000  # of one key, and samples
FORMS = "an array of values, { from = a, to = b, steps = n }, or { range = [a, b] } for samples"


@dataclass(frozen=True, slots=True)
class VariedKey:
    """A key of a case, and the values that it takes."""

    label: str
    """In the study's table, such as 'task.cone_deg', 'surface.position.x' or 'robot'."""
    place: str
    """In the study file, for messages."""
    path: tuple[str | int, ...]
    """Of what is replaced in the tables of a case; the last one may index an array."""
    values: tuple[Any, ...]
    sampled: bool = False
    """Are its values the ends of a range, in which numbers are sampled?"""

    @property
    def is_pose(self) -> bool:
        """Does it move the surface alone?"""
        return self.path[0] == "surface" and self.path[1] in POSES

    def covers(self, key: str) -> bool:
        """Is what a fault is about this key, or inside it?"""
        name = ".".join(step for step in self.path if isinstance(step, str))
        return key == name or key.startswith((f"{name}.", f"{name}["))


@dataclass(frozen=True, slots=True)
class Variation:
    """All that varies: every combination of the values of keys, with every sample of ranges."""

    keys: tuple[VariedKey, ...]
    """Those that are sampled stand last."""
    count: int = 0
    """Samples of all ranges together; 0 without ranges."""
    seed: int = 0

    @property
    def axes(self) -> tuple[VariedKey, ...]:
        """The keys that are not sampled."""
        return tuple(key for key in self.keys if not key.sampled)

    @property
    def ranges(self) -> tuple[VariedKey, ...]:
        """The keys that are sampled."""
        return self.keys[len(self.axes) :]

    @property
    def size(self) -> int:
        """Number of tasks."""
        return math.prod((len(key.values) for key in self.axes), start=self.count or 1)

    @property
    def cases(self) -> int:
        """Number of tasks that differ in more than the pose of the surface."""
        fixed = all(key.is_pose for key in self.ranges)
        sizes = (len(key.values) for key in self.axes if not key.is_pose)
        return math.prod(sizes, start=1 if fixed else self.count)


def read_variation(table: Any, faults: list[Fault]) -> Variation:
    """Read the [vary] table; what is wrong is added to `faults` and left out."""
    section = Section("vary", table, faults)
    keys: list[VariedKey] = []
    if section.has("robots"):
        keys += _read_robots(section)
    sampler = section.word("sampler", SAMPLERS)
    count = _whole(section, "count", 1, MOST_VALUES)
    seed = _whole(section, "seed", 0)
    for (name, key), value in _flattened(section).items():
        place = f"vary.{name}.{printable(key)}"
        if name == "surface" and key in POSES and isinstance(value, Mapping):
            keys += _read_pose(place, key, value, faults)
        else:
            keys += _read_values(f"{name}.{key}", place, (name, key), value, faults)
    keys.sort(key=lambda key: key.sampled)
    ranges = any(key.sampled for key in keys)
    if ranges and count is None and "count" not in section.table:
        section.fault("count", "is missing; expected how many samples of the ranges to take")
    for key, given in (("sampler", sampler), ("count", count), ("seed", seed)):
        if given is not None and not ranges:
            section.fault(key, "is of no use without a { range = [low, high] }; leave it out")
    if section.is_table and not section.table:
        section.fault("", "is empty; expected at least one key that varies")
    return Variation(tuple(keys), (count or 1) if ranges else 0, seed or 0)


def _whole(section: Section, key: str, low: int, high: int = LARGEST_WHOLE) -> int | None:
    """A whole number in a range; None where it is left out."""
    written = section.take(key)
    return section.whole(key, written[key], low, high) if written else None


def _flattened(section: Section) -> dict[tuple[str, str], Any]:
    """Values of everything else by table and key: "task.cone_deg" = ..., or [vary.task].

    The parts of a pose, which may be written apart, are put together.
    """
    found: dict[tuple[str, str], Any] = {}
    for key, value in section.table.items():
        title, *parts = key.split(".", 2)
        if key in OWN:
            continue
        if title not in TABLES:
            guess = close(key, OWN)
            hint = f"did you mean {guess}?" if guess else f"known are {', '.join(OWN)}"
            what = f"is not known here; {hint} and keys such as task.cone_deg"
            section.fault(printable(key), what)
            continue
        for part in reversed(parts):
            value = {part: value}
        if not isinstance(value, Mapping):
            section.fault(key, f"must be a table [vary.{key}], got {shown(value)}")
            continue
        for name, inner in value.items():
            before = found.get((title, name), {})
            apart = isinstance(before, Mapping) and isinstance(inner, Mapping)
            if (title, name) in found and (not apart or before.keys() & inner.keys()):
                section.fault(f"{title}.{printable(name)}", "is written twice")
            found[title, name] = {**before, **inner} if apart else inner
    return found


def _read_robots(section: Section) -> list[VariedKey]:
    """The arms: names, paths of URDF or xacro files, or tables as under [robot]."""
    expected = 'an array of robots, such as ["ur5", { name = "puma560", limits = "set-1" }]'
    value = section.table["robots"]
    if not isinstance(value, list) or not value or len(value) > MOST_VALUES:
        section.wrong("robots", value, f"must be {expected}")
        return []
    tables: list[Any] = []
    for k, robot in enumerate(value):
        if is_text(robot):
            tables.append({"urdf": robot} if is_urdf(robot) else {"name": robot})
        elif isinstance(robot, Mapping):
            tables.append(dict(robot))
        else:
            section.fault(f"robots[{k}]", f"must be a name or a table, got {shown(robot)}")
    return [VariedKey("robot", "vary.robots", ("robot",), tuple(tables))]


def _read_pose(
    place: str, key: str, value: Mapping[str, Any], faults: list[Fault]
) -> list[VariedKey]:
    """A position or an orientation, part by part."""
    names, found = POSES[key], list[VariedKey]()
    faults += [
        Fault(f"{place}.{printable(name)}", f"is not known here; use {alternatives(names)}")
        for name in value
        if name not in names
    ]
    for index, name in enumerate(names):
        if name in value:
            inner = [float(value[name])] if is_number(value[name]) else value[name]
            own = f"surface.{key}.{name}", f"{place}.{name}", ("surface", key, index)
            found += _read_values(*own, inner, faults)
    return found


def _read_values(
    label: str, place: str, path: tuple[str | int, ...], value: Any, faults: list[Fault]
) -> list[VariedKey]:
    """A key with its values, in one of the forms that there are; nothing after a fault."""
    own, before = (label, place, path), len(faults)
    section = Section(place, value if isinstance(value, Mapping) else {}, faults)
    made = None
    if isinstance(value, list) and 0 < len(value) <= MOST_VALUES:
        made = VariedKey(*own, tuple(value))
    elif isinstance(value, list):
        number = f"has {len(value)} values, more than {MOST_VALUES}"
        section.fault("", number if value else f"is empty; expected {FORMS}")
    elif section.table.keys() == {"range"}:
        pair = section.interval("range", value["range"], "the key's own unit")
        made = VariedKey(*own, pair, sampled=True)
    elif section.table.keys() == {"from", "to", "steps"}:
        made = VariedKey(*own, _steps(section))
    else:
        section.fault("", f"must be {FORMS}; got {shown(value)}")
    return [] if made is None or len(faults) > before else [made]


def _steps(section: Section) -> tuple[float, ...]:
    """Evenly spaced values, both ends among them, from the first to the last: up or down."""
    before = len(section.faults)
    start, end = (
        section.number(key, section.table[key], "must be a finite number") for key in ("from", "to")
    )
    steps = section.whole("steps", section.table["steps"], 2, MOST_VALUES)
    if len(section.faults) == before and start == end:
        section.fault("to", f"must differ from from = {start:g}; an empty range has no steps")
    if len(section.faults) > before:
        return ()
    return (*(start + (end - start) * k / (steps - 1) for k in range(steps - 1)), end)
