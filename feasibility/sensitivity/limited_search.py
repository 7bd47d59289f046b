"""A search with a ration, and what it came to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from feasibility.clock import OutOfTime
from feasibility.roadmap import NODES, Exploration, SearchArrays
from feasibility.verdict import Answer, Evidence, Walk

LEAST = 100  # evaluations between two looks at the ration


@dataclass
class Rationed(Exploration):
    """An exploration that stops after a number of evaluations of the arm, whatever the clock."""

    most: float = np.inf

    def tick(self, text: str) -> None:
        """Stop when the ration is used up.

        Raises:
            OutOfTime: it is, or the deadline has passed.
        """
        super().tick(text)
        if self.work.counts[0] > self.most:
            raise OutOfTime

    def before_next_look(self) -> int:
        """No more than is left of the ration; see `Exploration.before_next_look`."""
        left = self.most - float(self.work.counts[0])
        return int(min(super().before_next_look(), max(left, LEAST)))

    def add_seeds(self, cell: int, guesses: NDArray[np.float64]) -> int:
        """Plant, unless the ration is used up; see `Exploration.add_seeds`."""
        self.tick("looking for configurations")
        return super().add_seeds(cell, guesses)


@dataclass(frozen=True, eq=False, slots=True)
class Trial:
    """What a search came to."""

    answer: Answer
    evidence: Evidence
    detail: str
    q: NDArray[np.float64]
    """(N, n) a configuration of the best component over each cell; NaN where it has none."""
    walk: Walk | None
    """A covering motion; None unless feasible."""
    angle: float | None = None
    """rad, the replay's bound on the angle between tool axis and approach direction along the walk;
    None until the replay has seen it. Until then the trial leads on, and is not told to anyone."""

    @property
    def found(self) -> bool:
        """True with a covering motion."""
        return self.walk is not None


def configurations(exploration: Exploration) -> NDArray[np.float64]:
    """(N, n) a configuration of the best component over each cell; NaN where it has none."""
    roadmap = exploration.roadmap
    q = np.full((len(exploration.cells), exploration.robot.n), np.nan)
    nodes = np.arange(roadmap.counters[NODES])[::-1]  # the first one over a cell is written last
    root = roadmap.component[nodes]
    while not np.array_equal(roadmap.parent[root], root):
        root = roadmap.parent[root]
    mine = nodes[np.equal(root, exploration.best)]
    q[roadmap.cell[mine]] = roadmap.q[mine]
    return q


def certifiable(problem: SearchArrays) -> bool:
    """Could a motion be certified everywhere, if there were one?

    Not in a cone of 0 degrees, where the offset surface folds, or where the surface is known less
    well than the task asks for.
    """
    smooth = bool(np.isfinite(problem.derivative_bounds).all())
    known = bool((problem.deviations < (problem.tolerance, problem.cone_chord)).all())
    return smooth and known and problem.cone_chord > 0.0
