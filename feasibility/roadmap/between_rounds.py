"""What is tried between rounds that gain nothing: proofs, finer cells, new starts.

In this order, because each costs more than the one before: a cut proof with few boxes after the
first round without gain; with more boxes, and then the surface in finer cells, after some; new
starts all over the surface and the last proof after more. Rounds go on where one of these gains.
"""

from __future__ import annotations

from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.proving import Proving
from feasibility.roadmap.refinement import COARSE, FINE, refine
from feasibility.roadmap.search import Between, restart
from feasibility.task import Task

FIRST, SECOND, THIRD, LAST = 1, 4, 8, 16  # rounds without gain
FEW_BOXES, MORE_BOXES = 20_000, 200_000


def between_rounds(exploration: Exploration, proving: Proving, task: Task) -> Between:
    """What to try after so many rounds without gain.

    Args:
        exploration: the search.
        proving: its proofs.
        task: the task that the search keeps to.
    """

    def proved(budget: int) -> bool:
        # Where a cell is proved uncoverable already, only more cells can be gained.
        return not exploration.proved and proving.attempt(budget)

    def between(dry: int) -> None:
        if not exploration.apart:
            return
        if dry == FIRST:
            proved(FEW_BOXES)
        elif dry == SECOND and not proved(MORE_BOXES):
            refine(exploration, task, COARSE)
        elif dry == THIRD:
            before = exploration.sizes()
            restart(exploration)
            if exploration.sizes() == before:
                proved(MORE_BOXES)
        elif dry == LAST and not refine(exploration, task, FINE):
            proved(MORE_BOXES)

    return between
