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
    def of(corners: Array) -> FaceTree:
        """The tree over triangles (F, 3, 3) m, cut at medians along the widest axis."""
        depth = 0
        while len(corners) > LEAF << depth:
            depth += 1
        levels = [(np.arange(1 << level) * len(corners)) >> level for level in range(depth + 1)]
        order, places = np.arange(len(corners)), corners.mean(axis=1)
        for starts in levels[:-1]:
            low, high = (find.reduceat(places[order], starts) for find in (np.fmin, np.fmax))
            row, axis = np.arange(len(starts)), (high - low).argmax(axis=1)
            width = np.maximum((high - low)[row, axis], 1e-300)
            node = np.repeat(row, np.diff(starts, append=len(order)))
            along = (places[order, axis[node]] - low[node, axis[node]]) / width[node]
            order = order[np.argsort(node + 0.999 * along)]
        corners = np.ascontiguousarray(corners[order])
        low, high = corners.min(axis=1), corners.max(axis=1)
        ends = [
            [np.fmin.reduceat(low, starts), np.fmax.reduceat(high, starts)] for starts in levels
        ]
        boxes = np.concatenate([np.hstack(one) for one in ends])
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
