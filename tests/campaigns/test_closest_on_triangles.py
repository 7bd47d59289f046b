"""Nearest places on many meshes, most of them of triangles that files should not hold."""

import numpy as np
import pytest
from triangle_probes import KINDS, assert_nearest, degenerate, scattered

MESHES = 100  # of each kind


@pytest.mark.parametrize("kind", KINDS)
def test_places_on_degenerate_triangles(kind):
    for seed in range(MESHES):
        rng = np.random.default_rng([seed, KINDS.index(kind)])
        corners = degenerate(kind, rng)
        near = corners[rng.integers(0, 300, 30), 0] + 1e-3 * rng.normal(size=(30, 3))
        assert_nearest(corners, np.concatenate([2.0 * rng.normal(size=(30, 3)), near]))


def test_places_on_meshes_of_any_size():
    rng = np.random.default_rng(99)
    for _ in range(MESHES):
        corners = scattered(int(rng.integers(1, 3000)), 10.0 ** rng.uniform(-4, 1), rng)
        assert_nearest(corners, 2.0 * rng.normal(size=(20, 3)))
