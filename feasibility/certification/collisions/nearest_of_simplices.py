"""The points nearest to the origin of many tetrahedra at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

TINY = 1e-300  # what keeps quotients of zeros finite
FLAT = 1e-30  # [m^4] square of twice the area of a face, below which its edges have to do
THIN = 1e-12  # [m] height of a tetrahedron, below which nothing is inside

EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])
FACES = np.array([[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]])
OPPOSITE = np.array([3, 2, 1, 0])  # the corner that is not of each face
OF_EDGES = np.concatenate([EDGES, EDGES[:, 1:]], axis=1)  # as three corners, one of them twice


def nearest_of(corners: Array) -> tuple[Array, Array]:
    """The nearest points, and what they are spanned by.

    Args:
        corners: (k, 4, 3), which may coincide.

    Returns:
        (k, 3) the points, 0 where the origin is inside; (k, 3, 3) corners that span them.
    """
    start = corners[:, EDGES[:, 0]]
    way = corners[:, EDGES[:, 1]] - start
    square = np.maximum(np.einsum("kei,kei->ke", way, way), TINY)
    share = np.clip(-np.einsum("kei,kei->ke", start, way) / square, 0.0, 1.0)
    on_edges = start + share[:, :, None] * way
    on_faces, inside = _on_faces(corners)
    points = np.concatenate([on_edges, on_faces], axis=1)
    best = np.einsum("kpi,kpi->kp", points, points).argmin(axis=1)
    rows = np.arange(len(corners))
    kept = np.concatenate([OF_EDGES, FACES])[best]
    found = np.where(inside[:, None], 0.0, points[rows, best])
    return found, corners[rows[:, None], kept]


def _on_faces(corners: Array) -> tuple[Array, NDArray[np.bool_]]:
    """(k, 4, 3) the origin projected onto the faces, inf if beside them; (k,) is it inside?"""
    a, b, c = (corners[:, FACES[:, i]] for i in range(3))
    normals = _cross(b - a, c - a)
    square = np.einsum("kfi,kfi->kf", normals, normals)
    flat = square <= FLAT
    height = np.einsum("kfi,kfi->kf", normals, a)
    projected = (height / np.where(flat, 1.0, square))[:, :, None] * normals
    ahead = projected - a, projected - b, projected - c
    turned = [_cross(one, other) for one, other in zip(ahead, ahead[1:] + ahead[:1], strict=True)]
    sides = np.stack([np.einsum("kfi,kfi->kf", normals, one) for one in turned])
    beside = flat | ~(sides.min(axis=0) >= 0.0)
    other = np.einsum("kfi,kfi->kf", normals, corners[:, OPPOSITE]) - height
    thin = flat | (np.abs(other) <= THIN * np.sqrt(square))
    inside = (~thin & (-height * other > 0.0)).all(axis=1)
    return np.where(beside[:, :, None], np.inf, projected), inside


def _cross(a: Array, b: Array) -> Array:
    """(k, 4, 3) cross products; numpy's own takes three times as long."""
    turned = np.empty_like(a)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        turned[..., i] = a[..., j] * b[..., k] - a[..., k] * b[..., j]
    return turned
