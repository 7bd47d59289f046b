"""What a demanded coverage makes of an answer."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from feasibility.task import Task
from feasibility.treated.words import share_words
from feasibility.verdict import Answer, Evidence

if TYPE_CHECKING:
    from feasibility.treated.area import TreatedArea

NOT_MEASURED = "No motion along which the treated area could be measured is known."


class Decision(NamedTuple):
    """An answer, its evidence and the sentences about it."""

    answer: Answer
    evidence: Evidence
    message: str


def with_coverage(decision: Decision, task: Task, found: TreatedArea | None) -> Decision:
    """A feasible answer remains only where enough of the area is treated for certain.

    Nothing follows from one motion that treats too little: another may treat more. And a cell
    whose centre cannot be reached may be treated from beside it. So a coverage that falls short
    makes the answer undecided, never infeasible; what is proved of the cells stays proved.
    """
    if task.coverage is None or decision.answer is not Answer.FEASIBLE:
        return decision
    if found is None:
        return Decision(Answer.UNDECIDED, Evidence.BUDGET, f"{decision.message} {NOT_MEASURED}")
    required = f"{100.0 * task.coverage:g} %"
    if found.lower >= task.coverage:
        words = f"It treats {share_words(found)} of the area; {required} is required."
        return decision._replace(message=f"{decision.message} {words}")
    short = (
        f"It treats {share_words(found)} of the area, and {required} is required: "
        + ("more splitting may show it." if found.upper >= task.coverage else "that is too little.")
        + ' Finer cells, such as surface.cells = "auto", or passes that are closer treat more.'
    )
    return Decision(Answer.UNDECIDED, Evidence.BUDGET, f"{decision.message} {short}")
