"""A tree of boxes over triangles: which of them is nearest to a point, compiled.

The tree is perfect and lies in one array, the children of node i being 2 i + 1 and 2 i + 2. The
nodes of a level hold runs of one list of the triangles, node j of level l those from j F / 2^l on;
so nothing else has to be kept of it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints
from coverable.kernels import allocating_entry, entry, kernel
from surfaces.meshes.closest_on_triangle import on_triangle

LEAF = 2  # triangles in a leaf, at most
SAME = 2e-14  # [1] of the largest coordinate: distances that differ by less are rounding


class FaceTree(NamedTuple):
    """F >= 1 triangles, and the boxes around runs of them, as a plain tuple for numba."""

    corners: Array
    """(F, 3, 3) m, run by run."""
    order: Ints
    """(F,) which of the given triangles each is."""
    boxes: Array
    """(2^(d + 1) - 1, 6) m, lowest and highest corner of each node."""
    depth: int
    """d, the level of the leaves."""
    same: float
    """m, distances that differ by less are one: then the triangle given first counts, so that what
    is nearest to an edge does not depend on rounding."""
    waiting: Ints
    """(d + 1,) scratch: nodes still to be looked into."""
    bounds: Array
    """(d + 1,) scratch: m^2, squares of their distances."""

    @staticmethod
    def of(corners: Array) -> FaceTree:
        """The tree over triangles (F, 3, 3) m, cut at medians along the widest axis."""
        count = len(corners)
        depth = 0
        while count > LEAF << depth:
            depth += 1
        corners, order = np.ascontiguousarray(corners), np.arange(count)
        _sort_by_halves(corners.mean(axis=1), depth, order)
        corners = corners[order]
        boxes = np.empty(((2 << depth) - 1, 6))
        _boxes_around(corners, depth, boxes)
        same = SAME * max(float(np.abs(corners).max()), 1e-300)
        scratch = np.empty(depth + 1, dtype=np.int64), np.empty(depth + 1)
        return FaceTree(corners, order, boxes, depth, same, *scratch)

    def nearest(self, points: Array) -> tuple[Ints, Array]:
        """Triangles (k,), and weights (k, 3) on them, of the places nearest to points (k, 3) m.

        -1 and NaN for points that are not finite.
        """
        faces = np.empty(len(points), dtype=np.int64)
        weights = np.empty((len(points), 3))
        nearest_faces(self, np.ascontiguousarray(points), faces, weights)
        return faces, weights


@kernel
def _beside_box(boxes, node, x, y, z):  # type: ignore[no-untyped-def]
    """m^2, the square of the distance of a point from a box; 0 inside."""
    dx = max(boxes[node, 0] - x, x - boxes[node, 3], 0.0)
    dy = max(boxes[node, 1] - y, y - boxes[node, 4], 0.0)
    dz = max(boxes[node, 2] - z, z - boxes[node, 5], 0.0)
    return dx * dx + dy * dy + dz * dz


@kernel
def nearest_face(tree, x, y, z, guess, weights, found):  # type: ignore[no-untyped-def]
    """The row of `tree.corners` nearest to a point, or as near as rounding can tell.

    Args:
        tree: a `FaceTree`.
        x, y, z: m; finite.
        guess: a row that may be near.
        weights: (3,) receives the weights of the nearest point.
        found: (3,) scratch.
    """
    corners, order, boxes = tree.corners, tree.order, tree.boxes
    waiting, bounds = tree.waiting, tree.bounds
    count, depth, same = corners.shape[0], tree.depth, tree.same
    first_leaf = (1 << depth) - 1
    best, least = guess, np.sqrt(on_triangle(corners, guess, x, y, z, weights))
    within, node, top = (least + same) ** 2, 0, 0
    while node >= 0:
        if node < first_leaf:
            near, far = 2 * node + 1, 2 * node + 2
            to, further = _beside_box(boxes, near, x, y, z), _beside_box(boxes, far, x, y, z)
            if further < to:
                near, far, to, further = far, near, further, to
            if further <= within:
                waiting[top], bounds[top] = far, further
                top += 1
            if to <= within:
                node = near
                continue
        else:
            leaf = node - first_leaf
            for f in range((leaf * count) >> depth, ((leaf + 1) * count) >> depth):
                square = on_triangle(corners, f, x, y, z, found)
                if square > within:
                    continue
                away = np.sqrt(square)
                if away < least - same or (away <= least + same and order[f] < order[best]):
                    best = f
                    for k in range(3):
                        weights[k] = found[k]
                if away < least:
                    least, within = away, (away + same) ** 2
        node = -1
        while top > 0 and node < 0:
            top -= 1
            if bounds[top] <= within:
                node = waiting[top]
    return best


@allocating_entry
def nearest_faces(tree, points, faces, weights):  # type: ignore[no-untyped-def]
    """`nearest_face` for points (k, 3) m; fills faces (k,), as they were given, and weights."""
    near, found = 0, np.empty(3)
    for i in range(points.shape[0]):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        if np.isfinite(x + y + z):
            near = nearest_face(tree, x, y, z, near, weights[i], found)
            faces[i] = tree.order[near]
        else:
            faces[i], weights[i] = -1, np.nan


@kernel
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


@kernel
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


@entry
def _sort_by_halves(places, depth, order):  # type: ignore[no-untyped-def]
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


@entry
def _boxes_around(corners, depth, boxes):  # type: ignore[no-untyped-def]
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
