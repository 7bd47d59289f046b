"""Warm starts: configurations of one value of a quantity, projected at others by Newton steps.

How far all of them go together is the least of how far each goes. So the cells are taken one after
another, the hard ones first: one that still projects at the best value so far costs a few
evaluations, and only for one that does not its own limit is searched for. The expected number of
those is the logarithm of the number of cells.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from coverable_arrays import Array, Ints
from feasibility.sensitivity.limited_search import NO_CELL, project_all
from feasibility.sensitivity.probes import Prober
from feasibility.sensitivity.quantities import Quantity

SAMPLE = 12  # cells that are projected on the way
MOST = 40  # cells that are projected in the end; the search that follows projects all
HARD = 3  # cells that have to get further before all of them are tried


class Reached(NamedTuple):
    """How far configurations could be continued."""

    k: int
    """Number of steps."""
    q: Array
    """(N, n) configurations there, or some way further on."""
    cell: int
    """The cell that fails at the next step; `NO_CELL` if there is none, or none was tried."""


class WarmStart:
    """Configurations over all cells, each at the value it was projected at last."""

    def __init__(self, prober: Prober, quantity: Quantity, start: int, q: Array) -> None:
        """Begin at `start` steps with configurations (N, n) that are over their cells there."""
        self.prober, self.quantity, self.start = prober, quantity, start
        self.first = q
        self.q = q.copy()

    def projects(self, cells: Ints, k: int) -> int:
        """How many of these cells project at k steps, before the first that does not."""
        found = self.q.copy()
        arrays = self.prober.centres_at(self.quantity, k)
        count = int(project_all(arrays, self.prober.work, cells, found))
        self.q[cells[:count]] = found[cells[:count]]
        return count

    def reaches(self, k: int) -> bool:
        """Do the hardest cells project at k steps, by way of half of them?"""
        hard = self.prober.order()[:HARD]
        half = (self.start + k) // 2
        return all(self.projects(hard, value) == len(hard) for value in (half, k))

    def reach(self, bad: int) -> Reached:
        """How far all cells project together, before `bad` steps (which is not tried)."""
        self.prober.tick()
        sign = 1 if bad > self.start else -1
        order = self.prober.order()[:MOST]
        if abs(bad - self.start) > 1 and not self.projects(order[:1], self.start + sign):
            return Reached(self.start, self.first, int(order[0]))
        low = k = self.start
        for k in self._stops(bad):
            if k == bad - sign or self.projects(order[:SAMPLE], k) < min(SAMPLE, len(order)):
                break
            low = k
        return self._common_reach(order, low, k)

    def _stops(self, bad: int) -> list[int]:
        """Values on the way to the last one before `bad`, and that one."""
        sign = 1 if bad > self.start else -1
        length = abs(bad - self.start) - 1
        if self.quantity.monotone:
            steps = [length // 2, length]
        else:  # steps that double, so that what is found is the stretch around the start
            steps = [2**i - 1 for i in range(1, length.bit_length() + 1)]
            steps = [step for step in steps if step < length] + [length]
        return [self.start + sign * step for step in steps]

    def _common_reach(self, order: Ints, low: int, k: int) -> Reached:
        """The last value up to k steps at which every cell projects.

        Some are known to at `low`. Cells that were projected further on before are left there: they
        are near enough to begin from.
        """
        at, failed = 0, NO_CELL
        while k != self.start and at < len(order):
            at += self.projects(order[at:], k)
            if at == len(order):
                break
            cell = order[at : at + 1]
            self.prober.suspect(int(cell[0]))
            alone = self._reach_of(cell, low, k)
            failed, k = failed if alone == k else int(cell[0]), alone
            low = self.start if abs(k - self.start) <= abs(low - self.start) else low
            at += 1
        if k == self.start:
            return Reached(k, self.first, failed)
        return Reached(k, self.q.copy(), failed)

    def _reach_of(self, cell: Ints, low: int, bad: int) -> int:
        """The last value up to `bad`, where it failed from afar, at which a cell (1,) projects."""
        start, top = low, bad
        if low != self.start and not self.projects(cell, low):
            self.q[cell] = self.first[cell]
            start, bad = self.start, low
        gallop = not self.quantity.monotone and start == self.start
        sign = 1 if bad > start else -1
        k = last_true(lambda k: self.projects(cell, k) == 1, start, bad, gallop)
        # The next value may have failed from further away only.
        while k != top and self.projects(cell, k + sign):
            k += sign
            if k != top:
                k = last_true(lambda k: self.projects(cell, k) == 1, k, top, gallop=True)
        return k


def last_true(holds: Callable[[int], bool], good: int, bad: int, gallop: bool = False) -> int:
    """The last whole number before `bad`, seen from `good`, for which `holds` is true.

    Args:
        holds: called for numbers strictly between the two ends, at most about log2 of their
            distance times, twice that when galloping.
        good: where it is known to be true.
        bad: where it is known, or taken, to be false; above or below `good`.
        gallop: go out from `good` in steps that double until `holds` fails, so that the number
            found belongs to the stretch around `good` even where `holds` comes true again further
            on, unless a gap fits between two steps.

    Returns:
        A number k with holds(k) true (or k = good), whose neighbour towards `bad` is false (or is
        `bad` itself).

    Example:
        >>> last_true(lambda k: k <= 37, 0, 100)
        37
        >>> last_true(lambda k: k >= -5, 10, -90, gallop=True)
        -5
    """
    sign = 1 if bad > good else -1
    step = 1
    while gallop and good + sign * step != bad and (bad - good) * sign > step:
        if not holds(good + sign * step):
            bad = good + sign * step
            break
        good += sign * step
        step *= 2
    while abs(bad - good) > 1:
        middle = (good + bad) // 2
        if holds(middle):
            good = middle
        else:
            bad = middle
    return good
