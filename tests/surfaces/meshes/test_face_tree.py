"""The tree over triangles against a look at each of them, in more digits."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from mesh_patches import sheet
from triangle_probes import KINDS, assert_nearest, degenerate, scattered

from surfaces.meshes import FaceTree


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
