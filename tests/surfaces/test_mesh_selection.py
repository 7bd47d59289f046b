"""Parts of meshes: exact areas, however the cut runs."""

import mesh_writers as w
import numpy as np
import pytest
from approved import refused
from samples import sampled, seeds

from coverable import cut_box, cut_plane, faces_within_cone, take_faces
from surfaces.meshes.cleaning import clean

CUBE = clean(*w.cube(0.2))
HILLY = clean(*w.hilly())


@sampled("seed", seeds(10, all=200))
def test_the_two_sides_of_a_cut_make_up_the_whole(seed):
    rng, mesh = np.random.default_rng(seed), (CUBE, HILLY)[seed % 2]
    middle = mesh.vertices.mean(axis=0) + rng.normal(0, 0.03, 3)
    normal = rng.normal(0, 1, 3)
    unit = normal / np.linalg.norm(normal)
    over, under = cut_plane(mesh, middle, normal), cut_plane(mesh, middle, -normal)
    for part, sign in ((over, 1), (under, -1)):
        w.assert_clean(part)
        assert (sign * (part.vertices - middle) @ unit).min() > -1e-6
        # What was no border before now lies in the plane; of a closed mesh all of it.
        ends = part.vertices[part.edges.border_vertices]
        in_plane = (np.abs((ends - middle) @ unit) < 1e-12).all(axis=1)
        assert in_plane.all() if mesh is CUBE else in_plane.any()
    assert over.area + under.area == pytest.approx(mesh.area, rel=1e-12)
    assert over.history != under.history
    assert len(over.history) == 1


# What a cut leaves of a mesh, in m^2, where planes run along edges, through vertices and faces.
PLATE = clean(*w.plate(6, 4, 0.6, 0.4))
FLAT = clean(*w.plate(7, 5, 0.3, 0.2))
KNOWN = {
    "along edges": (lambda: cut_plane(PLATE, (0.3, 0, 0), (1, 0, 0)), 0.12),
    "along diagonals": (lambda: cut_plane(PLATE, (0, 0, 0), (1, -1, 0)), 0.16),
    "across diagonals": (lambda: cut_plane(PLATE, (0, 0.4, 0), (1, 1, 0)), 0.16),
    "faces in the plane": (lambda: cut_plane(CUBE, (0, 0, 0), (0, 0, 1)), 0.24),
    "faces in the plane alone": (lambda: cut_plane(CUBE, (0, 0, 0.2), (0, 0, 1)), 0.04),
    "box": (lambda: cut_box(FLAT, (0.1, 0.05, -1), (0.25, 0.15, 1)), 0.015),
    "box round all": (lambda: cut_box(FLAT, (-1, -1, -1), (1, 1, 1)), 0.06),
    "top": (lambda: faces_within_cone(CUBE, (0, 0, 1), 1e-3), 0.04),
    "all but the bottom": (lambda: faces_within_cone(CUBE, (0, 0, 1), 90), 0.2),
    "three sides": (lambda: faces_within_cone(CUBE, (1, 1, 1), 60), 0.12),
}


@pytest.mark.parametrize("name", KNOWN)
def test_parts_by_hand(name):
    made, area = KNOWN[name]
    part = made()
    w.assert_clean(part)
    assert part.area == pytest.approx(area)


def test_a_box_is_six_planes():
    low, high = np.array([0.05, 0.031, -0.02]), np.array([0.222, 0.177, 0.011])
    part = expected = cut_box(HILLY, low, high)
    w.assert_clean(part)
    assert (part.vertices >= low - 1e-6).all()
    assert (part.vertices <= high + 1e-6).all()
    expected = HILLY
    for axis in np.eye(3):
        expected = cut_plane(cut_plane(expected, low, axis), high, -axis)
    assert part.area == pytest.approx(expected.area, rel=1e-9)
    assert len(part.history) == 1
    assert f"{part.area:.4g} of {HILLY.area:.4g} m^2" in part.history[0]


def test_faces_by_number():
    for chosen in ([7, 3, 3, 200], np.isin(np.arange(len(HILLY.faces)), [3, 7, 200])):
        part = take_faces(HILLY, chosen)
        assert np.array_equal(part.vertices[part.faces], HILLY.vertices[HILLY.faces[[3, 7, 200]]])


@pytest.mark.parametrize("angle", [5.0, 30.0, 90.0, 180.0])
def test_faces_that_look_up(angle):
    chosen = np.degrees(np.arccos(np.clip(HILLY.face_normals[:, 2], -1, 1))) <= angle
    part = faces_within_cone(HILLY, (0, 0, 7), angle)
    w.assert_clean(part)
    assert np.array_equal(part.vertices[part.faces], HILLY.vertices[HILLY.faces[chosen]])


WRONG = [
    (cut_plane, (0, 0, 9), (0, 0, 1)), (cut_box, (1, 1, 1), (2, 2, 2)),
    (faces_within_cone, (0, 0, -1), 20), (take_faces, []),
    (cut_plane, (0, 0), (0, 0, np.nan)), (cut_plane, (0, 0, 0), (0, 0, 0)),
    (cut_box, (0, 0, 0), (1, 0, 1)), (cut_box, (0, 0, np.inf), "x"),
    (faces_within_cone, (0, 0, 0), -3), (faces_within_cone, (0, 0, 1), 200),
    *[(take_faces, each) for each in ([0, 400], [-1], [0.5], [[1], [1, 2]], "all", [True, False])],
]  # fmt: skip


def test_nothing_left_and_bad_numbers_are_said(approved):
    said = [refused(cut, HILLY, *arguments) for cut, *arguments in WRONG]
    approved("parts that are none", "\n".join(said))
