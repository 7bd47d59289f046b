"""The largest speed of the tool, and how near singularities a motion comes: figures to explain."""

from dataclasses import dataclass, replace

import numpy as np

from feasibility.certification.rate_replay import RateReplay, replay_rates
from feasibility.clock import Clock, OutOfTime
from feasibility.demands.rated_graph import RatedGraph, grow, rated_graph
from feasibility.demands.routes import covered
from feasibility.verdict import Verdict


@dataclass(frozen=True, eq=False, slots=True)
class RateFigures:
    """What the motions of a feasible verdict allow."""

    witness: RateReplay
    """Of the covering motion itself."""
    largest: float
    """m/s, the largest speed that a motion over all cells is known to hold."""


def rate_figures(
    verdict: Verdict, clock: Clock | None = None, more: bool = True
) -> RateFigures | None:
    """Look for the largest speed; None where the verdict has no motion.

    Where the joints have no velocity limits, it is inf.

    Args:
        verdict: a feasible one, of the complete search.
        clock: when its time is over, what is known by then is returned.
        more: whether motions beyond those of the verdict are tried, as `check` does at a speed.
    """
    if verdict.witness is None or not len(verdict.cells):
        return None
    free = replace(verdict.task, speed=None, min_manipulability=None)
    replayed = replay_rates(verdict.robot, verdict.cells, free, verdict.witness, closely=True)
    if not np.isfinite(replayed.speed):
        return RateFigures(replayed, replayed.speed)
    rated = rated_graph(replace(verdict, task=free))
    try:
        if more:
            grow(rated, Clock() if clock is None else clock)
    except OutOfTime:
        rated.rate()
    return RateFigures(replayed, max(replayed.speed, largest_speed(rated, begin_of(rated))))


def begin_of(rated: RatedGraph) -> int | None:
    """The node that the motion has to begin at; None where the arm has no start."""
    start = rated.robot.start
    if start is None:
        return None
    return int(np.argmin([np.abs(q - start).max() for q in rated.graph.q]))


def largest_speed(rated: RatedGraph, begin: int | None, sigma: float = -np.inf) -> float:
    """m/s, the largest speed that a motion over all cells allows; 0 where there is no motion."""
    speeds = np.unique([r.speed for r in rated.rated.values() if r.sigma >= sigma])
    low, high = -1, len(speeds)  # speeds[low] is possible, speeds[high] is not
    while high - low > 1:
        middle = (low + high) // 2
        if covered(rated, rated.holding(float(speeds[middle]), sigma), begin).all():
            low = middle
        else:
            high = middle
    return float(speeds[low]) if low >= 0 else 0.0
