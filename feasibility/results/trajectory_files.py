"""Trajectories as files: CSV, JSON, and YAML shaped like a ROS `trajectory_msgs/JointTrajectory`.

What is written is read back as the same numbers. Files are untrusted: they are read with a cap, as
plain text, and every number is checked; nothing in them is ever run.
"""

from __future__ import annotations

import csv
import io
import json
import math
import os
from pathlib import Path
from typing import Any

import numpy as np

from feasibility.results.trajectory_checks import (
    MOST_JOINTS,
    MOST_SAMPLES,
    names,
    numbers,
    raise_all,
)
from feasibility.results.trajectory_yaml import as_yaml, from_yaml
from feasibility.safe_files import FileError, read_regular, shown_path, write_whole
from feasibility.timing import Trajectory

CAP = 64 << 20  # [bytes] largest file that is read
FORMAT = "coverable trajectory 1"
_SHAPES = {"velocities": "_velocity", "accelerations": "_acceleration"}


def save_trajectory(path: str | os.PathLike[str], trajectory: Trajectory) -> Path:
    """Write a trajectory; the file's ending says how: .csv, .json, .yaml or .yml.

    Raises:
        FileError: another ending, or the file cannot be written.
    """
    text = _of_ending(path, {"csv": as_csv, "json": as_json_text, "yaml": as_yaml})(trajectory)
    return write_whole(path, lambda stream: stream.write(text.encode()))


def check_ending(path: str | os.PathLike[str]) -> None:
    """Refuse a file whose ending says no format.

    Raises:
        FileError: another ending than .csv, .json, .yaml or .yml.
    """
    _of_ending(path, {"csv": None, "json": None, "yaml": None})


def load_trajectory(path: str | os.PathLike[str]) -> Trajectory:
    """Read a trajectory that `save_trajectory` wrote.

    Raises:
        FileError: there is no such file, or it is not such a trajectory: all faults, with places.
    """
    read = _of_ending(path, {"csv": from_csv, "json": from_json_text, "yaml": from_yaml})
    data = read_regular(path, CAP, "a trajectory (.csv, .json or .yaml)")
    try:
        return read(data.decode("utf-8"))
    except UnicodeDecodeError as error:
        raise FileError(f"is not text: {error.reason}", shown_path(path)) from error
    except ValueError as error:
        raise FileError(str(error), shown_path(path)) from error


def _of_ending(path: str | os.PathLike[str], known: dict[str, Any]) -> Any:
    """What belongs to a file's ending."""
    ending = Path(path).suffix.lower().lstrip(".")
    ending = "yaml" if ending == "yml" else ending
    if ending not in known:
        raise FileError(
            f"{shown_path(path)}: expected a name that ends in .csv, .json or .yaml (a trajectory)"
        )
    return known[ending]


# -- CSV ---------------------------------------------------------------------------------------


def as_csv(trajectory: Trajectory) -> str:
    """One row a sample: time (s), joints, their velocities and accelerations, tool speed, cell."""
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(_columns(trajectory.joint_names))
    table = np.column_stack(
        [trajectory.time, trajectory.q, trajectory.dq, trajectory.ddq, trajectory.tool_speed]
    )
    for values, cell in zip(table.tolist(), trajectory.cell.tolist(), strict=True):
        rows.writerow([*map(repr, values), "" if cell < 0 else cell])
    return text.getvalue()


def _columns(joints: tuple[str, ...]) -> list[str]:
    """Names of the columns."""
    derived = [joint + end for end in _SHAPES.values() for joint in joints]
    return ["time", *joints, *derived, "tool_speed", "cell"]


def from_csv(text: str) -> Trajectory:
    """Read what `as_csv` wrote.

    Raises:
        ValueError: it is something else.
    """
    try:
        rows = list(csv.reader(io.StringIO(text), strict=True))
    except csv.Error as error:
        raise ValueError(f"is not CSV: {error}") from error
    head = rows[0] if rows else []
    n = (len(head) - 3) // 3
    joints = tuple(head[1 : 1 + max(n, 0)])
    if n < 1 or n > MOST_JOINTS or head != _columns(joints):
        raise ValueError(
            "line 1: expected the columns time, the joints, their velocities "
            "(joint_velocity), their accelerations (joint_acceleration), tool_speed, cell"
        )
    if len(rows) - 1 > MOST_SAMPLES:
        raise ValueError(f"has more than {MOST_SAMPLES:,} samples")
    faults: list[str] = []
    table = np.full((len(rows) - 1, len(head) - 1), math.nan)
    cells = np.full(len(rows) - 1, -1, dtype=np.int64)
    for k, row in enumerate(rows[1:]):
        if len(row) != len(head):
            faults.append(f"line {k + 2}: expected {len(head)} columns, found {len(row)}")
            continue
        try:
            table[k] = [float(word) for word in row[:-1]]
            cells[k] = int(row[-1]) if row[-1] else -1
        except (ValueError, OverflowError):
            faults.append(f"line {k + 2}: expected numbers, and a whole number or nothing as cell")
    raise_all(faults)
    columns = np.split(table, np.cumsum([1, n, n, n]), axis=1)
    return Trajectory(
        joints, columns[0][:, 0], columns[1], columns[2], columns[3], columns[4][:, 0], cells
    )


# -- JSON --------------------------------------------------------------------------------------


def as_json_text(trajectory: Trajectory) -> str:
    """One object; times in seconds, radians or metres; cell is null between centres."""
    cells = [None if cell < 0 else cell for cell in trajectory.cell.tolist()]
    record = {
        "format": FORMAT,
        "joint_names": list(trajectory.joint_names),
        "time": trajectory.time.tolist(),
        "positions": trajectory.q.tolist(),
        "velocities": trajectory.dq.tolist(),
        "accelerations": trajectory.ddq.tolist(),
        "tool_speed": trajectory.tool_speed.tolist(),
        "cell": cells,
    }
    return json.dumps(record, allow_nan=False) + "\n"


def from_json_text(text: str) -> Trajectory:
    """Read what `as_json_text` wrote.

    Raises:
        ValueError: it is something else.
    """
    try:
        record = json.loads(text)
    except RecursionError as error:
        raise ValueError("is nested too deeply for a trajectory") from error
    except ValueError as error:
        raise ValueError(f"is not JSON: {error}") from error
    keys = {
        "format", "joint_names", "time", "positions", "velocities", "accelerations", "tool_speed",
        "cell",
    }  # fmt: skip
    if not isinstance(record, dict) or record.get("format") != FORMAT:
        raise ValueError(f'expected an object with "format": "{FORMAT}"')
    faults = [f"the key {key!r} is missing" for key in sorted(keys - set(record))]
    faults += [f"there is an unknown key {key[:40]!r}" for key in sorted(set(record) - keys)]
    raise_all(faults)
    joints = names(record["joint_names"], "joint_names", faults)
    k, n = len(record["time"]) if isinstance(record["time"], list) else 0, len(joints)
    if k > MOST_SAMPLES:
        faults.append(f"has more than {MOST_SAMPLES:,} samples")
    raise_all(faults)
    arrays = {
        key: numbers(record[key], shape, key, faults)
        for key, shape in (
            ("time", (k,)), ("positions", (k, n)), ("velocities", (k, n)),
            ("accelerations", (k, n)), ("tool_speed", (k,)),
        )
    }  # fmt: skip
    cells = record["cell"]
    if not isinstance(cells, list) or len(cells) != k or not all(map(_is_cell, cells)):
        faults.append(f"cell must be a list of {k} whole numbers >= 0, or null between centres")
    raise_all(faults)
    return Trajectory(
        joints, arrays["time"], arrays["positions"], arrays["velocities"], arrays["accelerations"],
        arrays["tool_speed"], np.array([-1 if c is None else c for c in cells], dtype=np.int64),
    )  # fmt: skip


def _is_cell(value: object) -> bool:
    """Is it a flat index, or null?"""
    whole = isinstance(value, int) and not isinstance(value, bool)
    return value is None or (whole and 0 <= value < 2**62)  # type: ignore[operator]
