"""Repair changes nothing but what it says; triangle meshes hold what they promise."""

import pickle
from itertools import pairwise

import mesh_corpus as corpus
import mesh_writers as w
import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from surfaces import SurfaceError
from surfaces.meshes import TriangleMesh
from surfaces.meshes.normals import blended
from surfaces.meshes.repair import clean, notes_of, one_fan_each, weld_distance
from surfaces.meshes.repair.degenerate import flipped, welded
from surfaces.meshes.repair.orientation import oriented

RNG = np.random.default_rng(11)


def hilly(nu=12, nv=9):
    """A wavy plate."""
    vertices, faces = w.plate(nu, nv)
    vertices[:, 2] = 0.03 * np.sin(20 * vertices[:, 0]) * np.cos(15 * vertices[:, 1])
    return vertices, faces


def distance_to(vertices, faces, points):
    """How far points lie from triangles, by dense sampling of these: an upper bound."""
    k = 20
    a, b = np.meshgrid(np.arange(k + 1), np.arange(k + 1))
    a, b = (g[a + b <= k] / k for g in (a, b))
    share = np.stack([1 - a - b, a, b], axis=1)
    return cKDTree((share @ vertices[faces]).reshape(-1, 3)).query(points)[0].max()


def test_a_clean_mesh_stays_as_it_is():
    vertices, faces = hilly()
    mesh = clean(vertices, faces)
    w.assert_clean(mesh)
    assert np.array_equal(mesh.vertices, vertices)
    assert np.array_equal(mesh.faces, faces)
    assert notes_of(mesh) == ()


def test_cleaning_twice_changes_nothing_more():
    for vertices, faces in (
        corpus.with_chain_of_caps(),
        (corpus.NEAR, corpus.SOUP),
        corpus.BOW_TIE,
    ):
        once = clean(vertices, faces)
        twice = clean(once.vertices, once.faces)
        assert np.array_equal(once.vertices[once.faces], twice.vertices[twice.faces])
        assert twice.area == once.area


def test_everything_at_once_gives_the_surface_back():
    """Soup, shuffled, jittered, partly flipped, with repeats, points and strangers thrown in."""
    vertices, faces = hilly()
    true = clean(vertices, faces)
    soup = vertices[faces].reshape(-1, 3) + RNG.uniform(-1.5e-8, 1.5e-8, (3 * len(faces), 3))
    triangles = np.arange(len(soup)).reshape(-1, 3)
    triangles = np.concatenate([triangles, triangles[:7, ::-1], triangles[:5, [0, 0, 1]]])
    turned = RNG.random(len(triangles)) < 0.3
    triangles[turned] = triangles[turned][:, ::-1]
    triangles = RNG.permutation(triangles)
    soup = np.concatenate([soup, [[np.nan] * 3, [7, 7, 7]]])
    mesh = clean(soup, triangles)
    w.assert_clean(mesh)
    assert len(mesh.faces) == len(faces)
    assert len(mesh.vertices) == len(vertices)
    assert cKDTree(vertices).query(mesh.vertices)[0].max() < 4e-8
    assert mesh.area == pytest.approx(true.area, rel=1e-5)
    where = cKDTree(vertices[faces].mean(axis=1)).query(mesh.vertices[mesh.faces].mean(axis=1))[1]
    assert sorted(where) == list(range(len(faces)))
    assert np.abs(mesh.face_normals - true.face_normals[where]).max() < 1e-4
    for fragment in ("no face uses", "repeated others were joined", "two corners", "7 faces (",
                     "turned over"):  # fmt: skip
        assert sum(fragment in note for note in notes_of(mesh)) == 1
    assert len(notes_of(mesh)) == 5


@pytest.mark.parametrize("seed", range(20))
def test_turning_faces_over_at_random_is_undone(seed):
    """Up to the whole; the larger area decides, in each piece by itself."""
    rng = np.random.default_rng(seed)
    a, b = hilly(), w.cube()
    vertices, faces = corpus.stacked((a[0], a[1]), (b[0] + 1.0, b[1]))
    true = clean(vertices, faces)
    turned = rng.random(len(faces)) < rng.random()
    mixed = np.where(turned[:, None], faces[:, ::-1], faces)
    mesh = clean(vertices, mixed)
    w.assert_clean(mesh)
    assert np.array_equal(np.sort(mesh.faces, axis=1), np.sort(faces, axis=1))
    for piece in (true.pieces == 0, true.pieces == 1):
        flipped_area = true.face_areas[piece & turned].sum()
        sign = -1 if flipped_area > true.face_areas[piece].sum() / 2 else 1
        assert np.abs(mesh.face_normals[piece] - sign * true.face_normals[piece]).max() < 1e-12


def test_vertices_that_lie_together_become_one():
    """Clusters far smaller than the distance, by brute force; and nothing else is joined."""
    centres = RNG.uniform(0, 1, (60, 3))
    points = np.repeat(centres, 5, axis=0) + RNG.uniform(-7e-8, 7e-8, (300, 3))
    order = RNG.permutation(len(points))
    points, cluster = points[order], np.repeat(np.arange(60), 5)[order]
    stands = welded(points, weld_distance(points))
    expected = [int(np.flatnonzero(cluster == c)[0]) for c in cluster]
    assert stands.tolist() == expected


@pytest.mark.parametrize("dimension", [1, 2, 3])
def test_a_crowd_of_vertices_is_thinned_and_none_moves_far(dimension):
    """Chains in which each vertex is close to the next do not shrink to a point."""
    crowd = np.zeros((3000, 3))
    crowd[:, :dimension] = RNG.uniform(0, 3e-6, (3000, dimension))
    points = RNG.permutation(np.concatenate([crowd, [[0.5, 0.5, 0.7071]]]))
    distance = weld_distance(points)
    stands = welded(points, distance)
    assert (stands[stands] == stands).all()
    assert np.linalg.norm(points[stands] - points, axis=1).max() <= distance
    left = points[np.unique(stands)]
    left = left[left[:, 0] < 0.1]
    assert np.ptp(left, axis=0)[:dimension].min() > 2e-6
    # Every box of the grid keeps one at most.
    assert len(left) <= (2 + 3e-6 / (distance / np.sqrt(12))) ** dimension


def test_a_million_points_in_one_place_are_welded_in_bounded_memory():
    import tracemalloc

    points = np.concatenate([RNG.uniform(0, 1e-7, (1_000_000, 3)), [[1, 1, 1]]])
    tracemalloc.start()
    stands = welded(points, weld_distance(points))
    assert tracemalloc.get_traced_memory()[1] < 400 << 20
    tracemalloc.stop()
    assert len(np.unique(stands)) == 2


@pytest.mark.parametrize("seed", range(30))
def test_caps_are_flipped_without_moving_the_surface(seed):
    """Corners put on the edges of random fans; on each edge the cap has its own middle corners."""
    rng = np.random.default_rng(seed)
    vertices, faces = hilly(3, 3)
    vertices, faces = list(vertices), [list(map(int, face)) for face in faces]
    whole = clean(vertices, faces)
    # Split one side of an edge at points on it, and close the slit with a fan of caps.
    cut = 0
    for a, b in whole.edges.vertices[:: rng.integers(2, 6)].tolist():
        owner = next((f for f in faces if (a, b) in pairwise([*f, f[0]])), None)
        if owner is None:
            continue
        apex = next(k for k in owner if k not in (a, b))
        shares = np.sort(rng.uniform(0.1, 0.9, rng.integers(1, 4)))
        chain = [int(a)]
        for share in shares:
            vertices.append(vertices[a] + share * (vertices[b] - vertices[a]))
            chain.append(len(vertices) - 1)
        chain.append(int(b))
        faces.remove(owner)
        cut += 1
        faces += [[p, q, apex] for p, q in pairwise(chain)]
        faces += [[chain[0], chain[k + 1], chain[k]] for k in range(1, len(chain) - 1)]
    assert cut > 2
    mesh = clean(vertices, faces)
    w.assert_clean(mesh)
    assert any("flipping" in note for note in notes_of(mesh))
    assert len(mesh.vertices) == len(vertices)
    assert len(mesh.edges.border_faces) == len(whole.edges.border_faces)
    assert mesh.area == pytest.approx(whole.area, rel=1e-9)
    assert (mesh.pieces == 0).all()
    middles = mesh.vertices[mesh.faces].mean(axis=1)
    # The samples on the triangles lie at most this far apart.
    assert distance_to(whole.vertices, whole.faces, middles) < 0.01


def test_only_caps_leaves_nothing():
    line = np.array([[k, 0, 0] for k in range(4)], float)
    faces, _, dropped = flipped(line, np.array([[0, 1, 2], [0, 2, 3]]), 1e-6)
    assert (len(faces), dropped) == (0, 2)


def test_a_flip_never_makes_an_edge_twice():
    """A thin tetrahedron: the edge that the flip wants is there already, so the cap is dropped."""
    vertices = [[0, 0, 0], [1, 0, 0], [0.5, 0, 0], [0.5, 0.5, 0]]
    mesh = clean(vertices, [[0, 1, 3], [0, 2, 1], [0, 3, 2], [1, 2, 3]])
    w.assert_clean(mesh)
    assert any("dropped" in note for note in notes_of(mesh))


def test_fans_are_parted_and_nothing_moves():
    """Three cones with one tip between them."""
    tip = np.zeros((1, 3))
    parts, faces = [tip], []
    for k in range(3):
        angle = 2 * np.pi * np.arange(6) / 6
        ring = np.stack([0.3 * np.cos(angle), 0.3 * np.sin(angle), 0 * angle + 1], axis=1)
        parts.append(ring @ Rotation.from_rotvec([0, 2.0 * k, 0]).as_matrix().T)
        first = 1 + 6 * k
        faces += [[0, first + j, first + (j + 1) % 6] for j in range(6)]
    vertices = np.concatenate(parts)
    parted, numbers, added = one_fan_each(vertices, np.array(faces))
    assert added == 2
    assert np.array_equal(parted[numbers], vertices[np.array(faces)])
    mesh = clean(vertices, faces)
    w.assert_clean(mesh)
    assert sorted(np.bincount(mesh.pieces)) == [6, 6, 6]


@pytest.mark.parametrize("count", [3, 4, 7, 24])
def test_one_sided_and_two_sided_bands(count):
    with pytest.raises(SurfaceError, match="only one side"):
        clean(*w.strip(twisted=True, count=max(count, 4)))
    vertices, faces = w.strip(twisted=False, count=count)
    w.assert_clean(clean(vertices, faces))
    assert oriented(vertices, faces)[1] == 0


def test_the_moebius_strip_is_found_among_others():
    vertices, faces = corpus.stacked(
        w.strip(twisted=False), (w.strip(twisted=True)[0] + [3, 0, 0], w.strip(twisted=True)[1])
    )
    with pytest.raises(SurfaceError, match=r"48 faces around \((3|2\.99\d*), "):
        clean(vertices, faces)


@pytest.mark.parametrize(
    ("vertices", "faces", "said"),
    [
        ([[0, 0], [1, 1]], [[0, 1, 1]], "vertices must have shape (V, 3)"),
        (w.cube()[0], [[0, 1]], "faces must have shape (F, 3)"),
        (w.cube()[0], np.empty((0, 3), int), "at least one face"),
        (w.cube()[0], [[0.0, 1.0, 2.0]], "whole numbers"),
        ("mesh", [[0, 1, 2]], "arrays of numbers"),
        ([[0, 0, 0], [1, 0]], [[0, 1, 2]], "arrays of numbers"),
        (np.empty((0, 3)), [[0, 1, 2]], "do not exist"),
        (w.cube()[0], np.array([[0, 1, 2**63]], np.uint64), "do not exist"),
    ],
)
def test_arrays_that_are_no_mesh(vertices, faces, said):
    with pytest.raises(SurfaceError) as caught:
        clean(vertices, faces)
    assert said in str(caught.value)


def test_both_faults_are_named():
    with pytest.raises(SurfaceError, match=r"(?s)2 faults.*vertices must .*faces must"):
        clean([[0, 0]], [[0, 1]])


def test_a_rigid_motion_and_a_scale_change_nothing():
    turn = Rotation.from_rotvec([0.3, -2, 1.1]).as_matrix()
    for vertices, faces in (hilly(), corpus.with_chain_of_caps(), corpus.BOW_TIE):
        here = clean(vertices, faces)
        for scale in (1e-3, 1.0, 40.0):
            there = clean(scale * (np.asarray(vertices) @ turn.T + [1, -2, 0.5]), faces)
            assert np.array_equal(here.faces, there.faces)
            assert there.area == pytest.approx(scale**2 * here.area, rel=1e-9)
            assert len(notes_of(here)) == len(notes_of(there))


def vertex_normals(mesh):
    """(F, 3, 3) at the corners of faces, one for each vertex."""
    alike = np.repeat(mesh.face_normals[:, None], 3, axis=1)
    return blended(mesh.vertices, mesh.faces, alike, mesh.faces)


def test_blended_normals_do_not_see_how_faces_are_cut():
    """Cutting faces through a corner keeps its normal; finer spheres have better ones."""
    vertices, faces = w.cube()
    other = np.array([[*face[1:], face[0]] for face in faces])
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    crossed = np.array([[q[k], q[k + 1], q[(k + 3) % 4]] for q in quads for k in (0,)])
    crossed = np.concatenate([crossed, [[q[1], q[2], q[3]] for q in quads]])
    expected = (vertices - 0.1) / (0.1 * np.sqrt(3))
    for cut in (faces, other, crossed):
        assert np.abs(vertex_normals(TriangleMesh(vertices, cut)) - expected[cut]).max() < 1e-12


def test_blended_normals_of_a_sheet_folded_onto_itself():
    """Its two faces cancel, and yet the normal is a unit vector."""
    mesh = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 1, 1e-12]], [[0, 1, 2], [1, 0, 3]])
    assert np.abs(np.linalg.norm(vertex_normals(mesh), axis=2) - 1).max() < 1e-12


def test_the_constructor_holds_the_rules():
    vertices, faces = w.cube()
    for bad, said in (
        (faces[:0], "no faces"),
        (faces + 1, "must name vertices"),
        (np.concatenate([faces, [[0, 1, 6]]]), "more than two faces"),
        (np.concatenate([corpus.FLIPPED[:3], faces[3:]]), "disagree"),
        (np.concatenate([faces, [[0, 0, 0]]]), "no area"),
    ):
        with pytest.raises(SurfaceError, match=said):
            TriangleMesh(vertices, bad)
    with pytest.raises(SurfaceError, match="finite"):
        TriangleMesh(corpus.NAN, faces)


def test_meshes_pickle_and_stay_protected():
    mesh = clean([*w.cube()[0], [9, 9, 9]], w.cube()[1])
    again = pickle.loads(pickle.dumps(mesh))
    w.assert_clean(again)
    assert notes_of(again) == notes_of(mesh)
    assert len(notes_of(mesh)) == 1
    assert np.array_equal(again.vertices, mesh.vertices)
    with pytest.raises(ValueError, match="read-only"):
        mesh.vertices[0] = 0.0
    with pytest.raises(AttributeError):
        mesh.faces = mesh.faces[:1]


def test_pieces_are_numbered_by_area():
    parts = [(w.cube(size)[0] + [k, 0, 0], w.cube()[1]) for k, size in enumerate((0.1, 0.3, 0.2))]
    mesh = clean(*corpus.stacked(*parts))
    assert mesh.pieces.tolist() == [2] * 12 + [0] * 12 + [1] * 12


def test_holes_are_counted_and_measured():
    vertices, faces = w.plate(9, 8, 0.9, 0.8)
    squares = np.array([18, 36, 53])  # none touches another or the border
    inner = np.concatenate([2 * squares, 2 * squares + 1])
    mesh = clean(vertices, np.delete(faces, inner, axis=0))
    note = next(note for note in notes_of(mesh) if "hole" in note)
    assert "3 holes" in note
    assert "0.4 m around" in note


def pipe(radii, heights, n=24):
    """Rings of n points about z, joined from each to the next; outward is away from z."""
    angle = np.linspace(0, 2 * np.pi, n, endpoint=False)
    rings = [
        np.column_stack([r * np.cos(angle), r * np.sin(angle), np.full(n, z)])
        for r, z in zip(radii, heights, strict=True)
    ]
    k, nxt = np.arange(n), (np.arange(n) + 1) % n
    bands = [
        [
            [k + b * n, nxt + b * n, nxt + (b + 1) * n],
            [k + b * n, nxt + (b + 1) * n, k + (b + 1) * n],
        ]
        for b in range(len(rings) - 1)
    ]
    faces = np.concatenate([np.array(band).transpose(0, 2, 1).reshape(-1, 3) for band in bands])
    return np.concatenate(rings), faces


# Border lines: holes, and open ends where a piece has more than one.
OPEN = {
    "pipe": (pipe([1, 1, 1], [0, 1, 2]), 0, 2),
    "long pipe": (pipe([0.05] * 9, range(9)), 0, 2),
    "waisted pipe": (pipe([1, 0.5, 1], [0, 1, 2]), 0, 2),
    "funnel, steep": (pipe([1, 0.8], [0, 2]), 0, 2),
    "disc with a hole": (pipe([0.2, 1], [0, 0]), 1, 0),
    "flat ring": (pipe([0.9, 1], [0, 0]), 1, 0),
    "shallow dish with a hole": (pipe([0.2, 0.6, 1], [0, 0.1, 0.3]), 1, 0),
}


@pytest.mark.parametrize("name", OPEN)
@pytest.mark.parametrize("flipped", [False, True])
def test_the_ends_of_a_pipe_are_no_holes(name, flipped):
    (vertices, faces), holes, ends = OPEN[name]
    turn, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))
    mesh = clean(vertices @ turn.T, faces[:, ::-1] if flipped else faces)
    notes = [note for note in notes_of(mesh) if "hole" in note or "open end" in note]
    expected = [f"{holes} hole;"] * bool(holes) + [f"{ends} open ends"] * bool(ends)
    assert len(notes) == len(expected)
    for note, words in zip(notes, expected, strict=True):
        assert words in note


def test_a_pipe_with_a_hole_in_its_side():
    vertices, faces = pipe([1] * 9, np.linspace(0, 4, 9))
    middles = vertices[faces].mean(axis=1)
    window = (np.abs(middles[:, 2] - 2) < 0.6) & (middles[:, 0] > 0.8)
    notes = notes_of(clean(vertices, faces[~window]))
    assert any("1 hole;" in note for note in notes)
    assert any("2 open ends" in note for note in notes)


def knotted(rng):
    """Faces between points of a small grid: many are straight, doubled or meet in bundles."""
    count = int(rng.integers(3, 12))
    return rng.integers(0, 3, (count, 3)).astype(float), rng.integers(
        0, count, (rng.integers(1, 8), 3)
    )


def battered(rng):
    """A plate with faces gone or turned over, and vertices moved onto lines between others."""
    vertices, faces = w.plate(int(rng.integers(1, 6)), int(rng.integers(1, 6)))
    vertices = vertices + rng.choice([0, 1e-7, 1e-3]) * rng.normal(size=vertices.shape)
    for a, b, c in rng.integers(0, len(vertices), (rng.integers(0, 6), 3)):
        vertices[a] = vertices[b] + rng.random() * (vertices[c] - vertices[b])
    turned = rng.random(len(faces)) < 0.2
    faces = np.where(turned[:, None], faces[:, ::-1], faces)
    return vertices, faces[np.sort(rng.permutation(len(faces))[: rng.integers(1, len(faces) + 1)])]


@pytest.mark.parametrize("make", [knotted, battered])
@pytest.mark.parametrize("seed", range(8))
def test_any_arrays_are_refused_or_made_clean(make, seed):
    rng = np.random.default_rng(seed)
    outcomes = {True: 0, False: 0}
    for _ in range(20):
        vertices, faces = make(rng)
        try:
            mesh = clean(vertices, faces)
        except SurfaceError:
            outcomes[False] += 1
            continue
        outcomes[True] += 1
        w.assert_clean(mesh)
        # No more area than there was, and none lost without a word.
        size = np.linalg.norm(
            np.cross(*(np.diff(vertices[faces], axis=1).transpose(1, 0, 2))), axis=1
        )
        before = size.sum() / 2
        assert mesh.area <= before + 1e-4 * max(before, 1e-3)
        if not any("dropped" in note for note in notes_of(mesh)):
            assert mesh.area == pytest.approx(before, rel=1e-4)
        again = clean(mesh.vertices, mesh.faces)
        assert again.area == pytest.approx(mesh.area, rel=1e-9)
    assert outcomes[True] > 3
