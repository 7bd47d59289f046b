"""Neighbours: worked out by hand, from shared corners in space, and from angles around a cell."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from surfaces import cylinder, hyperboloid, plane, sphere
from surfaces.adjacency import grid_neighbours


def lists(found):
    return [found.of(k).tolist() for k in range(len(found.indptr) - 1)]


def test_three_by_three_by_hand():
    # 0 1 2
    # 3 4 5
    # 6 7 8
    assert lists(grid_neighbours(3, 3)) == [
        [1, 4, 3],
        [2, 5, 4, 3, 0],
        [5, 4, 1],
        [0, 1, 4, 7, 6],
        [0, 1, 2, 5, 8, 7, 6, 3],
        [1, 2, 8, 7, 4],
        [3, 4, 7],
        [3, 4, 5, 8, 6],
        [4, 5, 7],
    ]


def test_three_by_four_with_joined_columns_by_hand():
    # 0 1  2  3
    # 4 5  6  7
    # 8 9 10 11
    found = lists(grid_neighbours(3, 4, closed=(False, True)))
    assert found[4] == [3, 0, 1, 5, 9, 8, 11, 7]
    assert found[7] == [2, 3, 0, 4, 8, 11, 10, 6]
    assert found[0] == [1, 5, 4, 7, 3]


def test_four_by_three_with_joined_rows_by_hand():
    # 0  1  2
    # 3  4  5
    # 6  7  8
    # 9 10 11
    found = lists(grid_neighbours(4, 3, closed=(True, False)))
    assert found[1] == [9, 10, 11, 2, 5, 4, 3, 0]
    assert found[9] == [6, 7, 10, 1, 0]


def test_pole_rows_by_hand():
    # 0 1 2 3 4 5     upper pole above, open below
    # 6 7 8 9 10 11
    found = lists(grid_neighbours(2, 6, closed=(False, True), poles=(True, False)))
    assert found[0] == [4, 3, 2, 1, 7, 6, 11, 5]
    assert found[6] == [5, 0, 1, 7, 11]
    found = lists(grid_neighbours(2, 7, closed=(False, True), poles=(True, False)))
    assert found[0] == [5, 4, 3, 2, 1, 8, 7, 13, 6]
    found = lists(grid_neighbours(1, 8, closed=(False, True), poles=(False, True)))
    assert found[2] == [3, 5, 6, 7, 1]


@pytest.mark.parametrize(
    "surface",
    [
        plane((0, 1), (0, 1)),
        cylinder(0.5, (0, 350), (0, 1)),
        cylinder(0.5, (0, 360), (0, 1)),
        hyperboloid(0.5, 0.5, (10, 370), (0, 1)),
        sphere(1.0, (20, 160), (0, 360)),
        sphere(1.0, (20, 160), (0, 300)),
    ],
    ids=repr,
)
@pytest.mark.parametrize("shape", [(1, 1), (1, 5), (2, 3), (3, 2), (5, 1), (5, 5)], ids=str)
def test_cells_are_neighbours_exactly_when_they_share_a_corner(surface, shape):
    cells = surface.cells(*shape)
    corners = cells.outlines(samples=1)[:, :4]
    gaps = np.linalg.norm(corners[:, None, :, None] - corners[None, :, None, :], axis=-1)
    touching = (gaps < 1e-9).any(axis=(2, 3))
    expected = [(i, j) for i, j in itertools.combinations(range(len(cells)), 2) if touching[i, j]]
    assert list(map(tuple, cells.pairs.tolist())) == expected


@pytest.mark.parametrize("columns", [1, 2, 3, 4, 5, 8, 9])
@pytest.mark.parametrize("rows", [1, 2, 4])
def test_cells_at_a_pole_touch_those_across_it(rows, columns):
    cells = sphere(1.0, (0, 180), (0, 360)).cells(rows, columns)
    opposite = {columns // 2, (columns + 1) // 2}
    expected = set()
    for i, j, di, dj in itertools.product(range(rows), range(columns), (-1, 0, 1), (-1, 0, 1)):
        row = i + di
        shifts = {0} if 0 <= row < rows else opposite
        row = min(max(row, 0), rows - 1)
        for shift in shifts:
            a, b = i * columns + j, row * columns + (j + dj + shift) % columns
            if a != b:
                expected.add((min(a, b), max(a, b)))
    assert list(map(tuple, cells.pairs.tolist())) == sorted(expected)


@pytest.mark.parametrize(
    ("surface", "shape"),
    [
        (sphere(1.0, (0, 180), (0, 360)), (6, 12)),
        (sphere(1.0, (0, 180), (0, 360)), (6, 13)),
        (sphere(1.0, (0, 90), (-180, 180)), (4, 6)),
        (sphere(1.0, (10, 90), (10, 180)), (9, 10)),
        (cylinder(1.0, (0, 360), (0, 1)), (12, 5)),
        (hyperboloid(1.0, 1.0, (0, 300), (-0.5, 0.5)), (9, 4)),
        (plane((0, 1), (0, 2)), (4, 5)),
    ],
    ids=repr,
)
def test_neighbours_are_listed_clockwise_as_seen_with_u_down_and_v_right(surface, shape):
    cells = surface.cells(*shape)
    step = 1e-6
    down = surface.point(cells.u + step, cells.v) - surface.point(cells.u - step, cells.v)
    right = surface.point(cells.u, cells.v + step) - surface.point(cells.u, cells.v - step)
    for k in range(len(cells)):
        ahead = cells.centres[cells.neighbours.of(k)] - cells.centres[k]
        x = ahead @ right[k] / np.linalg.norm(right[k])
        y = -ahead @ down[k] / np.linalg.norm(down[k])
        # Clockwise from the left, so that a list that starts at the upper left rises from 0.
        angle = (np.pi - np.arctan2(y, x)) % (2 * np.pi)
        turned = (angle - angle[0]) % (2 * np.pi)
        assert (np.diff(turned) > 1e-9).all(), (k, cells.neighbours.of(k))


@given(
    rows=st.integers(0, 6),
    columns=st.integers(0, 7),
    closed=st.tuples(st.booleans(), st.booleans()),
    poles=st.tuples(st.booleans(), st.booleans()),
)
def test_neighbourhood_is_symmetric_without_self_or_repeats(rows, columns, closed, poles):
    if any(poles):  # a pole means that the columns close around it and the rows end
        closed = (False, True)
    found = grid_neighbours(rows, columns, closed, poles)
    around = lists(found)
    assert len(around) == rows * columns
    for k, indices in enumerate(around):
        assert k not in indices
        assert len(set(indices)) == len(indices)
        assert all(k in around[other] for other in indices)
    pairs = found.pairs.tolist()
    assert pairs == sorted([i, j] for i, js in enumerate(around) for j in js if i < j)
