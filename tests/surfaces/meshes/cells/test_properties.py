"""Figures of mesh cells against brute force, hand-made cells, and rigid motions."""

import math
from functools import cached_property

import numpy as np
import pytest
from mesh_patches import PATCHES, Mesh, bent, box, dome, grid, hood, joined, sheet, used

from surfaces import SurfaceError
from surfaces.meshes.cells.clustering import cells_for
from surfaces.meshes.cells.properties import coarse, figures


def vectors_of(vertices, faces):
    """(F, 3) m^2, area times normal."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return np.cross(b - a, c - a) / 2


def normals_of(mesh):
    """(V, 3) area-weighted vertex normals."""
    normals = np.zeros_like(mesh.vertices)
    for k in range(3):
        np.add.at(normals, mesh.faces[:, k], vectors_of(*mesh))
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


class Cut:
    """A patch cut into cells, and their figures."""

    def __init__(self, mesh: Mesh, count: int = 60) -> None:
        self.mesh = mesh
        cut = cells_for(*mesh, count=count)
        self.vertices, self.faces, self.labels = cut.mesh.vertices, cut.mesh.faces, cut.labels
        self.normals = normals_of(Mesh(self.vertices, self.faces))
        self.figures = figures(self.vertices, self.faces, self.normals, self.labels)

    @cached_property
    def border(self):
        """Directed edges (a, b) -> (own cell, other cell or -1) where these differ."""
        owner = {}
        for face, corners in enumerate(self.faces.tolist()):
            for k in range(3):
                owner[corners[k], corners[(k + 1) % 3]] = int(self.labels[face])
        return {
            (a, b): (cell, owner.get((b, a), -1))
            for (a, b), cell in owner.items()
            if owner.get((b, a), -1) != cell
        }


@pytest.fixture(scope="module", params=PATCHES)
def cut(request: pytest.FixtureRequest) -> Cut:
    return Cut(PATCHES[request.param]())


def test_areas(cut):
    vectors = vectors_of(cut.vertices, cut.faces)
    for cell in range(60):
        member = cut.labels == cell
        area = np.linalg.norm(vectors[member], axis=1).sum()
        assert cut.figures.areas[cell] == pytest.approx(area, rel=1e-12)
    total = np.linalg.norm(vectors_of(*cut.mesh), axis=1).sum()
    assert cut.figures.areas.sum() == pytest.approx(total, rel=1e-12)


def test_centres_lie_on_their_own_faces(cut):
    found = cut.figures
    np.testing.assert_array_equal(cut.labels[found.faces], np.arange(60))
    assert found.weights.min() >= -1e-12
    np.testing.assert_allclose(found.weights.sum(axis=1), 1.0, atol=1e-12)
    corners = cut.vertices[cut.faces[found.faces]]
    points = np.einsum("nk,nkc->nc", found.weights, corners)
    np.testing.assert_allclose(found.centres, points, atol=1e-13)
    normals = np.einsum("nk,nkc->nc", found.weights, cut.normals[cut.faces[found.faces]])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    np.testing.assert_allclose(found.normals, normals, atol=1e-12)


def sampled(corners, n=25):
    """Points all over triangles (F, 3, 3), corners and edges too: (F, K, 3)."""
    i, j = np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij")
    weights = np.column_stack([(n - i - j).ravel(), i.ravel(), j.ravel()])
    weights = weights[weights[:, 0] >= 0] / n
    return np.einsum("ks,fsc->fkc", weights, corners)


def to_segments(points, starts, ends):
    """(P,) distance of each point from the nearest of some segments."""
    along = ends - starts
    t = np.einsum("psc,sc->ps", points[:, None] - starts, along) / (along**2).sum(axis=1)
    nearest = starts + np.clip(t, 0, 1)[..., None] * along
    return np.linalg.norm(points[:, None] - nearest, axis=2).min(axis=1)


def test_centres_are_nearest_to_the_centroid_or_deep_inside(cut):
    vectors = vectors_of(cut.vertices, cut.faces)
    edges = cut.border
    usual = 0
    for cell in range(60):
        member = cut.labels == cell
        corners = cut.vertices[cut.faces[member]]
        area = np.linalg.norm(vectors[member], axis=1)
        centroid = np.average(corners.mean(axis=1), axis=0, weights=area)
        distance = np.linalg.norm(sampled(corners) - centroid, axis=2).min()
        own = np.linalg.norm(cut.figures.centres[cell] - centroid)
        ends = np.array([edge for edge, sides in edges.items() if sides[0] == cell])
        segments = cut.vertices[ends[:, 0]], cut.vertices[ends[:, 1]]
        depth = to_segments(cut.figures.centres[None, cell], *segments)[0]
        deepest = to_segments(corners.mean(axis=1), *segments).max()
        assert depth >= min(0.5 * deepest, 0.25 * math.sqrt(area.sum())) - 1e-12
        if own <= distance + 1e-12:
            usual += 1
        else:
            assert depth >= 0.8 * deepest - 1e-12
    assert usual >= 55


def angle(a, b):
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), (a * b).sum(axis=-1))


def test_flatness_and_crease(cut):
    vectors = vectors_of(cut.vertices, cut.faces)
    unit = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    found = cut.figures
    one, other = joined(cut.faces).T
    crease, inner = np.zeros(60), cut.labels[one] == cut.labels[other]
    np.maximum.at(crease, cut.labels[one[inner]], angle(unit[one], unit[other])[inner])
    np.testing.assert_allclose(found.crease, crease, atol=1e-9)
    for cell in range(60):
        member = cut.labels == cell
        mean = vectors[member].sum(axis=0)
        lean = angle(unit[member], mean / np.linalg.norm(mean)).max()
        assert found.flatness[cell] == pytest.approx(lean, abs=1e-9)


def test_shared_borders(cut):
    edges = cut.border
    length, segments = {}, {}
    for (a, b), (own, other) in edges.items():
        if 0 <= own < other:
            piece = np.linalg.norm(cut.vertices[a] - cut.vertices[b])
            length[own, other] = length.get((own, other), 0.0) + piece
            segments.setdefault((own, other), []).append((a, b))
    found = cut.figures.borders
    assert found.pairs.tolist() == sorted(map(list, length))
    for pair, total, middle in zip(found.pairs.tolist(), *found[1:], strict=True):
        assert total == pytest.approx(length[tuple(pair)], rel=1e-12)
        ends = np.array(segments[tuple(pair)])
        starts, stops = cut.vertices[ends[:, 0]], cut.vertices[ends[:, 1]]
        assert to_segments(middle[None], starts, stops)[0] < 1e-12
        weights = np.linalg.norm(stops - starts, axis=1)
        mean = np.average((starts + stops) / 2, axis=0, weights=weights)
        nearest = to_segments(mean[None], starts, stops)[0]
        assert np.linalg.norm(middle - mean) == pytest.approx(nearest, abs=2e-6 * total)


def test_neighbours_go_clockwise(cut):
    found = cut.figures
    pairs = found.borders.pairs.tolist()
    middles = {tuple(pair): m for pair, m in zip(pairs, found.borders.midpoints, strict=True)}
    assert sorted(map(list, middles)) == found.neighbours.pairs.tolist()
    for cell in range(60):
        around = found.neighbours.of(cell).tolist()
        if not around:
            continue
        assert around[0] == min(around)
        assert len(set(around)) == len(around)
        normal = found.normals[cell]
        left = np.cross(normal, [0.6, -0.64, 0.48])
        ahead = np.cross(left, normal)
        away = [middles[min(cell, k), max(cell, k)] - found.centres[cell] for k in around]
        # Seen from the normal's tip, once round.
        angles = np.array([math.atan2(-(a @ left), a @ ahead) for a in away])
        turns = np.diff(np.append(angles, angles[0])) % math.tau
        assert turns.sum() == pytest.approx(math.tau if len(around) > 1 else 0.0, abs=1e-9)


def test_outlines_close_and_lie_on_borders(cut):
    edges = cut.border
    lines = cut.figures.outlines
    walked = {}
    for loop, cell in enumerate(lines.cells.tolist()):
        chain = lines.vertices[lines.starts[loop] : lines.starts[loop + 1]].tolist()
        for a, b in zip(chain, chain[1:] + chain[:1], strict=True):
            assert (a, b) not in walked
            walked[a, b] = cell
    # Every border edge of each cell, each once, with the cell on its left.
    assert walked == {edge: own for edge, (own, _) in edges.items()}
    total = 0.0
    for cell in range(60):
        for line in lines.of(cell):
            np.testing.assert_array_equal(line[0], line[-1])
            total += np.linalg.norm(np.diff(line, axis=0), axis=1).sum()
    outer = sum(
        np.linalg.norm(cut.vertices[a] - cut.vertices[b])
        for (a, b), (_, other) in edges.items()
        if other < 0
    )
    assert total == pytest.approx(2 * cut.figures.borders.lengths.sum() + outer, rel=1e-12)


def test_rigid_motion_changes_only_the_frame(cut, motion):
    rotation, translation = motion
    vertices = cut.vertices @ rotation.T + translation
    moved = figures(vertices, cut.faces, cut.normals @ rotation.T, cut.labels)
    still = cut.figures
    np.testing.assert_array_equal(moved.faces, still.faces)
    np.testing.assert_allclose(moved.centres, still.centres @ rotation.T + translation, atol=1e-11)
    np.testing.assert_allclose(moved.normals, still.normals @ rotation.T, atol=1e-9)
    for name in ("areas", "flatness", "crease"):
        np.testing.assert_allclose(getattr(moved, name), getattr(still, name), atol=1e-7)
    np.testing.assert_array_equal(moved.borders.pairs, still.borders.pairs)
    np.testing.assert_array_equal(moved.neighbours.indices, still.neighbours.indices)
    np.testing.assert_array_equal(moved.outlines.vertices, still.outlines.vertices)


def test_four_squares_by_hand():
    # 2 3    seen from above; 0 and 3 touch in a point only
    # 0 1
    u, v, faces = grid(2, 2)
    vertices = np.column_stack([u, v, 0 * u])
    labels = np.repeat([0, 2, 1, 3], 2)  # faces run along v first
    up = np.tile([0.0, 0.0, 2.0], (9, 1))
    found = figures(vertices, faces, up, labels)
    assert found.borders.pairs.tolist() == [[0, 1], [0, 2], [1, 3], [2, 3]]
    np.testing.assert_allclose(found.borders.lengths, 0.5)
    np.testing.assert_allclose(
        found.borders.midpoints, [[0.5, 0.25, 0], [0.25, 0.5, 0], [0.75, 0.5, 0], [0.5, 0.75, 0]]
    )
    assert [found.neighbours.of(k).tolist() for k in range(4)] == [[1, 2], [0, 3], [0, 3], [1, 2]]
    np.testing.assert_allclose(found.centres[2], [0.25, 0.75, 0])
    np.testing.assert_allclose(found.normals, [[0, 0, 1]] * 4)
    np.testing.assert_allclose(found.areas, 0.25)
    assert found.flatness.max() == 0.0


def test_a_cross_by_hand_is_clockwise():
    u, v, faces = grid(3, 3)
    vertices = np.column_stack([u, v, 0 * u])
    #   3      the middle cell, from the right, clockwise: below, left, above
    # 2 0 4
    #   1
    names = np.array([[5, 2, 6], [1, 0, 3], [7, 4, 8]])
    found = figures(vertices, faces, np.tile([0.0, 0, 1], (16, 1)), np.repeat(names.ravel(), 2))
    assert found.neighbours.of(0).tolist() == [1, 2, 3, 4]
    down = figures(
        vertices, faces[:, ::-1], np.tile([0.0, 0, -1], (16, 1)), np.repeat(names.ravel(), 2)
    )
    assert down.neighbours.of(0).tolist() == [1, 4, 3, 2]


def test_a_ring_has_its_centre_on_the_ring_and_two_loops():
    mesh = sheet(60)
    x, y, _ = (mesh.vertices[mesh.faces].mean(axis=1) - [0.3, 0.2, 0]).T
    radius = np.hypot(x, y)
    labels = np.where(radius < 0.1, 0, np.where(radius < 0.15, 1, 2))
    found = figures(*mesh, np.tile([0.0, 0, 1], (len(mesh.vertices), 1)), labels)
    assert np.hypot(*(found.centres[1] - [0.3, 0.2, 0])[:2]) == pytest.approx(0.125, abs=0.007)
    assert np.hypot(*(found.centres[0] - [0.3, 0.2, 0])[:2]) < 1e-3
    assert [len(found.outlines.of(k)) for k in range(3)] == [1, 2, 2]
    assert found.borders.pairs.tolist() == [[0, 1], [1, 2]]
    # Outer loops run counter-clockwise and holes clockwise: signed areas add up.
    for cell in range(3):
        signed = sum(
            np.cross(line[:-1], line[1:])[:, 2].sum() / 2 for line in found.outlines.of(cell)
        )
        assert signed == pytest.approx(found.areas[cell], rel=1e-9)


def test_a_cell_that_meets_itself_in_a_point():
    # Two opposite quarters of a square joined around a third: a loop passes the middle twice.
    u, v, faces = grid(4, 4)
    vertices = np.column_stack([u, v, 0 * u])
    x, y, _ = vertices[faces].mean(axis=1).T
    inner = (abs(x - 0.5) < 0.25) & (abs(y - 0.5) < 0.25)
    labels = np.where(inner & ((x < 0.5) == (y < 0.5)), np.where(x < 0.5, 1, 2), 0)
    found = figures(vertices, faces, np.tile([0.0, 0, 1], (25, 1)), labels)
    assert found.borders.pairs.tolist() == [[0, 1], [0, 2]]
    signed = [
        sum(np.cross(p[:-1], p[1:])[:, 2].sum() / 2 for p in found.outlines.of(k)) for k in range(3)
    ]
    np.testing.assert_allclose(signed, found.areas, rtol=1e-12)
    # Around cell 0, and in a figure of eight around both quarters.
    assert [len(found.outlines.of(k)) for k in range(3)] == [2, 1, 1]
    eight = found.outlines.of(0)[1]
    assert (np.linalg.norm(eight[:-1] - [0.5, 0.5, 0], axis=1) < 1e-12).sum() == 2


def test_a_closed_cell_has_no_border():
    found = Cut(box(), count=1).figures
    assert found.outlines.of(0) == []
    assert len(found.borders.pairs) == 0
    assert len(found.neighbours.of(0)) == 0
    assert np.isfinite(found.centres).all()
    assert np.isfinite(found.flatness).all()
    np.testing.assert_allclose(np.linalg.norm(found.normals, axis=1), 1.0)


def test_an_unused_label_is_refused():
    with pytest.raises(SurfaceError, match="cell 1 has no face"):
        figures(*box(), np.ones((8, 3)), np.array([0] * 6 + [2] * 6))


def test_normals_on_a_sphere_are_those_of_the_sphere():
    cut = Cut(dome(80, 100), count=200)
    radial = cut.figures.centres / np.linalg.norm(cut.figures.centres, axis=1, keepdims=True)
    assert angle(cut.figures.normals, radial).max() < math.radians(0.5)
    # A spherical cap of a cell's area leans as far as its border: a = 2 pi (1 - cos lean).
    lean = np.arccos(1 - cut.figures.areas / math.tau)
    assert (cut.figures.flatness > 0.8 * lean).all()
    assert (cut.figures.flatness < 2.5 * lean).all()


def test_advice_on_cells_too_large_does_help():
    mesh = bent(
        lambda u, v: (0.1 * np.cos(3 * u), 0.1 * np.sin(3 * u), 0.5 * v),
        200,
        100,
    )
    text = coarse(Cut(mesh, count=8).figures)
    assert "of 8 cells" in text
    assert "too large for the curvature" in text
    count = int(text.split("about ")[1].split(" cells")[0].replace(",", ""))
    assert 8 < count < 200
    assert coarse(Cut(mesh, count=count).figures) == ""
    size = float(text.split("size = ")[1].split(" m")[0])
    assert coarse(Cut(mesh, count=round(0.3 * 0.5 / size**2)).figures) == ""
    assert coarse(Cut(hood(), count=200).figures) == ""


def test_a_crease_is_named_as_one():
    text = coarse(Cut(box(), count=100).figures)
    assert "folded over a crease of up to 90 degrees" in text
    assert "size" not in text
    one_side = used(Mesh(box().vertices, box().faces[:2]))
    assert coarse(Cut(one_side, count=10).figures) == ""
