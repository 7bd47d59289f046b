"""The tree over triangles against a look at each of them, in more digits."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from mesh_patches import sheet
from numpy.typing import NDArray

from surfaces.meshes import FaceTree

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
    """Triangles of one size, anywhere."""
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


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 17, 1000])
def test_nearest_places_are_those_of_a_look_at_each(count: int) -> None:
    rng = np.random.default_rng(count)
    assert_nearest(scattered(count, rng.choice([0.01, 0.3]), rng), 1.5 * rng.normal(size=(100, 3)))


@pytest.mark.parametrize("kind", KINDS)
def test_triangles_that_are_none_have_nearest_places_too(kind: str) -> None:
    rng = np.random.default_rng(KINDS.index(kind))
    corners = degenerate(kind, rng)
    lines = corners[rng.integers(0, 300, 60), 0] + 1e-3 * rng.normal(size=(60, 3))
    assert_nearest(
        corners, np.concatenate([1.5 * rng.normal(size=(60, 3)), lines, corners[:20, 1]])
    )


def test_each_box_holds_its_triangles_and_each_triangle_is_there_once() -> None:
    rng = np.random.default_rng(8)
    for count in (1, 2, 7, 64, 333):
        corners = scattered(count, 0.1, rng)
        corners[::3] = corners[0]  # of equal ones there may be any number
        tree = FaceTree.of(corners)
        assert sorted(tree.order) == list(range(count))
        np.testing.assert_array_equal(tree.corners, corners[tree.order])
        for level in range(tree.depth + 1):
            for node in range(2**level):
                run = slice((node * count) >> level, ((node + 1) * count) >> level)
                some = tree.corners[run].reshape(-1, 3)
                box = tree.boxes[2**level - 1 + node]
                np.testing.assert_array_equal(box, np.concatenate([some.min(0), some.max(0)]))


def test_over_an_edge_the_triangle_given_first_counts_whatever_the_rounding() -> None:
    """Over the edges of an octahedron two faces are equally near, over its vertices four."""
    rng = np.random.default_rng(0)
    vertices = np.concatenate([np.eye(3), -np.eye(3)])
    octants = np.array(list(itertools.product((0, 3), repeat=3))) + np.arange(3)
    for _ in range(50):
        faces = rng.permutation(octants)
        frame = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        tree = FaceTree.of(vertices[faces] @ frame)
        for count in (1, 2):
            for some in itertools.combinations(range(6), count):
                holds = np.isin(faces, some).sum(axis=1) == count
                if holds.any():
                    point = rng.uniform(1.0, 3.0) * vertices[list(some)].sum(axis=0) @ frame
                    assert tree.nearest(point[None])[0] == np.flatnonzero(holds)[0]


def test_points_that_are_not_finite_have_no_face() -> None:
    flat = sheet(4)
    points = np.array([[0.1, 0.1, 1.0], [np.nan, 0.0, 0.0], [0.0, np.inf, 0.0]])
    faces, weights = FaceTree.of(flat.vertices[flat.faces]).nearest(points)
    assert faces.tolist()[1:] == [-1, -1]
    assert np.isnan(weights[1:]).all()
    assert faces[0] >= 0
