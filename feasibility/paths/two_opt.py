"""Shortening the order of a visit: 2-opt and Or-opt on an open path, until nothing improves.

G. A. Croes, A method for solving traveling-salesman problems, Operations Research 6 (1958);
I. Or, Traveling salesman-type combinatorial problems (1976).
"""

from __future__ import annotations

import numpy as np

from coverable_arrays import Array, Ints
from coverable_kernels import entry, kernel, put

LONGEST_PART = 3  # places that Or-opt moves at once
GAIN = 1e-9  # [1], share of the whole length that a change must gain
MOST_SWEEPS = np.int64(200)


def tour_length(distance: Array, tour: Ints) -> float:
    """Length of an open path through places in this order."""
    return float(distance[tour[:-1], tour[1:]].sum())


def improved(distance: Array, tour: Ints) -> Ints:
    """A path that is no longer, and that no turn of a part and no move of a short part shortens.

    Args:
        distance: (N, N) symmetric distances.
        tour: (N,) places in the order of the path, which may begin and end anywhere.

    Example:
        >>> x = np.array([0.0, 1.0, 2.0, 3.0])
        >>> improved(np.abs(x[:, None] - x), np.array([0, 2, 1, 3])).tolist()
        [0, 1, 2, 3]
    """
    result = np.array(tour, dtype=np.int64)
    gain = GAIN * max(tour_length(distance, result), np.finfo(float).tiny)
    _improve(np.ascontiguousarray(distance), result, np.empty_like(result), gain, MOST_SWEEPS)
    return result


@entry
def _improve(distance, tour, former, gain, sweeps):  # type: ignore[no-untyped-def]
    """Sweep over all changes, taking each that gains, until a sweep finds none."""
    n = tour.shape[0]
    for _ in range(sweeps):
        found = False
        for i in range(n - 1):
            for j in range(i + 1, n):
                if _turn_cost(distance, tour, i, j) < -gain:
                    _turn(tour, i, j)
                    found = True
        for size in range(1, min(LONGEST_PART, n - 2) + 1):
            for i in range(n - size + 1):
                if _move(distance, tour, former, i, size, gain):
                    found = True
        if not found:
            return


@kernel
def _step(distance, tour, a, b):  # type: ignore[no-untyped-def]
    """Distance between the places a and b of a tour; nothing beyond its ends."""
    if a < 0 or b < 0 or a >= tour.shape[0] or b >= tour.shape[0]:
        return 0.0
    return distance[tour[a], tour[b]]


@kernel
def _turn_cost(distance, tour, i, j):  # type: ignore[no-untyped-def]
    """What turning the places i .. j round would add."""
    new = _step(distance, tour, i - 1, j) + _step(distance, tour, i, j + 1)
    return new - _step(distance, tour, i - 1, i) - _step(distance, tour, j, j + 1)


@kernel
def _turn(tour, i, j):  # type: ignore[no-untyped-def]
    """Turn the places i .. j of a tour round."""
    while i < j:
        tour[i], tour[j] = tour[j], tour[i]
        i += 1
        j -= 1


@kernel
def _move(distance, tour, former, i, size, gain):  # type: ignore[no-untyped-def]
    """Put the places i .. i + size - 1 where that gains most, either way round."""
    n = tour.shape[0]
    last = i + size - 1
    saved = _step(distance, tour, i - 1, i) + _step(distance, tour, last, last + 1)
    if i > 0 and last < n - 1:
        saved -= _step(distance, tour, i - 1, last + 1)
    best, before, around = -gain, -1, False
    # Before place k of what is left; its neighbours there are `left` and `right`.
    for k in range(n - size + 1):
        if k == i:
            continue
        right = k if k < i else k + size
        left = right - 1
        closed = 0.0
        if left >= 0 and right < n:
            closed = _step(distance, tour, left, right)
        straight = _step(distance, tour, left, i) + _step(distance, tour, last, right) - closed
        turned = _step(distance, tour, left, last) + _step(distance, tour, i, right) - closed
        if straight - saved < best:
            best, before, around = straight - saved, k, False
        if turned - saved < best:
            best, before, around = turned - saved, k, True
    if before < 0:
        return False
    if around:
        _turn(tour, i, last)
    put(former, tour)
    row = 0
    for k in range(n - size + 1):
        if k == before:
            for part in range(size):
                tour[row] = former[i + part]
                row += 1
        if k < n - size:
            tour[row] = former[k if k < i else k + size]
            row += 1
    return True
