"""Smoothed copies of meshes: what they leave, what they move, and how far off they say they are."""

from __future__ import annotations

import numpy as np
import pytest
from mesh_patches import bent
from triangle_probes import least_distances

from coverable_errors import CoverableError
from surfaces import mesh
from surfaces.meshes import TriangleMesh, smoothed

LENGTH = 0.1


def bead(flank: float, nu: int = 40, nv: int = 40):
    """0.6 x 0.4 m with a ridge 8 mm high across, its flanks so wide (m)."""

    def shape(u, v):
        x = 0.6 * u
        return x, 0.4 * v, 0.008 * np.clip((0.015 + flank - abs(x - 0.31)) / flank, 0.0, 1.0)

    return bent(shape, nu, nv)


@pytest.mark.parametrize(("share", "kept"), [(4.0, 0.996), (1.0, 0.5), (0.5, 1.0 / 17.0)])
def test_a_wave_of_the_length_keeps_half_its_height(share: float, kept: float) -> None:
    wave = bent(
        lambda u, v: (u, 0.5 * v, 1e-3 * np.sin(2.0 * np.pi * u / (share * LENGTH))), 200, 100
    )
    smooth = smoothed(mesh(TriangleMesh(*wave)), LENGTH, 1.0)
    corners = smooth.mesh.vertices
    inner = (abs(corners[:, :2] - [0.5, 0.25]) < [0.3, 0.1]).all(axis=1)
    assert abs(corners[inner, 2]).max() == pytest.approx(1e-3 * kept, rel=0.1)


def test_planes_stay_up_to_their_borders_needles_or_not() -> None:
    def shape(u, v):  # rows down to a micrometre wide, far from the origin
        return 5.0 + 0.6 * u, 7.0 + 0.4 * v**9, 0.3 * u + 0.2

    flat = mesh(TriangleMesh(*bent(shape, 12, 6)))
    assert smoothed(flat, LENGTH, 1.0).smoothing.off < 1e-9


@pytest.mark.parametrize("flank", [0.008, 0.035])
@pytest.mark.parametrize("cut", [False, True])
def test_neither_is_further_from_the_other_than_is_said(flank: float, cut: bool) -> None:
    """Of the cells too, whose triangles are other ones; the surface before is kept for the rest."""
    rng = np.random.default_rng(1)
    vertices, faces = bead(flank)
    given = mesh(TriangleMesh(vertices, faces))
    smooth = smoothed(given, LENGTH, 0.01)
    if cut:
        smooth = smooth.cells(20).surface
    assert 1e-3 < smooth.smoothing.off < 0.008
    assert smooth.deviations == (smooth.smoothing.off, 0.0)
    corners, copied = vertices[faces], smooth.mesh.vertices[smooth.mesh.faces]
    for points, triangles in (
        (copied[:, 0], corners),
        (copied.mean(axis=1), corners),
        (vertices, copied),
        (corners.mean(axis=1), copied),
    ):
        some = rng.choice(points, 40, replace=False)
        assert least_distances(triangles, some).max() <= smooth.smoothing.off + 1e-12
    some = rng.choice(smooth.wall.mesh.vertices, 40, replace=False)
    assert least_distances(corners, some).max() < 1e-12
    assert smooth.wall.mesh.area == pytest.approx(given.mesh.area, rel=1e-9)
    assert smoothed(given, LENGTH, 1e-3).deviations == (0.0, 0.0)  # more than the tolerance


def test_it_moves_with_its_wall_and_lengths_that_make_no_sense_are_refused() -> None:
    given = mesh(TriangleMesh(*bead(0.01)))
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    moved = smoothed(given, LENGTH, 0.01).moved(turn, [1.0, 2.0, 3.0])
    place = given.mesh.vertices[:9] @ turn.T + [1.0, 2.0, 3.0]
    assert np.abs(moved.wall.closest(place).height).max() < 1e-12
    for length, said in ((0.0, "length"), (np.nan, "length"), (1e-4, "take .* m or more")):
        with pytest.raises(CoverableError, match=said):
            smoothed(given, length, 0.01)
