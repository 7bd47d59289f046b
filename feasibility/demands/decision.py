"""What a demanded coverage makes of an answer."""

from typing import TYPE_CHECKING

from feasibility.demands.treated_words import share_words
from feasibility.task import Task
from feasibility.verdict import Answer, Decision, Evidence

if TYPE_CHECKING:
    from feasibility.demands.area import TreatedArea

NOT_MEASURED = "No motion along which the treated area could be measured is known."


def with_coverage(decision: Decision, task: Task, found: "TreatedArea | None") -> Decision:
    """A feasible answer remains only where enough of the area is treated for certain.

    Nothing follows from one motion that treats too little: another may treat more. And a cell
    whose centre cannot be reached may be treated from beside it. So a coverage that falls short
    makes the answer undecided, never infeasible; what is proved of the cells stays proved.
    """
    if task.coverage is None or decision.answer is not Answer.FEASIBLE:
        return decision
    short = shortfall(task, found)
    if short or found is None:
        message = f"{decision.message} {short[0].upper()}{short[1:]}"
        return Decision(Answer.UNDECIDED, Evidence.BUDGET, message)
    words = f"It treats {share_words(found)} of the area; {100.0 * task.coverage:g} % is required."
    return decision._replace(message=f"{decision.message} {words}")


def shortfall(task: Task, found: "TreatedArea | None") -> str:
    """What is missing of the coverage that a task requires; empty where nothing is."""
    if task.coverage is None or (found is not None and found.lower >= task.coverage):
        return ""
    if found is None:
        return NOT_MEASURED
    return (
        f"it treats {share_words(found)} of the area, and {100.0 * task.coverage:g} % is required: "
        + ("more splitting may show it." if found.upper >= task.coverage else "that is too little.")
        + ' Finer cells, such as surface.cells = "auto", or passes that are closer treat more.'
    )
