"""Curves lie on their surfaces, meet the centres, and keep their bounds."""

from __future__ import annotations

import numpy as np
import pytest

from surfaces import cylinder, hyperboloid, plane, sphere

PATCHES = {
    "dome": lambda: sphere(1.0, (10, 90), (10, 180)).cells(9, 10),
    "ball": lambda: sphere(0.4, (0, 180), (0, 360), side="outside").cells(5, 7),
    "cap": lambda: sphere(0.4, (0, 70), (-180, 180), position=(1, 2, 3)).cells(3, 8),
    "pipe": lambda: cylinder(0.3, (0, 360), (0, 1)).cells(4, 3),
    "saddle": lambda: hyperboloid(0.5, 0.4, (-170, 20), (-0.3, 0.5)).cells(5, 6),
    "plate": lambda: plane((0, 1), (0, 2), rpy_deg=(10, 20, 30)).cells(3, 3),
    "fine": lambda: sphere(1.0, (10, 90), (10, 180)).cells(60, 50),
}


@pytest.fixture(params=PATCHES)
def cells(request):
    """Cells of several patches."""
    return PATCHES[request.param]()


def places(cells, count=23):
    """Every curve at `count` places that are no multiples of anything."""
    t = np.linspace(0.0, 1.0, count)
    return np.repeat(np.arange(len(cells.curves)), count), np.tile(t, len(cells.curves))


def test_curves_run_from_centre_to_centre(cells):
    """One for each pair, from the smaller index to the larger, normals too."""
    curves = cells.curves
    assert len(curves) == len(cells.pairs)
    which = np.arange(len(curves))
    for end, column in ((0.0, 0), (1.0, 1)):
        closest_point, normal = curves.at(which, np.full(len(which), end))
        np.testing.assert_allclose(closest_point, cells.centres[cells.pairs[:, column]], atol=1e-12)
        np.testing.assert_allclose(normal, cells.normals[cells.pairs[:, column]], atol=1e-12)


def test_curves_lie_on_the_patch_within_their_deviations(cells):
    """Heights and normals at 23 places each, against the surface's own nearest points."""
    which, t = places(cells)
    closest_point, normal = cells.curves.at(which, t)
    found = cells.surface.closest(closest_point)
    deviations = cells.curves.deviations[which]
    rounding = 1e-12
    assert found.inside.all()
    assert (np.abs(found.height) <= deviations[:, 0] + rounding).all()
    assert (np.linalg.norm(normal - found.normal, axis=1) <= deviations[:, 1] + rounding).all()
    assert cells.curves.deviations.max() <= 2e-6


def test_bends_bound_second_differences(cells):
    """Between 23 places each, where no piece ends in between or one does; some reach the bound."""
    count = 23
    which, t = places(cells, count)
    values = np.hstack(cells.curves.at(which, t)).reshape(-1, count, 6)
    second = (values[:, 2:] - 2.0 * values[:, 1:-1] + values[:, :-2]) * (count - 1.0) ** 2
    for part, half in enumerate((slice(0, 3), slice(3, 6))):
        found = np.linalg.norm(second[..., half], axis=2).max(axis=1)
        most = np.maximum.reduceat(cells.curves.derivative_bounds[:, part], cells.curves.first[:-1])
        assert (found <= most * (1.0 + 1e-6) + 1e-8).all()
        bent = most > 1e-6
        assert (found[bent] >= 0.8 * most[bent]).all()


def test_slopes_are_continuous(cells):
    """Where one piece ends and the next begins, value and slope agree."""
    curves = cells.curves
    count = np.diff(curves.first)
    ends = np.delete(np.arange(curves.first[-1]), curves.first[1:] - 1)  # pieces with a next one
    powers, slopes = np.ones(4), np.array([0.0, 1.0, 2.0, 3.0])
    left = curves.cubics[ends]
    for power, here in (
        (powers, curves.cubics[ends + 1, 0]),
        (slopes, curves.cubics[ends + 1, 1]),
    ):
        np.testing.assert_allclose(np.einsum("p,kpd->kd", power, left), here, atol=1e-9)
    assert (count >= 1).all()


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_the_offset_folds_where_it_reaches_the_radius(side):
    """Inside a pipe of 0.3 m: around it from 0.3 m on, along it never; outside never."""
    cells = cylinder(0.3, (0, 120), (0, 1)).cells(4, 4)
    rows, columns = np.divmod(cells.pairs, 4)
    around, along = columns[:, 0] == columns[:, 1], rows[:, 0] == rows[:, 1]
    for share, folds in ((0.9, False), (0.99, False), (1.0, True), (1.5, True)):
        found = cells.curves.folds(side * share * 0.3)
        assert (found[around] == (folds and side < 0.0)).all()
        assert not found[along].any()


def test_turning_is_the_largest_curvature_of_the_offset():
    """Of parallel surfaces: 1 / (R + h) on a sphere, the steeper of two on a saddle."""
    dome = sphere(1.0, (10, 90), (10, 180)).cells(9, 10)
    for height in (-0.5, -0.005, 0.0, 0.3):
        curvature = dome.curves.curvature(height)
        assert curvature.max() == pytest.approx(1.0 / (1.0 + height), rel=1e-4)
        assert curvature.shape == dome.curves.first[-1:]
    flat = plane((0, 1), (0, 1)).cells(3, 3)
    assert flat.curves.curvature(0.1).max() < 1e-12


def test_a_rigid_motion_moves_the_curves_along(cells):
    """Closest points and normals turn with the surface; bounds and deviations stay."""
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    moved = cells.surface.moved(turn, [0.3, -0.2, 0.1]).cells(*cells.shape)
    which, t = places(cells, 5)
    for here, there, shift in zip(
        cells.curves.at(which, t), moved.curves.at(which, t), ([0.3, -0.2, 0.1], 0.0), strict=True
    ):
        np.testing.assert_allclose(here @ turn.T + shift, there, atol=1e-9)
    np.testing.assert_allclose(
        cells.curves.derivative_bounds, moved.curves.derivative_bounds, atol=1e-6
    )
    carried = cells.curves.moved(turn, np.array([0.3, -0.2, 0.1]))
    np.testing.assert_allclose(carried.cubics, moved.curves.cubics, atol=1e-9)


def test_no_pairs_no_curves():
    """A single cell, or none."""
    for shape in ((1, 1), (0, 5)):
        curves = plane((0, 1), (0, 1)).cells(*shape).curves
        assert len(curves) == 0
        assert curves.folds(0.1).shape == (0,)
        assert curves.curvature(0.1).shape == (0,)


def test_links_name_the_pair_of_each_neighbour(cells):
    """Both ways."""
    indptr, indices = cells.neighbours
    owner = np.repeat(np.arange(len(cells)), np.diff(indptr))
    pair = cells.pairs[cells.neighbours.links]
    np.testing.assert_array_equal(np.sort(np.column_stack([owner, indices]), axis=1), pair)
