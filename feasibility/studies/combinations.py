"""The tasks of a study: every combination of what varies, each a case written in full."""

import copy
import itertools
import json
import os
import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from coverable.arrays import Array
from coverable.errors import Fault, listed, shown
from feasibility.cases.robot_table import in_robot_table
from feasibility.cases.surface_reading import faults_of_building
from feasibility.cases.table_reader import ORIGIN, CaseError, Section
from feasibility.cases.toml import as_read
from feasibility.cases.toml_edits import make_absolute
from feasibility.studies.built_cases import (
    arm_of,
    case_of,
    mounted_as,
    mounting_fault,
    part_at_home,
    surface_at_home,
)
from feasibility.studies.pool import Tables
from feasibility.studies.run import StudyTask
from feasibility.studies.varied_keys import Variation, VariedKey
from robots.errors import RobotError
from surfaces.arguments import check_pose

MOST_ALIKE = 4  # values of one key that are named, of those that are wrong for the same cause


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


class _Combination(NamedTuple):
    """Values of everything but the surface's pose, and the case that they make."""

    values: Mapping[str, str]
    """By label, for messages."""
    tables: Tables
    faults: Sequence[Fault]


def tasks_of(
    base: Tables,
    varied: Variation,
    base_dir: str | os.PathLike[str] | None,
    faults: list[Fault],
) -> tuple[StudyTask, ...]:
    """Every combination of what varies; those that make no case are kept as faults, one a cause.

    Cases that differ in the pose of the surface alone are checked once, and each pose by itself.
    """
    entries, wrong, checked, tasks = varied.keys, list[Fault](), dict[str, _Combination](), []
    for entry in entries:
        for k, value in enumerate(entry.values if entry.is_pose else ()):
            pose: Tables = {}
            put({"surface": pose}, entry.path, value)
            Section(f"{entry.place}[{k}]: surface", pose, wrong).make(check_pose, pose)
    for *values, sample in itertools.product(*(axis.values for axis in varied.axes), draw(varied)):
        row: list[tuple[VariedKey, Any]] = list(zip(entries, (*values, *sample), strict=True))
        parameters = {entry.label: _parameter(entry.label, value) for entry, value in row}
        others = [(entry, value) for entry, value in row if not entry.is_pose]
        name = json.dumps([value for _, value in others], sort_keys=True)
        if name not in checked:
            texts = {entry.label: shown(parameters[entry.label]) for entry, _ in others}
            checked[name] = _Combination(texts, *_case_with(base, others, base_dir))
        case = checked[name]
        if case.faults or wrong:
            continue
        tables = {**case.tables, "surface": copy.deepcopy(case.tables["surface"])}
        for entry, value in row:
            if entry.is_pose:
                numbers = list(map(float, value)) if isinstance(value, list) else float(value)
                put(tables, entry.path, numbers)
        tasks.append(StudyTask(tables, parameters))
    faults += [*wrong, *_refusals(entries, list(checked.values()))]
    return tuple(tasks)


def _case_with(
    base: Tables, values: Sequence[tuple[VariedKey, Any]], base_dir: str | os.PathLike[str] | None
) -> tuple[Tables, list[Fault]]:
    """The base with some values and all defaults filled in, or what is wrong with it.

    Paths are relative to `base_dir`, by default to the working directory.
    """
    tables, given = copy.deepcopy(base), base.get("robot", {})
    for entry, value in values:
        if entry.path == ("robot",):
            fault = mounting_fault(value, given)
            if fault is not None:
                name = value.get("name", value.get("urdf"))
                return {}, [Fault("robot", f"{name} {fault}")]
            value = mounted_as(value, given)
        put(tables, entry.path, copy.deepcopy(value))
    make_absolute(tables, base_dir)
    try:
        case = case_of(tables)
    except CaseError as error:
        return {}, list(error.faults)
    faults = list[Fault]()
    try:
        arm_of(case)
    except RobotError as error:
        faults += in_robot_table(error)
    if "file" in case.surface.values:
        faults += _faults_of_file(surface_at_home(case))
    return ({} if faults else as_read(case.to_tables())), faults


def _refusals(entries: Sequence[VariedKey], checked: Sequence[_Combination]) -> Iterator[Fault]:
    """What is wrong with combinations, each cause once, with the values that only those have."""
    causes = defaultdict[tuple[str, str], list[tuple[Fault, Mapping[str, str]]]](list)
    for one in checked:
        for fault in one.faults:
            causes[fault.key, cause_of(fault.message)].append((fault, one.values))
    for (key, _), found in causes.items():
        fault, some = found[0]
        refused = [values for _, values in found]
        bad = {label: list(dict.fromkeys(values[label] for values in refused)) for label in some}
        alike = [
            f"{label} = {listed(texts, MOST_ALIKE)}"
            for label, texts in bad.items()
            if any(one.values[label] not in texts for one in checked)
        ]
        places = [f"with {', '.join(alike)}: "] if alike else []
        places += [f"{entry.place}: " for entry in entries if entry.covers(key)]
        yield fault._replace(key=[*places, "base."][0] + key)


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
    """Numbers for all ranges, so many times; one empty sample without ranges."""
    if not varied.ranges:
        return [()]
    low, high = np.array([span.values for span in varied.ranges]).T
    return [tuple(row) for row in spread(low, high, varied.count, varied.seed).tolist()]


def spread(low: Array, high: Array, count: int, seed: int | np.random.Generator) -> Array:
    """(count, n) places between two corners (n,): points of a scrambled Sobol sequence."""
    from scipy.stats import qmc

    sequence = qmc.Sobol(len(low), scramble=True, seed=seed)
    # The sequence is balanced at powers of two only; what is left over is not taken.
    return low + (high - low) * sequence.random_base2((count - 1).bit_length())[:count]


@lru_cache(maxsize=256)
def _faults_of_file(surface: str) -> list[Fault]:
    """What reading the file of a surface says; `surface` is its table, as JSON."""
    return faults_of_building(part_at_home(surface))
