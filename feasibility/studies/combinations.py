"""The tasks of a study: every combination of what varies, each a case written in full."""

import copy
import itertools
import json
import re
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from coverable.errors import Fault, shown
from feasibility.cases.robot_table import in_robot_table
from feasibility.cases.surface_reading import faults_of_building, read_surface
from feasibility.cases.table_reader import CaseError
from feasibility.cases.toml import as_read, parse_toml
from feasibility.studies.built_cases import (
    arm_of,
    case_of,
    mounted_as,
    mounting_fault,
    surface_at_home,
)
from feasibility.studies.pool import Tables
from feasibility.studies.run import StudyTask
from feasibility.studies.varied_keys import POSES, Key, Variation

ORIGIN = (0.0, 0.0, 0.0)
POSED = [[key] for key in POSES]


def put(tables: Tables, path: Sequence[str | int], value: Any) -> None:
    """Replace what is at a path; arrays of three are made where there are none."""
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


def tasks_of(base: Tables, varied: Variation, faults: list[Fault]) -> tuple[StudyTask, ...]:
    """Every combination of what varies; those that make no case are kept as faults, one a cause.

    Cases that differ in the pose of the surface alone are checked once.
    """
    entries = (*varied.axes, *varied.ranges)
    checked: dict[str, Tables | None] = {}
    refused: dict[tuple[str, str], tuple[Fault, list[dict[str, str]]]] = {}
    tasks = []
    for combination in itertools.product(*(axis.values for axis in varied.axes), draw(varied)):
        *values, sample = combination
        row = list(zip(entries, (*values, *sample), strict=True))
        parameters = {entry.label: _parameter(entry.label, value) for entry, value in row}
        others = [(entry, value) for entry, value in row if not entry.is_pose]
        name = json.dumps([value for _, value in others], sort_keys=True)
        if name not in checked:
            made, found = case_with(base, others)
            checked[name] = None if found else made
            texts = {k: shown(v) for k, v in parameters.items() if k.split(".")[1:2] not in POSED}
            for fault in found:
                cause = fault.key, cause_of(fault.message)
                refused.setdefault(cause, (fault, []))[1].append(texts)
        case = checked[name]
        if case is None:
            continue
        tables = {**case, "surface": copy.deepcopy(case["surface"])}
        for entry, value in row:
            if entry.is_pose:
                numbers = list(map(float, value)) if isinstance(value, list) else float(value)
                put(tables, entry.path, numbers)
        tasks.append(StudyTask(tables, parameters))
    faults += [_as_one(*alike) for alike in refused.values()]
    return tuple(tasks)


def case_with(base: Tables, values: Sequence[tuple[Key, Any]]) -> tuple[Tables, list[Fault]]:
    """The base with some values and all defaults filled in, or what is wrong with it."""
    tables, faults = copy.deepcopy(base), []
    given = base.get("robot", {})
    for entry, value in values:
        if entry.path == ("robot",):
            fault = mounting_fault(value, given)
            if fault is not None:
                faults.append(Fault("robot", f"{value.get('name', value.get('urdf'))} {fault}"))
            value = mounted_as(value, given)
        put(tables, entry.path, copy.deepcopy(value))
    faults = faults or faults_of(tables)
    return ({} if faults else as_read(case_of(tables).to_tables())), faults


def _as_one(first: Fault, texts: list[dict[str, str]]) -> Fault:
    """Combinations refused for one cause as one fault, with the values that they have in common."""
    alike = [
        f"{label} = {value}"
        for label, value in texts[0].items()
        if all(other[label] == value for other in texts)
    ]
    more = f" ({len(texts)} combinations with that)" if len(texts) > 1 else ""
    place = f"vary: with {', '.join(alike)}: " if alike else "vary: "
    return Fault(f"{place}{first.key}", f"{first.message}{more}", first.place)


def cause_of(message: str) -> str:
    """What is wrong, whatever the numbers are; digits of names stay.

    Example:
        >>> cause_of("joint2 must lie in 0 .. 180, got -3.5e+1")
        'joint2 must lie in # .. #, got #'
    """
    return re.sub(r"(?<![\w'.-])[-+]?\d+(\.\d+)?(e[-+]?\d+)?(?!\w)", "#", message)


def _parameter(label: str, value: Any) -> Any:
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
    low, high = np.array([(span.low, span.high) for span in varied.ranges]).T
    return [tuple(row) for row in (low + (high - low) * unit).tolist()]


def faults_of(tables: Tables) -> list[Fault]:
    """What is wrong with a case, its arm and its files too."""
    from robots.errors import RobotError

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
        found += _faults_of_file(surface_at_home(case))
    return found


@lru_cache(maxsize=256)
def _faults_of_file(surface: str) -> list[Fault]:
    """What reading the file of a surface says; `surface` is its table as a document."""
    part = read_surface(parse_toml(surface)["surface"], [])
    return [] if part is None else faults_of_building(part)
