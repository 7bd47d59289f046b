"""Programs as text and files.

Times are those of the trajectory. URScript is given positions at a fixed period, on the quintics
through the samples, which the replay of the trajectory has judged; RAPID and KRL are given the
samples themselves, each with its time. How a controller goes from point to point is its own affair:
the nearer the points, the less it matters.
"""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from coverable_arrays import Array
from feasibility.collisions import listed_words
from feasibility.programs.controllers import (
    KRL,
    RAPID,
    URSCRIPT,
    AxisMap,
    Language,
    check_program,
    language_of,
)
from feasibility.safe_files import write_whole
from feasibility.timing import Trajectory, at_times
from feasibility.version import version
from robots import Robot

SERVO = 0.008  # [s], a whole number of cycles of every UR controller (2 ms and 8 ms)
LOOKAHEAD, GAIN = 0.1, 300  # [s], [1]: of servoj, its defaults
RAD_DIGITS, DEG_DIGITS, TIME_DIGITS = 7, 4, 4
UNUSED = "9E9"  # what RAPID calls an external axis that is not there
LONGEST_NAME = 24  # characters of a KRL program's name


class _Rows(NamedTuple):
    """Points of a program."""

    arm: list[list[str]]
    """Six numbers each."""
    external: list[list[str]]
    steps: list[float]
    """s, from each point to the next."""
    duration: float
    """s."""


def program_text(
    language: Language,
    robot: Robot,
    run: Trajectory,
    case: str = "case",
    name: str = "coverable_path",
    signs: Sequence[float] | None = None,
    offsets_deg: Sequence[float] | None = None,
) -> str:
    """A timed motion as a program.

    Args:
        language: see `language_of`.
        robot: the arm.
        run: its trajectory.
        case: what the question is called, for the comment at the head.
        name: of the program, for KRL.
        signs, offsets_deg: of the controller's axes, see `check_program`.

    Raises:
        ProgramError: the arm has no program in this language.
    """
    axes = check_program(language, robot, signs, offsets_deg)
    head = _head(axes, robot, run, case)
    if language is URSCRIPT:
        return _urscript(head, _rows(axes, robot, *_servoed(run)))
    rows = _rows(axes, robot, run.time, run.q)
    return _rapid(head, rows) if language is RAPID else _krl(head, rows, name)


def save_program(
    path: str | os.PathLike[str],
    robot: Robot,
    run: Trajectory,
    case: str = "case",
    signs: Sequence[float] | None = None,
    offsets_deg: Sequence[float] | None = None,
) -> Path:
    """Write a program in the language of the file's ending, see `language_of`.

    Raises:
        FileError: another ending, or the file cannot be written.
        ProgramError: the arm has no program in this language.
    """
    language, name = language_of(path), re.sub(r"\W", "_", Path(path).stem, flags=re.ASCII)
    name = name if name[:1].isalpha() else f"p_{name}"
    text = program_text(language, robot, run, case, name[:LONGEST_NAME], signs, offsets_deg)
    return write_whole(path, lambda stream: stream.write(text.encode("ascii")))


def _head(axes: AxisMap, robot: Robot, run: Trajectory, case: str) -> list[str]:
    """The comment at the head, in lines of plain ASCII."""
    lines = [
        f"{axes.language.name} program of a coverage motion, written by coverable {version()}",
        f"case: {case:.200}; robot: {robot.name:.80}; {run.duration:.3f} s",
        f"{listed_words(run.collisions)}, and dynamics are not checked",
        *axes.words(robot),
        "Angles are those of the URDF: compare a few poses with the controller's display first.",
        "The move to the first point is not checked. Run it dry, at reduced speed, before use.",
    ]
    return ["".join(c if " " <= c <= "~" else "?" for c in line) for line in lines]


def _servoed(run: Trajectory) -> tuple[Array, Array]:
    """Times (m,) and positions (m, n) every `SERVO` seconds, the last one at or behind the end."""
    count = int(np.ceil(round(run.duration / SERVO, 6))) + 1
    time = np.arange(count, dtype=np.float64) * SERVO
    return time, at_times(run, run.time[0] + time)


def _rows(axes: AxisMap, robot: Robot, time: Array, q: Array) -> _Rows:
    """Numbers as text, and the steps of rounded times, which add up to the last of them."""
    digits = RAD_DIGITS if axes.language is URSCRIPT else DEG_DIGITS
    ticks = np.round((time - time[0]) * 10**TIME_DIGITS)
    kept = np.append(True, np.diff(ticks) > 0)  # of two samples at one time, the first
    q, ticks = q[kept], ticks[kept]
    arm, external = (
        [[f"{value + 0.0:.{digits}f}" for value in row] for row in table.tolist()]
        for table in axes.values(robot, q, digits)
    )
    steps = (np.diff(ticks) / 10**TIME_DIGITS).tolist()
    return _Rows(arm, external, steps, float(ticks[-1]) / 10**TIME_DIGITS)


def _urscript(head: list[str], rows: _Rows) -> str:
    """`servoj` at a fixed period."""
    first, *others = [f"[{', '.join(row)}]" for row in rows.arm]
    rest = f"0, 0, {SERVO:g}, {LOOKAHEAD:g}, {GAIN}"
    body = [
        f"movej({first}, a=0.5, v=0.2)",
        *(f"servoj({point}, {rest})" for point in others),
        "stopj(2.0)",
    ]
    lines = [f"# {line}" for line in head]
    lines += ["def coverable_path():", *(f"  {line}" for line in body), "end", "coverable_path()"]
    return "\n".join(lines) + "\n"


def _rapid(head: list[str], rows: _Rows) -> str:
    """`MoveAbsJ` with times in place of speeds, corners as small as there are."""
    points = []
    for arm, external in zip(rows.arm, rows.external, strict=True):
        extra = [*external, *[UNUSED] * (6 - len(external))]
        points.append(f"[[{','.join(arm)}],[{','.join(extra)}]]")
    last = len(rows.steps) - 1
    body = [f"MoveAbsJ {points[0]},v50,fine,tool0;"]
    for k, (point, step) in enumerate(zip(points[1:], rows.steps, strict=True)):
        zone = "fine" if k == last else "z0"
        body.append(f"MoveAbsJ {point},v1000\\T:={step:.{TIME_DIGITS}f},{zone},tool0;")
    lines = ["MODULE CoverablePath", *(f"  ! {line}" for line in head), "  PROC coverable_path()"]
    lines += [f"    {line}" for line in body]
    return "\n".join([*lines, "  ENDPROC", "ENDMODULE"]) + "\n"


def _krl(head: list[str], rows: _Rows, name: str) -> str:
    """One joint spline with its times: shares in percent."""
    points = []
    for arm, external in zip(rows.arm, rows.external, strict=True):
        named = [f"A{k + 1} {value}" for k, value in enumerate(arm)]
        named += [f"{axis} {value}" for axis, value in zip(KRL.external, external, strict=False)]
        points.append(f"{{{', '.join(named)}}}")
    lines = ["&ACCESS RVP", f"DEF {name}()", *(f"; {line}" for line in head)]
    lines += ["BAS(#INITMOV, 0)", "BAS(#VEL_PTP, 10)", f"PTP {points[0]}"]
    if rows.steps:
        lines += ["PTP_SPLINE", "  TIME_BLOCK START"]
        for point, step in zip(points[1:], rows.steps, strict=True):
            lines += [f"  SPTP {point}", f"  TIME_BLOCK PART = {100 * step / rows.duration:.8f}"]
        lines += [f"  TIME_BLOCK END = {rows.duration:.{TIME_DIGITS}f}", "ENDSPLINE"]
    return "\n".join([*lines, "END"]) + "\n"
