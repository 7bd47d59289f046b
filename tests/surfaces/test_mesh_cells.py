"""Cells of meshes: every face in one connected cell of even area, and figures by brute force."""

import math
from functools import cached_property
from itertools import pairwise

import networkx as nx
import numpy as np
import pytest
from approved import refused
from mesh_patches import CONNECTED, PATCHES, Mesh, bent, box, grid, islands, sheet, used
from referee import unit
from samples import sampled, spread
from trimesh.graph import face_adjacency
from trimesh.triangles import cross

from coverable import mesh
from surfaces.meshes.cells.borders import LabelledFaces, outlines
from surfaces.meshes.cells.clustering import cells_for, cluster_faces
from surfaces.meshes.cells.mesh_cells import MeshCells
from surfaces.meshes.cells.properties import coarse, figures
from surfaces.meshes.cells.subdivision import subdivide
from surfaces.meshes.face_tree import FaceTree
from surfaces.meshes.triangle_mesh import TriangleMesh

N = 60


def vectors_of(vertices, faces):
    """(F, 3) m^2, area times normal."""
    return cross(vertices[faces]) / 2


def areas_of(vertices, faces):
    return np.linalg.norm(vectors_of(vertices, faces), axis=1)


def parts_of(pairs, count):
    graph = nx.empty_graph(count)
    graph.add_edges_from(pairs.tolist())
    return nx.number_connected_components(graph)


class Cut:
    def __init__(self, given: Mesh, count: int = N) -> None:
        self.given = given
        cut = cells_for(*given, count=count)
        self.vertices, self.faces, self.labels = cut.mesh.vertices, cut.mesh.faces, cut.labels
        self.vectors, self.areas = (f(self.vertices, self.faces) for f in (vectors_of, areas_of))
        normals = np.zeros_like(self.vertices)
        for k in range(3):
            np.add.at(normals, self.faces[:, k], self.vectors)
        self.normals = unit(normals)
        self.figures = figures(self.vertices, self.faces, self.normals, self.labels)
        self.outlines = outlines(LabelledFaces.of(self.vertices, self.faces, self.labels))

    @cached_property
    def border(self):
        """Directed edges (a, b) -> (own cell, other cell or -1) where these differ."""
        owner = {}
        for face, corners in enumerate(self.faces.tolist()):
            for k in range(3):
                owner[corners[k], corners[(k + 1) % 3]] = int(self.labels[face])
        across = {(a, b): (cell, owner.get((b, a), -1)) for (a, b), cell in owner.items()}
        return {edge: sides for edge, sides in across.items() if sides[0] != sides[1]}


@pytest.fixture(scope="module", params=PATCHES)
def cut(request) -> Cut:
    return Cut(PATCHES[request.param]())


def assert_even(cut: Cut, count: int) -> None:
    sizes, pairs = np.bincount(cut.labels, minlength=count), face_adjacency(cut.faces)
    inner = cut.labels[pairs[:, 0]] == cut.labels[pairs[:, 1]]
    assert len(sizes) == count
    assert sizes.min() > 0
    # As many connected parts as cells: each cell is in one.
    assert parts_of(pairs[inner], len(cut.faces)) == count
    own = np.bincount(cut.labels, weights=cut.areas)
    assert own.std() <= 0.2 * own.mean()
    np.testing.assert_allclose(cut.figures.areas, own, rtol=1e-12)
    whole = areas_of(*cut.given).sum()
    assert cut.areas.sum() == pytest.approx(whole, rel=1e-12)
    assert cut.areas.max() <= whole / count / 80 * (1 + 1e-8)


def test_cells_are_connected_even_compact_and_complete(cut):
    assert_even(cut, N)
    pairs = cut.labels[face_adjacency(cut.faces)]
    islanded = len(cut.given.faces) == len(islands().faces)
    assert parts_of(pairs[pairs[:, 0] != pairs[:, 1]], N) == (3 if islanded else 1)
    if len(cut.given.faces) == 1:
        return  # a wedge has no room for compact cells
    centre = cut.vertices[cut.faces].mean(axis=1)
    for cell in range(N):
        own = cut.labels == cell
        middle = np.average(centre[own], axis=0, weights=cut.areas[own])
        # A square reaches 0.71 of its side; a rectangle of 1 to 3 reaches 0.91.
        farthest = np.linalg.norm(centre[own] - middle, axis=1).max()
        assert farthest < 1.2 * np.sqrt(cut.areas[own].sum())


MANY = [(name, count) for count in (20, 77, 500, 200) for name in PATCHES]


@sampled(("name", "count"), spread(MANY, 3))
def test_few_and_many_cells_are_even_too(name, count):
    assert_even(Cut(PATCHES[name](), count), count)


def to_segments(points, starts, ends):
    """(P,) distance of each point from the nearest of some segments."""
    along = ends - starts
    t = np.einsum("psc,sc->ps", points[:, None] - starts, along) / (along**2).sum(axis=1)
    nearest = starts + np.clip(t, 0, 1)[..., None] * along
    return np.linalg.norm(points[:, None] - nearest, axis=2).min(axis=1)


def test_centres_are_deep_inside_their_cells(cut):
    found, share = cut.figures, cut.figures.weights
    np.testing.assert_array_equal(cut.labels[found.faces], np.arange(N))
    assert share.min() >= -1e-12
    np.testing.assert_allclose(share.sum(axis=1), 1.0, atol=1e-12)
    own = cut.faces[found.faces]
    points, normals = (np.einsum("nk,nkc->nc", share, x[own]) for x in (cut.vertices, cut.normals))
    np.testing.assert_allclose(found.centres, points, atol=1e-13)
    np.testing.assert_allclose(found.normals, unit(normals), atol=1e-12)
    for cell in range(N):
        corners = cut.vertices[cut.faces[cut.labels == cell]]
        ends = np.array([edge for edge, sides in cut.border.items() if sides[0] == cell])
        segments = cut.vertices[ends[:, 0]], cut.vertices[ends[:, 1]]
        depth = to_segments(found.centres[None, cell], *segments)[0]
        deepest = to_segments(corners.mean(axis=1), *segments).max()
        area = cut.figures.areas[cell]
        assert depth >= min(0.5 * deepest, 0.25 * math.sqrt(area)) - 1e-12


def test_borders_are_shared_and_outlines_close(cut):
    found, segments, walked = cut.figures.borders, {}, {}
    for edge, (own, other) in cut.border.items():
        if 0 <= own < other:
            segments.setdefault((own, other), []).append(edge)
    assert list(map(tuple, found.pairs.tolist())) == sorted(segments)
    for pair, total, middle in zip(found.pairs.tolist(), *found[1:], strict=True):
        starts, stops = cut.vertices[np.array(segments[tuple(pair)])].swapaxes(0, 1)
        weights = np.linalg.norm(stops - starts, axis=1)
        assert total == pytest.approx(weights.sum(), rel=1e-12)
        assert to_segments(middle[None], starts, stops)[0] < 1e-12
        mean = np.average((starts + stops) / 2, axis=0, weights=weights)
        nearest = to_segments(mean[None], starts, stops)[0]
        assert np.linalg.norm(middle - mean) == pytest.approx(nearest, abs=2e-6 * total)
    for cell, lines in enumerate(cut.outlines):
        for edge in (edge for line in lines for edge in pairwise(line.tolist())):
            assert edge not in walked
            walked[edge] = cell
    # Every border edge of each cell, each once, with the cell on its left.
    assert walked == {edge: own for edge, (own, _) in cut.border.items()}


def test_neighbours_go_clockwise(cut):
    found = cut.figures
    middles = dict(zip(map(tuple, found.borders.pairs.tolist()), found.borders.midpoints, strict=1))
    assert sorted(map(list, middles)) == found.neighbours.pairs.tolist()
    for cell in range(N):
        around = found.neighbours.of(cell).tolist()
        if not around:
            continue
        assert around[0] == min(around)
        assert len(set(around)) == len(around)
        left = np.cross(found.normals[cell], [0.6, -0.64, 0.48])
        ahead = np.cross(left, found.normals[cell])
        away = [middles[min(cell, k), max(cell, k)] - found.centres[cell] for k in around]
        # Seen from the normal's tip, once round.
        angles = np.array([math.atan2(-(a @ left), a @ ahead) for a in away])
        turns = np.diff(np.append(angles, angles[0])) % math.tau
        assert turns.sum() == pytest.approx(math.tau if len(around) > 1 else 0.0, abs=1e-9)


def test_a_closed_cell_has_no_border():
    closed = Cut(box(), count=1)
    found = closed.figures
    assert closed.outlines == [[]]
    assert len(found.borders.pairs) == len(found.neighbours.of(0)) == 0
    assert np.isfinite(found.centres).all()
    assert np.isfinite(found.flatness).all()
    np.testing.assert_allclose(np.linalg.norm(found.normals, axis=1), 1.0)


def test_advice_on_coarse_cells_does_help():
    half_pipe = bent(lambda u, v: (0.1 * np.cos(3 * u), 0.1 * np.sin(3 * u), 0.5 * v), 200, 100)
    text = coarse(Cut(half_pipe, count=8).figures)
    assert "of 8 cells" in text
    assert "too large for the curvature" in text
    count = int(text.split("about ")[1].split(" cells")[0].replace(",", ""))
    assert 8 < count < 200
    assert coarse(Cut(half_pipe, count=count).figures) == ""
    creased = coarse(Cut(box(), count=100).figures)
    assert "folded over a crease of up to 90 degrees" in creased
    assert "size" not in creased
    assert coarse(Cut(used(Mesh(box().vertices, box().faces[:2])), count=10).figures) == ""


def test_pieces_share_cells_by_area_and_size_is_the_side_of_a_square():
    cut, area = cells_for(*islands(), count=100), areas_of(*islands())
    ends = np.cumsum([2 * 20 * 20, 2 * 24 * 20, 2 * 8 * 8])
    piece = np.searchsorted(ends, np.arange(len(area)), side="right")
    ideal = np.bincount(piece, weights=area) / area.sum() * 100
    of_face = piece[cut.mesh.original]
    for p in range(3):
        assert len(np.unique(cut.labels[of_face == p])) == pytest.approx(ideal[p], abs=1)
    assert len(np.unique(cells_for(*sheet(), size=0.05).labels)) == round(0.6 * 0.4 / 0.05**2)
    assert not cells_for(*sheet(), size=5.0).labels.any()
    u, v, faces = grid(3, 3)
    assert sorted(cluster_faces(np.column_stack([u, v, 0 * u]), faces, 18)) == list(range(18))


def assert_subdivided(given, most_area):
    fine = subdivide(given.vertices, given.faces, most_area)
    old, new = areas_of(*given), areas_of(fine.vertices, fine.faces)
    assert new.max() <= most_area * (1 + 1e-8)
    # Parts fill their face, turn as it does, and lie in its plane.
    filled = np.bincount(fine.original, weights=new, minlength=len(old))
    np.testing.assert_allclose(filled, old, rtol=1e-9, atol=1e-13 * old.sum())
    parents = (vectors_of(*given) / old[:, None])[fine.original]
    along = np.einsum("ij,ij->i", vectors_of(fine.vertices, fine.faces), parents)
    np.testing.assert_allclose(along, new, atol=1e-13 * old.max())
    # No vertex lies inside an edge: borders have as many edges as vertices, and their length.
    np.testing.assert_array_equal(fine.vertices[: len(given.vertices)], given.vertices)
    lengths = [border_length(fine.vertices, fine.faces), border_length(*given)]
    assert lengths[0] == pytest.approx(lengths[1], rel=1e-12, abs=1e-12)
    assert (np.diff(fine.original) >= 0).all()
    return fine


def border_length(vertices, faces):
    """m, of edges with one face; an edge with a vertex inside it would count too."""
    ends = np.sort(np.column_stack([faces.ravel(), np.roll(faces, -1, axis=1).ravel()]), axis=1)
    each, times = np.unique(ends, axis=0, return_counts=True)
    return np.linalg.norm(np.subtract(*vertices[each[times == 1]].swapaxes(0, 1)), axis=1).sum()


@pytest.mark.parametrize("parts", [30, 4000])
@pytest.mark.parametrize("name", CONNECTED)
def test_subdivision_keeps_the_surface(name, parts):
    given = CONNECTED[name]()
    fine = assert_subdivided(given, areas_of(*given).sum() / parts)
    assert len(fine.faces) < 4 * max(parts, len(given.faces))  # needles become few and even
    if (name, parts) == ("hood", 30):  # fine enough as it is
        np.testing.assert_array_equal(fine.faces, given.faces)


def test_what_makes_no_cells_is_refused(approved):
    numbers = [{}, {"count": 5, "size": 0.1}]
    numbers += [{"count": k} for k in (0, 20_001, 2.5, True, 10**5000)]
    numbers += [{"size": k} for k in (1e-9, math.nan, -1.0, 1e-200, 1e200, 10**400, "0.1")]
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, -1, 0.0]])
    u, v, faces = grid(1, 4000)
    comb = np.column_stack([100 * u, 1e-5 * v, 0 * u]), faces
    surface = mesh(TriangleMesh(*sheet(3)))
    count = len(surface.mesh.faces)
    asked = [lambda k=k: cells_for(*sheet(), **k) for k in numbers]
    asked += [
        lambda: cluster_faces(*islands(), 2),
        lambda: cluster_faces(vertices, np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]]), 1),
        lambda: cluster_faces(vertices, np.array([[0, 1, 2], [0, 1, 3]]), 1),
        lambda: figures(*box(), np.ones((8, 3)), np.array([0] * 6 + [2] * 6)),
        lambda: subdivide(*box(), 1e-9),
        lambda: subdivide(*comb, areas_of(*comb).sum() / 2e6),
    ]
    asked += [lambda k=k: subdivide(*box(), k) for k in (0.0, -1.0, math.nan, math.inf)]
    labels = (np.zeros(3, int), np.zeros(count), np.full(count, -1), np.full(count, 1))
    asked += [lambda k=k: MeshCells.of(surface, k) for k in labels]
    approved("what makes no cells", "\n".join(map(refused, asked)))
    assert surface.cells(5).unravel(4) == (4,)
    with pytest.raises(IndexError):
        surface.cells(5).unravel(5)


@pytest.mark.parametrize("name", ["blade", "box", "scattered"])
def test_closest_places_are_on_the_cells_of_the_pair(name):
    """Points beside the pair, and far off, where other cells are nearer (a blade is thin)."""
    rng = np.random.default_rng(3)
    cells = mesh(TriangleMesh(*PATCHES[name]()), position=(0.3, 0.1, -0.2)).cells(40)
    corners, graph = cells.surface.face_balls[0], cells.graph()
    pairs = cells.pairs[rng.integers(0, len(cells.pairs), 12)]
    middles = cells.centres[pairs].mean(axis=1)[:, None]
    points = middles + rng.choice([0.003, 0.3], (12, 40, 1)) * rng.normal(size=(12, 40, 3))
    points[3, 5], points[4, 6, 1] = np.nan, np.nan
    found, normals = cells.closest_along(pairs, points)
    elsewhere = 0
    for row, (a, b) in enumerate(pairs.tolist()):
        around = [a, b, *(set(graph[a]) & set(graph[b]))]
        some = np.flatnonzero(np.isin(cells.labels, around))
        known = np.isfinite(points[row]).all(axis=1)
        assert np.isnan(found[row, ~known]).all()
        own = points[row, known] - cells.surface.position
        face, weights = FaceTree.of(corners[some]).nearest(own)
        least = np.linalg.norm(own - np.einsum("kc,kci->ki", weights, corners[some[face]]), axis=1)
        away = np.linalg.norm(points[row, known] - found[row, known], axis=1)
        np.testing.assert_allclose(away, least, rtol=0, atol=1e-13)
        beside = cells.surface.normals_at(some[face], weights)
        assert np.median(np.linalg.norm(normals[row, known] - beside, axis=1)) < 1e-9
        elsewhere += (np.abs(cells.surface.closest(points[row, known]).height) < away - 1e-9).sum()
    assert elsewhere > 10
