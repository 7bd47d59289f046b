"""Shortening the order of a visit: 2-opt and Or-opt on an open path, until nothing improves.

G. A. Croes, A method for solving traveling-salesman problems, Operations Research 6 (1958);
I. Or, Traveling salesman-type combinatorial problems (1976).
"""

import numpy as np

from coverable.arrays import Array, Ints

LONGEST_PART = 3  # places that Or-opt moves at once
GAIN = 1e-9  # [1], share of the whole length that a change must gain
MOST_SWEEPS = 200


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
    count = len(tour)
    gain = GAIN * max(tour_length(distance, tour), np.finfo(float).tiny)
    # Before the first place and behind the last one is a place that nothing is away from.
    away = np.pad(distance, (0, 1))
    path = np.pad(np.asarray(tour, dtype=np.int64), 1, constant_values=count)
    for _ in range(MOST_SWEEPS):
        before = path.copy()
        for i in range(1, count):
            _turn(away, path, i, gain)
        for size in range(1, min(LONGEST_PART, count - 2) + 1):
            for i in range(1, count - size + 2):
                path = _moved(away, path, i, size, gain)
        if (path == before).all():
            break
    return path[1:-1]


def _turn(away: Array, path: Ints, i: int, gain: float) -> None:
    """Turn round the places i .. j of a path for each j in turn that gains."""
    j = i
    while True:
        last, behind = path[j + 1 : -1], path[j + 2 :]
        more = away[path[i - 1], last] + away[path[i], behind]
        more -= away[path[i - 1], path[i]] + away[last, behind]
        gains = np.flatnonzero(more < -gain)
        if not len(gains):
            return
        j += 1 + int(gains[0])
        path[i : j + 1] = path[i : j + 1][::-1].copy()


def _moved(away: Array, path: Ints, i: int, size: int, gain: float) -> Ints:
    """The places i .. i + size - 1 put where that gains most, either way round."""
    part, rest = path[i : i + size], np.concatenate([path[:i], path[i + size :]])
    left, right = rest[:-1], rest[1:]
    ways = np.stack(
        [away[left, a] + away[b, right] for a, b in ((part[0], part[-1]), (part[-1], part[0]))]
    )
    ways -= away[left, right]
    turned, k = divmod(int(np.argmin(ways)), len(left))
    if ways[turned, k] >= ways[0, i - 1] - gain:
        return path
    return np.concatenate([rest[: k + 1], part[:: 1 - 2 * turned], rest[k + 1 :]])
