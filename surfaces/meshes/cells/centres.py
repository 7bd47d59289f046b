"""The centre of a cell made of faces: on its surface, well inside it."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from surfaces.meshes.closest_point import nearest_on_triangle
from surfaces.meshes.triangle_mesh import sum_by

kernel = njit(cache=True, error_model="numpy")

_INSIDE = 0.25  # of sqrt(area): as far from the border as this is well inside (a disc has 0.56)
_DEEP = 0.8  # of the greatest distance to the border: as good as the greatest


class Places(NamedTuple):
    """A place on each of N cells."""

    points: NDArray[np.float64]
    """(N, 3) m."""
    faces: NDArray[np.int64]
    """(N,) the face it lies on."""
    weights: NDArray[np.float64]
    """(N, 3) barycentric coordinates on that face, >= 0, of sum 1."""


def centre_places(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    labels: NDArray[np.int64],
    areas: NDArray[np.float64],
    border: NDArray[np.bool_],
) -> Places:
    """The point of each cell nearest to its centroid; elsewhere where that is at its border.

    The centroid of a ring or a horseshoe lies outside, and the point nearest to it on the border.
    Such a cell gets the middle of a face that is about as far from the border as can be, and of
    those the one nearest to the centroid.

    Args:
        vertices: (V, 3) m.
        faces: (F, 3) vertex indices.
        labels: (F,) cell of each face.
        areas: (F,) m^2, of the faces.
        border: (F, 3) whether an edge lies on its cell's border.
    """
    count = int(labels.max()) + 1
    corners = vertices[faces]
    middles = corners.mean(axis=1)
    total = sum_by(labels, areas, count)
    centroids = sum_by(labels, areas[:, None] * middles, count) / total[:, None]
    order = np.argsort(labels, kind="stable")
    indptr = np.searchsorted(labels[order], np.arange(count + 1))
    chosen = np.empty(count, dtype=np.int64)
    weights = np.empty((count, 3))
    _choose(corners, middles, border, order, indptr, centroids, total, chosen, weights)
    points = np.einsum("nk,nkc->nc", weights, corners[chosen])
    return Places(points, chosen, weights)


@kernel
def _to_segment(p, a, b):  # type: ignore[no-untyped-def]
    """The squared distance of p from the segment a-b, m^2."""
    along, length = 0.0, 0.0
    for k in range(3):
        along += (p[k] - a[k]) * (b[k] - a[k])
        length += (b[k] - a[k]) ** 2
    t = min(max(along / length, 0.0), 1.0) if length > 0.0 else 0.0
    square = 0.0
    for k in range(3):
        square += (a[k] + t * (b[k] - a[k]) - p[k]) ** 2
    return square


@kernel
def _depth(p, corners, border, members):  # type: ignore[no-untyped-def]
    """The squared distance of p from the border of a cell; inf where it has none."""
    least = math.inf
    for face in members:
        for k in range(3):
            if border[face, k]:
                square = _to_segment(p, corners[face, k], corners[face, (k + 1) % 3])
                least = min(least, square)
    return least


@kernel
def _choose(corners, middles, border, order, indptr, centroids, total, chosen, weights):  # type: ignore[no-untyped-def]
    """Write each cell's face and the place on it; see `centre_places`."""
    here = np.empty(3)
    point = np.empty(3)
    for n in range(indptr.shape[0] - 1):
        members = order[indptr[n] : indptr[n + 1]]
        resolution = 1e-12 * total[n]  # of squared distances: the first of equal ones is taken
        nearest = math.inf
        for face in members:
            a, b, c = corners[face, 0], corners[face, 1], corners[face, 2]
            here[0], here[1], here[2] = nearest_on_triangle(a, b, c, centroids[n])
            square = 0.0
            for k in range(3):
                at = here[0] * a[k] + here[1] * b[k] + here[2] * c[k]
                square += (at - centroids[n, k]) ** 2
            if square < nearest - resolution:
                nearest, chosen[n] = square, face
                weights[n] = here
        for k in range(3):
            point[k] = 0.0
            for c in range(3):
                point[k] += weights[n, c] * corners[chosen[n], c, k]
        inside = _depth(point, corners, border, members)
        if inside >= _INSIDE**2 * total[n]:
            continue
        depths = np.empty(members.shape[0])
        for m in range(members.shape[0]):
            depths[m] = _depth(middles[members[m]], corners, border, members)
        deepest = depths.max()
        if inside >= deepest / 4.0:
            continue
        nearest = math.inf
        for m in range(members.shape[0]):
            if depths[m] < _DEEP**2 * deepest - resolution:
                continue
            square = 0.0
            for k in range(3):
                square += (middles[members[m], k] - centroids[n, k]) ** 2
            if square < nearest - resolution:
                nearest, chosen[n] = square, members[m]
                weights[n, :] = 1.0 / 3.0
