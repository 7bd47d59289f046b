"""A study file: a base case and what varies, read with every fault named.

```toml
[base]
case = "paper/4a"                  # a built-in case, or a case file beside this one; and/or
task = { cone_deg = 30 }           # tables of a case, whose keys replace those of the case

[vary]                             # every combination of these
robots = ["puma560", { name = "ur5" }]
"task.cone_deg" = [20, 30, 45]     # any key of a case; or { from = 20, to = 45, steps = 6 },
                                   # evenly spaced; { from = 45, to = 20, ... } goes down
"surface.position" = { x = [0.0, 0.1], y = { range = [-0.2, 0.2] }, z = 0.3 }
"surface.rpy_deg" = { yaw = { range = [-90, 90] } }
sampler = "sobol"                  # ranges are sampled together
count = 64
seed = 0
```
"""

import copy
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from operator import getitem
from typing import Any

from coverable.errors import Fault, listed, shown
from feasibility.cases.case import TABLES, load_case, read_document
from feasibility.cases.table_reader import CaseError, Section
from feasibility.cases.toml import TomlError, as_read, parse_toml, toml_key
from feasibility.cases.toml_edits import make_absolute
from feasibility.read_files import shown_path
from feasibility.studies.combinations import cause_of, faults_of, put, tasks_of
from feasibility.studies.pool import Tables
from feasibility.studies.run import StudyTask
from feasibility.studies.varied_keys import Range, Variation, VariedKey, read_variation

MOST_TASKS = 1_000_000
MOST_ALIKE = 3  # values of one key, wrong for the same cause, that are reported one by one
MOST_INDICES = 8  # of the others
MOST_CASES = 10_000  # combinations of everything but the surface's pose: each is checked by itself


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
    text = read_document(path, "a study file (TOML)")
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
        raise CaseError(str(error), name) from error
    faults: list[Fault] = []
    _no_dates("", document, faults)
    if faults:  # nothing else of such a document can be written down again
        raise CaseError(faults, name)
    description = document.get("description", "")
    if not isinstance(description, str):
        faults.append(Fault("description", f"must be a sentence, got {shown(description)}"))
    section = Section("", document, faults)
    section.take("description")
    for title in ("base", "vary"):
        if not section.has(title):
            section.fault(title, f"is missing; expected a table [{title}]")
    section.refuse_others()
    base = _read_base(document["base"], base_dir, faults) if "base" in document else None
    varied = read_variation(document["vary"], faults) if "vary" in document else None
    if base is None or varied is None:
        raise CaseError(faults, name)
    varied = _absolute(varied, base_dir)
    if varied.size > MOST_TASKS:
        faults.append(Fault("vary", f"makes {varied.size} tasks, more than {MOST_TASKS}"))
    elif varied.cases > MOST_CASES:
        what = f"makes {varied.cases} cases besides those that differ in the pose"
        faults.append(Fault("vary", f"{what}, more than {MOST_CASES}"))
    else:
        _check(base, varied, faults)
    if faults:
        raise CaseError(faults, name)
    tasks = tasks_of(base, varied, faults)
    if faults:
        raise CaseError(faults, name)
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
            faults += [fault._replace(key=_join("base.case", fault.key)) for fault in error.faults]
    own = {}
    for title in TABLES:
        if section.has(title) and isinstance(section.table[title], Mapping):
            own[title] = dict(section.table[title])
        elif title in section.table:
            section.fault(title, f"must be a table, got {shown(section.table[title])}")
    section.refuse_others()
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

    def values(axis: VariedKey) -> tuple[Any, ...]:
        made = []
        for value in axis.values:
            tables: Any = {}
            put(tables, axis.path, copy.deepcopy(value))
            make_absolute(tables, base_dir)
            made.append(reduce(getitem, axis.path, tables))
        return tuple(made)

    files = ("urdf", "package_dirs", "file", "pieces", "srdf", "scene", "tool")
    axes = tuple(
        replace(axis, values=values(axis))
        if axis.path == ("robot",) or axis.path[-1] in files
        else axis
        for axis in varied.axes
    )
    return replace(varied, axes=axes)


def _check(base: Tables, varied: Variation, faults: list[Fault]) -> None:
    """Keep the faults of every value, each tried with the first value of everything else."""
    entries: list[tuple[VariedKey | Range, tuple[Any, ...]]] = [
        *((axis, axis.values) for axis in varied.axes),
        *((span, (span.low, span.high)) for span in varied.ranges),
    ]

    def tried(changed: int, value: Any) -> list[Fault]:
        tables = copy.deepcopy(base)
        for k, (entry, values) in enumerate(entries):
            put(tables, entry.path, copy.deepcopy(value if k == changed else values[0]))
        return faults_of(tables)

    known = tried(-1, None)
    for fault in known:
        places = [f"{e.place}[0]" for e, _ in entries if _covers(e.path, fault.key)]
        place = _join(places[0], fault.key) if places else f"base.{fault.key}"
        faults.append(fault._replace(key=place))
    for n, (entry, values) in enumerate(entries):
        alike: dict[tuple[str, str], list[int]] = {}
        for k, value in enumerate(values[1:], start=1):
            for fault in tried(n, value):
                if fault in known:
                    continue
                same = alike.setdefault((fault.key, cause_of(fault.message)), [])
                same.append(k)
                if len(same) <= MOST_ALIKE:
                    faults.append(fault._replace(key=_join(f"{entry.place}[{k}]", fault.key)))
        faults += [
            Fault(entry.place, _more(key, same[MOST_ALIKE:]))
            for (key, _), same in alike.items()
            if len(same) > MOST_ALIKE
        ]


def _more(key: str, indices: Sequence[int]) -> str:
    """Values that are wrong for the same cause as others that were reported."""
    which = listed([f"[{k}]" for k in indices], MOST_INDICES)
    what = "value is" if len(indices) == 1 else "values are"
    return f"{len(indices)} more {what} no better for {key}: {which}"


def _covers(path: Sequence[str | int], key: str) -> bool:
    """Is what a fault is about at the path, or inside it?"""
    name = ".".join(step for step in path if isinstance(step, str))
    return key == name or key.startswith((f"{name}.", f"{name}["))
