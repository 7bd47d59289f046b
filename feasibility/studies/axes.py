"""The [vary] table of a study: which keys of the case take which values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from coverable_errors import LARGEST_WHOLE, Fault, alternatives, close, is_number, printable, shown
from feasibility.cases import (
    Section,
    is_text,
)

POSES = {"position": ("x", "y", "z"), "rpy_deg": ("roll", "pitch", "yaw")}
TITLES = ("robot", "surface", "task", "search")
SAMPLERS = ("sobol",)
MOST_VALUES = 100_000  # of one key, and samples
FORMS = "an array of values, { from = a, to = b, steps = n }, or { range = [a, b] } for samples"


@dataclass(frozen=True, slots=True)
class Axis:
    """One key of a case and the values that it takes."""

    label: str
    """In the study's table, such as 'task.cone_deg', 'surface.position.x' or 'robot'."""
    place: str
    """In the study file, for messages."""
    path: tuple[str | int, ...]
    """Of what is replaced in the tables of a case; the last one may index an array."""
    values: tuple[Any, ...]

    @property
    def is_pose(self) -> bool:
        """Does it move the surface alone?"""
        return self.path[0] == "surface" and self.path[1] in POSES


@dataclass(frozen=True, slots=True)
class Range:
    """One number of a case that is sampled."""

    label: str
    place: str
    path: tuple[str | int, ...]
    low: float
    high: float

    @property
    def is_pose(self) -> bool:
        """Does it move the surface alone?"""
        return self.path[0] == "surface" and self.path[1] in POSES


@dataclass(frozen=True, slots=True)
class Variation:
    """All that varies: every combination of the axes' values, with every sample of the ranges."""

    axes: tuple[Axis, ...]
    ranges: tuple[Range, ...]
    count: int
    """Samples of all ranges together; 0 without ranges."""
    seed: int

    @property
    def size(self) -> int:
        """Number of tasks."""
        size = self.count if self.ranges else 1
        for axis in self.axes:
            size *= len(axis.values)
        return size


def read_variation(table: Any, faults: list[Fault]) -> Variation:
    """Read the [vary] table; what is wrong is added to `faults` and left out."""
    section = Section("vary", table, faults)
    axes: list[Axis] = []
    ranges: list[Range] = []
    if section.has("robots"):
        _read_robots(section, axes)
    sampler = section.word("sampler", SAMPLERS)
    count = _whole(section, "count", 1, MOST_VALUES)
    seed = _whole(section, "seed", 0)
    for name, key, value in _flattened(section):
        place = f"vary.{name}.{printable(key)}"
        if name == "surface" and key in POSES and isinstance(value, Mapping):
            _read_pose(place, key, value, axes, ranges, faults)
        else:
            _read_values(f"{name}.{key}", place, (name, key), value, axes, ranges, faults)
    if ranges and count is None and "count" not in section.table:
        section.fault("count", "is missing; expected how many samples of the ranges to take")
    for key, given in (("sampler", sampler), ("count", count), ("seed", seed)):
        if given is not None and not ranges:
            section.fault(key, "is of no use without a { range = [low, high] }; leave it out")
    if section.is_table and not section.table:
        section.fault("", "is empty; expected at least one key that varies")
    return Variation(tuple(axes), tuple(ranges), (count or 1) if ranges else 0, seed or 0)


def _whole(section: Section, key: str, low: int, high: int = LARGEST_WHOLE) -> int | None:
    """A whole number in a range; None where it is left out."""
    written = section.take(key)
    return section.whole(key, written[key], low, high) if written else None


def _flattened(section: Section) -> list[tuple[str, str, Any]]:
    """Table, key and value of everything else: "task.cone_deg" = ..., or [vary.task]."""
    found: list[tuple[str, str, Any]] = []
    own = ("robots", "sampler", "count", "seed")
    for key, value in section.table.items():
        title, dot, rest = key.partition(".")
        if key in own:
            continue
        if dot and title in TITLES and rest:
            name, _, inner = rest.partition(".")
            found.append((title, name, {inner: value} if inner else value))
        elif key in TITLES and isinstance(value, Mapping):
            found += [(key, name, inner) for name, inner in value.items()]
        elif key in TITLES:
            section.fault(key, f"must be a table [vary.{key}], got {shown(value)}")
        else:
            guess = close(key, own)
            hint = f"did you mean {guess}?" if guess else "known are robots, sampler, count, seed"
            section.fault(
                printable(key), f"is not known here; {hint} and keys such as task.cone_deg"
            )
    if len({entry[:2] for entry in found}) < len(found):
        found = _merged(section, found)
    return found


def _merged(section: Section, found: list[tuple[str, str, Any]]) -> list[tuple[str, str, Any]]:
    """Keys that are written more than once: parts of a pose are put together."""
    result: dict[tuple[str, str], Any] = {}
    for title, name, value in found:
        before = result.get((title, name))
        if before is None:
            result[title, name] = value
        elif isinstance(before, Mapping) and isinstance(value, Mapping):
            for key in sorted(before.keys() & value.keys()):
                section.fault(f"{title}.{printable(name)}.{printable(key)}", "is written twice")
            result[title, name] = {**before, **value}
        else:
            section.fault(f"{title}.{printable(name)}", "is written twice")
    return [(*key, value) for key, value in result.items()]


def _read_robots(section: Section, axes: list[Axis]) -> None:
    """The arms: names, or tables as under [robot]."""
    expected = 'an array of robots, such as ["ur5", { name = "puma560", limits = "set-1" }]'
    value = section.table["robots"]
    if not isinstance(value, list) or not value or len(value) > MOST_VALUES:
        section.wrong("robots", value, f"must be {expected}")
        return
    tables: list[Any] = []
    for k, robot in enumerate(value):
        if is_text(robot):
            tables.append({"name": robot})
        elif isinstance(robot, Mapping):
            tables.append(dict(robot))
        else:
            section.fault(f"robots[{k}]", f"must be a name or a table, got {shown(robot)}")
    if len(tables) == len(value):
        axes.append(Axis("robot", "vary.robots", ("robot",), tuple(tables)))


def _read_pose(
    place: str,
    key: str,
    value: Mapping[str, Any],
    axes: list[Axis],
    ranges: list[Range],
    faults: list[Fault],
) -> None:
    """A position or an orientation, part by part."""
    names = POSES[key]
    for name in value:
        if name not in names:
            faults.append(
                Fault(f"{place}.{printable(name)}", f"is not known here; use {alternatives(names)}")
            )
    for index, name in enumerate(names):
        if name not in value:
            continue
        label, path = f"surface.{key}.{name}", ("surface", key, index)
        inner = value[name]
        if is_number(inner):
            axes.append(Axis(label, f"{place}.{name}", path, (float(inner),)))
            continue
        before = len(axes)
        _read_values(label, f"{place}.{name}", path, inner, axes, ranges, faults)
        for axis in axes[before:]:
            bad = [value for value in axis.values if not is_number(value)]
            if bad:
                faults.append(Fault(axis.place, f"must hold finite numbers, got {shown(bad[0])}"))
                axes.remove(axis)


def _read_values(
    label: str,
    place: str,
    path: tuple[str | int, ...],
    value: Any,
    axes: list[Axis],
    ranges: list[Range],
    faults: list[Fault],
) -> None:
    """The values of one key, in one of the forms that there are."""
    if isinstance(value, list):
        if not value:
            faults.append(Fault(place, f"is empty; expected {FORMS}"))
        elif len(value) > MOST_VALUES:
            faults.append(Fault(place, f"has {len(value)} values; at most {MOST_VALUES} will do"))
        else:
            axes.append(Axis(label, place, path, tuple(value)))
        return
    if isinstance(value, Mapping) and value.keys() == {"range"}:
        before = len(faults)
        pair = Section(place, value, faults).interval("range", value["range"], "the key's own unit")
        if len(faults) == before:
            ranges.append(Range(label, place, path, *pair))
        return
    if isinstance(value, Mapping) and value.keys() == {"from", "to", "steps"}:
        _read_steps(label, place, path, Section(place, value, faults), axes)
        return
    faults.append(Fault(place, f"must be {FORMS}; got {shown(value)}"))


def _read_steps(
    label: str, place: str, path: tuple[str | int, ...], section: Section, axes: list[Axis]
) -> None:
    """Evenly spaced values, both ends among them, from the first to the last: up or down."""
    before = len(section.faults)
    start, end = (
        section.number(key, section.table[key], "must be a finite number") for key in ("from", "to")
    )
    steps = section.whole("steps", section.table["steps"], 2, MOST_VALUES)
    if len(section.faults) > before:
        return
    if start == end:
        section.fault("to", f"must differ from from = {start:g}; an empty range has no steps")
        return
    values = [start + (end - start) * k / (steps - 1) for k in range(steps - 1)]
    axes.append(Axis(label, place, path, (*values, end)))
