"""A joint motion that anybody may have made, as a CSV file with a column for each joint.

Columns go by name and stand in any order. A joint's values are radians (metres where it slides), or
degrees in a column `NAME_deg`. Two columns more are used: `cell`, the number of the cell that a row
is at, and `working`, with 1 in rows at which the tool works and 0 elsewhere. What else our files
and those of other programs have beside the joints (time, velocities) is not used, and said to be;
any other column is a fault. So are a joint without a column, one with two, ragged rows, what is no
finite number, and values that can only be degrees.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints, Mask
from coverable.columns import FLAG, NUMBER, WHOLE_OR_NOTHING, Kind, read_columns
from coverable.errors import CoverableError, Fault, close, printable
from feasibility.read_files import FileError, read_text, shown_path
from feasibility.results.trajectory_files import WORKING
from robots.robot import Robot

CAP = 64 << 20  # bytes
MOST_ROWS = 1_000_000
MOST_COLUMNS = 1000
CELL = "cell"
NO_MARK = -2.0
MARK = Kind("", lambda word: NO_MARK if math.isnan(one := WHOLE_OR_NOTHING.value(word)) else one)
"""The cell of a row; what is no such number makes the column one that is not used."""
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
        return _from_csv(text, robot)
    except CoverableError as error:
        raise FileError(error.faults, name) from error


def _from_csv(text: str, robot: Robot) -> Motion:
    """See `load_motion`."""
    lines = read_columns(text, MOST_ROWS, f"joint names: {', '.join(robot.joint_names)}")
    head = lines.head
    if len(head) > MOST_COLUMNS:
        raise FileError(f"has more than {MOST_COLUMNS:,} columns")
    joints = _columns(head, robot, lines.place)
    working, cell = (
        head.index(word) if head.count(word) == 1 and word not in robot.joint_names else None
        for word in (WORKING, CELL)
    )
    kinds = {column: NUMBER for column, _ in joints}
    kinds |= {} if working is None else {working: FLAG}
    kinds |= {} if cell is None else {cell: MARK}
    values = dict(zip(kinds, lines.numbers(kinds).T, strict=True))
    if cell is not None and (values[cell] == NO_MARK).any():
        del values[cell]
    rows = [np.radians(values[at]) if in_degrees else values[at] for at, in_degrees in joints]
    q = _checked(np.stack(rows, axis=1), robot)
    unused = [word for at, word in enumerate(head) if at not in values]
    notes = [f"not used: {', '.join(map(printable, unused))}"] if unused else []
    return Motion(
        q=q,
        notes=(*notes, *_turns(q, robot)),
        working=None if working is None else values[working] == 1.0,
        marks=values[cell].astype(np.int64) if cell in values else None,
    )


def _columns(head: Sequence[str], robot: Robot, place: str) -> list[tuple[int, bool]]:
    """For each joint its column, and whether that is in degrees.

    Raises:
        FileError: with all faults of the header, which stands at `place`.
    """
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
        raise FileError(faults)
    return [places[joint][0] for joint in robot.joint_names]


def _is_aside(word: str, robot: Robot) -> bool:
    """Is it a column that motions often have beside the joints?"""
    derived = {joint + end for joint in robot.joint_names for end in DERIVED}
    return word in (*LEFT_ASIDE, WORKING) or word in derived


def _checked(q: Array, robot: Robot) -> Array:
    """The values, unless they are in other units.

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
                f"{limits}, and all values would fit as {taken}; {remedy.format(joint=joint)}"
            )
    return q


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
