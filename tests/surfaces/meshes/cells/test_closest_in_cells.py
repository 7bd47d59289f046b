"""Closest places on the cells of a pair, against the tree over the faces of those cells alone."""

from __future__ import annotations

import mesh_patches
import numpy as np
import pytest

from surfaces import mesh
from surfaces.meshes import FaceTree, TriangleMesh
from surfaces.meshes.cells import MeshCells


def around(cells: MeshCells, pair: tuple[int, int]) -> list[int]:
    """The cells of a pair, and those that touch both."""
    near = {cell: set(cells.graph()[cell]) for cell in pair}
    return [*pair, *(near[pair[0]] & near[pair[1]])]


@pytest.mark.parametrize("shape", ["blade", "box", "scattered"])
def test_the_closest_places_are_on_the_cells_of_the_pair(shape: str) -> None:
    """Points beside the pair, and far off, where other cells are nearer (a blade is thin)."""
    rng = np.random.default_rng(3)
    part = TriangleMesh(*mesh_patches.PATCHES[shape]())
    cells = mesh(part, position=(0.3, 0.1, -0.2), rpy_deg=(20, 30, 40)).cells(40)
    surface, corners = cells.surface, cells.surface.face_balls[0]
    pairs = cells.pairs[rng.integers(0, len(cells.pairs), 12)]
    middles = cells.centres[pairs].mean(axis=1)[:, None]
    points = middles + rng.choice([0.003, 0.3], (12, 40, 1)) * rng.normal(size=(12, 40, 3))
    points[3, 5], points[4, 6, 1] = np.nan, np.nan
    faces, weights = cells._closest_faces(pairs, points)
    elsewhere = 0
    for row, pair in enumerate(pairs.tolist()):
        some = np.flatnonzero(np.isin(cells.labels, around(cells, pair)))
        known = np.isfinite(points[row]).all(axis=1)
        flat = (points[row, known] - surface.position) @ surface.rotation
        best, share = FaceTree.of(corners[some]).nearest(flat)
        found = faces[row, known], weights[row, known]
        assert np.isin(found[0], some).all()
        away, least = (
            np.linalg.norm(flat - np.einsum("kc,kci->ki", w, corners[f]), axis=1)
            for f, w in (found, (some[best], share))
        )
        np.testing.assert_allclose(away, least, rtol=0, atol=1e-13)
        elsewhere += int((~np.isin(surface.nearest(points[row, known])[0], some)).sum())
        assert (faces[row, ~known] == -1).all()
        assert np.isnan(weights[row, ~known]).all()
    assert elsewhere > 20


def test_normals_turn_as_the_corners_say() -> None:
    """n along the sum of w_c (own_c + t (crease_c - own_c)), t from the weight on the crease."""
    rng = np.random.default_rng(4)
    surface = mesh(TriangleMesh(*mesh_patches.box()), rpy_deg=(10, 20, 30)).cells(60).surface
    face = np.concatenate(
        [
            np.flatnonzero(surface.on_crease.any(axis=1)),
            rng.integers(0, len(surface.mesh.faces), 50),
        ]
    )
    weights = rng.dirichlet(np.ones(3), len(face)) ** rng.choice([1.0, 8.0], (len(face), 1))
    weights /= weights.sum(axis=1, keepdims=True)
    share = surface.crease_share(face, weights)[:, None, None]
    assert 0.0 < share.mean() < 1.0
    own, crease = surface.corner_normals[face], surface.crease_normals[face]
    mean = (weights[..., None] * (own + share * (crease - own))).sum(axis=1)
    expected = mean / np.linalg.norm(mean, axis=1, keepdims=True) @ surface.rotation.T
    np.testing.assert_allclose(surface.normals_at(face, weights), expected, rtol=0, atol=1e-15)
    two = face.reshape(1, -1), weights.reshape(1, -1, 3)
    np.testing.assert_array_equal(surface.normals_at(*two)[0], surface.normals_at(face, weights))
