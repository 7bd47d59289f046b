"""When the tool works along a trajectory: not where it is lifted, nor over holes."""

from collections.abc import Sequence
from itertools import groupby

import numpy as np

from coverable.arrays import Ints
from feasibility.timing.sampled_trajectory import Trajectory
from surfaces.passes.pass_stretches import Pass
from surfaces.passes.toolpath import LIFTED, PassPlaces

OFF = -1


def working_places(places: PassPlaces, stretches: Sequence[Pass]) -> Ints:
    """(N,) which stretch of work each place belongs to; -1 where the tool is lifted.

    Where one pass follows on another along the surface the tool goes on working, as it does for the
    treated area; between two parts of one pass there is a hole.

    Args:
        places: of passes.
        stretches: of the same passes.
    """
    levels = np.array([each.level for each in stretches])
    lifted = places.stretch == LIFTED
    stretch = np.where(lifted, 0, places.at_work)
    onto = (np.diff(stretch, prepend=stretch[:1]) != 0) & ~lifted
    hole = onto & (levels[stretch] == np.roll(levels[stretch], 1))
    begins = hole | (np.diff(lifted.astype(np.int64), prepend=1) < 0)
    return np.where(lifted, OFF, np.cumsum(begins) - 1)


def working_times(run: Trajectory, work: Ints | None = None) -> list[tuple[float, float]]:
    """s, beginning and end of each stretch in which the tool works, in order.

    Args:
        run: a trajectory; before the first cell and behind the last one it does not work.
        work: (N,) which stretch of work each cell belongs to, -1 for none, see `working_places`; by
            default all are one.

    Example:
        >>> still, cells = np.zeros((4, 1)), np.array([-1, 0, 2, 1])
        >>> run = Trajectory(("a",), np.arange(4.0), still, still, still, np.zeros(4), cells)
        >>> working_times(run), working_times(run, np.array([0, 0, -1]))
        ([(1.0, 3.0)], [(1.0, 1.0), (3.0, 3.0)])
    """
    marks = np.flatnonzero(run.cell >= 0)
    own = np.zeros(len(marks), dtype=np.int64) if work is None else work[run.cell[marks]]
    found = []
    for number, group in groupby(zip(own.tolist(), run.time[marks].tolist(), strict=True), _first):
        times = [time for _, time in group]
        if number != OFF:
            found.append((times[0], times[-1]))
    return found


def _first(pair: tuple[int, float]) -> int:
    return pair[0]
