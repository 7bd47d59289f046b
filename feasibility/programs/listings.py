"""Points as FANUC's TP and Yaskawa's INFORM: positions in a list of their own, and numbered lines.

Both controllers hold so many lines in a program, so that a long motion becomes several, which a
main program calls in their order.
"""

import textwrap
from collections.abc import Sequence
from datetime import datetime

from feasibility.programs.motions import Points

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


def tp(head: Sequence[str], points: Points, name: str) -> dict[str, str]:
    """Joint moves with times in ms, which a .LS file holds as text (option ASCII upload)."""
    programs = dict[str, str]()
    for ending, numbers in _parts(points, MOST_TP):
        lines = [f"  !{line}" for line in _remarks(head, ending)]
        lines += ["  UFRAME_NUM=0", "  UTOOL_NUM=1"] if ending in ("", "_p1") else []
        positions = list[str]()
        for number, point in enumerate(numbers, start=1):
            lines.append(f"J P[{number}] {_tp_speed(points, point)}")
            lines += [f"  {line.strip().rstrip(';').rstrip()}" for line in points.at(point)]
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
    return _text([f"/PROG  {name}", attributes, *numbered, "/POS", *positions, "/END"])


def _tp_speed(points: Points, point: int) -> str:
    """How fast a point is gone to, and whether the arm stops there."""
    if point == 0:
        return "5% FINE"
    stop = "FINE" if point == len(points.steps) else "CNT100"
    return f"{round(1e3 * float(points.steps[point - 1]))}msec {stop}"


def inform(head: Sequence[str], points: Points, name: str) -> dict[str, str]:
    """Joint moves at shares of the axes' largest speeds, positions in pulses."""
    programs = dict[str, str]()
    for ending, numbers in _parts(points, MOST_INFORM):
        lines = [f"'{line}" for line in _remarks(head, ending)]
        for number, point in enumerate(numbers):
            lines.append(f"MOVJ C{number:05d} {_vj(points, point)}")
            lines += [line.strip() for line in points.at(point)]
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
    return _text([*top, *lines, "END"])


def _vj(points: Points, point: int) -> str:
    """The share (%) of the quickest axis' largest speed, and whether the arm stops there."""
    if point == 0:
        return "VJ=5.00 PL=0"
    share = min(max(100.0 * points.shares[point - 1], SLOWEST), FASTEST)
    return f"VJ={share:.2f}" + " PL=0" * (point == len(points.steps))


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


def _text(lines: Sequence[str]) -> str:
    """With the ends of lines that these controllers write themselves."""
    return "\r\n".join("\n".join(lines).split("\n")) + "\r\n"
