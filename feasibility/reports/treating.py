"""What a report of a verdict says of the area that its motion treats."""

from __future__ import annotations

from dataclasses import dataclass

from feasibility.cases.case import Case
from feasibility.treated.treated_words import share_words, treated_words
from feasibility.verdict import Answer, Verdict

ENOUGH = 0.99  # [1] share of the area, below which it is said how to treat more
OVERLAPPING = 0.9  # [1] of the footprint: passes that far apart leave nothing between them
FEASIBLE_CELLS = "feasible: one continuous motion visits every cell"
SHORT = "a motion visits every cell, but it is not shown to treat enough of the area"


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
