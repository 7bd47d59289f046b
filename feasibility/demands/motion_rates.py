"""What motions allow: speed of the tool, and distance from singularities.

More motions than a verdict knows are made from cell to cell, from every known configuration,
whatever the required speed: so what is found at one speed is found at every lower one, too.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Mask
from feasibility.certification.motion_replay import replay
from feasibility.certification.rate_replay import RateReplay, in_place, replay_rates, too_slow
from feasibility.certification.segment_rates import segment_rates
from feasibility.clock import Clock
from feasibility.demands.every_demand import TOGETHER, further
from feasibility.paths.coverage import CoveragePath
from feasibility.paths.motion_graph import MotionGraph, join_self_motions, motion_graph_of, step_to
from feasibility.paths.order import PathError
from feasibility.task import Task
from feasibility.verdict import Certificate, Verdict, Walk
from robots.robot import Robot
from surfaces.cells import Cells


class MotionRates(NamedTuple):
    """What one motion allows."""

    speed: float
    """m/s, lower bound of what the tool may have all along, but where it waits; inf where it does
    not move."""
    sigma: float
    """Lower bound of the smallest singular value; inf where it was not requested."""
    sampled_sigma: float
    """Upper bound of it."""
    joint: int
    """The joint that allows no more speed."""
    most: float
    """m/s, upper bound of that speed."""

    def fault(self, robot: Robot, task: Task, where: str = "") -> str:
        """Why it does not hold what a task requires; empty where it does.

        That is the joint that is too slow, `where` (" at ...", or nothing), or the singular values.
        """
        if task.speed is not None and self.speed < task.speed:
            times = task.speed / self.most if self.most > 0.0 else np.inf
            return too_slow(robot, self.joint, times, where)
        least = task.min_manipulability
        if least is None or self.sigma >= least:
            return ""
        return f"singular values fall to {self.sampled_sigma:.3g} on the way; {least:g} is required"


def motion_rates(
    robot: Robot, cells: Cells, task: Task, motions: Sequence[Array]
) -> list[MotionRates]:
    """Rate motions of (m, n) rows, straight in joint space between them, all at once.

    The tool may wait over the centres of cells. Singular values are computed where the task limits
    them.
    """
    count = len(motions)
    if not count:
        return []
    q = np.vstack(motions)
    owner = np.repeat(np.arange(count), [len(motion) for motion in motions])
    inside = owner[:-1] == owner[1:]
    owner, resting = owner[:-1][inside], in_place(robot, cells, task, q)[inside]
    found = segment_rates(
        robot, q[:-1][inside], q[1:][inside],
        sigma=task.min_manipulability, group=owner, resting=resting,
    )  # fmt: skip
    speed, sigma, sampled, most = (np.full(count, np.inf) for _ in range(4))
    joint = np.zeros(count, dtype=np.int64)
    np.minimum.at(sigma, owner, found.sigma)
    np.minimum.at(sampled, owner, found.sampled_sigma)
    order = np.lexsort((found.speed, owner))
    moving, first = np.unique(owner[order], return_index=True)
    rows = order[first]
    speed[moving], joint[moving] = found.speed[rows], found.joint[rows]
    most[moving] = found.sampled_speed[rows]
    each = (column.tolist() for column in (speed, sigma, sampled, joint, most))
    return [MotionRates(*row) for row in zip(*each, strict=True)]


def replay_at_rates(
    robot: Robot, cells: Cells, task: Task, walk: Walk, needed: Mask
) -> tuple[Certificate, str]:
    """Replay a motion over the cells `needed` (N,), and judge all else that it has to hold alone.

    Returns:
        What was measured, and why the motion is refused; empty if it is accepted.
    """
    replayed = replay(robot, cells, task, walk, needed)
    refusal = replayed.refusal or further(robot, cells, task, [walk], TOGETHER).refusal
    return replayed.certificate, refusal


def path_rates(path: CoveragePath, walk: Walk | None = None) -> RateReplay | None:
    """The judge's answer about a path's motion; None where the task requires nothing.

    A path in an order of its own need not be as fast as the motion of the verdict. That is
    reported, not refused: timing runs it slower there. `walk` may be another motion over the same
    cells, such as the samples of its trajectory.

    Raises:
        PathError: singular values fall below what the task requires.
    """
    task = path.task
    if not task.requires_rates:
        return None
    replayed = replay_rates(path.robot, path.cells, task, path.walk if walk is None else walk)
    least = task.min_manipulability
    if least is not None and not replayed.sigma >= least:
        raise PathError(
            f"the {'path' if walk is None else 'timed path'} in this order comes too near to a "
            f"singularity: {replayed.faults[-1]}; try another --order"
        )
    return replayed


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
        return None if self.robot.start is None else self.graph.nearest(self.robot.start)

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
