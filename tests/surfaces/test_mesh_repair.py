"""Repair changes nothing but what it says; triangle meshes hold what they promise."""

import mesh_writers as w
import numpy as np
import pytest
from approved import refused
from mesh_patches import SIDES, stacked
from samples import sampled, seeds
from scipy.spatial.transform import Rotation

from coverable import SurfaceError
from surfaces.meshes.cleaning import clean
from surfaces.meshes.degenerate import weld_distance, welded
from surfaces.meshes.mesh_notes import notes_of
from surfaces.meshes.normals import blended
from surfaces.meshes.orientation import one_fan_each, oriented
from surfaces.meshes.triangle_mesh import TriangleMesh

V, F = w.cube()
UNCLEAN = {"caps": w.chain_of_caps(), "bow tie": w.bow_tie(), "wavy": w.hilly(12, 9)}


@pytest.mark.parametrize("name", UNCLEAN)
def test_cleaning_again_moving_and_scaling_change_nothing_more(name):
    vertices, faces = UNCLEAN[name]
    turn = Rotation.from_rotvec([0.3, -2, 1.1]).as_matrix()
    here = clean(vertices, faces)
    assert name != "wavy" or (np.array_equal(here.vertices, vertices) and not notes_of(here))
    again = clean(here.vertices, here.faces)
    assert np.array_equal(here.vertices[here.faces], again.vertices[again.faces])
    for scale in (1e-3, 1.0, 40.0):
        there = clean(scale * (np.asarray(vertices) @ turn.T + [1, -2, 0.5]), faces)
        assert np.array_equal(here.faces, there.faces)
        assert there.area == pytest.approx(scale**2 * here.area, rel=1e-9)
        assert len(notes_of(here)) == len(notes_of(there))


@pytest.mark.parametrize("dimension", [1, 2, 3])
def test_a_crowd_of_vertices_is_thinned_and_none_moves_far(dimension):
    """Chains in which each vertex is close to the next do not shrink to a point."""
    rng, crowd = np.random.default_rng(13), np.zeros((3000, 3))
    crowd[:, :dimension] = rng.uniform(0, 3e-6, (3000, dimension))
    points = rng.permutation(np.concatenate([crowd, [[0.5, 0.5, 0.7071]]]))
    distance = weld_distance(points)
    stands = welded(points, distance)
    assert (stands[stands] == stands).all()
    assert np.linalg.norm(points[stands] - points, axis=1).max() <= distance
    left = points[np.unique(stands)]
    left = left[left[:, 0] < 0.1]
    assert np.ptp(left, axis=0)[:dimension].min() > 2e-6
    # Every box of a grid keeps one at most.
    assert len(left) <= (2 + 3e-6 / (distance / np.sqrt(12))) ** dimension


def test_what_the_larger_area_says_is_outside_is():
    faces = np.array(F)
    faces[:3] = faces[:3, ::-1]
    found, turned = oriented(np.array(V), faces)
    assert turned == 3
    assert (found == F).all()


def test_a_flip_never_makes_an_edge_twice():
    """A thin tetrahedron: the edge that the flip wants is there already, so the cap is dropped."""
    vertices = [[0, 0, 0], [1, 0, 0], [0.5, 0, 0], [0.5, 0.5, 0]]
    mesh = clean(vertices, [[0, 1, 3], [0, 2, 1], [0, 3, 2], [1, 2, 3]])
    w.assert_clean(mesh)
    assert any("dropped" in note for note in notes_of(mesh))


def test_the_first_fan_of_several_keeps_their_vertex():
    vertices, faces = map(np.array, w.bow_tie())
    parted, numbers, added = one_fan_each(vertices, faces)
    assert added == 1
    assert (parted[numbers] == vertices[faces]).all()
    assert (numbers[0] == faces[0]).all()


def vertex_normals(mesh):
    """(F, 3, 3) at the corners of faces, one for each vertex."""
    alike = np.repeat(mesh.face_normals[:, None], 3, axis=1)
    return blended(mesh.vertices, mesh.faces, alike, mesh.faces)


def test_blended_normals_do_not_see_how_faces_are_cut():
    """Cutting faces through a corner keeps its normal; those of a folded sheet are unit vectors."""
    crossed = np.array([half for a, b, c, d in SIDES for half in ([a, b, d], [b, c, d])])
    expected = (V - 0.1) / (0.1 * np.sqrt(3))
    for cut in (F, np.roll(F, -1, axis=1), crossed):
        assert np.abs(vertex_normals(TriangleMesh(V, cut)) - expected[cut]).max() < 1e-12
    folded = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 1, 1e-12]], [[0, 1, 2], [1, 0, 3]])
    assert np.abs(np.linalg.norm(vertex_normals(folded), axis=2) - 1).max() < 1e-12


ARRAYS = [
    ([[0, 0], [1, 1]], [[0, 1, 1]]), (V, [[0, 1]]), (V, np.empty((0, 3), int)),
    (V, [[0.0, 1.0, 2.0]]), ("mesh", [[0, 1, 2]]), ([[0, 0, 0], [1, 0]], [[0, 1, 2]]),
    (np.empty((0, 3)), [[0, 1, 2]]), (V, np.array([[0, 1, 2**63]], np.uint64)), ([[0, 0]], [[0]]),
    ([[k, 0, 0] for k in range(4)], [[0, 1, 2], [0, 2, 3]]),
]  # fmt: skip
MESHES = [
    (V, F[:0]), (V, F + 1), (V, [*F, [0, 1, 6]]), (V, [*F[:3, ::-1], *F[3:]]), (V, [*F, [0, 0, 0]]),
    (np.where(V > 0, np.nan, V), F),
]  # fmt: skip


def test_arrays_that_are_no_mesh_are_refused(approved):
    said = [refused(clean, *given) for given in ARRAYS]
    said += [refused(TriangleMesh, *given) for given in MESHES]
    approved("arrays that are no mesh", "\n".join(said))


def test_pieces_are_numbered_by_area():
    parts = [(w.cube(size)[0] + [k, 0, 0], F) for k, size in enumerate((0.1, 0.3, 0.2))]
    assert clean(*stacked(*parts)).pieces.tolist() == [2] * 12 + [0] * 12 + [1] * 12


def knotted(rng):
    """Faces between points of a small grid: many are straight, doubled or meet in bundles."""
    count = int(rng.integers(3, 12))
    vertices = rng.integers(0, 3, (count, 3)).astype(float)
    return vertices, rng.integers(0, count, (rng.integers(1, 8), 3))


def battered(rng):
    """A plate with faces gone or turned over, and vertices moved onto lines between others."""
    vertices, faces = w.plate(int(rng.integers(1, 6)), int(rng.integers(1, 6)))
    vertices = vertices + rng.choice([0, 1e-7, 1e-3]) * rng.normal(size=vertices.shape)
    for a, b, c in rng.integers(0, len(vertices), (rng.integers(0, 6), 3)):
        vertices[a] = vertices[b] + rng.random() * (vertices[c] - vertices[b])
    faces = np.where(rng.random((len(faces), 1)) < 0.2, faces[:, ::-1], faces)
    return vertices, faces[np.sort(rng.permutation(len(faces))[: rng.integers(1, len(faces) + 1)])]


@pytest.mark.parametrize("make", [knotted, battered])
@sampled("seed", seeds(4, all=100))
def test_any_arrays_are_refused_or_made_clean(make, seed):
    """With no more area than there was, and none lost without a word."""
    rng, taken = np.random.default_rng(seed), 0
    for _ in range(20):
        vertices, faces = make(rng)
        try:
            mesh = clean(vertices, faces)
        except SurfaceError:
            continue
        taken += 1
        w.assert_clean(mesh)
        sides = np.diff(vertices[faces], axis=1).transpose(1, 0, 2)
        before = np.linalg.norm(np.cross(*sides), axis=1).sum() / 2
        assert mesh.area <= before + 1e-4 * max(before, 1e-3)
        if not any("dropped" in note for note in notes_of(mesh)):
            assert mesh.area == pytest.approx(before, rel=1e-4)
        assert clean(mesh.vertices, mesh.faces).area == pytest.approx(mesh.area, rel=1e-9)
    assert taken > 3
