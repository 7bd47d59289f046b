"""A joint motion that anybody may have made, as a CSV file with a column for each joint.

Columns go by name and stand in any order. A joint's values are radians (metres where it slides), or
degrees in a column `NAME_deg`. Two columns more are used: `cell`, the number of the cell that a row
is at, and `working`, with 1 in rows at which the tool works and 0 elsewhere. What else our files
and those of other programs have beside the joints (time, velocities) is not used, and said to be;
any other column is a fault. So are a joint without a column, one with two, ragged rows, what is no
finite number, and values that can only be degrees.
"""

from __future__ import annotations

import csv
import io
import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints, Mask
from coverable.errors import Fault, close, number_in, printable, shown
from feasibility.read_files import FileError, read_text, shown_path
from feasibility.results.trajectory_files import COMMENT, WORKING
from robots.robot import Robot

CAP = 64 << 20  # bytes
MOST_ROWS = 1_000_000
MOST_COLUMNS = 1000
CELL, DIGITS = "cell", 10
LEFT_ASIDE = (CELL, "time", "t", "tool_speed", "time_from_start", "index", "row", "waypoint")
DERIVED = ("_velocity", "_acceleration", "_effort")
SLACK = 1e-6  # rad or m, beyond limits, of values that are taken for another unit
UNITS = (
    ("revolute", math.radians(1.0), 4.0 * math.pi, "degrees", "rad",
     "give radians, or call the columns {joint}_deg and so on"),
    ("prismatic", 1e-3, 0.5, "millimetres", "m", "give metres"),
)  # fmt: skip
"""Kinds of joints: what a unit that people confuse is worth, how far (rad, m) beyond its limits a
value is no wrong turn, the names of both units, and the remedy."""
DELIMITERS = (",", ";", "\t")


class Motion(NamedTuple):
    """A motion as it was read."""

    q: Array
    """(m, n) rows, rad or m, in the order of the robot's joints."""
    notes: tuple[str, ...]
    """What was not used."""
    working: Mask | None = None
    """(m,) at which rows the tool works, by a column `working` of 0 and 1; None for all."""
    marks: Ints | None = None
    """(m,) the cell that each row is said to be at, by a column `cell`, -1 where that is empty;
    None without such a column of whole numbers."""


def load_motion(path: str | os.PathLike[str], robot: Robot) -> Motion:
    """Read a joint motion for a robot: CSV, also a trajectory that `save_trajectory` wrote so.

    Raises:
        FileError: it cannot be read, or is no motion of this robot: all faults, with places.
    """
    name = shown_path(path)
    if Path(path).suffix.lower() == ".json":
        raise FileError("JSON is written only; give the motion as CSV", name)
    text = read_text(path, CAP, "a joint motion (.csv)")
    try:
        return _from_csv(text, robot, name)
    except csv.Error as error:
        raise FileError(f"is not CSV: {error}", name) from error


def _from_csv(text: str, robot: Robot, name: str) -> Motion:
    """See `load_motion`."""
    first = next((line for line in text.splitlines() if not line.startswith(COMMENT)), "")
    delimiter = max(DELIMITERS, key=first.count)
    lines = csv.reader(io.StringIO(text), delimiter=delimiter, strict=True)
    rows = [
        (lines.line_num, row) for row in lines
        if any(word.strip() for word in row) and not row[0].startswith(COMMENT)
    ]  # fmt: skip
    if not rows:
        raise FileError("is empty; expected a line of joint names, then a row a waypoint", name)
    place, head = f"line {rows[0][0]}", [word.strip() for word in rows[0][1]]
    if not any(math.isnan(number_in(word)) for word in head):
        expected = f"expected a first line of joint names: {', '.join(robot.joint_names)}"
        raise FileError(f"begins with numbers; {expected}", name)
    if len(head) > MOST_COLUMNS or len(rows) - 1 > MOST_ROWS:
        most = f"{MOST_ROWS:,} rows and {MOST_COLUMNS:,} columns"
        raise FileError(f"has more than {most}", name)
    columns, faults = _columns(head, robot, place)
    if faults:
        raise FileError(faults, name)
    if len(rows) == 1:
        raise FileError("has no rows", name)
    q = np.full((len(rows) - 1, robot.n), np.nan)
    at_work = head.index(WORKING) if head.count(WORKING) == 1 else None
    working = np.ones(len(q), dtype=bool)
    for k, (line, row) in enumerate(rows[1:]):
        if len(row) != len(head):
            what = f"has {len(row)} fields, not the {len(head)} of the first line"
            faults.append(Fault("", what, f"line {line}"))
            continue
        for joint, (column, in_degrees) in enumerate(columns):
            value = number_in(row[column])
            if not math.isfinite(value):
                what = f"{head[column]} is {shown(row[column].strip())}, no finite number"
                faults.append(Fault("", what, f"line {line}"))
            q[k, joint] = math.radians(value) if in_degrees else value
        if at_work is not None:
            working[k] = row[at_work].strip() == "1"
            if row[at_work].strip() not in ("0", "1"):
                faults.append(Fault("", f"expected 0 or 1 as {WORKING}", f"line {line}"))
    if faults:
        raise FileError(faults, name)
    marks = _marks(head, [row for _, row in rows[1:]])
    used = {column for column, _ in columns} | {at_work}
    used |= set() if marks is None else {head.index(CELL)}
    unused = [word for column, word in enumerate(head) if column not in used]
    notes = [f"not used: {', '.join(map(printable, unused))}"] if unused else []
    found = _checked(q, robot, name, tuple(notes))
    return found._replace(working=None if at_work is None else working, marks=marks)


def _marks(head: Sequence[str], rows: Sequence[Sequence[str]]) -> Ints | None:
    """The cells that rows are said to be at; None where that is not said in whole numbers."""
    if head.count(CELL) != 1:
        return None
    words = [row[head.index(CELL)].strip() for row in rows]
    if not all(word == "" or (word.isdecimal() and len(word) < DIGITS) for word in words):
        return None
    return np.array([-1 if word == "" else int(word) for word in words], dtype=np.int64)


def _columns(
    head: Sequence[str], robot: Robot, place: str = "line 1"
) -> tuple[list[tuple[int, bool]], list[Fault]]:
    """For each joint its column, and whether that is in degrees; and all faults, at `place`."""
    faults, places = [], dict[str, list[tuple[int, bool]]]()
    degrees = {
        f"{joint}_deg": joint
        for joint, slides in zip(robot.joint_names, robot.prismatic.tolist(), strict=True)
        if not slides
    }
    for column, word in enumerate(head):
        if word in robot.joint_names:
            places.setdefault(word, []).append((column, False))
        elif word in degrees:
            places.setdefault(degrees[word], []).append((column, True))
        elif not _is_aside(word, robot):
            guess = close(word, robot.joint_names)
            hint = f"; did you mean {guess}?" if guess else ""
            text = f"is no joint of {robot.name}{hint}"
            faults.append(Fault("", f"column {printable(word)!r} {text}", place))
    for joint in robot.joint_names:
        found = places.get(joint, [])
        if len(found) != 1:
            what = "has no column" if not found else f"has {len(found)} columns"
            faults.append(Fault("", f"joint {joint} {what}", place))
    if faults:
        names = ", ".join(robot.joint_names)
        faults.append(Fault("", f"expected a column for each of {names}"))
        return [], faults
    return [places[joint][0] for joint in robot.joint_names], []


def _is_aside(word: str, robot: Robot) -> bool:
    """Is it a column that motions often have beside the joints?"""
    derived = {joint + end for joint in robot.joint_names for end in DERIVED}
    return word in (*LEFT_ASIDE, WORKING) or word in derived


def _checked(q: Array, robot: Robot, name: str, notes: tuple[str, ...]) -> Motion:
    """The motion, unless its values are in other units.

    They are where one is far beyond its limits, and all of the same kind of joint would be inside
    them in the other unit. Joints without limits say nothing.
    """
    for kind, factor, far, taken, unit, remedy in UNITS:
        some = np.flatnonzero(robot.prismatic == (kind == "prismatic"))
        low, high, values = robot.lower[some], robot.upper[some], q[:, some]
        beyond = np.maximum(low - values, values - high)
        other = factor * values
        fits = (other >= low - SLACK).all() and (other <= high + SLACK).all()
        if fits and beyond.max(initial=-np.inf) > far:
            row, column = np.unravel_index(np.argmax(beyond), beyond.shape)
            joint = robot.joint_names[some[column]]
            limits = f"{low[column]:.4g} .. {high[column]:.4g} {unit}"
            raise FileError(
                f"holds {taken}, it seems: {joint} is {values[row, column]:g} where its limits are "
                f"{limits}, and all values would fit as {taken}; {remedy.format(joint=joint)}",
                name,
            )
    return Motion(q, (*notes, *_turns(q, robot)))


def _turns(q: Array, robot: Robot) -> list[str]:
    """A note where a joint seems to be wrapped at half a turn: it jumps by a turn."""
    jumps = (np.abs(np.diff(q, axis=0)) > math.pi) & ~robot.prismatic
    if not jumps.any():
        return []
    row, joint = np.argwhere(jumps)[0]
    return [
        f"{robot.joint_names[joint]} moves by more than half a turn from row {row + 1} to "
        f"{row + 2}; values must be unwrapped"
    ]
