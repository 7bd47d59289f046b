"""Triangles of every shape, and a look at each of them for the place nearest to a point."""

import numpy as np
from numpy.typing import NDArray

from surfaces.meshes.face_tree import FaceTree

Array = NDArray[np.float64]


def least_distances(corners: Array, points: Array) -> Array:
    """(k,) m, of points from triangles: sides and planes one by one, in more digits than double."""
    long = np.longdouble
    a, b, c = (corners[None, :, k].astype(long) for k in range(3))
    p = points[:, None].astype(long)
    least = np.full(np.broadcast_shapes(p.shape, a.shape)[:2], np.inf, dtype=long)
    for start, end in ((a, b), (b, c), (c, a)):
        side = end - start
        square = (side * side).sum(axis=2)
        t = ((p - start) * side).sum(axis=2) / np.where(square > 0, square, 1)
        foot = start + np.clip(t, 0, 1)[..., None] * side
        least = np.minimum(least, np.sqrt(((p - foot) ** 2).sum(axis=2)))
    normal = np.cross(b - a, c - a)
    square = (normal * normal).sum(axis=2)
    height = ((p - a) * normal).sum(axis=2) / np.where(square > 0, np.sqrt(square), 1)
    foot = p - (height / np.where(square > 0, np.sqrt(square), 1))[..., None] * normal
    inside = square > 0
    for start, end in ((a, b), (b, c), (c, a)):
        inside = inside & ((np.cross(end - start, foot - start) * normal).sum(axis=2) >= 0)
    return np.where(inside, np.minimum(least, abs(height)), least).min(axis=1).astype(float)


def scattered(count: int, size: float, rng: np.random.Generator) -> Array:
    return rng.normal(size=(count, 1, 3)) + size * rng.normal(size=(count, 3, 3))


def degenerate(kind: str, rng: np.random.Generator) -> Array:
    """300 triangles of a kind that files hold, and readers should not."""
    corners = scattered(300, 0.3, rng)
    a, b, c = corners.transpose(1, 0, 2)
    share = rng.uniform(-0.5, 1.5, (300, 1))
    if kind == "thin":  # down to a height of 1e-12 of their length
        c[:] = a + share * (b - a) + 10.0 ** rng.uniform(-12, -1, (300, 1)) * (c - a)
    elif kind == "long":
        c[:] = a + 10.0 ** rng.uniform(-9, -1, (300, 1)) * (c - a)
    elif kind == "in a line":
        c[:] = a + np.round(8.0 * share) / 8.0 * (b - a)
    elif kind == "two corners equal":
        corners[np.arange(300), rng.integers(0, 3, 300)] = corners[:, 0]
    elif kind == "points":
        b[:] = c[:] = a
    elif kind == "repeated":
        corners[:] = corners[rng.integers(0, 20, 300)]
    elif kind == "large and small":
        corners[:] = a[:, None] + 10.0 ** rng.uniform(-6, 1, (300, 1, 1)) * (corners - a[:, None])
    elif kind == "far away":
        corners += 1e3
    return np.ascontiguousarray(corners[:, rng.permutation(3)])


KINDS = (
    "thin", "long", "in a line", "two corners equal", "points", "repeated", "large and small",
    "far away",
)  # fmt: skip


def assert_nearest(corners: Array, points: Array) -> None:
    """The tree's places are on their triangles, and none is nearer."""
    faces, weights = FaceTree.of(corners).nearest(points)
    assert (weights >= 0.0).all()
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, rtol=0, atol=1e-15)
    away = np.linalg.norm(points - np.einsum("kc,kci->ki", weights, corners[faces]), axis=1)
    scale = max(np.abs(corners).max(), np.abs(points).max())
    assert np.abs(away - least_distances(corners, points)).max() <= 1e-14 * scale
