"""Trajectories as YAML, shaped like a ROS `trajectory_msgs/JointTrajectory`.

The reader knows the lines that the writer writes and no more of YAML: lists of numbers on one line
each. Tool speed and cells, which the message has no fields for, stand there as comments.
"""

from __future__ import annotations

import json
import math
import re
from typing import Any

import numpy as np

from feasibility.results.trajectory_checks import MOST_SAMPLES, names, numbers, raise_all
from feasibility.timing import Trajectory

_ROWS = ("positions", "velocities", "accelerations")
_POINT = re.compile(
    r"- (?:# cell (?P<cell>\d{1,18}), |# )tool_speed (?P<speed>\S{1,40})\n"
    + "".join(rf"  {row}: (?P<{row}>\[[^\]\n]*\])\n" for row in _ROWS)
    + r"  time_from_start: \{sec: (?P<sec>\d{1,10}), nanosec: (?P<nanosec>\d{1,9})\}\n"
)


def as_yaml(trajectory: Trajectory) -> str:
    """The fields of a `trajectory_msgs/JointTrajectory`; times are rounded to nanoseconds."""
    lines = ["# trajectory_msgs/JointTrajectory, in radians, metres and seconds"]
    lines += [
        f"joint_names: {json.dumps(list(trajectory.joint_names), ensure_ascii=False)}",
        "points:",
    ]
    for k, cell in enumerate(trajectory.cell.tolist()):
        nanoseconds = round(float(trajectory.time[k]) * 1e9)
        seconds, rest = divmod(nanoseconds, 10**9)
        mark = f"cell {cell}, " if cell >= 0 else ""
        lines.append(f"- # {mark}tool_speed {float(trajectory.tool_speed[k])!r}")
        for name, row in zip(_ROWS, (trajectory.q, trajectory.dq, trajectory.ddq), strict=True):
            lines.append(f"  {name}: [{', '.join(map(_number, row[k].tolist()))}]")
        lines.append(f"  time_from_start: {{sec: {seconds}, nanosec: {rest}}}")
    return "\n".join(lines) + "\n"


def _number(value: float) -> str:
    """All digits of a number, with the point that YAML 1.1 wants: 1e-05 is text to it."""
    text = repr(value)
    return text.replace("e", ".0e") if "e" in text and "." not in text else text


def from_yaml(text: str) -> Trajectory:
    """Read what `as_yaml` wrote.

    Raises:
        ValueError: it is something else.
    """
    match = re.match(r"(?:#[^\n]*\n)*joint_names: (\[[^\n]*\])\npoints:\n", text)
    if match is None:
        raise ValueError(
            "expected the lines 'joint_names: [...]' and 'points:', then the points, as "
            "save_trajectory writes them"
        )
    faults: list[str] = []
    joints = names(_list(match[1]), "joint_names", faults)
    raise_all(faults)
    time: list[float] = []
    speed: list[float] = []
    cells: list[int] = []
    rows: dict[str, list[list[float]]] = {name: [] for name in _ROWS}
    place = match.end()
    while place < len(text):
        point = _POINT.match(text, place)
        if point is None or len(time) >= MOST_SAMPLES:
            line = text.count("\n", 0, place) + 1
            what = "a point" if point is None else f"at most {MOST_SAMPLES:,} points"
            raise ValueError(f"line {line}: expected {what}, as save_trajectory writes them")
        for name in _ROWS:
            values = _list(point[name])
            if len(values) != len(joints) or not all(type(v) in (int, float) for v in values):
                line = text.count("\n", 0, point.start(name)) + 1
                raise ValueError(f"line {line}: {name} must hold {len(joints)} numbers")
            rows[name].append(values)
        time.append(int(point["sec"]) + int(point["nanosec"]) * 1e-9)
        speed.append(_float(point["speed"]))
        cells.append(-1 if point["cell"] is None else int(point["cell"]))
        place = point.end()
    table = {name: numbers(rows[name], (len(time), len(joints)), name, faults) for name in _ROWS}
    raise_all(faults)
    return Trajectory(
        joints, np.array(time), table["positions"], table["velocities"], table["accelerations"],
        np.array(speed), np.array(cells, dtype=np.int64),
    )  # fmt: skip


def _list(text: str) -> list[Any]:
    """A list on one line; empty where it is none."""
    try:
        value = json.loads(text)
    except (ValueError, RecursionError):
        return []
    return value if isinstance(value, list) else []


def _float(text: str) -> float:
    """A number, nan where it is none, which `Trajectory` refuses."""
    try:
        return float(text)
    except ValueError:
        return math.nan
