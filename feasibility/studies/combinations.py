"""The tasks of a study: every combination of what varies, each a case written in full."""

from __future__ import annotations

import copy
import itertools
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any

from coverable_errors import Fault, shown
from feasibility.cases import (
    Case,
    CaseError,
    as_read,
    faults_of_building,
    in_robot_table,
    parse_toml,
    read_surface,
    toml_document,
)
from feasibility.studies.axes import POSES, Axis, Range, Variation
from feasibility.studies.outcome import HOME, arm_of
from feasibility.studies.run import StudyTask

ORIGIN = (0.0, 0.0, 0.0)
POSED = [[key] for key in POSES]

Tables = dict[str, Any]


def put(tables: Tables, path: Sequence[str | int], value: Any) -> None:
    """Replace what stands at a path; arrays of three are made where there are none."""
    table: Any = tables
    for step, following in itertools.pairwise(path):
        if isinstance(following, int):
            before = table.get(step)
            if not isinstance(before, list) or len(before) != len(ORIGIN):
                table[step] = list(ORIGIN)
        elif not isinstance(table.get(step), dict):
            table[step] = {}
        table = table[step]
    table[path[-1]] = value


def get(tables: Tables, path: Sequence[str | int]) -> Any:
    """What stands at a path."""
    value: Any = tables
    for step in path:
        value = value[step]
    return value


class Frames:
    """All tasks of a study: cases that differ in more than the pose, and the poses of each."""

    def __init__(self, base: Tables, varied: Variation) -> None:
        """Every combination of what varies."""
        self.base, self.varied = base, varied

    @property
    def count(self) -> int:
        """How many cases have to be checked by themselves."""
        count = 1
        for axis in self.varied.axes:
            count *= 1 if axis.is_pose else len(axis.values)
        return count * (self.varied.count if self._sampled else 1)

    @property
    def _sampled(self) -> bool:
        """Is anything sampled but the pose?"""
        return not all(span.is_pose for span in self.varied.ranges)

    def tasks(self, faults: list[Fault]) -> Iterator[StudyTask]:
        """The tasks in order; combinations that make no case are kept as faults, one a cause."""
        axes, ranges = self.varied.axes, self.varied.ranges
        samples = draw(self.varied)
        checked: dict[str, Tables | None] = {}
        refused: dict[tuple[str, str], Refused] = {}
        for values in itertools.product(*(axis.values for axis in axes)):
            for sample in samples:
                entries: list[tuple[Axis | Range, Any]] = list(zip(axes, values, strict=True))
                entries += zip(ranges, sample, strict=True)
                parameters = {entry.label: _said(entry.label, value) for entry, value in entries}
                tables = self._tables(entries, parameters, checked, refused)
                if tables is not None:
                    yield StudyTask(tables, parameters)
        faults += [one.fault() for one in refused.values()]

    def _tables(
        self,
        entries: list[tuple[Axis | Range, Any]],
        parameters: Mapping[str, Any],
        checked: dict[str, Tables | None],
        refused: dict[tuple[str, str], Refused],
    ) -> Tables | None:
        """The checked tables of one combination; None where it makes no case."""
        others = [(entry, value) for entry, value in entries if not entry.is_pose]
        name = json.dumps([value for _, value in others], sort_keys=True)
        if name not in checked:
            tables = copy.deepcopy(self.base)
            for entry, value in others:
                put(tables, entry.path, copy.deepcopy(value))
            found = faults_of(tables)
            # Filled in is what the case leaves open.
            checked[name] = None if found else as_read(case_of(tables).to_tables())
            said = {k: shown(v) for k, v in parameters.items() if k.split(".")[1:2] not in POSED}
            for fault in found:
                cause = fault.key, cause_of(fault.message)
                refused.setdefault(cause, Refused(fault, said)).add(said)
        frame = checked[name]
        if frame is None:
            return None
        tables = {**frame, "surface": copy.deepcopy(frame["surface"])}
        for entry, value in entries:
            if entry.is_pose:
                numbers = list(map(float, value)) if isinstance(value, list) else float(value)
                put(tables, entry.path, numbers)
        return tables


class Refused:
    """Combinations that make no case, all for the same cause."""

    def __init__(self, fault: Fault, said: Mapping[str, str]) -> None:
        """The first of them: what is wrong with it, and what its keys are."""
        self.first, self.count = fault, 0
        self.seen: dict[str, set[str]] = {label: set() for label in said}
        self.said = dict(said)

    def add(self, said: Mapping[str, str]) -> None:
        """One more of them, or the first."""
        self.count += 1
        for label, value in said.items():
            self.seen[label].add(value)

    def fault(self) -> Fault:
        """All of them as one fault, with the values that they have in common."""
        alike = [f"{label} = {v}" for label, v in self.said.items() if len(self.seen[label]) == 1]
        more = f" ({self.count} combinations with that)" if self.count > 1 else ""
        place = f"vary: with {', '.join(alike)}: " if alike else "vary: "
        return Fault(f"{place}{self.first.key}", f"{self.first.message}{more}", self.first.place)


def cause_of(message: str) -> str:
    """What is wrong, whatever the numbers are; digits of names stay.

    Example:
        >>> cause_of("joint2 must lie in 0 .. 180, got -3.5e+1")
        'joint2 must lie in # .. #, got #'
    """
    return re.sub(r"(?<![\w'.-])[-+]?\d+(\.\d+)?(e[-+]?\d+)?(?!\w)", "#", message)


def _said(label: str, value: Any) -> Any:
    """A value for the study's table: whole numbers of real quantities as such, arms by name."""
    if label == "robot" and value.keys() == {"name"}:
        return value["name"]
    if isinstance(value, int) and not isinstance(value, bool) and not label.startswith("search."):
        return value if label.startswith("surface.cells") else float(value)
    return value


def draw(varied: Variation) -> list[tuple[float, ...]]:
    """Samples of the ranges: points of a scrambled Sobol sequence; one empty one without ranges.

    Returns:
        `count` samples, one number for each range.
    """
    if not varied.ranges:
        return [()]
    from scipy.stats import qmc

    sequence = qmc.Sobol(len(varied.ranges), scramble=True, seed=varied.seed)
    # The sequence is balanced at powers of two only; what is left over is not taken.
    unit = sequence.random_base2((varied.count - 1).bit_length())[: varied.count]
    return [
        tuple(
            span.low + (span.high - span.low) * float(t)
            for span, t in zip(varied.ranges, row, strict=True)
        )
        for row in unit
    ]


def case_of(tables: Tables) -> Case:
    """The case of some tables, checked.

    Raises:
        CaseError: with everything that is wrong.
    """
    return Case.from_toml(toml_document(tables))


def faults_of(tables: Tables) -> list[Fault]:
    """What is wrong with a case, its arm and its files too."""
    from robots import RobotError

    try:
        case = case_of(tables)
    except CaseError as error:
        return list(error.faults)
    found: list[Fault] = []
    try:
        arm_of(case)
    except RobotError as error:
        found += in_robot_table(error)
    if "file" in case.surface.values:
        table = {key: value for key, value in case.surface.table().items() if value is not None}
        found += _faults_of_file(toml_document({"surface": {**table, **HOME}}))
    return found


@lru_cache(maxsize=256)
def _faults_of_file(surface: str) -> list[Fault]:
    """What reading the file of a surface says; `surface` is its table as a document."""
    part = read_surface(parse_toml(surface)["surface"], [])
    return [] if part is None else faults_of_building(part)
