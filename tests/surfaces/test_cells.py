"""Cells: centres, normals, areas, borders, and what a grid promises its users."""

import math
import pickle

import numpy as np
import pytest

from surfaces import SurfaceError, cylinder, plane, sphere


def test_centres_normals_and_areas(patch):
    cells = patch.cells(6, 11)
    assert len(cells) == 66
    assert cells.shape == (6, 11)
    i, j = np.divmod(np.arange(66), 11)
    (u0, u1), (v0, v1) = patch.u_range, patch.v_range
    assert cells.u == pytest.approx(u0 + (i + 0.5) * (u1 - u0) / 6, abs=1e-14)
    assert cells.v == pytest.approx(v0 + (j + 0.5) * (v1 - v0) / 11, abs=1e-14)
    assert (cells.centres == patch.point(cells.u, cells.v)).all()
    assert (cells.normals == patch.normal(cells.u, cells.v)).all()
    assert cells.areas.min() > 0
    assert cells.areas.sum() == pytest.approx(float(patch.area(u0, u1, v0, v1)), rel=1e-13)


def test_the_paper_s_grid_has_305_pairs():
    cells = sphere(1.0, (10, 90), (10, 180)).cells(9, 10)
    assert cells.pairs.shape == (305, 2)
    assert cells.pairs.dtype == np.int64


def test_graph_has_every_cell_and_every_pair(patch):
    cells = patch.cells(4, 5)
    graph = cells.graph()
    assert sorted(graph.nodes) == list(range(20))
    assert {tuple(sorted(edge)) for edge in graph.edges} == set(map(tuple, cells.pairs.tolist()))
    assert graph.number_of_edges() == len(cells.pairs)


def test_index_and_unravel_are_inverse_and_refuse_what_is_not_there():
    cells = plane((0, 1), (0, 1)).cells(3, 4)
    assert [cells.index(*cells.unravel(k)) for k in range(12)] == list(range(12))
    assert cells.index(1, 2) == 6
    for i, j in [(-1, 0), (3, 0), (0, 4), (0, -1)]:
        with pytest.raises(IndexError, match="3 x 4"):
            cells.index(i, j)
    for k in (-1, 12):
        with pytest.raises(IndexError, match="3 x 4"):
            cells.unravel(k)


def test_outlines_run_round_each_cell_on_the_surface(patch):
    cells = patch.cells(5, 6)
    outlines = cells.outlines(samples=4)
    assert outlines.shape == (30, 17, 3)
    assert (outlines[:, 0] == outlines[:, -1]).all()
    assert np.abs(patch.closest(outlines).height).max() < 1e-13
    u, v = np.linspace(*patch.u_range, 6), np.linspace(*patch.v_range, 7)
    i, j = np.divmod(np.arange(30), 6)
    for corner, (du, dv) in enumerate([(0, 0), (0, 1), (1, 1), (1, 0)]):
        expected = patch.point(u[i + du], v[j + dv])
        assert outlines[:, 4 * corner] == pytest.approx(expected, abs=1e-13)


@pytest.mark.parametrize(("nu", "nv"), [(0, 3), (3, 0), (0, 0)])
@pytest.mark.parametrize("closed", [False, True])
def test_an_empty_grid_is_a_value_not_an_error(nu, nv, closed):
    cells = sphere(1.0, (0, 180), (0, 360 if closed else 90)).cells(nu, nv)
    assert len(cells) == 0
    assert cells.pairs.shape == (0, 2)
    assert cells.neighbours.indptr.tolist() == [0]
    assert cells.centres.shape == cells.normals.shape == (0, 3)
    assert cells.areas.sum() == 0
    assert cells.outlines().shape == (0, 33, 3)
    assert cells.graph().number_of_nodes() == 0


def test_one_cell_has_no_neighbours(patch):
    cells = patch.cells(1, 1)
    assert len(cells) == 1
    assert len(cells.pairs) == 0


@pytest.mark.parametrize("bad", [-1, 2.0, "3", None, True, math.nan])
def test_sizes_must_be_whole_numbers(bad):
    sheet = plane((0, 1), (0, 1))
    with pytest.raises(SurfaceError, match=r"nu must be a whole number >= 0"):
        sheet.cells(bad, 1)
    with pytest.raises(SurfaceError, match=r"nv must be a whole number >= 0"):
        sheet.cells(1, bad)
    with pytest.raises(SurfaceError, match="samples must be a whole number"):
        sheet.cells(1, 1).outlines(bad)
    with pytest.raises(SurfaceError, match="samples must be a whole number >= 1"):
        sheet.cells(1, 1).outlines(0)


def test_numpy_integers_are_whole_numbers():
    assert plane((0, 1), (0, 1)).cells(np.int64(2), np.int32(3)).shape == (2, 3)


def test_cells_pickle_and_stay_protected(patch):
    cells = patch.cells(3, 4)
    pairs = cells.pairs
    copy = pickle.loads(pickle.dumps(cells))
    assert copy.shape == cells.shape
    assert (copy.centres == cells.centres).all()
    assert (copy.areas == cells.areas).all()
    assert (copy.pairs == pairs).all()
    for value in (cells, copy):
        for array in (value.u, value.centres, value.normals, value.pairs, *value.neighbours):
            assert not array.flags.writeable


def test_a_rigid_motion_changes_no_neighbour_and_no_area(patch, motion):
    before, after = patch.cells(5, 4), patch.moved(*motion).cells(5, 4)
    assert (before.neighbours.indices == after.neighbours.indices).all()
    assert (before.areas == after.areas).all()
    rotation, translation = motion
    assert after.centres == pytest.approx(before.centres @ rotation.T + translation, abs=1e-13)


@pytest.mark.parametrize(("closed", "n"), [(False, 300), (True, 1000)])
def test_a_million_cells(closed, n):
    cells = cylinder(1.0, (0, 360 if closed else 180), (0, 1)).cells(n, n)
    assert len(cells) == n * n
    across = n if closed else n - 1  # pairs of rows
    assert len(cells.pairs) == n * (n - 1) + across * n + 2 * across * (n - 1)
    assert cells.areas.sum() == pytest.approx(2 * math.pi if closed else math.pi, rel=1e-12)


def test_importing_surfaces_loads_nothing_heavy():
    import subprocess
    import sys

    heavy = "{'numba', 'pinocchio', 'networkx', 'scipy', 'trimesh'}"
    script = f"import sys, surfaces; sys.exit(', '.join({heavy} & set(sys.modules)) or None)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
