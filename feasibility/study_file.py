"""A study file: a base case and what varies, read with every fault named.

```toml
[base]
case = "paper/4a"                  # a built-in case, or a case file beside this one; and/or
task = { cone_deg = 30 }           # tables of a case, whose keys replace those of the case

[vary]                             # every combination of these
robots = ["puma560", { name = "ur5" }]
"task.cone_deg" = [20, 30, 45]     # any key of a case; or { from = 20, to = 45, steps = 6 }
"surface.position" = { x = [0.0, 0.1], y = { range = [-0.2, 0.2] }, z = 0.3 }
"surface.rpy_deg" = { yaw = { range = [-90, 90] } }
sampler = "sobol"                  # ranges are sampled together
count = 64
seed = 0
```
"""

from __future__ import annotations

import copy
import itertools
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from feasibility.case import LARGEST_FILE, Case, load_case
from feasibility.case_edits import as_read, make_absolute
from feasibility.case_faults import CaseError, Fault, Section, close, printable, shown
from feasibility.case_surface import faults_of_building, read_surface
from feasibility.files import FileError, read_regular, shown_path
from feasibility.study import StudyTask
from feasibility.study_axes import POSES, TITLES, Axis, Range, Variation, read_variation
from feasibility.study_outcome import arm_of
from feasibility.toml_text import TomlError, parse_toml, toml_document, toml_key, toml_value

MOST_TASKS = 1_000_000
MOST_FRAMES = 10_000  # combinations of everything but the surface's pose: each is checked by itself
ORIGIN = (0.0, 0.0, 0.0)
HOME = {"position": ORIGIN, "rpy_deg": ORIGIN}

Tables = dict[str, Any]


@dataclass(frozen=True, eq=False, slots=True)
class Study:
    """A base case and what varies, checked: every task is a case that can be built."""

    name: str
    description: str
    tasks: tuple[StudyTask, ...]
    """In the order of the table: the first key that varies turns slowest, samples fastest."""
    labels: tuple[str, ...]
    """What varies: the keys of every task's parameters."""


def load_study(path: str | os.PathLike[str]) -> Study:
    """Read a study file.

    Raises:
        CaseError: with everything that is wrong.
    """
    name = shown_path(path)
    try:
        text = read_regular(path, LARGEST_FILE, "a study file (TOML)").decode("utf-8-sig")
    except FileError as error:
        source, _, message = str(error).partition(": ")
        raise CaseError(source, [Fault("", message)]) from error
    except UnicodeDecodeError as error:
        message = f"is not UTF-8 text (byte {error.start}); expected a study file (TOML)"
        raise CaseError(name, [Fault("", message)]) from error
    return read_study(text, os.path.dirname(os.path.abspath(path)), name)


def read_study(
    text: str, base_dir: str | os.PathLike[str] | None = None, name: str = "study"
) -> Study:
    """Read a study.

    Args:
        text: TOML.
        base_dir: folder that its paths are relative to; default the working directory.
        name: what the study is called in messages.

    Raises:
        CaseError: with everything that is wrong.

    Example:
        >>> study = read_study('''
        ... base.case = "paper/4a"
        ... vary."task.cone_deg" = [30, 45]
        ... vary."surface.position" = { x = { from = 0, to = 0.2, steps = 3 } }
        ... ''')
        >>> len(study.tasks), dict(study.tasks[1].parameters)
        (6, {'task.cone_deg': 30.0, 'surface.position.x': 0.1})
    """
    try:
        document = parse_toml(text)
    except TomlError as error:
        raise CaseError(name, [Fault("", str(error))]) from error
    faults: list[Fault] = []
    _no_dates("", document, faults)
    if faults:  # nothing else of such a document can be written down again
        raise CaseError(name, faults)
    description = document.get("description", "")
    if not isinstance(description, str):
        faults.append(Fault("description", f"must be a sentence, got {shown(description)}"))
    for title in ("base", "vary"):
        if title not in document:
            faults.append(Fault(title, f"is missing; expected a table [{title}]"))
    known = ("description", "base", "vary")
    for key in document:
        if key not in known:
            guess = close(key, known)
            hint = f"did you mean {guess}?" if guess else f"known are {', '.join(known)}"
            faults.append(Fault(printable(key), f"is not known here; {hint}"))
    base = _read_base(document["base"], base_dir, faults) if "base" in document else None
    varied = read_variation(document["vary"], faults) if "vary" in document else None
    if base is None or varied is None:
        raise CaseError(name, faults)
    varied = _absolute(varied, base_dir)
    if varied.size > MOST_TASKS:
        faults.append(Fault("vary", f"makes {varied.size} tasks; at most {MOST_TASKS} will do"))
    elif _Frames(base, varied).count > MOST_FRAMES:
        what = f"makes {_Frames(base, varied).count} cases besides those that differ in the pose"
        faults.append(Fault("vary", f"{what}; at most {MOST_FRAMES} will do"))
    else:
        _check(base, varied, faults)
    if faults:
        raise CaseError(name, faults)
    tasks = tuple(_Frames(base, varied).tasks(faults))
    if faults:
        raise CaseError(name, faults)
    labels = (*(axis.label for axis in varied.axes), *(span.label for span in varied.ranges))
    return Study(name, description, tasks, labels)


def _no_dates(place: str, value: Any, faults: list[Fault]) -> None:
    """Keep a fault for every date or time: no key of a study is one."""
    if isinstance(value, Mapping):
        for key, inner in value.items():
            _no_dates(f"{place}.{toml_key(key)}" if place else toml_key(key), inner, faults)
    elif isinstance(value, list):
        for k, inner in enumerate(value):
            _no_dates(f"{place}[{k}]", inner, faults)
    elif not isinstance(value, (str, int, float, bool)):
        faults.append(Fault(place, f"must be no date or time, got {shown(str(value))}"))


def _read_base(
    table: Any, base_dir: str | os.PathLike[str] | None, faults: list[Fault]
) -> Tables | None:
    """The tables of the base case, not yet checked."""
    section = Section("base", table, faults)
    if not section.is_table:
        return None
    name = section.text("case", "the name of a built-in case, or the path of a case file")
    tables: Tables = {}
    if name is not None:
        path = os.path.join(base_dir or "", os.path.expanduser(name))
        is_file = name.endswith(".toml") or os.path.isfile(path)
        try:
            case = load_case(path if is_file else name)
            tables = as_read(case.to_tables())
        except CaseError as error:
            faults += [Fault(_join("base.case", key), message) for key, message in error.faults]
    own = {}
    for title in TITLES:
        if section.has(title) and isinstance(section.table[title], Mapping):
            own[title] = dict(section.table[title])
        elif title in section.table:
            section.fault(title, f"must be a table, got {shown(section.table[title])}")
    section.done()
    make_absolute(own, base_dir)
    for title, keys in own.items():
        # Another arm or another kind of surface has other keys: it replaces the whole table.
        fresh = keys.keys() & {"name", "urdf", "kind"}
        tables[title] = keys if fresh else {**tables.get(title, {}), **keys}
    return tables


def _join(place: str, key: str) -> str:
    """Where, and the key there."""
    return f"{place}: {key}" if key else place


def _absolute(varied: Variation, base_dir: str | os.PathLike[str] | None) -> Variation:
    """Make paths among the values independent of the working directory."""

    def values(axis: Axis) -> tuple[Any, ...]:
        made = []
        for value in axis.values:
            tables: Tables = {}
            _put(tables, axis.path, copy.deepcopy(value))
            make_absolute(tables, base_dir)
            made.append(_get(tables, axis.path))
        return tuple(made)

    files = ("urdf", "package_dirs", "file", "pieces")
    axes = tuple(
        Axis(axis.label, axis.place, axis.path, values(axis))
        if axis.path == ("robot",) or axis.path[-1] in files
        else axis
        for axis in varied.axes
    )
    return Variation(axes, varied.ranges, varied.count, varied.seed)


def _put(tables: Tables, path: Sequence[str | int], value: Any) -> None:
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


def _get(tables: Tables, path: Sequence[str | int]) -> Any:
    """What stands at a path."""
    value: Any = tables
    for step in path:
        value = value[step]
    return value


def _case_of(tables: Tables) -> Case:
    """The case of some tables, checked.

    Raises:
        CaseError: with everything that is wrong.
    """
    rows = [f"{toml_key(title)} = {toml_value(table)}" for title, table in tables.items()]
    return Case.from_toml("\n".join(rows))


def _check(base: Tables, varied: Variation, faults: list[Fault]) -> None:
    """Keep the faults of every value, each tried with the first value of everything else."""
    entries: list[tuple[Axis | Range, tuple[Any, ...]]] = [
        *((axis, axis.values) for axis in varied.axes),
        *((span, (span.low, span.high)) for span in varied.ranges),
    ]

    def tried(changed: int, value: Any) -> list[Fault]:
        tables = copy.deepcopy(base)
        for k, (entry, values) in enumerate(entries):
            _put(tables, entry.path, copy.deepcopy(value if k == changed else values[0]))
        return _faults_of(tables)

    known = tried(-1, None)
    for key, message in known:
        places = [f"{e.place}[0]" for e, _ in entries if _covers(e.path, key)]
        faults.append(Fault(_join(places[0], key) if places else f"base.{key}", message))
    for n, (entry, values) in enumerate(entries):
        for k, value in enumerate(values[1:], start=1):
            faults += [
                Fault(_join(f"{entry.place}[{k}]", key), message)
                for key, message in tried(n, value)
                if (key, message) not in known
            ]


def _covers(path: Sequence[str | int], key: str) -> bool:
    """Is what a fault is about at the path, or inside it?"""
    name = ".".join(step for step in path if isinstance(step, str))
    return key == name or key.startswith((f"{name}.", f"{name}["))


def _faults_of(tables: Tables) -> list[Fault]:
    """What is wrong with a case, its arm and its files too."""
    from robots import RobotError

    try:
        case = _case_of(tables)
    except CaseError as error:
        return list(error.faults)
    found = []
    try:
        arm_of(case)
    except RobotError as error:
        found.append(Fault("robot", str(error)))
    if "file" in case.surface.values:
        table = {key: value for key, value in case.surface.table().items() if value is not None}
        found += _faults_of_file(toml_document({"surface": {**table, **HOME}}))
    return found


@lru_cache(maxsize=256)
def _faults_of_file(surface: str) -> list[Fault]:
    """What reading the file of a surface says; `surface` is its table as a document."""
    part = read_surface(parse_toml(surface)["surface"], [])
    return [] if part is None else faults_of_building(part)


class _Frames:
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
        """The tasks in order; combinations that make no case are kept as faults."""
        axes, ranges = self.varied.axes, self.varied.ranges
        samples = draw(self.varied)
        checked: dict[str, Tables | None] = {}
        for values in itertools.product(*(axis.values for axis in axes)):
            for sample in samples:
                entries: list[tuple[Axis | Range, Any]] = list(zip(axes, values, strict=True))
                entries += zip(ranges, sample, strict=True)
                parameters = {entry.label: _said(entry.label, value) for entry, value in entries}
                tables = self._tables(entries, parameters, checked, faults)
                if tables is not None:
                    yield StudyTask(tables, parameters)

    def _tables(
        self,
        entries: list[tuple[Axis | Range, Any]],
        parameters: Mapping[str, Any],
        checked: dict[str, Tables | None],
        faults: list[Fault],
    ) -> Tables | None:
        """The checked tables of one combination; None where it makes no case."""
        others = [(entry, value) for entry, value in entries if not entry.is_pose]
        name = json.dumps([value for _, value in others], sort_keys=True)
        if name not in checked:
            tables = copy.deepcopy(self.base)
            for entry, value in others:
                _put(tables, entry.path, copy.deepcopy(value))
            checked[name] = self._checked(tables, parameters, faults)
        frame = checked[name]
        if frame is None:
            return None
        tables = {**frame, "surface": copy.deepcopy(frame["surface"])}
        for entry, value in entries:
            if entry.is_pose:
                numbers = list(map(float, value)) if isinstance(value, list) else float(value)
                _put(tables, entry.path, numbers)
        return tables

    def _checked(
        self, tables: Tables, parameters: Mapping[str, Any], faults: list[Fault]
    ) -> Tables | None:
        """The tables with everything filled in that the case leaves open."""
        found = _faults_of(tables)
        shown_values = ", ".join(
            f"{label} = {shown(value)}"
            for label, value in parameters.items()
            if label.split(".")[1:2] not in [[key] for key in POSES]
        )
        faults += [Fault(f"vary: with {shown_values}: {key}", text) for key, text in found]
        return None if found else as_read(_case_of(tables).to_tables())


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
