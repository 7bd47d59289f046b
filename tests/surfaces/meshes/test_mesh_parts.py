"""Parts of meshes: every place of every face reaches a finest part, strips along creases too."""

from dataclasses import replace

import mesh_patches
import numpy as np
import pytest
from part_walks import survivors
from smooth_probes import POSE

from surfaces import mesh
from surfaces.meshes.facets import facets_of
from surfaces.meshes.normals import WIDTH
from surfaces.meshes.triangle_mesh import TriangleMesh


def box(x=0.3, y=0.4, z=0.5):
    corners = [[a, b, c] for a in (0, x) for b in (0, y) for c in (0, z)]
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [(a, b, c) for a, b, c, _ in sides] + [(a, c, d) for a, _, c, d in sides]
    return TriangleMesh(corners, faces)


def rough(seed=2):
    """A sheet with random heights: normals of neighbours differ by any angle, creases all over."""
    u, v, faces = mesh_patches.grid(6, 6)
    z = np.random.default_rng(seed).normal(scale=0.05, size=len(u))
    return TriangleMesh(np.stack([u, v, z], axis=1), faces)


def plain(shape):
    return TriangleMesh(shape.vertices, shape.faces)


MESHES = {
    "a triangle": mesh(TriangleMesh([[0, 0, 0], [1, 0, 0], [0.3, 0.2, 0.1]], [[0, 1, 2]]), **POSE),
    "sheet": mesh(plain(mesh_patches.sheet(10)), **POSE),
    "dome": mesh(plain(mesh_patches.dome(20, 25)), side="inside"),
    "horn": mesh(plain(mesh_patches.horn(24, 20)), **POSE),
    "box": mesh(box(), **POSE),
    "box of cells": mesh(box(), **POSE).cells(count=8).surface,
    "rough": mesh(rough(), **POSE),
    "rough cells": mesh(rough(), **POSE).cells(count=12).surface,
}


@pytest.fixture(params=MESHES, ids=str)
def surface(request):
    return MESHES[request.param]


def places(surface, count=2000, seed=4):
    """Faces (k,) and weights (k, 3): inside, on edges and corners, and on strips along creases."""
    rng = np.random.default_rng(seed)
    face = rng.integers(len(surface.mesh.faces), size=count)
    creased = np.flatnonzero(surface.on_crease.any(axis=1))
    if len(creased):
        face[::2] = rng.choice(creased, len(face[::2]))
    weights = rng.dirichlet([1.0, 1.0, 1.0], count)
    weights[rng.uniform(size=(count, 3)) < 0.1] = 0.0
    on = surface.on_crease[face]
    near = np.where(on, 1.0, WIDTH * rng.uniform(size=(count, 1)))
    weights[::4] *= near[::4]
    empty = weights.sum(axis=1) == 0.0
    weights[empty, 0] = 1.0
    return face, weights / weights.sum(axis=1, keepdims=True)


def test_every_place_reaches_a_finest_part(surface):
    face, weights = places(surface)
    points, normals = surface.points_at(face, weights), surface.normals_at(face, weights)
    for most in (1, 50, 2000):
        parts = surface.parts(1e-3, 0.05, most)
        assert survivors(parts, points, normals).all()
        assert len(parts) <= most


def test_closest_points_reach_a_finest_part(surface):
    """With the normals that motions are judged by."""
    face, weights = places(surface, 1000)
    rng = np.random.default_rng(6)
    normals = surface.normals_at(face, weights)
    above = surface.points_at(face, weights) + rng.normal(scale=0.01, size=(1000, 1)) * normals
    found = surface.closest(above)
    faces, at = surface.nearest(above)
    parts = surface.parts(1e-3, 0.05, 2000)
    assert survivors(parts, surface.points_at(faces, at), found.normal).all()


def test_smaller_radii_lose_places():
    for name in ("dome", "horn", "box of cells", "rough cells"):
        surface = MESHES[name]
        face, weights = places(surface)
        points, normals = surface.points_at(face, weights), surface.normals_at(face, weights)
        parts = surface.parts(1e-3, 0.05, 100)
        for column in (0, 1):
            radius = parts.radius.copy()
            radius[:, column] *= 0.8
            assert not survivors(replace(parts, radius=radius), points, normals).all(), name


@pytest.mark.parametrize("straight", [0.02, 0.2, 5.0])
def test_facets_are_the_mesh_and_their_normals_its_own(surface, straight):
    normals = surface.corner_normals, surface.crease_normals
    facets = facets_of(surface.face_balls[0], *normals, surface.on_crease, straight)
    sides = facets.corners[:, 1:] - facets.corners[:, :1]
    areas = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1) / 2.0
    assert areas.sum() == pytest.approx(surface.mesh.area)
    assert areas.min() > 0.0
    rng = np.random.default_rng(8)
    share = rng.dirichlet([1.0, 1.0, 1.0], len(areas))
    a, b, c = share.T
    basis = np.stack([a * a, b * b, c * c, 2 * a * b, 2 * b * c, 2 * c * a], axis=1)
    place = np.einsum("gk,gkd->gd", share, facets.corners)
    direction = np.einsum("gk,gkd->gd", basis, facets.normals)
    length = np.linalg.norm(direction, axis=1)
    root = place @ surface.rotation.T + surface.position
    faces, weights = surface.nearest(root)
    normals = surface.normals_at(faces, weights) @ surface.rotation
    assert (np.abs(length - 1.0) <= facets.off + 1e-12).all()
    assert direction / length[:, None] == pytest.approx(normals, abs=1e-7)


def test_flat_sides_of_a_box_are_flat_parts():
    parts = MESHES["box"].parts(1e-3, 0.05)
    finest = parts.children[:, 0] < 0
    assert parts.radius[finest].max() < 1e-11
    assert finest.sum() <= 12


def test_a_sheet_is_one_part_with_little_beside_it():
    parts = MESHES["sheet"].parts(1e-3, 0.05)
    assert len(parts) == 1
    sides = np.linalg.norm(parts.slopes[0, :, :3], axis=1)
    assert np.sort(2.0 * sides) == pytest.approx([0.4, 0.6], rel=0.02)


def test_single_faces_are_exact():
    """Over one face without a crease points are affine, and so is what the normal is along."""
    surface = MESHES["dome"]
    parts = surface.parts(1e-12, 1e-12)
    finest = parts.children[:, 0] < 0
    assert finest.sum() == len(surface.mesh.faces)
    assert parts.radius[finest, 0].max() < 1e-11
    turn = np.linalg.norm(surface.corner_normals - np.roll(surface.corner_normals, 1, 1), axis=2)
    assert parts.radius[finest, 1].max() < turn.max() ** 2 / 8.0
