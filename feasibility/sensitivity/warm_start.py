"""Configurations carried from one value of a quantity to others, by Newton over the cells' centres.

How far all of them go together is the least of how far each goes. So the cells are taken one after
another, the hard ones first: one that still lands at the best value so far costs a few evaluations,
and only one that does not is asked how far it goes by itself. The expected number of those is the
logarithm of the number of cells.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from feasibility.compiled import kernel
from feasibility.roadmap import project_onto_cell
from feasibility.sensitivity.parameters import Quantity
from feasibility.sensitivity.thresholds import last_true

if TYPE_CHECKING:
    from feasibility.sensitivity.probes import Prober

FOLLOW_STEPS = np.int64(15)  # Newton steps that put a neighbour's configuration onto the fibre
SAMPLE = 12  # cells that are looked at on the way
MOST = 40  # cells that are looked at in the end; the search that follows looks at all
HARD = 3  # cells that have to get further before all of them are carried
NO_CELL = -1


@kernel
def follow_all(problem, work, order, q):  # type: ignore[no-untyped-def]
    """Newton onto the fibre over each cell of `order` from its row of q (N, n), in place.

    Returns:
        How many cells of `order` were landed on before the first failure.
    """
    for k in range(order.shape[0]):
        row = q[order[k]]
        for j in range(row.shape[0]):
            row[j] = min(max(row[j], problem.lower[j]), problem.upper[j])
        if not project_onto_cell(problem, work, order[k], row, FOLLOW_STEPS):
            return k
    return order.shape[0]


@kernel
def project_guesses(problem, work, cell, guesses, steps, projected):  # type: ignore[no-untyped-def]
    """Newton onto the fibre over one cell from each guess (k, n) in place; fills `projected` (k,)."""
    for k in range(guesses.shape[0]):
        projected[k] = project_onto_cell(problem, work, cell, guesses[k], steps)


class Reached(NamedTuple):
    """How far configurations were carried."""

    k: int
    """Number of steps."""
    q: NDArray[np.float64]
    """(N, n) configurations there, or some way further on."""
    cell: int
    """The cell that fails at the next step; `NO_CELL` if there is none, or if none was asked."""


class Carrying:
    """Configurations over all cells, wherever they were carried last."""

    def __init__(
        self, prober: Prober, quantity: Quantity, start: int, q: NDArray[np.float64]
    ) -> None:
        """Begin at `start` steps with configurations (N, n) that are over their cells there."""
        self.prober, self.quantity, self.start = prober, quantity, start
        self.first = q
        self.q = q.copy()

    def lands(self, cells: NDArray[np.int64], k: int) -> int:
        """How many of these cells can be carried to k steps, before the first that cannot."""
        trial = self.q.copy()
        problem = self.prober.centres_at(self.quantity, k)
        count = int(follow_all(problem, self.prober.work, cells, trial))
        self.q[cells[:count]] = trial[cells[:count]]
        return count

    def goes_to(self, k: int) -> bool:
        """Can the hardest cells be carried to k steps, by way of half of them?"""
        hard = self.prober.order()[:HARD]
        half = (self.start + k) // 2
        return all(self.lands(hard, value) == len(hard) for value in (half, k))

    def reach(self, bad: int) -> Reached:
        """How far all cells can be carried together, before `bad` steps (never asked about)."""
        self.prober.tick()
        way = 1 if bad > self.start else -1
        order = self.prober.order()[:MOST]
        if abs(bad - self.start) > 1 and not self.lands(order[:1], self.start + way):
            return Reached(self.start, self.first, int(order[0]))
        low = k = self.start
        for k in self._stops(bad):
            if k == bad - way or self.lands(order[:SAMPLE], k) < min(SAMPLE, len(order)):
                break
            low = k
        return self._shrunk(order, low, k)

    def _stops(self, bad: int) -> list[int]:
        """Values on the way to the last one before `bad`, and that one."""
        way = 1 if bad > self.start else -1
        length = abs(bad - self.start) - 1
        if self.quantity.monotone:
            steps = [length // 2, length]
        else:  # steps that double, so that what is found is the stretch around the start
            steps = [2**i - 1 for i in range(1, length.bit_length() + 1)]
            steps = [step for step in steps if step < length] + [length]
        return [self.start + way * step for step in steps]

    def _shrunk(self, order: NDArray[np.int64], low: int, k: int) -> Reached:
        """The last value up to k steps that every cell is carried to.

        Some are known to be carried to `low`. Cells that were carried further before are left
        there: they are near enough to begin from.
        """
        at, failed = 0, NO_CELL
        while k != self.start and at < len(order):
            at += self.lands(order[at:], k)
            if at == len(order):
                break
            cell = order[at : at + 1]
            self.prober.suspect(int(cell[0]))
            alone = self._alone(cell, low, k)
            failed, k = failed if alone == k else int(cell[0]), alone
            low = self.start if abs(k - self.start) <= abs(low - self.start) else low
            at += 1
        if k == self.start:
            return Reached(k, self.first, failed)
        return Reached(k, self.q.copy(), failed)

    def _alone(self, cell: NDArray[np.int64], low: int, bad: int) -> int:
        """The last value up to `bad`, where it failed from afar, that a cell (1,) is carried to."""
        start, top = low, bad
        if low != self.start and not self.lands(cell, low):
            self.q[cell] = self.first[cell]
            start, bad = self.start, low
        gallop = not self.quantity.monotone and start == self.start
        way = 1 if bad > start else -1
        k = last_true(lambda k: self.lands(cell, k) == 1, start, bad, gallop)
        # The next value may have failed from further away only.
        while k != top and self.lands(cell, k + way):
            k += way
            if k != top:
                k = last_true(lambda k: self.lands(cell, k) == 1, k, top, gallop=True)
        return k
