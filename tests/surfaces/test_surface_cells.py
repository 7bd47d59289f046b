"""Cells of every kind of surface, which of them are neighbours, and the curves between these."""

import itertools
import math
import pickle

import numpy as np
import pytest
from bounds import holds
from samples import sampled, spread
from specimens import ALL, SMOOTH, cells_of

from coverable import SurfaceError, cylinder, plane, sphere, torus
from coverable.kernels import allocating_entry
from surfaces.patches import closed_form_kernels

cell_at, closest_on_patch, wrap = map(
    allocating_entry,
    (closed_form_kernels.cell_at, closed_form_kernels.closest_on_patch, closed_form_kernels.wrap),
)
TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
SHIFT = np.array([0.3, -0.2, 0.1])
CELLS = {name: cells_of(surface, 4, 5) for name, surface in ALL.items()}
GRIDS = {
    **{name: CELLS[name] for name in SMOOTH},
    "round the pole": sphere(0.4, (0, 70), (-180, 180), position=(1, 2, 3)).cells(3, 8),
    "odd at the poles": sphere(1.0, (0, 180), (0, 360)).cells(6, 13),
    "a row": sphere(1.0, (10, 90), (10, 180)).cells(1, 14),
    "a column": torus(0.5, 0.2, (-180, 180), (0, 360)).cells(14, 1),
    "fine": sphere(1.0, (10, 90), (10, 180)).cells(9, 10),
}


@pytest.fixture(params=CELLS, ids=str)
def cells(request):
    return CELLS[request.param]


@pytest.fixture(params=GRIDS, ids=str)
def grid(request):
    return GRIDS[request.param]


def test_cells_are_even_stand_on_the_surface_and_are_found_again(cells):
    found = cells.surface.closest(cells.centres)
    assert np.abs(found.height).max() < 1e-10
    assert found.inside.all()
    assert found.normal == pytest.approx(cells.normals, abs=1e-6)
    assert (cells.areas > 0).all()
    copy = pickle.loads(pickle.dumps(cells))
    assert (copy.centres == cells.centres).all()
    assert (copy.pairs == cells.pairs).all()
    for one in (cells, copy):
        for array in (one.centres, one.normals, one.pairs, one.neighbours.indices):
            assert not array.flags.writeable
    above = cells.centres + 1e-3 * cells.normals
    assert (cells.locate(above) == np.arange(len(cells))).all() or cells.surface.kind == "mesh"
    graph = cells.graph()
    assert sorted(graph.nodes) == list(range(len(cells)))
    assert {tuple(sorted(edge)) for edge in graph.edges} == set(map(tuple, cells.pairs.tolist()))


def test_grids_are_even_and_their_outlines_run_round_the_cells(grid):
    surface, (nu, nv) = grid.surface, grid.shape
    i, j = np.divmod(np.arange(nu * nv), nv)
    (u0, u1), (v0, v1) = surface.u_range, surface.v_range
    assert grid.u == pytest.approx(u0 + (i + 0.5) * (u1 - u0) / nu, abs=1e-13)
    assert grid.v == pytest.approx(v0 + (j + 0.5) * (v1 - v0) / nv, abs=1e-13)
    assert np.abs(grid.centres - surface.point(grid.u, grid.v)).max() < 1e-13
    outlines = grid.outlines(samples=2)
    assert outlines.shape == (nu * nv, 9, 3)
    assert (outlines[:, 0] == outlines[:, -1]).all()
    u, v = np.linspace(u0, u1, nu + 1), np.linspace(v0, v1, nv + 1)
    for corner, (du, dv) in enumerate([(0, 0), (0, 1), (1, 1), (1, 0)]):
        expected = surface.point(u[i + du], v[j + dv])
        assert outlines[:, 2 * corner] == pytest.approx(expected, abs=1e-12)
    assert [grid.index(*grid.unravel(k)) for k in range(len(grid))] == list(range(len(grid)))
    assert (grid.at(grid.u, grid.v) == np.arange(len(grid))).all()
    assert (grid.at([np.nan, grid.u[0]], [grid.v[0], np.nan]) == -1).all()


@sampled("cells", spread([*CELLS], 11), indirect=True)
def test_triangles_of_cells_face_outwards_and_fill_them(cells):
    which = np.arange(len(cells))[::4]
    drawn = cells.triangles(which, samples=16)
    corners = drawn.vertices[drawn.faces]
    looks = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    outwards = cells.surface.closest(corners.mean(axis=1)).normal
    assert ((looks * outwards).sum(axis=1) >= -1e-12).all()
    area = 0.5 * np.linalg.norm(looks, axis=1).sum()
    assert area == pytest.approx(cells.areas[which].sum(), rel=1e-2)
    assert np.abs(cells.surface.closest(cells.borders(3)).height).max() < 1e-9


def test_cells_are_neighbours_exactly_where_they_share_a_corner(grid):
    surface = grid.surface
    corners = grid.outlines(samples=1)[:, :4]
    gaps = np.linalg.norm(corners[:, None, :, None] - corners[None, :, None, :], axis=-1)
    touch = {(i, j) for i, j in np.argwhere((gaps < 1e-9).any(axis=(2, 3))).tolist() if i < j}
    nu, nv = grid.shape
    for pole, row in zip(surface.poles, (0, nu - 1), strict=True):
        if pole:  # of those around it only what is beside, across, and beside what is across
            across = {nv // 2, (nv + 1) // 2}
            near = {(c + d) % nv for c in {0, *across} for d in (-1, 0, 1)}
            touch -= {(row * nv + a, row * nv + b) for a, b in itertools.combinations(range(nv), 2)
                      if (b - a) % nv not in near}  # fmt: skip
    if not any(surface.poles) and (corners[:, 0] == corners[:, 1]).all(axis=1).any():
        return  # a pole that is not gone around
    assert set(map(tuple, grid.pairs.tolist())) == touch


@pytest.mark.parametrize("name", SMOOTH)
def test_neighbours_run_clockwise_and_links_name_their_pairs(name):
    """Seen with u down and v to the right, from the upper left on."""
    grid = SMOOTH[name].cells(5, 6)
    right, down = (grid.surface.point(grid.u + a, grid.v + b) - grid.centres
                   for a, b in ((0.0, 1e-6), (1e-6, 0.0)))  # fmt: skip
    for k in range(6, 24):  # not beside a pole
        ahead = grid.centres[grid.neighbours.of(k)] - grid.centres[k]
        x, y = (ahead @ way[k] / np.linalg.norm(way[k]) for way in (right, down))
        turned = np.arctan2(y, x)
        assert (np.diff((turned - turned[0]) % math.tau) > 1e-9).all(), k
    indptr, indices = grid.neighbours
    owner = np.repeat(np.arange(len(grid)), np.diff(indptr))
    pair = grid.pairs[grid.neighbours.links]
    np.testing.assert_array_equal(np.sort(np.column_stack([owner, indices]), axis=1), pair)


def test_grids_without_cells_with_one_and_with_a_million():
    for turn, shape in itertools.product((90, 360), ((0, 3), (3, 0), (0, 0))):
        none = sphere(1.0, (0, 180), (0, turn)).cells(*shape)
        assert (len(none), none.pairs.shape, none.outlines().shape) == (0, (0, 2), (0, 33, 3))
        assert none.locate([[0.5, 0.5, 0.0]]).tolist() == [-1]
        assert none.graph().number_of_nodes() == len(none.curves) == none.areas.sum() == 0
    one = plane((0, 1), (0, 1)).cells(1, 1)
    assert (len(one.pairs), one.curves.folds(0.1).shape) == (0, (0,))
    for closed, n in ((False, 300), (True, 500)):
        many = cylinder(1.0, (0, 360 if closed else 180), (0, 1)).cells(np.int64(n), np.int32(n))
        across = n if closed else n - 1  # pairs of rows
        assert len(many.pairs) == n * (n - 1) + across * n + 2 * across * (n - 1)


@pytest.mark.parametrize("bad", [-1, 2.0, "3", None, True, math.nan])
def test_sizes_must_be_whole_numbers(bad):
    sheet = plane((0, 1), (0, 1))
    for ask in (lambda: sheet.cells(bad, 1), lambda: sheet.cells(1, bad),
                lambda: sheet.cells(1, 1).outlines(bad)):  # fmt: skip
        with pytest.raises(SurfaceError, match=r"(nu|nv|samples) must be a whole number"):
            ask()
    for ask in (sheet.cells(3, 4).unravel, lambda k: sheet.cells(3, 4).index(0, k)):
        for k in (-1, 12):
            with pytest.raises(IndexError, match="3 x 4"):
                ask(k)


@pytest.mark.parametrize("name", [n for n, s in SMOOTH.items() if hasattr(s, "code")])
def test_the_compiled_patch_is_the_patch_to_the_last_bit(name):
    surface, rng = SMOOTH[name], np.random.default_rng(7)
    kernel = surface.cells(4, 6).patch_kernel
    u, v = rng.uniform(*surface.u_range, 100), rng.uniform(*surface.v_range, 100)
    points = surface.point(u, v) + rng.normal(scale=0.05, size=(100, 1)) * surface.normal(u, v)
    found = surface.closest(points)
    rows = np.searchsorted(np.linspace(*surface.u_range, 5), u, side="right") - 1
    columns = np.searchsorted(np.linspace(*surface.v_range, 7), v, side="right") - 1
    for k in range(100):
        values = closest_on_patch(kernel, *points[k])
        assert values[:3] == (found.u[k], found.v[k], found.height[k])
        assert list(values[3:]) == found.normal[k].tolist()
        assert cell_at(kernel, u[k], v[k]) == rows[k] * 6 + columns[k]
        for turns in (-3, 1):
            around = (u[k] + math.tau * turns * surface.u_closed,
                      v[k] + math.tau * turns * surface.v_closed)  # fmt: skip
            assert cell_at(kernel, *around) == rows[k] * 6 + columns[k]
    assert np.isnan(closest_on_patch(kernel._replace(code=99), 0.1, 0.2, 0.3)).all()


def test_beside_the_patch_there_is_no_cell_and_its_rim_belongs_to_it():
    kernel = plane((0, 0.6), (0, 0.4)).cells(3, 2).patch_kernel
    for u, v in [(-1e-6, 0.1), (0.600001, 0.1), (0.1, -0.1), (0.1, 0.5), (math.nan, 0.1),
                 (0.1, math.nan), (math.inf, 0.1)]:  # fmt: skip
        assert cell_at(kernel, u, v) == -1
    assert [cell_at(kernel, *at) for at in ((0, 0), (0.6, 0.4), (0.6 + 1e-12, -1e-12))] == [0, 5, 4]
    assert cell_at(plane((0, 1), (0, 1)).cells(0, 3).patch_kernel, 0.5, 0.5) == -1
    assert plane((0, 1), (0, 2)).cells(3, 4).at([-5, 5, 0.5], [-5, 5, 9]).tolist() == [0, 11, 7]


@sampled("cells", spread([*CELLS], 16), indirect=True)
def test_curves_join_centres_on_the_surface_within_what_they_state(cells):
    curves, count = cells.curves, 15
    pair = np.repeat(np.arange(len(curves)), count)
    points, normals = curves.at(pair, np.tile(np.linspace(0, 1, count), len(curves)))
    ends = points.reshape(-1, count, 3)[:, [0, -1]]
    assert ends == pytest.approx(cells.centres[cells.pairs], abs=1e-9)
    ends = normals.reshape(-1, count, 3)[:, [0, -1]]
    on = cells.surface.closest(points)
    deviations = curves.deviations[pair]
    if cells.surface.kind != "mesh":  # of which it is only measured, and a little more now and then
        holds(deviations[:, 0], np.abs(on.height), used=0.0)
    crease = cells.surface.kind in ("mesh", "piecewise")
    if not crease:
        assert ends == pytest.approx(cells.normals[cells.pairs], abs=1e-9)
        assert on.inside.all()
        assert curves.deviations.max() < 3e-5
    if cells.surface.kind != "mesh":
        # The normal there may turn across the curve, where the surface bends more than along it.
        # On an outer edge it is any between those of two pieces.
        off = np.linalg.norm(normals - on.normal, axis=1) * ~curves.creased[pair]
        holds(deviations[:, 1], off, used=0.0, tiny=1e-9)
    values = np.hstack([points, normals]).reshape(-1, count, 6)
    second = np.diff(values, 2, axis=1) * (count - 1.0) ** 2
    smooth = ~curves.creased
    for k, half in enumerate((slice(0, 3), slice(3, 6))):
        most = np.maximum.reduceat(curves.derivative_bounds[:, k], curves.first[:-1])
        found = np.linalg.norm(second[..., half], axis=2).max(axis=1)
        holds(most[smooth] * (1 + 1e-6), found[smooth], used=0.0, tiny=1e-7)
        bent = smooth & (most > 1e-4)
        assert crease or not bent.any() or np.median(found[bent] / most[bent]) >= 0.8
    travel = np.linalg.norm(np.diff(values[..., :3], axis=1), axis=2).sum(axis=1)
    chord = np.linalg.norm(values[:, -1, :3] - values[:, 0, :3], axis=1)
    assert (travel <= math.pi / 2 * chord).all() or crease  # no curve goes the long way round


@sampled("grid", spread([*GRIDS], 14), indirect=True)
def test_curves_are_smooth_and_move_along_with_their_surface(grid):
    curves = grid.curves
    last = np.delete(np.arange(curves.first[-1]), curves.first[1:] - 1)  # pieces with a next one
    for power, here in ((np.ones(4), 0), (np.arange(4.0), 1)):
        ahead = np.einsum("p,kpd->kd", power, curves.cubics[last])
        np.testing.assert_allclose(ahead, curves.cubics[last + 1, here], atol=1e-9)
    moved = grid.surface.moved(TURN, SHIFT).cells(*grid.shape)
    assert (moved.pairs == grid.pairs).all()
    assert (moved.areas == grid.areas).all()
    carried = curves.moved(TURN, SHIFT)
    np.testing.assert_allclose(carried.cubics, moved.curves.cubics, atol=1e-9)
    np.testing.assert_allclose(curves.derivative_bounds, moved.curves.derivative_bounds, atol=1e-6)


def test_curves_of_other_surfaces_are_other_curves():
    """Fitted once for all poses: a little of anything makes them differ, a side does not."""
    first = sphere(1.0, (10, 90), (10, 180)).cells(3, 4).curves
    for radius in np.linspace(0.9, 1.1, 6):  # more than are kept
        other = sphere(radius + 0.01, (10, 90), (10, 180)).cells(3, 4).curves
        assert not np.allclose(first.cubics, other.cubics)
    again = sphere(1.0, (10, 90), (10, 180), side="outside").cells(3, 4).curves
    np.testing.assert_array_equal(first.cubics, again.cubics)
    assert len(sphere(1.0, (10, 90), (10, 180)).cells(4, 3).curves) == len(first)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_parallel_curves_fold_where_they_reach_the_radius(side):
    """Inside a pipe of 0.3 m: around it from 0.3 m on, along it never; outside never."""
    cells = cylinder(0.3, (0, 120), (0, 1)).cells(4, 4)
    rows, columns = np.divmod(cells.pairs, 4)
    around, along = columns[:, 0] == columns[:, 1], rows[:, 0] == rows[:, 1]
    for share, folds in ((0.9, False), (0.99, False), (1.0, True), (1.5, True)):
        found = cells.curves.folds(side * share * 0.3)
        assert (found[around] == (folds and side < 0.0)).all()
        assert not found[along].any()
    for name in ("doughnut", "egg", "hood"):
        assert not CELLS[name].curves.folds(0.005 * side).any()
