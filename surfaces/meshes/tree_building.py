"""Building the tree of boxes over triangles, compiled: see `surfaces.meshes.face_tree`."""

from __future__ import annotations

import numpy as np

from coverable_kernels import njit


@njit(cache=True, error_model="numpy", _nrt=False)
def _widest_axis(places, order, begin, end):  # type: ignore[no-untyped-def]
    """The axis along which places order[begin:end] spread most."""
    widest, axis = -1.0, 0
    for k in range(3):
        low, high = np.inf, -np.inf
        for i in range(begin, end):
            value = places[order[i], k]
            low, high = min(low, value), max(high, value)
        if high - low > widest:
            widest, axis = high - low, k
    return axis


@njit(cache=True, error_model="numpy", _nrt=False)
def _part(places, order, begin, end, middle, axis):  # type: ignore[no-untyped-def]
    """Swap order[begin:end] until none before `middle` is further along the axis than one after.

    Hoare's selection (1961), with the median of three as pivot; of equal numbers it swaps some too,
    so that many of them take no longer.
    """
    low, high = begin, end - 1
    while low < high:
        a, b, c = (
            places[order[low], axis],
            places[order[(low + high) >> 1], axis],
            places[order[high], axis],
        )
        pivot = max(min(a, b), min(max(a, b), c))
        i, j = low, high
        while i <= j:
            while places[order[i], axis] < pivot:
                i += 1
            while places[order[j], axis] > pivot:
                j -= 1
            if i <= j:
                order[i], order[j] = order[j], order[i]
                i, j = i + 1, j - 1
        if middle <= j:
            high = j
        elif middle >= i:
            low = i
        else:
            return


@njit(cache=True, error_model="numpy", _nrt=False)
def sort_by_halves(places, depth, order):  # type: ignore[no-untyped-def]
    """Sort triangles so that the runs of each level are halves of those of the level above.

    Args:
        places: (F, 3) m, finite, a point of each triangle.
        depth: levels below the first.
        order: (F,) numbers of the triangles; sorted.
    """
    count = order.shape[0]
    for level in range(depth):
        for node in range(1 << level):
            begin, end = (node * count) >> level, ((node + 1) * count) >> level
            middle = ((2 * node + 1) * count) >> (level + 1)
            axis = _widest_axis(places, order, begin, end)
            _part(places, order, begin, end, middle, axis)


@njit(cache=True, error_model="numpy", _nrt=False)
def boxes_around(corners, depth, boxes):  # type: ignore[no-untyped-def]
    """Write the boxes of all nodes, (2^(d + 1) - 1, 6) m, around sorted triangles (F, 3, 3) m."""
    count = corners.shape[0]
    first_leaf = (1 << depth) - 1
    for node in range(boxes.shape[0] - 1, -1, -1):
        for k in range(3):
            low, high = np.inf, -np.inf
            if node < first_leaf:
                one, other = 2 * node + 1, 2 * node + 2
                low = min(boxes[one, k], boxes[other, k])
                high = max(boxes[one, k + 3], boxes[other, k + 3])
            else:
                leaf = node - first_leaf
                for f in range((leaf * count) >> depth, ((leaf + 1) * count) >> depth):
                    for c in range(3):
                        low, high = min(low, corners[f, c, k]), max(high, corners[f, c, k])
            boxes[node, k], boxes[node, k + 3] = low, high
