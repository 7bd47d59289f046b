"""Why cells are missed, and what to try about it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from coverable.errors import counted
from feasibility.cases.surface_reading import OWN_KEYS
from feasibility.verdict import Answer, Cause, CauseKind, Verdict
from surfaces.cells import Cells

DETAILS = 3  # cells of one group whose details are listed
JSON_HINT = " (--json lists all)"  # of commands, behind what is left out
CAUSES = {
    CauseKind.OUT_OF_REACH: "out of reach",
    CauseKind.JOINT_LIMITS: "joint limits",
    CauseKind.ORIENTATION: "orientation (the tool cannot be held as required)",
    CauseKind.COLLISION: "collision",
    CauseKind.DISCONNECTED: "reachable, but not by the motion that covers the rest",
}


def causes_listed(missed: Iterable[Cause], cells: Cells, hint: str = JSON_HINT) -> Iterator[str]:
    """Causes grouped by kind, the largest group first, with the first few details."""
    groups: dict[tuple[CauseKind, bool], list[Cause]] = {}
    for cause in missed:
        groups.setdefault((cause.kind, cause.proved), []).append(cause)
    for (kind, proved), causes in sorted(groups.items(), key=lambda item: -len(item[1])):
        yield f"  {counted(len(causes), 'cell')}: {CAUSES[kind]}{', proved' if proved else ''}"
        for cause in causes[:DETAILS]:
            yield f"    {list(cells.unravel(cause.cell))} {cause.detail}".rstrip()
        if len(causes) > DETAILS:
            yield f"    ... and {len(causes) - DETAILS:,} more{hint}"


def hints_of(verdict: Verdict) -> list[str]:
    """What to try next where no motion was found."""
    hints = []
    if not verdict.task.cone_deg > 0.0:
        hints.append("--set task.cone_deg=1 gives the tool axis a tolerance")
    elif verdict.answer is Answer.UNDECIDED and "time limit" in verdict.message:
        hints.append("--set search.time_limit=... gives the search more time")
    elif verdict.answer is Answer.UNDECIDED and "limit of evaluations" in verdict.message:
        hints.append("--set search.evaluations=... lets the search try more")
    elif verdict.method == "greedy":
        hints.append("--set search.method=complete searches all postures of the arm")
        hints.append("--set search.moves=all lets several joints move at once")
    if verdict.method == "complete" and verdict.answer is Answer.INFEASIBLE:
        hints.append("coverable explain, with the same case, finds what would make it feasible")
        if verdict.covered.any():
            hints.append("coverable divide finds the fewest motions that cover what can be covered")
    kinds = {cause.kind for cause in verdict.causes}
    if kinds & {CauseKind.OUT_OF_REACH, CauseKind.JOINT_LIMITS}:
        hints.append("--set 'surface.position=[x, y, z]' moves the surface nearer to the arm")
    if CauseKind.JOINT_LIMITS in kinds:
        hints.append("--set robot.limits=... tries other joint limits (`coverable robots NAME`)")
    if CauseKind.ORIENTATION in kinds and verdict.task.cone_deg > 0.0:
        hints.append(f"--set task.cone_deg=... opens the cone ({verdict.task.cone_deg:g} now)")
        if verdict.task.roll is not None and verdict.task.roll_deg is not None:
            now = "{:g} to {:g} now".format(*verdict.task.roll_deg)
            hints.append(f"--set 'task.roll_deg=[..., ...]' widens the range of the roll ({now})")
    if CauseKind.DISCONNECTED in kinds:
        hints.append(f"{_narrower(verdict)} leaves out cells that need a second motion")
    shows = "it" if verdict.covered.all() else "which cells are missed"
    hints.append(f"--html view.html shows {shows}")
    return hints


def _narrower(verdict: Verdict) -> str:
    """The keys of a case that select a part of its surface."""
    kind = verdict.cells.surface.kind
    own = OWN_KEYS.get(kind, ())
    ranges = [f"surface.{key}" for key in ("u_deg", "u", "v_deg", "v") if key in own]
    if ranges:
        return f"a narrower {' or '.join(ranges)}"
    if kind == "piecewise":
        return "a narrower or smaller choice of surface.pieces"
    if kind in ("grid", "poses", "parametric"):
        return {"poses": "a part of the poses", "grid": "a part of the grid"}.get(
            kind, "a narrower u or v"
        )
    return "a part of it (surface.box, cut, facing or faces)"
