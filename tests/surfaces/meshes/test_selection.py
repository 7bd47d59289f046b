"""Parts of meshes: exact areas, however the cut runs."""

import mesh_corpus as corpus
import mesh_writers as w
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from surfaces import SurfaceError, cut_box, cut_plane, faces_within_cone, take_faces
from surfaces.meshes.repair import clean, notes_of


def hilly(nu=14, nv=11):
    vertices, faces = w.plate(nu, nv)
    vertices[:, 2] = 0.03 * np.sin(20 * vertices[:, 0]) * np.cos(15 * vertices[:, 1])
    return clean(vertices, faces)


def area_beyond(mesh, point, normal):
    """By clipping one triangle after the other (Sutherland and Hodgman)."""
    total = 0.0
    for triangle in mesh.vertices[mesh.faces]:
        heights = (triangle - point) @ normal
        corners = []
        for k in range(3):
            p, q, hp, hq = triangle[k], triangle[k - 2], heights[k], heights[k - 2]
            if hp >= 0:
                corners.append(p)
            if hp * hq < 0:
                corners.append(p + hp / (hp - hq) * (q - p))
        for k in range(1, len(corners) - 1):
            cross = np.cross(corners[k] - corners[0], corners[k + 1] - corners[0])
            total += 0.5 * np.linalg.norm(cross)
    return total


@pytest.mark.parametrize("seed", range(25))
def test_the_two_sides_of_a_cut_make_up_the_whole(seed):
    rng = np.random.default_rng(seed)
    mesh = hilly() if seed % 2 else clean(*w.cube(0.3))
    middle = mesh.vertices.mean(axis=0) + rng.normal(0, 0.03, 3)
    normal = rng.normal(0, 1, 3)
    unit = normal / np.linalg.norm(normal)
    over, under = cut_plane(mesh, middle, normal), cut_plane(mesh, middle, -normal)
    for part, sign in ((over, 1), (under, -1)):
        w.assert_clean(part)
        assert (sign * (part.vertices - middle) @ unit).min() > -1e-6
        assert part.area == pytest.approx(area_beyond(mesh, middle, sign * unit), rel=1e-9)
        # What was no border before now lies in the plane.
        ends = part.vertices[part.edges.border_vertices]
        in_plane = (np.abs((ends - middle) @ unit) < 1e-12).all(axis=1)
        assert in_plane.any()
    assert over.area + under.area == pytest.approx(mesh.area, rel=1e-12)
    assert over.history != under.history
    assert len(over.history) == 1
    if seed % 2 == 0:  # a closed mesh: all of the new border lies in the plane, and both agree
        assert in_plane.all()
        assert over.edges.border_lengths.sum() == pytest.approx(under.edges.border_lengths.sum())


def test_a_cut_along_edges_and_through_vertices():
    """The plane holds a row of vertices; no triangle is cut, none is lost."""
    mesh = clean(*w.plate(6, 4, 0.6, 0.4))
    half = cut_plane(mesh, (0.3, 0, 0), (1, 0, 0))
    w.assert_clean(half)
    assert len(half.faces) == len(mesh.faces) // 2
    assert half.area == pytest.approx(0.12)
    # Along a diagonal of the squares, then across it, through corners and edges by turns.
    for normal, share in (((1, -1, 0), 0.24 - 0.08), ((1, 1, 0), 0.24 - 0.08)):
        point = (0, 0, 0) if normal[1] < 0 else (0, 0.4, 0)
        part = cut_plane(mesh, point, normal)
        w.assert_clean(part)
        assert part.area == pytest.approx(share)


def test_faces_in_the_plane_are_kept():
    mesh = clean(*w.cube(0.2))
    assert cut_plane(mesh, (0, 0, 0), (0, 0, 1)).area == pytest.approx(mesh.area)
    assert cut_plane(mesh, (0, 0, 0.2), (0, 0, 1)).area == pytest.approx(0.04)


def test_a_cut_that_leaves_parts_hanging_in_a_point_parts_them():
    """Two peaks above the plane that share one saddle vertex."""
    vertices = [[0, 0, 0], [1, 1, 1], [1, -1, 1], [-1, 1, 1], [-1, -1, 1], [2, 0, -1]]
    vertices += [[0, 2, -1], [-2, 0, -1], [0, -2, -1]]
    faces = [[0, 2, 1], [0, 3, 4], [0, 1, 6], [0, 6, 3], [0, 4, 8], [0, 8, 2]]
    part = cut_plane(clean(vertices, faces), (0, 0, 0), (0, 0, 1))
    w.assert_clean(part)
    assert len(np.unique(part.pieces)) == 2
    assert any("2 separate pieces" in note for note in notes_of(part))


def test_a_box_is_six_planes():
    mesh = hilly()
    low, high = np.array([0.05, 0.031, -0.02]), np.array([0.222, 0.177, 0.011])
    part = cut_box(mesh, low, high)
    w.assert_clean(part)
    assert (part.vertices >= low - 1e-6).all()
    assert (part.vertices <= high + 1e-6).all()
    expected = mesh
    for axis in np.eye(3):
        expected = cut_plane(cut_plane(expected, low, axis), high, -axis)
    assert part.area == pytest.approx(expected.area, rel=1e-9)
    assert len(part.history) == 1
    assert f"{part.area:.4g} of {mesh.area:.4g} m^2" in part.history[0]
    flat = clean(*w.plate(7, 5, 0.3, 0.2))
    assert cut_box(flat, (0.1, 0.05, -1), (0.25, 0.15, 1)).area == pytest.approx(0.015)
    assert cut_box(flat, (-1, -1, -1), (1, 1, 1)).area == flat.area


def test_a_cut_moves_with_the_mesh():
    mesh, turn = hilly(), Rotation.from_rotvec([1, -0.4, 2]).as_matrix()
    point, normal = np.array([0.13, 0.1, 0]), np.array([0.3, 1, 0.2])
    here = cut_plane(mesh, point, normal)
    there = cut_plane(
        clean(mesh.vertices @ turn.T + 1.5, mesh.faces), turn @ point + 1.5, turn @ normal * 1e5
    )
    assert len(here.faces) == len(there.faces)
    assert np.abs(here.vertices @ turn.T + 1.5 - there.vertices).max() < 1e-12


@pytest.mark.parametrize("angle", [5.0, 30.0, 90.0, 180.0])
def test_faces_that_look_up(angle):
    mesh = hilly()
    leaning = np.degrees(np.arccos(np.clip(mesh.face_normals[:, 2], -1, 1)))
    part = faces_within_cone(mesh, (0, 0, 7), angle)
    w.assert_clean(part)
    chosen = leaning <= angle
    assert part.area == pytest.approx(mesh.face_areas[chosen].sum(), rel=1e-12)
    assert np.array_equal(part.vertices[part.faces], mesh.vertices[mesh.faces[chosen]])
    assert (part.face_normals[:, 2] >= np.cos(np.radians(angle)) - 1e-12).all()


def test_the_top_of_a_cube():
    mesh = clean(*w.cube(0.2))
    assert faces_within_cone(mesh, (0, 0, 1), 1e-3).area == pytest.approx(0.04)
    assert faces_within_cone(mesh, (0, 0, 1), 90).area == pytest.approx(0.2)  # all but the bottom
    assert faces_within_cone(mesh, (1, 1, 1), 60).area == pytest.approx(0.12)


def test_faces_by_number():
    mesh = hilly()
    part = take_faces(mesh, [7, 3, 3, 200])
    assert np.array_equal(part.vertices[part.faces], mesh.vertices[mesh.faces[[3, 7, 200]]])
    w.assert_clean(part)
    chosen = mesh.face_areas > np.median(mesh.face_areas)
    assert take_faces(mesh, chosen).area == pytest.approx(mesh.face_areas[chosen].sum())


def test_notes_of_the_whole_stay_and_those_of_the_pieces_are_told_anew():
    vertices, faces = corpus.stacked((corpus.V, corpus.F), (corpus.SECOND, corpus.F))
    mesh = clean([*vertices, [3, 3, 3]], faces)
    assert len(notes_of(mesh)) == 2
    part = cut_plane(cut_plane(mesh, (0.3, 0, 0), (-1, 0, 0)), (0, 0, 0.1), (0, 0, 1))
    assert ["no face uses" in notes_of(part)[0], len(notes_of(part))] == [True, 3]
    assert "12 faces" in notes_of(part)[1]


@pytest.mark.parametrize(
    ("cut", "said"),
    [
        (
            lambda m: cut_plane(m, (0, 0, 9), (0, 0, 1)),
            "nothing lies beyond the plane through (0, 0, 9)",
        ),
        (lambda m: cut_box(m, (1, 1, 1), (2, 2, 2)), "nothing lies in the box (1, 1, 1)"),
        (lambda m: faces_within_cone(m, (0, 0, -1), 20), "leans away from it by"),
        (lambda m: take_faces(m, []), "no face was chosen"),
    ],
)
def test_nothing_left_says_where_the_mesh_is(cut, said):
    with pytest.raises(SurfaceError) as caught:
        cut(hilly())
    assert said in str(caught.value)
    assert "the mesh lies in (0, 0, -0.0" in str(caught.value)
    assert "(0.3, 0.2, 0.0" in str(caught.value)


@pytest.mark.parametrize(
    ("cut", "said"),
    [
        (lambda m: cut_plane(m, (0, 0), (0, 0, np.nan)), ("point must be three", "normal must be")),
        (
            lambda m: cut_plane(m, (0, 0, 0), (0, 0, 0)),
            ("normal must be three finite numbers that are not all zero",),
        ),
        (lambda m: cut_box(m, (0, 0, 0), (1, 0, 1)), ("low must be below the opposite corner",)),
        (lambda m: cut_box(m, (0, 0, np.inf), "x"), ("low must be three", "high must be three")),
        (lambda m: faces_within_cone(m, (0, 0, 0), -3), ("direction must", "half_angle_deg must")),
        (lambda m: faces_within_cone(m, (0, 0, 1), 200), ("<= 180",)),
        (lambda m: take_faces(m, [0, 400]), ("1 of 2 indices name no face, the first is 400",)),
        (lambda m: take_faces(m, [-1]), ("the first is -1",)),
        (lambda m: take_faces(m, [0.5]), ("whole numbers",)),
        (lambda m: take_faces(m, [[1], [1, 2]]), ("whole numbers",)),
        (lambda m: take_faces(m, "all"), ("whole numbers",)),
        (lambda m: take_faces(m, [True, False]), ("whole numbers",)),
    ],
)
def test_bad_numbers_are_all_named(cut, said):
    with pytest.raises(SurfaceError) as caught:
        cut(hilly())
    for fragment in said:
        assert fragment in str(caught.value)
