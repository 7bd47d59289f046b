"""Trajectories as files: CSV, JSON, and YAML shaped like a ROS `trajectory_msgs/JointTrajectory`.

CSV is read back as the same numbers; JSON (ours, and that of compas_fab) and YAML are written for
other programs alone. Files are untrusted: they are read with a cap, as plain text, and every number
is checked.
"""

from __future__ import annotations

import csv
import io
import json
import os
from pathlib import Path
from typing import Any

import numpy as np

from coverable.columns import COMMENT, FLAG, NUMBER, WHOLE_OR_NOTHING, read_columns
from coverable.errors import CoverableError, Fault
from feasibility.collisions.words import listed_words
from feasibility.read_files import FileError, read_text, shown_path
from feasibility.safe_files import write_whole
from feasibility.timing.sampled_trajectory import Trajectory
from robots.robot import Robot

MOST_SAMPLES = 1_000_000
MOST_JOINTS = 64
CAP = 64 << 20  # [bytes] largest file that is read
FORMAT = "coverable trajectory 1"
WORKING = "working"  # the column, or the list, that says where the tool works
ARRAYS = {
    "time": "time", "positions": "q", "velocities": "dq", "accelerations": "ddq",
    "tool_speed": "tool_speed",
}  # fmt: skip
"""The arrays of the JSON, and what they are called in `Trajectory`."""
_SHAPES = {"velocities": "_velocity", "accelerations": "_acceleration"}


def save_trajectory(
    path: str | os.PathLike[str], trajectory: Trajectory, robot: Robot | None = None
) -> Path:
    """Write a trajectory; the file's ending says how: .csv, .json, .yaml, .yml or .compas.

    Args:
        path: of the file; .compas is the JSON of compas_fab, see `as_compas`.
        trajectory: what is written.
        robot: the arm, which .compas needs.

    Raises:
        FileError: another ending, the file cannot be written, or its ending needs the arm.
    """
    writers = {"csv": as_csv, "json": as_json_text, "yaml": as_yaml, "compas": None}
    write = _of_ending(path, writers)
    if write is not None:
        text = write(trajectory)
    elif robot is None:
        raise FileError("of compas_fab it needs the arm: give robot=", shown_path(path))
    else:
        from feasibility.results.compas_json import as_compas

        text = as_compas(robot, trajectory)
    return write_whole(path, lambda stream: stream.write(text.encode()))


def check_ending(path: str | os.PathLike[str]) -> None:
    """Refuse a file whose ending says no format.

    Raises:
        FileError: another ending than .csv, .json, .yaml, .yml or .compas.
    """
    _of_ending(path, dict.fromkeys(("csv", "json", "yaml", "compas")))


def load_trajectory(path: str | os.PathLike[str]) -> Trajectory:
    """Read a trajectory that `save_trajectory` wrote as CSV.

    Raises:
        FileError: there is no such file, or it is not such a trajectory: all faults, with places.
    """
    name = shown_path(path)
    if not _of_ending(path, {"csv": True, "json": False, "yaml": False, "compas": False}):
        raise FileError("JSON and YAML are written only; load the trajectory from CSV", name)
    text = read_text(path, CAP, "a trajectory (.csv)")
    try:
        return from_csv(text)
    except CoverableError as error:
        raise FileError(error.faults, name) from error


def _of_ending(path: str | os.PathLike[str], known: dict[str, Any]) -> Any:
    """What belongs to a file's ending."""
    ending = Path(path).suffix.lower().lstrip(".")
    ending = "yaml" if ending == "yml" else ending
    if ending not in known:
        raise FileError(
            "expected a name that ends in .csv, .json, .yaml or .compas (a trajectory)",
            shown_path(path),
        )
    return known[ending]


# -- CSV ---------------------------------------------------------------------------------------


def as_csv(trajectory: Trajectory) -> str:
    """One row a sample: time (s), joints, their velocities and accelerations, tool speed, cell.

    Where the tool does not work all along, a last column `working` says 1 where it does.
    """
    text = io.StringIO()
    text.write(f"{COMMENT} {listed_words(trajectory.collisions)}\n")
    rows = csv.writer(text, lineterminator="\n")
    working = trajectory.working
    rows.writerow([*_columns(trajectory.joint_names), *([] if working is None else [WORKING])])
    table = np.column_stack(
        [trajectory.time, trajectory.q, trajectory.dq, trajectory.ddq, trajectory.tool_speed]
    )
    works = [[]] * len(table) if working is None else [[int(one)] for one in working]
    for values, cell, work in zip(table.tolist(), trajectory.cell.tolist(), works, strict=True):
        rows.writerow([*map(repr, values), "" if cell < 0 else cell, *work])
    return text.getvalue()


def _columns(joints: tuple[str, ...]) -> list[str]:
    """Names of the columns."""
    derived = [joint + end for end in _SHAPES.values() for joint in joints]
    return ["time", *joints, *derived, "tool_speed", "cell"]


def from_csv(text: str) -> Trajectory:
    """Read what `as_csv` wrote.

    Raises:
        CoverableError: it is something else.
    """
    lines = read_columns(text, MOST_SAMPLES, "columns", delimiters=",")
    head = lines.head
    with_work = head[-1:] == [WORKING]
    n = (len(head) - with_work - 3) // 3
    joints = tuple(head[1 : 1 + max(n, 0)])
    if n < 1 or n > MOST_JOINTS or head[: len(head) - with_work] != _columns(joints):
        text = (
            "expected the columns time, the joints, their velocities (joint_velocity), their "
            "accelerations (joint_acceleration), tool_speed, cell"
        )
        raise CoverableError(Fault("", text, lines.place))
    kinds = dict.fromkeys(range(3 * n + 2), NUMBER) | {3 * n + 2: WHOLE_OR_NOTHING}
    values = lines.numbers(kinds | ({3 * n + 3: FLAG} if with_work else {}))
    time, q, dq, ddq, speed, cell, work = np.split(
        values, np.cumsum([1, n, n, n, 1, 1]), axis=1
    )  # fmt: skip
    return Trajectory(
        joints, time[:, 0], q, dq, ddq, speed[:, 0], cell[:, 0].astype(np.int64),
        working=work[:, 0] == 1.0 if with_work else None,
    )  # fmt: skip


# -- JSON --------------------------------------------------------------------------------------


def as_json_text(trajectory: Trajectory) -> str:
    """One object; times in seconds, radians or metres; cell is null between centres."""
    cells = [None if cell < 0 else cell for cell in trajectory.cell.tolist()]
    record: dict[str, Any] = {"format": FORMAT, "collisions": list(trajectory.collisions)}
    record["joint_names"] = list(trajectory.joint_names)
    record |= {key: getattr(trajectory, name).tolist() for key, name in ARRAYS.items()}
    if trajectory.working is not None:
        record[WORKING] = trajectory.working.tolist()
    return json.dumps({**record, "cell": cells}, allow_nan=False) + "\n"


# -- YAML --------------------------------------------------------------------------------------


def as_yaml(trajectory: Trajectory) -> str:
    """The fields of a `trajectory_msgs/JointTrajectory`; times are rounded to nanoseconds.

    Tool speed and cells, which the message has no fields for, stand there as comments.
    """
    lines = ["# trajectory_msgs/JointTrajectory, in radians, metres and seconds"]
    lines += [f"# {listed_words(trajectory.collisions)}"]
    lines += [
        f"joint_names: {json.dumps(list(trajectory.joint_names), ensure_ascii=False)}",
        "points:",
    ]
    rows = {key: getattr(trajectory, ARRAYS[key]) for key in ("positions", *_SHAPES)}
    for k, cell in enumerate(trajectory.cell.tolist()):
        nanoseconds = round(float(trajectory.time[k]) * 1e9)
        seconds, rest = divmod(nanoseconds, 10**9)
        mark = f"cell {cell}, " if cell >= 0 else ""
        lines.append(f"- # {mark}tool_speed {float(trajectory.tool_speed[k])!r}")
        for name, row in rows.items():
            lines.append(f"  {name}: [{', '.join(map(_number, row[k].tolist()))}]")
        lines.append(f"  time_from_start: {{sec: {seconds}, nanosec: {rest}}}")
    return "\n".join(lines) + "\n"


def _number(value: float) -> str:
    """All digits of a number, with the point that YAML 1.1 wants: 1e-05 is text to it."""
    text = repr(value)
    return text.replace("e", ".0e") if "e" in text and "." not in text else text
