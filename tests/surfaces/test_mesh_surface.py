"""Meshes as surfaces: nearest places, normals also over creases, parts, smoothed copies."""

import itertools
from dataclasses import replace
from functools import cache

import mesh_patches
import networkx as nx
import numpy as np
import pytest
from mesh_patches import bent, can, roof
from part_walks import survivors
from samples import sampled, seeds
from smooth_probes import POSE
from triangle_probes import KINDS, assert_nearest, degenerate, least_distances, scattered

from coverable import mesh
from coverable.errors import CoverableError
from surfaces.meshes.facets import facets_of
from surfaces.meshes.normals import sectors
from surfaces.meshes.smoothing import smoothed
from surfaces.meshes.triangle_mesh import TriangleMesh


def rough(count=6, seed=2):
    """A sheet with random heights: normals of neighbours differ by any angle, creases all over."""
    u, v, faces = mesh_patches.grid(count, count)
    z = np.random.default_rng(seed).normal(scale=0.05, size=len(u))
    return TriangleMesh(np.stack([u, v, z], axis=1), faces)


def plain(name, **sizes):
    return TriangleMesh(*getattr(mesh_patches, name)(**sizes))


@cache
def meshes():
    """Of smooth shapes, and of shapes with creases, as they are and cut into cells."""
    triangle = TriangleMesh([[0, 0, 0], [1, 0, 0], [0.3, 0.2, 0.1]], [[0, 1, 2]])
    return {
        "a triangle": mesh(triangle, **POSE),
        "sheet": mesh(plain("sheet", n=10), **POSE),
        "dome": mesh(plain("dome", nu=20, nv=25), side="inside"),
        "hood": mesh(plain("hood", nu=24, nv=20), **POSE),
        "box": mesh(plain("box"), **POSE),
        "box of cells": mesh(plain("box"), **POSE).cells(count=8).surface,
        "rough": mesh(rough(), **POSE),
        "rough cells": mesh(rough(), **POSE).cells(count=12).surface,
    }


@pytest.fixture(params=list(meshes()))
def surface(request):
    return meshes()[request.param]


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 17, 1000])
def test_nearest_places_are_those_of_a_look_at_each(count):
    rng = np.random.default_rng(count)
    assert_nearest(scattered(count, rng.choice([0.01, 0.3]), rng), 1.5 * rng.normal(size=(100, 3)))


@sampled("seed", seeds(1, all=100))
@pytest.mark.parametrize("kind", KINDS)
def test_triangles_that_are_none_have_nearest_places_too(kind, seed):
    rng = np.random.default_rng([seed, KINDS.index(kind)])
    corners = degenerate(kind, rng)
    lines = corners[rng.integers(0, 300, 60), 0] + 1e-3 * rng.normal(size=(60, 3))
    points = np.concatenate([1.5 * rng.normal(size=(60, 3)), lines, corners[:20, 1]])
    assert_nearest(corners, points)
    for _ in range(seed > 0):  # and of any size, in a campaign
        some = scattered(int(rng.integers(1, 3000)), 10.0 ** rng.uniform(-4, 1), rng)
        assert_nearest(some, 2.0 * rng.normal(size=(20, 3)))


@pytest.mark.parametrize("name", ["dome", "box", "blade", "slivers", "scattered"])
def test_heights_are_distances_from_the_nearest_triangle(name):
    """On, near and far from meshes of even and odd triangles; outside is on the faces' side."""
    rng, surface = np.random.default_rng(3), mesh(plain(name), **POSE)
    local = surface.mesh.vertices[surface.mesh.faces]
    low, high = local.min(axis=(0, 1)), local.max(axis=(0, 1))
    points = rng.uniform(low - 0.3, high + 0.3, (60 if name == "box" else 30, 3))
    placed = points @ surface.rotation.T + surface.position
    found = surface.closest(placed.reshape(2, -1, 3))
    height = found.height.ravel()
    np.testing.assert_allclose(np.abs(height), least_distances(local, points), atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(found.normal, axis=2), 1.0, atol=1e-12)
    assert found.inside.all()
    assert np.isnan(found.u).all()
    if name == "box":
        within = ((points > low) & (points < high)).all(axis=1)
        np.testing.assert_array_equal(height < 0.0, within)


CREASED = {"roof": lambda: roof(90), "steep roof": lambda: roof(140), "box": lambda: plain("box"),
           "can": can}  # fmt: skip


@pytest.mark.parametrize("name", CREASED)
def test_the_normal_is_continuous_and_turns_no_faster_than_is_said(name):
    """From either face of an edge, where three creases meet too; by differences, most on strips."""
    cells = mesh(CREASED[name]()).cells(50)
    surface, edges = cells.surface, cells.surface.mesh.edges
    faces, rng = surface.mesh.faces, np.random.default_rng(3)
    for share in [0.0, 1.0, *rng.uniform(size=7)]:
        one, other = (
            surface.normals_at(f, (faces[f] == edges.vertices[:, [0]]) * (1.0 - share)
                               + (faces[f] == edges.vertices[:, [1]]) * share)
            for f in edges.faces.T
        )  # fmt: skip
        np.testing.assert_allclose(one, other, atol=1e-12)
    creased = np.flatnonzero(surface.on_crease.any(axis=1))
    face = rng.choice(creased, 20_000)
    weights = rng.dirichlet([1, 1, 1], len(face)) * np.where(surface.on_crease[face], 20.0, 1.0)
    weights /= weights.sum(axis=1, keepdims=True)
    step = 1e-4 * rng.normal(size=(len(face), 3))
    ahead = weights + step - step.mean(axis=1, keepdims=True)
    inside = (ahead > 0.0).all(axis=1)
    way = np.einsum("kc,kci->ki", ahead - weights, surface.mesh.vertices[faces[face]])
    turn = surface.normals_at(face, ahead) - surface.normals_at(face, weights)
    rate = (np.linalg.norm(turn, axis=1) / np.linalg.norm(way, axis=1))[inside]
    said = cells.max_curvature[cells.labels[face[inside]]]
    assert (rate <= said * (1.0 + 1e-6)).all()
    assert (rate / said).max() > 0.6


def test_corners_are_parted_by_creases_alone():
    """Against the faces round every vertex, one by one, on a rough sheet full of broken creases."""
    made = rough(11, seed=5)
    parts, normals, counts = sectors(made), made.face_normals, set()
    for vertex in range(144):
        around, here = nx.Graph(), np.flatnonzero((made.faces == vertex).any(axis=1)).tolist()
        around.add_nodes_from(here)
        for one, other in itertools.combinations(here, 2):
            edge = set(made.faces[one]) & set(made.faces[other])
            if len(edge) == 2 and normals[one] @ normals[other] >= np.cos(np.radians(30.0)):
                around.add_edge(one, other)
        own = {f: int(parts[f][made.faces[f] == vertex][0]) for f in here}
        groups = [{own[f] for f in group} for group in nx.connected_components(around)]
        assert all(len(group) == 1 for group in groups)
        assert len(set().union(*groups)) == len(groups)
        counts.add(len(groups))
    assert {1, 2, 3} <= counts


def places(surface, count=2000, seed=4):
    """Faces (k,) and weights (k, 3): inside, on edges and corners, and on strips along creases."""
    rng = np.random.default_rng(seed)
    face = rng.integers(len(surface.mesh.faces), size=count)
    creased = np.flatnonzero(surface.on_crease.any(axis=1))
    if len(creased):
        face[::2] = rng.choice(creased, len(face[::2]))
    weights = rng.dirichlet([1.0, 1.0, 1.0], count)
    weights[rng.uniform(size=(count, 3)) < 0.1] = 0.0
    weights[::4] *= np.where(surface.on_crease[face], 1.0, 0.1 * rng.uniform(size=(count, 1)))[::4]
    weights[weights.sum(axis=1) == 0.0, 0] = 1.0
    return face, weights / weights.sum(axis=1, keepdims=True)


@pytest.mark.parametrize("name", ["dome", "hood", "box of cells", "rough cells"])
def test_every_place_reaches_a_finest_part_and_with_smaller_radii_some_do_not(name):
    """And so do nearest places of points above, with the normals that motions are judged by."""
    surface = meshes()[name]
    face, weights = places(surface)
    points, normals = surface.points_at(face, weights), surface.normals_at(face, weights)
    above = points + np.random.default_rng(6).normal(scale=0.01, size=(len(face), 1)) * normals
    near = surface.points_at(*surface.nearest(above)), surface.closest(above).normal
    for most in (1, 2000, 100):
        parts = surface.parts(1e-3, 0.05, most)
        assert survivors(parts, points, normals).all()
        assert survivors(parts, *near).all()
        assert len(parts) <= most
    for column in (0, 1):
        radius = parts.radius.copy()
        radius[:, column] *= 0.8
        assert not survivors(replace(parts, radius=radius), points, normals).all()


@pytest.mark.parametrize("straight", [0.02, 0.2, 5.0])
def test_facets_are_the_mesh_and_their_normals_its_own(surface, straight):
    normals = surface.corner_normals, surface.crease_normals
    facets = facets_of(surface.face_balls[0], *normals, surface.on_crease, straight)
    sides = facets.corners[:, 1:] - facets.corners[:, :1]
    areas = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1) / 2.0
    assert areas.sum() == pytest.approx(surface.mesh.area)
    assert areas.min() > 0.0
    share = np.random.default_rng(8).dirichlet([1.0, 1.0, 1.0], len(areas))
    a, b, c = share.T
    basis = np.stack([a * a, b * b, c * c, 2 * a * b, 2 * b * c, 2 * c * a], axis=1)
    direction = np.einsum("gk,gkd->gd", basis, facets.normals)
    length = np.linalg.norm(direction, axis=1)
    place = np.einsum("gk,gkd->gd", share, facets.corners)
    found = surface.normals_at(*surface.nearest(place @ surface.rotation.T + surface.position))
    assert (np.abs(length - 1.0) <= facets.off + 1e-12).all()
    assert direction / length[:, None] == pytest.approx(found @ surface.rotation, abs=1e-7)


LENGTH = 0.1


def bead(flank: float):
    """0.6 x 0.4 m with a ridge 8 mm high across, its flanks so wide (m)."""

    def shape(u, v):
        x = 0.6 * u
        return x, 0.4 * v, 0.008 * np.clip((0.015 + flank - abs(x - 0.31)) / flank, 0.0, 1.0)

    return bent(shape, 30, 30)


@pytest.mark.parametrize(("share", "kept"), [(4.0, 0.996), (1.0, 0.5), (0.5, 1.0 / 17.0)])
def test_a_wave_of_the_length_keeps_half_its_height(share, kept):
    wave = bent(lambda u, v: (u, 0.5 * v, 1e-3 * np.sin(2 * np.pi * u / (share * LENGTH))), 120, 60)
    corners = smoothed(mesh(TriangleMesh(*wave)), LENGTH, 1.0).mesh.vertices
    inner = (abs(corners[:, :2] - [0.5, 0.25]) < [0.3, 0.1]).all(axis=1)
    assert abs(corners[inner, 2]).max() == pytest.approx(1e-3 * kept, rel=0.1)


def test_planes_stay_up_to_their_borders_needles_or_not():
    """Rows down to a micrometre wide, far from the origin."""
    flat = bent(lambda u, v: (5.0 + 0.6 * u, 7.0 + 0.4 * v**9, 0.3 * u + 0.2), 12, 6)
    assert smoothed(mesh(TriangleMesh(*flat)), LENGTH, 1.0).smoothing.off < 1e-9


@pytest.mark.parametrize("flank", [0.008, 0.035])
def test_neither_is_further_from_the_other_than_is_said(flank):
    """Of the cells too, whose triangles are other ones; the surface before is kept for the rest."""
    rng, (vertices, faces) = np.random.default_rng(1), bead(flank)
    given = mesh(TriangleMesh(vertices, faces))
    whole = smoothed(given, LENGTH, 0.01)
    for smooth in (whole, whole.cells(20).surface):
        assert 1e-3 < smooth.smoothing.off < 0.008
        assert smooth.deviations == (smooth.smoothing.off, 0.0)
        corners, copied = vertices[faces], smooth.mesh.vertices[smooth.mesh.faces]
        apart = [
            least_distances(triangles, rng.choice(points, 12, replace=False)).max()
            for own, triangles in ((copied, corners), (corners, copied))
            for points in (own[:, 0], own.mean(axis=1))
        ]
        assert max(apart) <= smooth.smoothing.off + 1e-12
        assert max(apart) >= 0.4 * smooth.smoothing.off  # sliding along the sheet is a part of it
        some = rng.choice(smooth.wall.mesh.vertices, 12, replace=False)
        assert least_distances(corners, some).max() < 1e-12
        assert smooth.wall.mesh.area == pytest.approx(given.mesh.area, rel=1e-9)
    assert smoothed(given, LENGTH, 1e-3).deviations == (0.0, 0.0)  # more than the tolerance


def test_it_moves_with_its_wall_and_lengths_that_make_no_sense_are_refused():
    given = mesh(TriangleMesh(*bead(0.01)))
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    moved = smoothed(given, LENGTH, 0.01).moved(turn, [1.0, 2.0, 3.0])
    place = given.mesh.vertices[:9] @ turn.T + [1.0, 2.0, 3.0]
    assert np.abs(moved.wall.closest(place).height).max() < 1e-12
    for length, said in ((0.0, "length"), (np.nan, "length"), (1e-4, "take .* m or more")):
        with pytest.raises(CoverableError, match=said):
            smoothed(given, length, 0.01)
