"""Points as the text of a program: URScript, RAPID and KRL, a file each.

URScript is given positions at a fixed period; RAPID and KRL are given the samples themselves, each
with its time. How a controller goes from point to point is its own affair: the nearer the points,
the less it matters.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from feasibility.programs.controllers import KRL

SERVO = 0.008  # [s], a whole number of cycles of every UR controller (2 ms and 8 ms)
LOOKAHEAD, GAIN = 0.1, 300  # [s], [1]: of servoj, its defaults
FUNCTION_LINES = 300  # of a function of URScript
UNUSED = "9E9"  # what RAPID calls an external axis that is not there


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
    lines: dict[int, list[str]]
    """Those that switch the tool, by the number of the point at which they do."""

    def at(self, point: int) -> list[str]:
        """The lines that switch the tool at a point."""
        return self.lines.get(point, [])


def urscript(head: Sequence[str], points: Points, name: str) -> dict[str, str]:
    """`servoj` at a fixed period."""
    del name
    first, *others = [f"[{', '.join(row)}]" for row in points.arm]
    rest = f"0, 0, {SERVO:g}, {LOOKAHEAD:g}, {GAIN}"
    moves = [*points.at(0)]
    for k, point in enumerate(others, start=1):
        moves += [f"servoj({point}, {rest})", *points.at(k)]
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
    body = [f"MoveAbsJ {targets[0]},v50,fine,tool0;", *points.at(0)]
    for k, step in enumerate(points.steps, start=1):
        zone = "fine" if k == last else "z0"
        body += [f"MoveAbsJ {targets[k]},v1000\\T:={step},{zone},tool0;", *points.at(k)]
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
        return {"": _text([*lines, *points.at(0), "END"])}
    lines += ["PTP_SPLINE", "  TIME_BLOCK START"]
    lines += [f"  TRIGGER WHEN PATH=0 ONSTART DELAY=0 DO {line}" for line in points.at(0)]
    for k, step in enumerate(points.steps, start=1):
        lines += [f"  TRIGGER WHEN PATH=0 DELAY=0 DO {line}" for line in points.at(k)]
        share = 100.0 * float(step) / points.duration
        lines += [f"  SPTP {targets[k]}", f"  TIME_BLOCK PART = {share:.8f}"]
    lines += [f"  TIME_BLOCK END = {points.duration:.{KRL.time_digits}f}", "ENDSPLINE"]
    return {"": _text([*lines, "END"])}


def _text(lines: Sequence[str]) -> str:
    return "\n".join(lines) + "\n"
