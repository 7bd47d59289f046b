"""A tree of boxes over triangles: which of them is nearest to a point, compiled.

The tree is perfect and lies in one array, the children of node i being 2 i + 1 and 2 i + 2. The
nodes of a level hold runs of one list of the triangles, node j of level l those from j F / 2^l on;
so nothing else has to be kept of it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coverable_kernels import njit
from surfaces.meshes.closest_point import nearest_on_triangle

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

LEAF = 4  # triangles in a leaf, at most
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

    @staticmethod
    def of(corners: Array) -> FaceTree:
        """The tree over triangles (F, 3, 3) m, cut at medians along the widest axis."""
        count = len(corners)
        depth = 0
        while count > LEAF << depth:
            depth += 1
        order, middles, levels = np.arange(count), corners.mean(axis=1), []
        lowest, highest = corners.min(axis=1), corners.max(axis=1)
        for level in range(depth + 1):
            starts = (np.arange(2**level) * count) >> level
            low = np.minimum.reduceat(lowest[order], starts)
            high = np.maximum.reduceat(highest[order], starts)
            levels.append(np.hstack([low, high]))
            if level < depth:
                node = np.repeat(np.arange(2**level), np.diff(np.append(starts, count)))
                spots = middles[order]
                spread = np.maximum.reduceat(spots, starts) - np.minimum.reduceat(spots, starts)
                axis = spread.argmax(axis=1)[node]
                order = order[np.lexsort((spots[np.arange(count), axis], node))]
        same = SAME * max(float(np.abs(corners).max()), 1e-300)
        boxes = np.ascontiguousarray(np.concatenate(levels))
        return FaceTree(np.ascontiguousarray(corners[order]), order, boxes, depth, same)

    def nearest(self, points: Array) -> tuple[Ints, Array]:
        """Triangles (k,), and weights (k, 3) on them, of the places nearest to points (k, 3) m.

        -1 and NaN for points that are not finite.
        """
        faces = np.empty(len(points), dtype=np.int64)
        weights = np.empty((len(points), 3))
        nearest_faces(self, np.ascontiguousarray(points), faces, weights)
        return faces, weights


@njit(cache=True, error_model="numpy", inline="always")
def _beside_box(boxes, node, x, y, z):  # type: ignore[no-untyped-def]
    """m^2, the square of the distance of a point from a box; 0 inside."""
    dx = max(boxes[node, 0] - x, x - boxes[node, 3], 0.0)
    dy = max(boxes[node, 1] - y, y - boxes[node, 4], 0.0)
    dz = max(boxes[node, 2] - z, z - boxes[node, 5], 0.0)
    return dx * dx + dy * dy + dz * dz


@njit(cache=True, error_model="numpy")
def nearest_face(tree, p, guess, weights):  # type: ignore[no-untyped-def]
    """The row of `tree.corners` nearest to p, or as near as rounding can tell; -1 where p is NaN.

    Args:
        tree: a `FaceTree`.
        p: (3,) m, finite.
        guess: a row that may be near.
        weights: (3,) receives the weights of the nearest point.
    """
    corners, order, boxes = tree.corners, tree.order, tree.boxes
    count, depth, same = corners.shape[0], tree.depth, tree.same
    first_leaf = (1 << depth) - 1
    waiting, bound = np.empty(depth + 2, np.int64), np.empty(depth + 2)
    best, least = -1, np.inf
    waiting[0], waiting[1], top = 0, -1, 2  # -1: the guess alone
    bound[:2] = 0.0
    while top > 0:
        top -= 1
        node = waiting[top]
        if bound[top] > (least + same) ** 2:
            continue
        if 0 <= node < first_leaf:
            near, far = 2 * node + 1, 2 * node + 2
            to = _beside_box(boxes, near, p[0], p[1], p[2])
            further = _beside_box(boxes, far, p[0], p[1], p[2])
            if further < to:
                near, far, to, further = far, near, further, to
            waiting[top], bound[top] = far, further
            waiting[top + 1], bound[top + 1] = near, to
            top += 2
            continue
        begin, end = guess, guess + 1
        if node >= 0:
            leaf = node - first_leaf
            begin, end = (leaf * count) >> depth, ((leaf + 1) * count) >> depth
        for f in range(begin, end):
            w0, w1, w2 = nearest_on_triangle(corners[f, 0], corners[f, 1], corners[f, 2], p)
            square = 0.0
            for k in range(3):
                x = w0 * corners[f, 0, k] + w1 * corners[f, 1, k] + w2 * corners[f, 2, k]
                square += (p[k] - x) ** 2
            away = np.sqrt(square)
            if away < least - same or (away <= least + same and order[f] < order[best]):
                best = f
                weights[0], weights[1], weights[2] = w0, w1, w2
            if away < least:
                least = away
    return best


@njit(cache=True, error_model="numpy")
def nearest_faces(tree, points, faces, weights):  # type: ignore[no-untyped-def]
    """`nearest_face` for points (k, 3) m; fills faces (k,), as they were given, and weights."""
    near = 0
    for i in range(points.shape[0]):
        if np.isfinite(points[i]).all():
            near = nearest_face(tree, points[i], near, weights[i])
            faces[i] = tree.order[near]
        else:
            faces[i], weights[i] = -1, np.nan
