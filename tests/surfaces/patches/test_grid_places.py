"""Where in a grid a place lies, and which ends of a grid are closed."""

from __future__ import annotations

import numpy as np
import pytest
from spline_nets import TURN_KNOTS, full_turn, hood, turned

from surfaces import SurfaceError, bspline, cylinder, plane, sphere, torus


def pipe():
    """A closed NURBS pipe; u runs 0..1 around."""
    points, weights = turned([[0.5, -0.2], [0.5, 0.6]], [1, 1], *full_turn())
    return bspline(points, (2, 1), (TURN_KNOTS, None), weights, u=(0.0, 1.0))


GRIDS = {
    "plate": plane((0, 1), (0, 2)).cells(3, 4),
    "ball": sphere(0.5, (0, 180), (0, 360)).cells(4, 6),
    "hood": bspline(hood()).cells(3, 5),
    "pipe": pipe().cells(8, 2),
}


@pytest.mark.parametrize("name", GRIDS)
def test_no_cell_is_where_no_place_is(name):
    cells = GRIDS[name]
    nowhere = [[np.nan] * 3, [0.0, np.inf, 0.0], [np.nan, 0.0, 0.0]]
    assert (cells.locate(nowhere) == -1).all()
    assert (cells.at([np.nan, cells.u[0], np.nan], [cells.v[0], np.nan, np.nan]) == -1).all()
    assert (cells.locate(cells.centres) == np.arange(len(cells))).all()
    assert (cells.at(cells.u, cells.v) == np.arange(len(cells))).all()


def test_parameters_beyond_the_ranges_count_as_the_nearest():
    cells = GRIDS["plate"]
    assert cells.at([-5, 5, 0.5], [-5, 5, 9]).tolist() == [0, 11, cells.index(1, 3)]


def test_a_grid_without_cells_holds_no_place():
    for shape in ((0, 3), (3, 0)):
        cells = plane((0, 1), (0, 1)).cells(*shape)
        assert cells.locate([[0.5, 0.5, 0.0]]).tolist() == [-1]


def test_once_around_is_the_range_in_the_units_of_the_picture():
    """A spline counts as its knots do, an angle in degrees."""
    assert pipe().u_closed
    assert GRIDS["pipe"].unrolled().turns == (np.inf, 1.0)
    assert GRIDS["ball"].unrolled().turns == (pytest.approx(360.0, rel=1e-12), np.inf)
    around = cylinder(0.3, (0, 360), (0, 1)).cells(4, 2).unrolled()
    assert around.turns == (np.inf, pytest.approx(360.0, rel=1e-12))
    assert GRIDS["hood"].unrolled().turns == (np.inf, np.inf)


@pytest.mark.parametrize("side", [np.array([1, 2]), np.array(["inside", "outside"]), None, 3, []])
def test_a_side_that_is_no_word_is_a_fault_like_others(side):
    with pytest.raises(SurfaceError, match="side must be 'inside' or 'outside'"):
        plane((0, 1), (0, 1), side=side)


@pytest.mark.parametrize(
    "patch",
    [
        sphere(1.0, (10, 90), (10, 180)),
        cylinder(0.3, (0, 200), (0, 1), side="outside"),
        plane((0, 1), (0, 2)),
        torus(0.5, 0.1, (0, 90), (0, 360)),
    ],
    ids=lambda patch: patch.kind,
)
def test_triangles_face_outwards_and_fill_the_cells(patch):
    """Counterclockwise seen from outside, with the area of the cells as they get finer."""
    cells = patch.cells(3, 4)
    drawn = cells.triangles(np.arange(12), samples=24)
    corners = drawn.vertices[drawn.faces]
    looks = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert ((looks * drawn.normals[drawn.faces[:, 0]]).sum(axis=1) >= 0.0).all()
    area = 0.5 * np.linalg.norm(looks, axis=1).sum()
    assert area == pytest.approx(cells.areas.sum(), rel=5e-3)
