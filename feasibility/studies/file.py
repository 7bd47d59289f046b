"""A study file: a base case and what varies, read with every fault named (docs/studies.md)."""

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from coverable.errors import Fault, shown
from feasibility.cases.case import TABLES, load_case, read_document
from feasibility.cases.table_reader import CaseError, Section
from feasibility.cases.toml import TomlError, as_read, parse_toml
from feasibility.read_files import shown_path
from feasibility.studies.combinations import tasks_of
from feasibility.studies.pool import Tables
from feasibility.studies.run import StudyTask
from feasibility.studies.varied_keys import read_variation

MOST_TASKS = 1_000_000
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
        name: what messages call it.

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
    document = json.loads(json.dumps(document, default=str))  # no key is a date: each is refused
    faults: list[Fault] = []
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
    tasks: tuple[StudyTask, ...] = ()
    if varied.size > MOST_TASKS:
        faults.append(Fault("vary", f"makes {varied.size} tasks, more than {MOST_TASKS}"))
    elif varied.cases > MOST_CASES:
        what = f"makes {varied.cases} cases besides those that differ in the pose"
        faults.append(Fault("vary", f"{what}, more than {MOST_CASES}"))
    else:
        tasks = tasks_of(base, varied, base_dir, faults)
    if faults:
        raise CaseError(faults, name)
    return Study(name, description, tasks, tuple(key.label for key in varied.keys))


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
            faults += [
                fault._replace(key=f"base.case: {fault.key}".rstrip(": ")) for fault in error.faults
            ]
    for title, keys in section.take(*TABLES).items():
        if not isinstance(keys, Mapping):
            section.fault(title, f"must be a table, got {shown(keys)}")
            continue
        # Another arm or another kind of surface has other keys: it replaces the whole table.
        fresh = keys.keys() & {"name", "urdf", "kind"}
        tables[title] = {**({} if fresh else tables.get(title, {})), **keys}
    section.refuse_others()
    return tables
