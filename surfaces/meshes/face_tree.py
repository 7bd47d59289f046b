"""A tree of boxes over triangles: which of them is nearest to a point, compiled.

The tree is perfect and lies in one array, the children of node i being 2 i + 1 and 2 i + 2. The
nodes of a level hold runs of one list of the triangles, node j of level l those from j F / 2^l on;
so nothing else has to be kept of it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints
from coverable.kernels import allocating_entry, kernel
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
    def of(corners: Array, order: Ints | None = None) -> FaceTree:
        """The tree over triangles (F, 3, 3) m, by default cut at medians along the widest axis.

        Args:
            corners: the triangles.
            order: (F,) them in an order in which neighbours are close, where one is known.
        """
        depth = 0
        while len(corners) > LEAF << depth:
            depth += 1
        if order is None:
            order = _cut_at_medians(corners.mean(axis=1), depth)
        corners = np.ascontiguousarray(corners[order])
        (a, b, c), starts = corners.swapaxes(0, 1), _starts(len(corners), depth)
        low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
        levels = [np.hstack([np.fmin.reduceat(low, starts), np.fmax.reduceat(high, starts)])]
        for _ in range(depth):
            one, other = levels[-1][::2], levels[-1][1::2]
            low, high = np.fmin(one[:, :3], other[:, :3]), np.fmax(one[:, 3:], other[:, 3:])
            levels.append(np.hstack([low, high]))
        same = SAME * max(float(np.abs(corners).max()), 1e-300)
        scratch = np.empty(depth + 1, dtype=np.int64), np.empty(depth + 1)
        return FaceTree(corners, order, np.concatenate(levels[::-1]), depth, same, *scratch)

    def nearest(self, points: Array) -> tuple[Ints, Array]:
        """Triangles (k,), and weights (k, 3) on them, of the places nearest to points (k, 3) m.

        -1 and NaN for points that are not finite.
        """
        faces = np.empty(len(points), dtype=np.int64)
        weights = np.empty((len(points), 3))
        nearest_faces(self, np.ascontiguousarray(points), faces, weights)
        return faces, weights


def _starts(count: int, level: int) -> Ints:
    """(2^level,) where the runs of the nodes of a level begin."""
    return np.asarray((np.arange(1 << level) * count) >> level)


def _cut_at_medians(places: Array, depth: int) -> Ints:
    """The order of places (F, 3) m after so many cuts across the widest axis of each run."""
    order = each = np.arange(len(places))
    for level in range(depth):
        starts = _starts(len(places), level)
        low, high = (find.reduceat(places, starts) for find in (np.fmin, np.fmax))
        row, axis = each[: len(starts)], (high - low).argmax(axis=1)
        size = np.diff(starts, append=len(places))
        width = np.maximum((high - low)[row, axis], 1e-300)
        along = places[each, np.repeat(axis, size)] - np.repeat(low[row, axis], size)
        rank = np.argsort(np.repeat(row, size) + 0.999 * (along / np.repeat(width, size)))
        order, places = order[rank], places[rank]
    return order


@kernel
def _beside_box(boxes, node, x, y, z):  # noqa: ANN001, ANN202
    """m^2, the square of the distance of a point from a box; 0 inside."""
    dx = max(boxes[node, 0] - x, x - boxes[node, 3], 0.0)
    dy = max(boxes[node, 1] - y, y - boxes[node, 4], 0.0)
    dz = max(boxes[node, 2] - z, z - boxes[node, 5], 0.0)
    return dx * dx + dy * dy + dz * dz


@kernel
def nearest_face(tree, x, y, z, guess, weights, found):  # noqa: ANN001, ANN201
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
def nearest_faces(tree, points, faces, weights):  # noqa: ANN001, ANN201
    """`nearest_face` for points (k, 3) m; fills faces (k,), as they were given, and weights."""
    near, found = 0, np.empty(3)
    for i in range(points.shape[0]):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        if np.isfinite(x + y + z):
            near = nearest_face(tree, x, y, z, near, weights[i], found)
            faces[i] = tree.order[near]
        else:
            faces[i], weights[i] = -1, np.nan
