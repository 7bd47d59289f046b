"""Meshes as surfaces: closest points, continuous normals, cells and the curves between them."""

from __future__ import annotations

import pickle

import mesh_patches
import numpy as np
import pytest

from surfaces import SurfaceError, cylinder, sphere
from surfaces.meshes import TriangleMesh, mesh
from surfaces.meshes.cells import MeshCells

NAMES = ["sheet", "dome", "shell", "horn", "hood", "blade", "box", "holed", "slivers", "scattered"]
SMOOTH = ["sheet", "dome", "shell", "horn", "hood", "holed", "slivers"]


def surface_of(name, **pose):
    """One of the test patches as a surface."""
    made = getattr(mesh_patches, name)()
    return mesh(TriangleMesh(made.vertices, made.faces), **pose)


def from_patch(patch, nu, nv, **pose):
    """Triangles of a parametric patch, vertices on it."""
    made = mesh_patches.of_patch(patch, nu, nv)
    return mesh(TriangleMesh(*made), side=patch.side, **pose)


def nearest_by_force(surface, points):
    """Distance of each point from the mesh, triangle by triangle, by clamped projections."""
    corners = surface.mesh.vertices[surface.mesh.faces] @ surface.rotation.T + surface.position
    least = np.full(len(points), np.inf)
    for a, b, c in corners:
        normal = np.cross(b - a, c - a)
        normal /= np.linalg.norm(normal)
        off = (points - a) @ normal
        flat = points - off[:, None] * normal
        inside = np.ones(len(points), dtype=bool)
        for p, q in ((a, b), (b, c), (c, a)):
            inside &= np.cross(q - p, flat - p) @ normal >= 0.0
            t = np.clip((points - p) @ (q - p) / ((q - p) @ (q - p)), 0.0, 1.0)
            edge = np.linalg.norm(points - p - t[:, None] * (q - p), axis=1)
            least = np.minimum(least, edge)
        least = np.where(inside, np.minimum(least, np.abs(off)), least)
    return least


@pytest.mark.parametrize("name", ["dome", "box", "blade", "slivers", "scattered"])
def test_nearest_places_are_the_nearest(name):
    """Against every triangle, for points on, near and far from meshes of even and odd triangles."""
    rng = np.random.default_rng(3)
    surface = surface_of(name, position=(0.3, -0.2, 1.0), rpy_deg=(20, 40, -70))
    low, high = surface.mesh.vertices.min(axis=0), surface.mesh.vertices.max(axis=0)
    local = rng.uniform(low - 0.3, high + 0.3, (120, 3))
    points = local @ surface.rotation.T + surface.position
    closest_point = surface.closest(points)
    expected = nearest_by_force(surface, points)
    np.testing.assert_allclose(np.abs(closest_point.height), expected, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(closest_point.normal, axis=1), 1.0, atol=1e-12)
    assert closest_point.inside.all()
    assert np.isnan(closest_point.u).all()
    assert surface.closest(points.reshape(4, 30, 3)).height.shape == (4, 30)


def test_points_that_are_not_numbers_have_no_foot():
    """NaN in, NaN out; the others are not disturbed."""
    surface = surface_of("dome")
    points = np.array([[0.0, 0.0, 2.0], [np.nan, 0.0, 0.0], [0.0, np.inf, 0.0]])
    with np.errstate(invalid="ignore"):
        closest_point = surface.closest(points)
    assert np.isfinite(closest_point.height[0])
    assert not np.isfinite(closest_point.height[1:]).any()


@pytest.mark.parametrize("patch", [
    sphere(1.0, (10, 90), (10, 180)), cylinder(0.4, (0, 200), (0, 0.6), side="outside"),
])  # fmt: skip
def test_a_fine_mesh_has_the_normals_of_its_patch(patch):
    """Interpolated, a hundredth of what the facets are off, away from the border."""
    surface = from_patch(patch, 60, 80)
    u = np.random.default_rng(1).uniform(*patch.u_range, 300) * 0.9 + 0.05 * sum(patch.u_range)
    v = np.random.default_rng(2).uniform(*patch.v_range, 300) * 0.9 + 0.05 * sum(patch.v_range)
    found = surface.closest(patch.point(u, v))
    off = np.linalg.norm(found.normal - patch.normal(u, v), axis=1)
    facets = surface.mesh.face_normals[surface.nearest(patch.point(u, v))[0]]
    blunt = np.linalg.norm(facets - patch.normal(u, v), axis=1)
    assert np.median(off) < 0.05 * np.median(blunt)
    assert off.max() < 0.02
    assert np.abs(found.height).max() < 1e-3


def test_a_crease_keeps_its_faces_flat():
    """On a box every corner of a face has the face's normal, before and after it is cut.

    On the rims both sides have one normal each vertex, to which theirs turn.
    """
    surface = surface_of("box")
    np.testing.assert_allclose(
        surface.corner_normals, np.repeat(surface.mesh.face_normals[:, None], 3, axis=1), atol=1e-12
    )
    cells = surface.cells(60)
    fine = cells.surface
    np.testing.assert_allclose(
        fine.corner_normals, np.repeat(fine.mesh.face_normals[:, None], 3, axis=1), atol=1e-9
    )
    at = np.zeros((len(fine.mesh.vertices), 3))
    at[fine.mesh.faces.ravel()] = fine.crease_normals.reshape(-1, 3)
    np.testing.assert_array_equal(at[fine.mesh.faces], fine.crease_normals)
    flat = np.abs(fine.crease_normals - fine.mesh.face_normals[:, None]).max(axis=(1, 2)) < 1e-9
    assert 0.75 < fine.mesh.face_areas[flat].sum() / fine.mesh.area < 1.0
    assert "crease" in " ".join(cells.notes)


@pytest.mark.parametrize("name", NAMES)
def test_cutting_leaves_the_surface_what_it_was(name):
    """Area to 1e-12, every new vertex on the old mesh, cells even, connected, named once."""
    surface = surface_of(name, position=(0.1, 0.2, 0.3), rpy_deg=(0, 30, 0))
    cells = surface.cells(60)
    fine = cells.surface
    assert fine.mesh.area == pytest.approx(surface.mesh.area, rel=1e-12)
    assert cells.areas.sum() == pytest.approx(surface.mesh.area, rel=1e-12)
    corners = fine.mesh.vertices @ fine.rotation.T + fine.position
    assert np.abs(surface.closest(corners).height).max() < 1e-12
    assert len(cells) == 60
    assert cells.shape == (60,)
    assert cells.areas.std() <= 0.2 * cells.areas.mean()
    np.testing.assert_array_equal(cells.locate(cells.centres), np.arange(60))
    assert np.abs(fine.closest(cells.centres).height).max() < 1e-12
    if name != "blade":  # thin walls: the other side is as near
        np.testing.assert_allclose(fine.closest(cells.centres).normal, cells.normals, atol=1e-9)
    import networkx as nx

    assert nx.is_connected(cells.graph())


@pytest.mark.parametrize("name", NAMES)
def test_curves_of_a_mesh_lie_on_it_within_their_deviations(name):
    """Points at odd places, against the mesh; on smooth ones within a twentieth of a face."""
    cells = surface_of(name).cells(60)
    curves = cells.curves
    which = np.repeat(np.arange(len(curves)), 17)
    t = np.tile(np.linspace(0.0, 1.0, 17), len(curves))
    closest_point, normal = curves.at(which, t)
    found = cells.surface.closest(closest_point)
    deviations = curves.deviations[which]
    open_ = deviations[:, 1] < 0.02
    assert (np.abs(found.height) <= deviations[:, 0] + 1e-12)[open_].all()
    turned = np.linalg.norm(normal - found.normal, axis=1)
    assert (turned <= 1.5 * deviations[:, 1] + 1e-9)[open_].mean() > 0.999
    if name in SMOOTH:
        assert open_.all()
        assert curves.deviations[:, 0].max() < 0.05 * cells.surface.mean_edge_length
    for end, column in ((0.0, 0), (1.0, 1)):
        places = np.full(len(curves), end)
        closest_point, normal = curves.at(np.arange(len(curves)), places)
        np.testing.assert_allclose(closest_point, cells.centres[cells.pairs[:, column]], atol=1e-9)
        np.testing.assert_allclose(normal, cells.normals[cells.pairs[:, column]], atol=1e-9)


def test_a_rigid_motion_moves_everything_along():
    """The same cells, turned and shifted; curves too."""
    surface = surface_of("hood")
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    shift = np.array([0.3, -0.2, 0.1])
    one, other = surface.cells(40), surface.moved(turn, shift).cells(40)
    np.testing.assert_array_equal(one.labels, other.labels)
    np.testing.assert_allclose(one.centres @ turn.T + shift, other.centres, atol=1e-12)
    np.testing.assert_allclose(one.normals @ turn.T, other.normals, atol=1e-12)
    np.testing.assert_allclose(one.curves.deviations, other.curves.deviations, atol=1e-9)


def test_cells_pickle_and_are_the_same_again():
    """Arrays and curves survive."""
    cells = surface_of("dome").cells(30)
    again = pickle.loads(pickle.dumps(cells))
    np.testing.assert_array_equal(cells.centres, again.centres)
    np.testing.assert_array_equal(cells.pairs, again.pairs)
    np.testing.assert_array_equal(cells.curves.cubics, again.curves.cubics)


def test_what_is_drawn_is_the_surface():
    """Triangles fill the cells, borders run on the mesh, every cell has an outline on paper."""
    cells = surface_of("hood").cells(40)
    drawn = cells.triangles(np.arange(40))
    corners = drawn.vertices[drawn.faces]
    areas = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    assert 0.5 * areas.sum() == pytest.approx(cells.areas.sum(), rel=1e-12)
    lines = cells.borders()
    assert np.abs(cells.surface.closest(lines).height).max() < 1e-12
    edges = cells.surface.mesh.edges
    length = np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1).sum()
    expected = cells.figures.borders.lengths.sum() + edges.border_lengths.sum()
    assert length == pytest.approx(expected, rel=1e-12)
    flat = cells.unrolled()
    assert flat.centres.shape == (40, 2)
    assert len(flat.outlines) == 40
    assert all((loop[0] == loop[-1]).all() for loop in flat.outlines)


def test_labels_that_are_no_cells_are_refused():
    """Wrong length, kind, gaps."""
    surface = surface_of("dome")
    count = len(surface.mesh.faces)
    for labels, words in (
        (np.zeros(3, dtype=int), "one for each face"),
        (np.zeros(count), "whole numbers"),
        (np.full(count, -1), "from 0 on"),
        (np.full(count, 1), "cell 0 has no face"),
    ):
        with pytest.raises(SurfaceError, match=words):
            MeshCells.of(surface, labels)


def test_the_index_of_a_cell_is_one_number():
    """As the command line prints it."""
    cells = surface_of("dome").cells(30)
    assert cells.unravel(7) == (7,)
    with pytest.raises(IndexError):
        cells.unravel(30)


def test_a_trimesh_in_hand():
    """Checked and repaired like a file: duplicate faces go, and are spoken of."""
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.3)
    twice = trimesh.Trimesh(
        ball.vertices, np.vstack([ball.faces, ball.faces[:5]]), process=False, validate=False
    )
    surface = mesh(twice, side="outside", scale=2.0)
    assert surface.mesh.area == pytest.approx(4.0 * ball.area, rel=1e-9)
    assert surface.notes
    with pytest.raises(SurfaceError):
        mesh(ball, side="above")
    for source in (ball, surface.mesh):
        for scale in (-1.0, 0.0, float("nan"), "1"):
            with pytest.raises(SurfaceError, match=r"the mesh: scale must be a number in"):
                mesh(source, scale=scale)
    half = mesh(surface.mesh, scale=0.5)
    assert half.mesh.area == pytest.approx(ball.area, rel=1e-9)
    assert half.mesh.history == surface.mesh.history != ()
