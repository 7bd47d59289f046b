"""What a path allows of what the task asks of speed and singular values."""

from __future__ import annotations

from feasibility.certification.rates import RateReplay, replay_rates
from feasibility.paths import CoveragePath, PathError
from feasibility.verdict import Walk


def path_rates(path: CoveragePath, walk: Walk | None = None) -> RateReplay | None:
    """The judge's answer about a path's motion; None where the task asks for nothing.

    A path in an order of its own need not be as fast as the motion of the verdict. That is told,
    not refused: timing runs it slower there.

    Args:
        path: the path.
        walk: another motion over the same cells, such as the samples of its trajectory.

    Raises:
        PathError: singular values fall below what the task asks.
    """
    task = path.task
    if not task.asks_rates:
        return None
    judged = replay_rates(path.robot, path.cells, task, path.walk if walk is None else walk)
    least = task.min_manipulability
    if least is not None and not judged.sigma >= least:
        raise PathError(
            f"the {'path' if walk is None else 'timed path'} in this order comes too near to a "
            f"singularity: {judged.refusals[-1]}; try another --order"
        )
    return judged
