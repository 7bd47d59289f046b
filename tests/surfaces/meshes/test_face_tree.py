"""The tree over triangles against a look at each of them."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from mesh_patches import sheet

from surfaces.meshes import FaceTree
from surfaces.meshes.closest_point import nearest_of


@pytest.mark.parametrize("count", [1, 2, 4, 5, 17, 1000])
def test_nearest_triangles_are_those_of_a_look_at_each(count: int) -> None:
    rng = np.random.default_rng(count)
    middles = rng.normal(size=(count, 1, 3))
    corners = middles + rng.choice([0.01, 0.3]) * rng.normal(size=(count, 3, 3))
    points = 1.5 * rng.normal(size=(200, 3))
    faces, weights = FaceTree.of(corners).nearest(points)
    radii = np.linalg.norm(corners - corners.mean(axis=1, keepdims=True), axis=2).max(axis=1)
    away = np.linalg.norm(points - np.einsum("kc,kci->ki", weights, corners[faces]), axis=1)
    for k, point in enumerate(points):
        face, least = nearest_of(
            corners, corners.mean(axis=1), radii, np.arange(count), point, np.empty(3)
        )
        assert abs(away[k] - least) <= 1e-15 * (1.0 + least)
        assert faces[k] == face
    assert (weights >= 0.0).all()
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, rtol=0, atol=1e-15)


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
