"""The largest speed of the tool, and how near singularities a motion comes: figures to explain."""

from bisect import bisect_left
from dataclasses import dataclass, replace

import numpy as np

from feasibility.certification.rate_replay import RateReplay, replay_rates
from feasibility.clock import Clock, OutOfTime
from feasibility.demands.rated_graph import RatedGraph, grow, rated_graph
from feasibility.demands.routes import best_motion
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
    return RateFigures(replayed, max(replayed.speed, largest_speed(rated)))


def largest_speed(rated: RatedGraph) -> float:
    """m/s, the largest speed that a motion over all cells allows; 0 where there is no motion."""
    sigma = rated.task.min_manipulability or -np.inf
    speeds = np.unique([r.speed for r in rated.rated.values() if r.sigma >= sigma]).tolist()
    possible = bisect_left(
        speeds, True, key=lambda v: not best_motion(rated, rated.holding(v)).covered.all()
    )
    return float(speeds[possible - 1]) if possible else 0.0
