"""The complete search: does one component of the roadmap cover every cell?

In this order, because each step (of the list in `feasibility`) is much cheaper than the next:

6. Seed a pivot cell in the middle, and spread each seed at once into the cells that its component
   does not cover yet. Most feasible cases end here.
7. and 8. Where that does not do, more is tried, in `rounds.py`; which is loaded then.

A verdict with a witness or a proof does not depend on the order or on chance; without either the
verdict is "exhausted", and its message says what was tried.
"""

from typing import Any

import numpy as np

from feasibility.clock import Clock
from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.motions.search_arrays import arrays_of
from feasibility.roadmap.motions.self_motion import margin_shares
from feasibility.task import Task
from robots.robot import Robot
from surfaces.cells import Cells

PIVOT_SEEDS = 8


def exploration_of(
    robot: Robot,
    cells: Cells,
    task: Task,
    seed: int,
    clock: Clock | None = None,
    searched: Task | None = None,
    tried: dict[Any, Any] | None = None,
) -> Exploration:
    """An exploration that has not begun, with proofs that collisions keep the arm from cells.

    Args:
        robot, cells, task, seed, clock: of the search.
        searched: the task that it keeps to, where that is narrower than `task`.
        tried: of an attempt before, with links of other shapes; what is tried now is added.

    Raises:
        OutOfTime: the deadline passed.
    """
    clock = Clock() if clock is None else clock
    with clock.enforced():
        arrays = arrays_of(robot, cells, task if searched is None else searched)
    blockers = None
    if len(arrays.collisions):
        from feasibility.roadmap.blockers import blockers_of

        blockers = blockers_of(robot, cells, task, tried)
    return Exploration(robot, cells, arrays, seed, clock, blockers)


def seed_middle(exploration: Exploration) -> bool:
    """Step 6; True when one component covers every cell.

    Raises:
        OutOfTime: the deadline passed; the exploration holds what was found until then.
    """
    if len(exploration.cells) == 0:
        return True
    pivot = exploration.cells.middle
    exploration.tick("looking for configurations")
    guesses = exploration.guesses(PIVOT_SEEDS)
    margins = margin_shares(exploration.arrays, exploration.work, pivot, guesses)
    # The one with the largest margin first: it is the least likely to get stuck.
    for k in np.argsort(-margins, kind="stable"):
        if margins[k] >= 0.0:
            exploration.add_seeds(pivot, guesses[k : k + 1])
        if exploration.complete:
            return True
    return False
