"""Orders of cells: permutations, steps between neighbours, and lengths against brute force."""

from itertools import combinations, product
from types import SimpleNamespace

import numpy as np
import pytest
from mesh_patches import sheet
from path_cases import verdict_of
from samples import sampled, seeds

from coverable import PathError, coverage_path, mesh, plane
from feasibility.paths import order as orders
from surfaces.meshes.triangle_mesh import TriangleMesh

SHAPES = {(0, 3): [(False, False)], (1, 5): [(False, False)], (5, 1): [(False, False)],
          (4, 6): [(False, False)], (5, 4): [*product((True, False), repeat=2)][1:]}  # fmt: skip
"""Of each which sides may close on themselves."""


@pytest.mark.parametrize("order", orders.GRID_ORDERS)
@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_grid_orders_step_from_cell_to_the_next_wherever_they_begin(order, shape):
    """Over the seam only of a grid that closes there."""
    for closed, flipped in product(SHAPES[shape], product((False, True), repeat=2)):
        begins = [range(n if c else 1) for n, c in zip(shape, closed, strict=True)]
        for begin in product(*begins) if all(shape) else ():
            found = orders.grid_order(order, *shape, begin, flipped)
            assert sorted(found.tolist()) == list(range(np.prod(shape)))
            steps = np.abs(np.diff(np.stack(np.divmod(found, shape[1])), axis=1))
            for axis in np.flatnonzero(closed):
                steps[axis] = np.minimum(steps[axis], shape[axis] - steps[axis])
            assert (steps.sum(axis=0) == 1).all()
            first = np.add(begin, [n - 1 if t else 0 for n, t in zip(shape, flipped, strict=True)])
            assert np.divmod(found[0], shape[1]) == tuple(first % shape)
    i, j = np.divmod(orders.grid_order(order, *shape), shape[1])
    inwards = np.minimum(np.minimum(i, shape[0] - 1 - i), np.minimum(j, shape[1] - 1 - j))
    assert (np.diff({"rows": i, "columns": j, "spiral": inwards}[order]) >= 0).all()


def test_a_side_of_two_rows_does_not_close():
    assert orders.closed_sides(plane((0, 1), (0, 1), "outside").cells(2, 2)) == (False, False)


@sampled("seed", seeds(8, all=200))
def test_an_improved_tour_has_no_better_neighbour(seed):
    """Of those with a part turned round, or a part of up to three moved elsewhere."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 12))
    points = rng.random((n, 2))
    distance = np.linalg.norm(points[:, None] - points, axis=2)
    start = rng.permutation(n)
    tour = orders.improved(distance, start)
    assert sorted(tour.tolist()) == list(range(n))
    others = [start]
    for i, j in combinations(range(n + 1), 2):
        part, rest = tour[i:j], np.concatenate([tour[:i], tour[j:]])
        others.append(np.concatenate([tour[:i], part[::-1], tour[j:]]))
        for k in range(len(rest) + 1) if j - i <= 3 else ():
            others += [np.concatenate([rest[:k], p, rest[k:]]) for p in (part, part[::-1])]
    lengths = [orders.tour_length(distance, one) for one in (tour, *others)]
    assert lengths[0] <= min(lengths[1:]) + 1e-8


@pytest.mark.parametrize("name", ["4a", "4c", "5a", "5c"])
def test_the_shortest_order_is_no_longer_than_the_others(name):
    cells = verdict_of(name).cells
    steps = orders.step_lengths(cells, cells.pairs)
    found = orders.shortest_order(cells)
    assert sorted(found.tolist()) == list(range(len(cells)))
    others = [orders.grid_order(order, *map(int, cells.shape)) for order in orders.GRID_ORDERS]
    least = min(orders.route_length(steps, other) for other in others)
    assert orders.route_length(steps, found) <= least * (1 + 1e-9)


def test_the_length_of_a_route_goes_round_what_does_not_touch():
    cells = plane((0, 0.3), (0, 0.1)).cells(3, 1)
    steps = orders.step_lengths(cells, cells.pairs)
    assert orders.route_length(steps, np.array([0, 2, 1])) == pytest.approx(0.3, rel=1e-12)
    steps = orders.step_lengths(cells, np.array([[0, 1]]))
    assert orders.route_length(steps, np.array([0, 1, 2])) == np.inf


def test_one_cell_is_an_order_of_its_own():
    one = plane((0.0, 0.1), (0.0, 0.1)).cells(1, 1)
    assert orders.shortest_order(one).tolist() == [0]
    assert orders.route_length(orders.step_lengths(one, one.pairs), np.array([0])) == 0.0


def test_the_shortest_order_of_cells_in_two_pieces_names_each_once():
    cells = plane((0, 0.4), (0, 0.2)).cells(4, 2)
    pairs = cells.pairs[(cells.pairs < 4).all(axis=1) | (cells.pairs >= 4).all(axis=1)]
    assert sorted(orders.shortest_order(cells, pairs).tolist()) == list(range(8))


def test_cells_of_a_mesh_have_the_shortest_order_alone():
    cells = mesh(TriangleMesh(*sheet(12))).cells(12)
    assert sorted(orders.shortest_order(cells).tolist()) == list(range(len(cells)))
    asked = SimpleNamespace(cells=cells)  # no arm is asked
    for order in orders.GRID_ORDERS:
        with pytest.raises(PathError, match=f"{order}.*not.*use order 'shortest'"):
            coverage_path(asked, order)
    with pytest.raises(PathError, match=r"'zigzag'.*rows, columns, spiral, shortest"):
        coverage_path(asked, "zigzag")
