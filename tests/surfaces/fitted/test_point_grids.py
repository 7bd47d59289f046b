"""Surfaces through grids of points, in hand and in files."""

import io
import math

import numpy as np
import pytest
from user_formulas import EQUAL, ball, ring, sampled

from surfaces import SurfaceError, grid, read_grid

FLAT = sampled(lambda u, v: (u, v, 0.0 * u), (0, 1), (0, 2), (4, 5))


@pytest.mark.parametrize("name", EQUAL)
def test_it_runs_through_the_points_and_near_the_surface_they_are_of(name):
    formula, u, v, patch = EQUAL[name]
    points = sampled(formula, u, v, (25, 31))
    found = grid(points)
    lines = [np.linspace(0, 1, count) for count in (25, 31)]
    if name != "hyperboloid":  # whose rows are not evenly far apart
        nodes = np.meshgrid(*lines, indexing="ij")
        np.testing.assert_allclose(found.point(*nodes), points, atol=1e-12)
    assert np.abs(found.closest(points.reshape(-1, 3)).height).max() < 1e-12
    off = np.abs(patch.closest(found.cells(9, 9).centres).height).max()
    assert off < 1e-5
    stated = float(found.notes[0].split("by up to ")[1].split(" mm")[0]) / 1e3
    # The bilinear surface cuts off the sagitta of a step; the spline does not.
    assert off < 0.01 * stated
    assert 1e-5 < stated < 1e-2


def test_closed_rows_are_joined_where_they_meet_smoothly():
    tube = grid(sampled(ring, (0, math.tau), (0, 1.0), (33, 5)))
    assert (tube.u_closed, tube.v_closed) == (True, False)

    def leaf(u, v):
        return u * (1 - u), u * (1 - u) * (0.7 - u), v

    corner = sampled(leaf, (0, 1), (0, 1), (21, 5))
    open_ends = grid(corner)
    assert not open_ends.u_closed
    assert any("crease" in note for note in open_ends.notes)


def test_outward_is_up_with_rows_along_x_and_columns_along_y():
    found = grid(FLAT)
    assert found.normal(0.5, 0.5).tolist() == [0.0, 0.0, 1.0]
    assert "(0, 0, 1) in the middle" in found.notes[1]
    ahead = np.tile([1.0, 0.0, 0.0], (4, 1))
    np.testing.assert_allclose(found.cells(2, 2).tangents, ahead, atol=1e-9)


def _changed(place, value):
    points = FLAT.copy()
    points[place] = value
    return points


@pytest.mark.parametrize(
    ("points", "words"),
    [
        (FLAT[:1], "at least 2 x 2"),
        (FLAT[..., :2], "rows of points (x, y, z)"),
        ([[[0, 0, 0]], [[0, 0, 0], [1, 1, 1]]], "rows of one length"),
        (_changed((1, 2, 0), math.nan), "points[1][2][0] must be a finite number"),
        (_changed((2, 3), FLAT[2, 2]), "[2][2] is the same point as in the next column"),
        (_changed(3, FLAT[3, 0]), "row 3 is one point, a pole"),
        (FLAT[[0, 2, 1, 3]], "folds over"),
        (np.tile(FLAT[:, :1], (1, 5, 1)), "row 0 is one point, a pole"),
    ],
)
def test_points_that_make_no_surface_are_refused(points, words):
    with pytest.raises(SurfaceError) as caught:
        grid(points)
    assert words in str(caught.value)


def _table(points):
    rows = (
        f"{i},{j},{x!r},{y!r},{z!r}"
        for i, row in enumerate(points.tolist())
        for j, (x, y, z) in enumerate(row)
    )
    return "row,column,x,y,z\n" + "\n".join(rows) + "\n"


def test_files_of_both_kinds_hold_the_points_in_their_units(tmp_path):
    points = sampled(ball, (0.3, 1.0), (0, 1), (4, 5))
    np.save(tmp_path / "dome.npy", 1e3 * points)
    (tmp_path / "dome.csv").write_text(_table(1e3 * points))
    for name in ("dome.npy", "dome.csv"):
        np.testing.assert_allclose(read_grid(tmp_path / name, "mm"), points, atol=1e-15)
    assert read_grid(tmp_path / "dome.npy").max() > 100.0


def _npy(array, **options):
    stream = io.BytesIO()
    np.save(stream, array, **options)
    return stream.getvalue()


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.txt", b"", ".npy or a .csv"),
        ("a.npy", b"", "no .npy file"),
        ("a.npy", _npy(np.array([{}], dtype=object), allow_pickle=True), "no .npy file"),
        ("a.npy", _npy(np.zeros((3, 3))), "shape (m, n, 3)"),
        ("a.npy", _npy(np.zeros((3, 3, 2))), "shape (m, n, 3)"),
        ("a.npy", _npy(np.zeros((2, 2, 3), dtype=complex)), "shape (m, n, 3)"),
        ("a.npy", _npy(np.zeros((2, 2, 3)))[:-8], "no .npy file"),
        ("a.csv", _table(FLAT).replace("1,1,", "1,9,", 1).encode(), "row 0, column 5 is missing"),
        ("a.csv", b"x,y\n1,2\n", "header row,column,x,y,z"),
    ],
)
def test_files_that_hold_no_grid_are_refused_by_name(tmp_path, name, content, words):
    file = tmp_path / name
    file.write_bytes(content)
    with pytest.raises(SurfaceError) as caught:
        read_grid(file)
    assert words in str(caught.value)
    assert name in str(caught.value)
