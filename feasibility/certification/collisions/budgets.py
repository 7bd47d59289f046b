"""Certified clearance by distances alone, where no plane parts two bodies.

No point of body b, seen from body a, moves further than M = sum_j r_j |d_j| along a stretch. So
with the distances d(0) and d(1) at its ends, the bodies are at least (d(0) + d(1) - M) / 2 apart
all along it (Schwarzer, Saha and Latombe 2005); and a distance at one row bounds those at others.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from coverable_arrays import Array


class TooNear(Exception):
    """The bodies are nearer than needed at an instant, or that was not decided."""

    def __init__(self, row: int, share: float, distance: float) -> None:
        """Where; the distance (m) is NaN where it was not decided."""
        super().__init__(row, share, distance)
        self.row, self.share, self.distance = row, share, distance


class Budget:
    """Distances of two bodies along one motion."""

    def __init__(
        self, measure: Callable[[int, float], float], moved: Array, most_calls: int
    ) -> None:
        """What is known of the motion.

        Args:
            measure: the distance (m) at a row, and a share of the way to the next.
            moved: (m - 1,) m, M of each segment.
            most_calls: how often `measure` may be called.
        """
        self._measure, self._moved, self._left = measure, moved, most_calls
        self._way = np.concatenate([[0.0], np.cumsum(moved)])

    def certify(self, rows: NDArray[np.intp], needed: Array, aim: float) -> float:
        """A bound (m) of the distance along segments, above what is needed on each.

        Args:
            rows: (k,) the rows at which the segments begin.
            needed: (k,) m.
            aim: m; no higher bound is looked for.

        Raises:
            TooNear: less was measured, or calls ran out.
        """
        known = np.full(len(self._way), np.nan)
        least = np.full(len(self._way), -np.inf)
        bound, open_ = np.inf, np.ones(len(rows), dtype=bool)
        while open_.any():
            low = 0.5 * (least[rows] + least[rows + 1] - self._moved[rows])
            good = open_ & (low >= np.maximum(needed, aim))
            bound = min(bound, float(np.min(low[good], initial=np.inf)))
            open_ &= ~good
            if not open_.any():
                break
            k = int(np.argmin(np.where(open_, low - needed, np.inf)))
            row = int(rows[k])
            ends = [end for end in (row, row + 1) if np.isnan(known[end])]
            if not ends:
                bound = min(bound, self._within(row, known[row], known[row + 1], needed[k], aim))
                open_[k] = False
                continue
            known[ends[0]] = self._distance(ends[0], 0.0, needed[k])
            least = np.maximum(least, known[ends[0]] - np.abs(self._way - self._way[ends[0]]))
        return bound

    def _within(self, row: int, first: float, last: float, needed: float, aim: float) -> float:
        """The bound along one segment with known distances at its ends."""
        bound, parts = np.inf, [(0.0, 1.0, first, last)]
        while parts:
            start, length, d0, d1 = parts.pop()
            low = 0.5 * (d0 + d1 - length * self._moved[row])
            if low >= min(aim, 0.5 * (needed + min(d0, d1))) and low >= needed:
                bound = min(bound, low)
                continue
            half = 0.5 * length
            middle = self._distance(row, start + half, needed)
            parts += [(start, half, d0, middle), (start + half, half, middle, d1)]
        return bound

    def _distance(self, row: int, share: float, needed: float) -> float:
        """The distance at an instant.

        Raises:
            TooNear: it is less than needed, or there were too many calls.
        """
        if self._left <= 0:
            raise TooNear(row, share, np.nan)
        self._left -= 1
        distance = self._measure(row, share)
        if not distance >= needed:
            raise TooNear(row, share, distance)
        return distance
