"""Points as the texts of programs, in the five languages.

URScript is given positions at a fixed period; the others are given the samples themselves, each
with its time. How a controller goes from point to point is its own affair: the nearer the points,
the less it matters. TP and INFORM have positions in a list of their own, and numbered lines; as a
controller holds so many in a program, a long motion becomes several, which a main one calls.
"""

import textwrap
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

from feasibility.programs.controllers import KRL

SERVO = 0.008  # [s], a whole number of cycles of every UR controller (2 ms and 8 ms)
LOOKAHEAD, GAIN = 0.1, 300  # [s], [1]: of servoj, its defaults
FUNCTION_LINES = 300  # of a function of URScript
UNUSED = "9E9"  # what RAPID calls an external axis that is not there
REMARK = 30  # characters of a comment in either, of 32
MOST_TP = 9000  # points of a program; controllers hold some 32,000 lines
MOST_INFORM = 900  # the older controllers (NX100) count 999 steps
FASTEST, SLOWEST = 100.0, 0.01  # [%] of VJ
TP_ATTRIBUTES = """/ATTR
OWNER\t\t= MNEDITOR;
COMMENT\t\t= "coverable";
LINE_COUNT\t= {lines};
PROTECT\t\t= READ_WRITE;
TCD:  STACK_SIZE\t= 0,
      TASK_PRIORITY\t= 50,
      TIME_SLICE\t= 0,
      BUSY_LAMP_OFF\t= 0,
      ABORT_REQUEST\t= 0,
      PAUSE_REQUEST\t= 0;
DEFAULT_GROUP\t= 1,*,*,*,*;
CONTROL_CODE\t= 00000000 00000000;
/MN"""


@dataclass(frozen=True, slots=True)
class Points:
    """Points of a program."""

    arm: list[list[str]]
    """Six numbers each."""
    external: list[list[str]]
    steps: list[str]
    """s, from each point to the next."""
    shares: list[float]
    """How much of its largest velocity the quickest axis takes from each point to the next."""
    duration: float
    """s."""
    at: defaultdict[int, list[str]]
    """Lines that switch the tool, by the number of the point at which they do."""


def urscript(head: Sequence[str], points: Points, name: str) -> dict[str, str]:
    """`servoj` at a fixed period."""
    del name
    first, *others = [f"[{', '.join(row)}]" for row in points.arm]
    rest = f"0, 0, {SERVO:g}, {LOOKAHEAD:g}, {GAIN}"
    moves = [*points.at[0]]
    for k, point in enumerate(others, start=1):
        moves += [f"servoj({point}, {rest})", *points.at[k]]
    parts = [moves[k : k + FUNCTION_LINES] for k in range(0, len(moves), FUNCTION_LINES)]
    body, calls = list[str](), list[str]()
    for number, part in enumerate(parts, start=1):
        body += [f"def part_{number}():", *(f"  {line}" for line in part), "end"]
        calls.append(f"part_{number}()")
    body += [f"movej({first}, a=0.5, v=0.2)", *calls, "stopj(2.0)"]
    lines = [f"# {line}" for line in head]
    lines += ["def coverable_path():", *(f"  {line}" for line in body), "end", "coverable_path()"]
    return {"": _text(lines)}


def rapid(head: Sequence[str], points: Points, name: str) -> dict[str, str]:
    """`MoveAbsJ` with times in place of speeds, corners as small as there are."""
    del name
    targets = []
    for arm, external in zip(points.arm, points.external, strict=True):
        extra = [*external, *[UNUSED] * (6 - len(external))]
        targets.append(f"[[{','.join(arm)}],[{','.join(extra)}]]")
    last = len(points.steps)
    body = [f"MoveAbsJ {targets[0]},v50,fine,tool0;", *points.at[0]]
    for k, step in enumerate(points.steps, start=1):
        zone = "fine" if k == last else "z0"
        body += [f"MoveAbsJ {targets[k]},v1000\\T:={step},{zone},tool0;", *points.at[k]]
    lines = ["MODULE CoverablePath", *(f"  ! {line}" for line in head), "  PROC coverable_path()"]
    lines += [f"    {line}" for line in body]
    return {"": _text([*lines, "  ENDPROC", "ENDMODULE"])}


def krl(head: Sequence[str], points: Points, name: str) -> dict[str, str]:
    """One joint spline with its times: shares in percent.

    A spline holds no other instructions than triggers, which act at the end of the motion that they
    stand before, or at its start.
    """
    targets = []
    for arm, external in zip(points.arm, points.external, strict=True):
        named = [f"A{k + 1} {value}" for k, value in enumerate(arm)]
        named += [f"{axis} {value}" for axis, value in zip(KRL.external, external, strict=False)]
        targets.append(f"{{{', '.join(named)}}}")
    lines = ["&ACCESS RVP", f"DEF {name}()", *(f"; {line}" for line in head)]
    lines += ["BAS(#INITMOV, 0)", "BAS(#VEL_PTP, 10)", f"PTP {targets[0]}"]
    if not points.steps:
        return {"": _text([*lines, *points.at[0], "END"])}
    lines += ["PTP_SPLINE", "  TIME_BLOCK START"]
    lines += [f"  TRIGGER WHEN PATH=0 ONSTART DELAY=0 DO {line}" for line in points.at[0]]
    for k, step in enumerate(points.steps, start=1):
        lines += [f"  TRIGGER WHEN PATH=0 DELAY=0 DO {line}" for line in points.at[k]]
        share = 100.0 * float(step) / points.duration
        lines += [f"  SPTP {targets[k]}", f"  TIME_BLOCK PART = {share:.8f}"]
    lines += [f"  TIME_BLOCK END = {points.duration:.{KRL.time_digits}f}", "ENDSPLINE"]
    return {"": _text([*lines, "END"])}


def tp(head: Sequence[str], points: Points, name: str) -> dict[str, str]:
    """Joint moves with times in ms, which a .LS file holds as text (option ASCII upload)."""
    programs = dict[str, str]()
    for ending, numbers in _parts(points, MOST_TP):
        lines = [f"  !{line}" for line in _remarks(head, ending)]
        lines += ["  UFRAME_NUM=0", "  UTOOL_NUM=1"] if ending in ("", "_p1") else []
        positions = list[str]()
        for number, point in enumerate(numbers, start=1):
            speed = "5% FINE"  # how fast a point is gone to, and whether the arm stops there
            if point:
                stop = "FINE" if point == len(points.steps) else "CNT100"
                speed = f"{round(1e3 * float(points.steps[point - 1]))}msec {stop}"
            lines.append(f"J P[{number}] {speed}")
            lines += [f"  {line.strip().rstrip(';').rstrip()}" for line in points.at[point]]
            rows = [
                ",\t".join(f"J{k}= {points.arm[point][k - 1]} deg" for k in row)
                for row in ((1, 2, 3), (4, 5, 6))
            ]
            joined = ",\n\t".join(rows)
            positions.append(f"P[{number}]{{\n   GP1:\n\tUF : 0, UT : 1,\n\t{joined}\n}};")
        programs[ending] = _tp_text(f"{name}{ending}".upper(), lines, positions)
    if len(programs) > 1:
        calls = [f"  CALL {f'{name}{ending}'.upper()}" for ending in programs]
        lines = [f"  !{line}" for line in _remarks(head, "")]
        programs[""] = _tp_text(name.upper(), [*lines, *calls], [])
    return programs


def _tp_text(name: str, lines: Sequence[str], positions: Sequence[str]) -> str:
    """A program of numbered lines."""
    numbered = [f"{number:4d}:{line} ;" for number, line in enumerate(lines, start=1)]
    attributes = TP_ATTRIBUTES.format(lines=len(lines))
    return _text([f"/PROG  {name}", attributes, *numbered, "/POS", *positions, "/END"], "\r\n")


def inform(head: Sequence[str], points: Points, name: str) -> dict[str, str]:
    """Joint moves at shares of the axes' largest speeds, positions in pulses."""
    programs = dict[str, str]()
    for ending, numbers in _parts(points, MOST_INFORM):
        lines = [f"'{line}" for line in _remarks(head, ending)]
        for number, point in enumerate(numbers):
            speed = "VJ=5.00 PL=0"  # the share (%) of the quickest axis' largest; stops with PL=0
            if point:
                share = min(max(100.0 * points.shares[point - 1], SLOWEST), FASTEST)
                speed = f"VJ={share:.2f}" + " PL=0" * (point == len(points.steps))
            lines.append(f"MOVJ C{number:05d} {speed}")
            lines += [line.strip() for line in points.at[point]]
        rows = [f"C{k:05d}={','.join(points.arm[point])}" for k, point in enumerate(numbers)]
        programs[ending] = _job(f"{name}{ending}".upper(), rows, lines)
    if len(programs) > 1:
        calls = [f"CALL JOB:{f'{name}{ending}'.upper()}" for ending in programs]
        lines = [f"'{line}" for line in _remarks(head, "")]
        programs[""] = _job(name.upper(), [], [*lines, *calls])
    return programs


def _job(name: str, rows: Sequence[str], lines: Sequence[str]) -> str:
    """A job with positions in pulses."""
    kind = ["///TOOL 0", "///POSTYPE PULSE", "///PULSE", *rows] if rows else []
    top = ["/JOB", f"//NAME {name}", "//POS", f"///NPOS {len(rows)},0,0,0,0,0", *kind]
    date = f"///DATE {datetime.now():%Y/%m/%d %H:%M}"
    top += ["//INST", date, "///COMM coverable", "///ATTR SC,RW", "///GROUP1 RB1", "NOP"]
    return _text([*top, *lines, "END"], "\r\n")


def _parts(points: Points, most: int) -> list[tuple[str, range]]:
    """Numbers of points for each program, and what its name ends in."""
    count = len(points.arm)
    if count <= most:
        return [("", range(count))]
    starts = range(0, count, most)
    return [(f"_p{k}", range(a, min(a + most, count))) for k, a in enumerate(starts, start=1)]


def _remarks(head: Sequence[str], ending: str) -> list[str]:
    """The comment in short lines; that of one part of several stands in the main program."""
    text = ["A part of the program with this name but for its number."] if ending else head
    lines = [part for line in text for part in textwrap.wrap(line, REMARK)]
    return [line.replace(";", ",") for line in lines]


def _text(lines: Sequence[str], end: str = "\n") -> str:
    """With the ends of lines that a controller writes itself."""
    return end.join("\n".join(lines).split("\n")) + end
