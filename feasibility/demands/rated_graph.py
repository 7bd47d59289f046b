"""The motions that a verdict knows, each with the speed and the singular values it allows.

More motions are made from cell to cell, from every known configuration, whatever the required
speed: so what is found at one speed is found at every lower one, too.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from feasibility.clock import Clock
from feasibility.demands.motion_rates import MotionRates, motion_rates
from feasibility.paths.motion_graph import MotionGraph, join_self_motions, motion_graph_of, step_to
from feasibility.task import Task
from feasibility.verdict import Verdict
from robots.robot import Robot
from surfaces.cells import Cells

Edge = tuple[int, int]
"""Two nodes, the lower index first."""

MOST_STEPS = 20_000  # attempts from a configuration to a cell beside it


@dataclass
class RatedGraph:
    """Nodes, motions, and what they allow."""

    robot: Robot
    cells: Cells
    task: Task
    graph: MotionGraph
    rated: dict[Edge, MotionRates] = field(default_factory=dict)

    def rate(self) -> None:
        """Rate the motions that are not yet rated, all at once."""
        new = [(min(x, y), max(x, y)) for x, y in self.graph.edges.edges]
        new = [edge for edge in new if edge not in self.rated]
        if not new:
            return
        motions = [np.asarray(self.graph.motion(*edge)) for edge in new]
        found = motion_rates(self.robot, self.cells, self.task, motions)
        self.rated |= zip(new, found, strict=True)

    @property
    def begin(self) -> int | None:
        """The node that a motion has to begin at; None where the arm has no start."""
        start = self.robot.start
        if start is None:
            return None
        return int(np.argmin([np.abs(q - start).max() for q in self.graph.q]))

    def holding(self, speed: float) -> list[Edge]:
        """The motions that allow a speed (m/s), and the singular values that the task requires."""
        sigma = self.task.min_manipulability or -np.inf
        return [e for e, r in self.rated.items() if r.speed >= speed and r.sigma >= sigma]

    @property
    def enough(self) -> list[Edge]:
        """The motions that hold what the task requires."""
        return self.holding(self.task.speed or -np.inf)

    def fastest_to_cells(self, edges: Iterable[Edge]) -> dict[int, Edge]:
        """The fastest of some motions to each cell that they lead to."""
        best = dict[int, Edge]()
        for edge in edges:
            for cell in {self.graph.cell[node] for node in edge}:
                if cell not in best or self.rated[edge].speed > self.rated[best[cell]].speed:
                    best[cell] = edge
        return best

    def fault(self, edge: Edge, where: str = "") -> str:
        """Why a motion does not hold what the task requires; `where` as in `MotionRates.fault`."""
        return self.rated[edge].fault(self.robot, self.task, where)


def rated_graph(verdict: Verdict) -> RatedGraph:
    """The motions of a verdict of the complete search, rated."""
    graph = RatedGraph(verdict.robot, verdict.cells, verdict.task, motion_graph_of(verdict))
    graph.rate()
    return graph


def grow(rated: RatedGraph, clock: Clock) -> None:
    """Make more motions from every known configuration to the cells beside it, and over its own.

    Raises:
        OutOfTime: the deadline passed; what was made until then is rated.
    """
    graph, left = rated.graph, MOST_STEPS
    neighbours = rated.cells.neighbours
    try:
        for x, over in enumerate(list(graph.cell)):
            clock.tick(0, None, "looking for faster motions")
            join_self_motions(graph, x)
            beside = np.unique(neighbours.of(over)).tolist()
            for cell in beside:
                step_to(graph, x, cell)
            left -= len(beside)
            if left <= 0:
                break
    finally:
        rated.rate()
