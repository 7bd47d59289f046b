"""Cells of meshes: every face in one connected cell of even area, however the mesh lies."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mesh_patches import CONNECTED, PATCHES, Mesh, box, grid, hood, islands, joined, sheet, slivers
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from surfaces import SurfaceError
from surfaces.meshes.cells.clustering import FACES_PER_CELL, cells_for, cluster_faces
from surfaces.meshes.cells.subdivision import subdivide

COUNTS = (20, 200)
MANY = (77, 500)  # of every patch in the campaign larger_samples


def areas_of(vertices, faces):
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def number_of_components(pairs, count):
    links = coo_array((np.ones(len(pairs)), pairs.T), shape=(count, count))
    return connected_components(links, directed=False)[0]


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("name", PATCHES)
def test_cells_are_connected_even_and_complete(name, count):
    mesh = PATCHES[name]()
    cut = cells_for(*mesh, count=count)
    vertices, faces, labels = cut.mesh.vertices, cut.mesh.faces, cut.labels
    pairs = joined(faces)
    inner = labels[pairs[:, 0]] == labels[pairs[:, 1]]
    sizes = np.bincount(labels, minlength=count)
    area = areas_of(vertices, faces)
    cell_area = np.bincount(labels, weights=area)
    assert len(sizes) == count
    assert sizes.min() > 0
    # As many connected parts as cells: each cell is in one.
    assert number_of_components(pairs[inner], len(faces)) == count
    pieces = number_of_components(pairs, len(faces))
    assert number_of_components(labels[pairs[~inner]].reshape(-1, 2), count) == pieces
    assert pieces == (3 if name == "islands" else 1)
    assert cell_area.std() <= 0.2 * cell_area.mean()
    before = areas_of(*mesh)
    assert area.sum() == pytest.approx(before.sum(), rel=1e-12)
    assert area.max() <= before.sum() / count / FACES_PER_CELL * (1 + 1e-8)


@pytest.mark.parametrize("name", [name for name in PATCHES if name != "wedge"])
def test_cells_are_compact(name):
    cut = cells_for(*PATCHES[name](), count=60)
    faces, labels = cut.mesh.faces, cut.labels
    centre = cut.mesh.vertices[faces].mean(axis=1)
    area = areas_of(cut.mesh.vertices, faces)
    for cell in range(60):
        member = labels == cell
        middle = np.average(centre[member], axis=0, weights=area[member])
        farthest = np.linalg.norm(centre[member] - middle, axis=1).max()
        # A square reaches 0.71 of its side; a rectangle of 1 to 3 reaches 0.91. (A wedge has no
        # room for that.)
        assert farthest < 1.2 * np.sqrt(area[member].sum())


@pytest.mark.parametrize("name", PATCHES)
def test_same_cells_again_turned_moved_and_scaled(name, motion):
    mesh = PATCHES[name]()
    rotation, translation = motion
    cut = cells_for(*mesh, count=60)
    again = cells_for(*mesh, count=60)
    moved = cells_for(mesh.vertices @ rotation.T + translation, mesh.faces, count=60)
    scaled = cells_for(1000.0 * mesh.vertices, mesh.faces, count=60)
    for other in (again, moved, scaled):
        np.testing.assert_array_equal(other.mesh.faces, cut.mesh.faces)
        np.testing.assert_array_equal(other.labels, cut.labels)
    np.testing.assert_array_equal(again.mesh.vertices, cut.mesh.vertices)
    np.testing.assert_allclose(
        moved.mesh.vertices, cut.mesh.vertices @ rotation.T + translation, atol=1e-14 * 20
    )


def test_pieces_share_cells_by_area():
    cut = cells_for(*islands(), count=100)
    old = islands()
    area = areas_of(*old)
    ends = np.cumsum([2 * 20 * 20, 2 * 24 * 20, 2 * 8 * 8])
    piece = np.searchsorted(ends, np.arange(len(area)), side="right")
    ideal = np.bincount(piece, weights=area) / area.sum() * 100
    of_face = piece[cut.mesh.original]
    for p in range(3):
        assert len(np.unique(cut.labels[of_face == p])) == pytest.approx(ideal[p], abs=1)


def test_size_is_the_side_of_a_square():
    assert len(np.unique(cells_for(*sheet(), size=0.05).labels)) == round(0.6 * 0.4 / 0.05**2)
    assert not cells_for(*sheet(), size=5.0).labels.any()


def test_a_face_each():
    u, v, faces = grid(3, 3)
    vertices = np.column_stack([u, v, 0 * u])
    assert sorted(cluster_faces(vertices, faces, 18)) == list(range(18))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({}, "count is needed, or size, and not both"),
        ({"count": 5, "size": 0.1}, "count is needed, or size, and not both"),
        ({"count": 0}, "count must make 1 to 20,000 cells, got 0"),
        ({"count": 20_001}, "1 to 20,000 cells"),
        ({"count": 2.5}, "whole number"),
        ({"count": True}, "whole number"),
        ({"count": 10**5000}, "whole number"),
        ({"size": 1e-9}, "1 to 20,000 cells"),
        ({"size": float("nan")}, "finite number > 0"),
        ({"size": -1.0}, "finite number > 0"),
        ({"size": 1e-200}, "finite number > 0"),
        ({"size": 1e200}, "finite number > 0"),
        ({"size": 10**400}, "finite number > 0"),
        ({"size": "0.1"}, "finite number > 0"),
    ],
)
def test_bad_numbers_of_cells(arguments, message):
    with pytest.raises(SurfaceError, match=message):
        cells_for(*sheet(), **arguments)


def test_too_few_cells():
    with pytest.raises(SurfaceError, match="2 cells are too few for 3 separate pieces"):
        cluster_faces(*islands(), 2)


def test_unclean_meshes_are_refused():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, -1, 0.0]])
    three_on_an_edge = np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]])
    flipped = np.array([[0, 1, 2], [0, 1, 3]])
    for faces, words in ((three_on_an_edge, "more than two faces"), (flipped, "outer side")):
        with pytest.raises(SurfaceError, match=words):
            cluster_faces(vertices, faces, 1)


def check_subdivision(mesh, most_area):
    """Everything that a subdivision promises, against the old mesh."""
    fine = subdivide(mesh.vertices, mesh.faces, most_area)
    old = areas_of(*mesh)
    new = areas_of(fine.vertices, fine.faces)
    assert new.max() <= most_area * (1 + 1e-8)
    # Parts fill their face, turn as it does, and lie in its plane.
    filled = np.bincount(fine.original, weights=new, minlength=len(old))
    np.testing.assert_allclose(filled, old, rtol=1e-9, atol=1e-13 * old.sum())
    a, b, c = (fine.vertices[fine.faces[:, k]] for k in range(3))
    e, f, g = (mesh.vertices[mesh.faces[fine.original][:, k]] for k in range(3))
    vectors, parents = np.cross(b - a, c - a) / 2, np.cross(f - e, g - e) / 2
    along = np.einsum("ij,ij->i", vectors, parents) / old[fine.original]
    np.testing.assert_allclose(along, new, atol=1e-13 * old.max())
    # No vertex lies inside an edge: borders have as many edges as vertices, and their length.
    np.testing.assert_array_equal(fine.vertices[: len(mesh.vertices)], mesh.vertices)
    assert border_length(fine.vertices, fine.faces) == pytest.approx(
        border_length(*mesh), rel=1e-12, abs=1e-12
    )
    assert (np.diff(fine.original) >= 0).all()
    return fine


def border_length(vertices, faces):
    """m, of edges with one face; an edge with a vertex inside it would count too."""
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    _, index, times = np.unique(
        np.sort(np.column_stack([start, end]), axis=1),
        axis=0,
        return_index=True,
        return_counts=True,
    )
    single = index[times == 1]
    return np.linalg.norm(vertices[start[single]] - vertices[end[single]], axis=1).sum()


@pytest.mark.parametrize("parts", [30, 1000, 20_000])
@pytest.mark.parametrize("name", CONNECTED)
def test_subdivision_keeps_the_surface(name, parts):
    mesh = CONNECTED[name]()
    check_subdivision(mesh, areas_of(*mesh).sum() / parts)


@settings(max_examples=30)
@given(
    st.lists(st.floats(-1, 1), min_size=4, max_size=4),
    st.floats(1e-4, 1.0),
    st.floats(0.3, 3000),
)
def test_subdivision_of_any_two_triangles(numbers, height, parts):
    vertices = np.array(
        [[-1, 0, 0], [1, 0, 0], [numbers[0], height, numbers[1]], [*numbers[2:], 0]]
    )
    vertices[3, 1] = -abs(vertices[3, 1]) - height
    mesh = Mesh(vertices, np.array([[0, 1, 2], [1, 0, 3]]))
    check_subdivision(mesh, areas_of(*mesh).sum() / parts)


def test_needles_become_few_and_even():
    mesh = slivers()
    fine = check_subdivision(mesh, areas_of(*mesh).sum() / 5000)
    assert len(fine.faces) < 20_000
    u, v, faces = grid(1, 1)
    needle = Mesh(np.column_stack([u, 1e-3 * v, 0 * u]), faces)
    fine = check_subdivision(needle, 1e-3 / 1000)
    assert len(fine.faces) < 4000


def test_what_is_fine_stays_as_it_is():
    mesh = hood()
    fine = check_subdivision(mesh, areas_of(*mesh).max())
    np.testing.assert_array_equal(fine.faces, mesh.faces)


@pytest.mark.parametrize("most_area", [0.0, -1.0, float("nan"), float("inf")])
def test_bad_areas_are_refused(most_area):
    with pytest.raises(SurfaceError, match="most_area must be a finite number > 0"):
        subdivide(*box(), most_area)


def test_too_many_triangles_are_refused():
    with pytest.raises(SurfaceError, match="more than 4,000,000 triangles"):
        subdivide(*box(), 1e-9)
    u, v, faces = grid(1, 4000)
    comb = Mesh(np.column_stack([100 * u, 1e-5 * v, 0 * u]), faces)
    with pytest.raises(SurfaceError, match="needles"):
        subdivide(*comb, areas_of(*comb).sum() / 2e6)
