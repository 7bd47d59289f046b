"""What is missed, of the cells and of the area to be treated, and what to try about it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from coverable.errors import counted
from feasibility.cases.case import Case
from feasibility.cases.surface_reading import OWN_KEYS
from feasibility.demands.treated_words import share_words, treated_words
from feasibility.verdict import Answer, Cause, CauseKind, Verdict
from surfaces.cells import Cells

ENOUGH = 0.99  # [1] share of the area, below which it is said how to treat more
OVERLAPPING = 0.9  # [1] of the footprint: passes that far apart leave nothing between them
FEASIBLE_CELLS = "feasible: one continuous motion visits every cell"
SHORT = "a motion visits every cell, but it is not shown to treat enough of the area"
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


@dataclass(frozen=True)
class Treating:
    """A verdict of a task with a footprint."""

    verdict: Verdict

    @property
    def falls_short(self) -> bool:
        """Does a motion that visits every cell treat too little of the area?"""
        return self.verdict.treated is not None and self.verdict.answer is Answer.UNDECIDED

    def sentence(self, sentence: str) -> str:
        """How much of the area the motion treats, in place of the sentence about the cells."""
        task, treated = self.verdict.task, self.verdict.treated
        if treated is None:
            unknown = f"{FEASIBLE_CELLS}; what it treats is not measured."
            return unknown if self.verdict.feasible else sentence
        treats = f"treats {share_words(treated)} of the area"
        if not self.falls_short:
            return f"{FEASIBLE_CELLS} and {treats}."
        share = "" if task.coverage is None else f", where {100.0 * task.coverage:g} % is required"
        return f"undecided: one continuous motion visits every cell and {treats}{share}."

    def evidence(self, evidence: str) -> str:
        """What the answer rests on."""
        return SHORT if self.falls_short else evidence

    def text(self) -> str:
        """What the motion treats."""
        if self.verdict.treated is not None:
            return treated_words(self.verdict.treated)
        if not self.verdict.feasible:
            return ""
        return "not measured: " + (
            "the greedy search's motion need not pass the cells' centres"
            if self.verdict.method == "greedy"
            else "the time limit ran out"
        )

    def hints(self, case: Case) -> list[str]:
        """What would treat more of the area; nothing where enough is treated."""
        task, treated = self.verdict.task, self.verdict.treated
        if treated is None or task.disc is None:
            return []
        if treated.lower >= (ENOUGH if task.coverage is None else task.coverage):
            return []
        surface, hints = case.surface, []
        if surface.kind == "piecewise":
            hints.append(
                'cells = "auto" in each of surface.pieces cuts cells as fine as the footprint'
            )
        elif not surface.automatic:
            sized = "" if surface.values.get("cell_size") is None else "--set surface.cell_size= "
            hints.append(f"{sized}--set surface.cells=auto cuts cells as fine as the footprint")
        pitch = f"{OVERLAPPING * task.disc[1]:.2g}"
        hints.append(
            f"coverable path --passes best --pitch {pitch}, with the same case, runs passes that "
            "close"
        )
        if task.coverage is None:
            hints.append(f"--set task.coverage={ENOUGH:g} calls nothing feasible that treats less")
        return hints
