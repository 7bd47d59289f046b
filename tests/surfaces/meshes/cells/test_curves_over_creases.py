"""Curves over creases: over the corner of the shortest path, at rest there, on the surface."""

import itertools

import mesh_patches
import networkx as nx
import numpy as np
import pytest

from surfaces.curve_fitting import CurveFit
from surfaces.meshes import TriangleMesh, mesh
from surfaces.meshes.cells.reshaped_curves import _shortest
from surfaces.meshes.normals import sectors


def roof(angle_deg, side=0.3):
    """Two plates that meet at an edge along y; the normal turns by the angle there."""
    half = np.radians(angle_deg) / 2
    x, z = side * np.cos(half), -side * np.sin(half)
    vertices = [[0, 0, 0], [0, side, 0], [x, 0, z], [x, side, z], [-x, 0, z], [-x, side, z]]
    return TriangleMesh(np.array(vertices), [[0, 2, 3], [0, 3, 1], [0, 1, 5], [0, 5, 4]])


def creased_curves(cells):
    """Curves that come to rest, each as its pieces (4 k, 4, 6)."""
    curves = cells.curves
    which = np.flatnonzero(curves.creased)
    return which, [curves.cubics[curves.first[k] : curves.first[k + 1]] for k in which]


@pytest.mark.parametrize("angle", [40, 90, 150, -90])
def test_a_way_crosses_the_crease_where_it_is_shortest(angle):
    """Against every place of the edge, and from either side alone."""
    rng = np.random.default_rng(abs(angle))
    made = roof(angle)
    edge = made.vertices[[0, 1]]
    inwards = np.array([made.vertices[2], made.vertices[4]])
    along = edge[0] + np.linspace(0.0, 1.0, 20_001)[:, None] * (edge[1] - edge[0])
    for _ in range(20):
        right, left = (
            share[0] * corner + share[1] * edge[1]
            for corner, share in zip(inwards, rng.uniform(0.05, 0.9, (2, 2)), strict=True)
        )
        found = _shortest(np.array([right, left]), edge[None], inwards[None])
        lengths = np.linalg.norm(along - right, axis=1) + np.linalg.norm(along - left, axis=1)
        at = np.linalg.norm(found - right) + np.linalg.norm(found - left)
        assert at <= lengths.min() + 1e-12
        assert at == pytest.approx(lengths.min(), abs=1e-7)
        assert np.isnan(_shortest(np.array([right, 0.5 * right]), edge[None], inwards[None])).all()


@pytest.mark.parametrize("name", ["roof 40", "roof 90", "roof 140", "box", "can"])
def test_creased_curves_are_smooth_in_time_and_stay_on_the_surface(name):
    cells = mesh(PARTS[name]()).cells(60)
    which, pieces = creased_curves(cells)
    assert len(which) >= 5
    for cubics in pieces:
        ends = cubics.sum(axis=1)
        slopes = cubics[:, 1] + 2.0 * cubics[:, 2] + 3.0 * cubics[:, 3]
        np.testing.assert_allclose(ends[:-1], cubics[1:, 0], atol=1e-12)
        np.testing.assert_allclose(slopes[:-1], cubics[1:, 1], atol=1e-9)
        quarter = len(cubics) // 4
        assert np.abs(cubics[[quarter, 2 * quarter, 3 * quarter], 1]).max() < 1e-12
        assert np.abs(slopes[[quarter - 1, 2 * quarter - 1, 3 * quarter - 1]]).max() < 1e-12
    curves = cells.curves
    assert np.flatnonzero(curves.rests).size == 6 * len(which)
    t = np.random.default_rng(0).uniform(size=200)
    pair = np.repeat(which, len(t))
    closest_point, normal = curves.at(pair, np.tile(t, len(which)))
    on = cells.surface.closest(closest_point)
    assert (np.abs(on.height) <= curves.deviations[pair, 0] + 1e-9).all()
    good = curves.deviations[pair, 1] < 0.01
    assert good.mean() > 0.7
    apart = np.linalg.norm(normal - on.normal, axis=1)[good]
    assert (apart <= 1.1 * curves.deviations[pair[good], 1]).all()


def can():
    """A round tin without its bottom."""
    turn = np.linspace(0, 2 * np.pi, 48, endpoint=False)
    circle = 0.15 * np.column_stack([np.cos(turn), np.sin(turn)])
    low, high = (np.column_stack([circle, np.full(48, z)]) for z in (-0.1, 0.1))
    k, after = np.arange(48), (np.arange(48) + 1) % 48
    wall = np.concatenate([np.column_stack([k, after, 48 + k]),
                           np.column_stack([after, 48 + after, 48 + k])])  # fmt: skip
    lid = np.column_stack([48 + k, 48 + after, np.full(48, 96)])
    return TriangleMesh(np.vstack([low, high, [[0, 0, 0.1]]]), np.vstack([wall, lid]))


def box():
    """A closed box."""
    made = mesh_patches.box()
    return TriangleMesh(0.4 * made.vertices, made.faces)


PARTS = {
    **{f"roof {angle}": (lambda angle=angle: roof(angle)) for angle in (40, 90, 140)},
    "box": box,
    "can": can,
}


@pytest.mark.parametrize("counts", [(1, 8, 4), (8, 4, 16), (4, 64, 1)])
def test_the_last_fit_of_a_curve_counts(counts):
    """However many pieces it had before, the others keep theirs."""
    rng = np.random.default_rng(0)
    before, after, others = counts
    fits = [
        (np.array([1, 3]), rng.normal(size=(2, before, 4, 6))),
        (np.array([0, 2]), rng.normal(size=(2, others, 4, 6))),
        (np.array([3]), rng.normal(size=(1, after, 4, 6))),
    ]
    fit = CurveFit(None, np.zeros((4, 2)), np.zeros((4, 2)), np.zeros(4, dtype=bool), fits)
    curves = fit.joined()
    expected = [fits[1][1][0], fits[0][1][0], fits[1][1][1], fits[2][1][0]]
    assert np.diff(curves.first).tolist() == [len(cubics) for cubics in expected]
    np.testing.assert_array_equal(curves.cubics, np.concatenate(expected))


@pytest.mark.parametrize("name", PARTS)
def test_the_normal_is_continuous_over_every_edge(name):
    """From either face of an edge, also where three creases meet."""
    surface = mesh(PARTS[name]()).cells(50).surface
    edges, faces = surface.mesh.edges, surface.mesh.faces
    shares = np.random.default_rng(1).uniform(size=7)
    for share in [0.0, 1.0, *shares]:
        normals = []
        for side in range(2):
            face = edges.faces[:, side]
            weights = (faces[face] == edges.vertices[:, [0]]) * (1.0 - share)
            weights = weights + (faces[face] == edges.vertices[:, [1]]) * share
            normals.append(surface.normals_at(face, weights))
        np.testing.assert_allclose(normals[0], normals[1], atol=1e-12)


def test_the_normal_turns_in_a_narrow_strip_alone():
    """On a roof: the plates' own normals but for a tenth of the small faces along the edge."""
    surface = mesh(roof(90)).cells(60).surface
    x = np.linspace(-0.2, 0.2, 4001)
    points = np.column_stack([x * np.cos(np.pi / 4), np.full(4001, 0.11), -np.abs(x) * 0.7071])
    normals = surface.closest(points).normal
    flat = np.column_stack([np.sign(x), 0 * x, np.ones(4001)]) / np.sqrt(2)
    turned = np.linalg.norm(normals - flat, axis=1) > 1e-6
    assert turned.any()
    assert np.abs(x[turned]).max() < 0.1 * surface.mean_edge_length
    assert normals[2000] == pytest.approx([0, 0, 1], abs=1e-9)


@pytest.mark.parametrize("name", PARTS)
def test_the_normal_turns_no_faster_than_is_said(name):
    """By differences within the faces along creases, most of them on the strip."""
    cells = mesh(PARTS[name]()).cells(50)
    surface = cells.surface
    rng = np.random.default_rng(3)
    creased = np.flatnonzero((surface.corner_normals != surface.crease_normals).any(axis=(1, 2)))
    face = rng.choice(creased, 20_000)
    on_crease = (surface.corner_normals[face] != surface.crease_normals[face]).any(axis=2)
    weights = rng.dirichlet([1, 1, 1], len(face)) * np.where(on_crease, 20.0, 1.0)
    weights /= weights.sum(axis=1, keepdims=True)
    step = 1e-4 * rng.normal(size=(len(face), 3))
    ahead = weights + step - step.mean(axis=1, keepdims=True)
    inside = (ahead > 0.0).all(axis=1)
    corners = surface.mesh.vertices[surface.mesh.faces[face]]
    way = np.einsum("kc,kci->ki", ahead - weights, corners)
    turn = surface.normals_at(face, ahead) - surface.normals_at(face, weights)
    rate = (np.linalg.norm(turn, axis=1) / np.linalg.norm(way, axis=1))[inside]
    said = cells.max_curvature[cells.labels[face[inside]]]
    assert (rate <= said * (1.0 + 1e-6)).all()
    assert (rate / said).max() > 0.6


def test_corners_are_parted_by_creases_alone():
    """Against the faces round every vertex, one by one, on a rough sheet full of broken creases."""
    x, y, faces = mesh_patches.grid(11, 11)
    z = 0.05 * np.random.default_rng(5).normal(size=144)
    made = TriangleMesh(np.column_stack([x, y, z]), faces)
    parts = sectors(made)
    normals, counts = made.face_normals, set()
    for vertex in range(144):
        around = nx.Graph()
        here = np.flatnonzero((made.faces == vertex).any(axis=1)).tolist()
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
