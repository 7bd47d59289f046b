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

    def between(dry: int) -> bool:
        if not exploration.apart:
            return False
        if dry == FIRST:
            return proved(FEW_BOXES)
        if dry == SECOND:
            return proved(MORE_BOXES) or refine(exploration, task, COARSE)
        if dry == THIRD:
            before = exploration.sizes()
            restart(exploration)
            return exploration.sizes() != before or proved(MORE_BOXES)
        if dry == LAST:
            return refine(exploration, task, FINE) or proved(MORE_BOXES)
        return False

    return between
