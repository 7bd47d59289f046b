"""The covering walk on hand-made roadmaps: every cell, only stored motions, few detours."""

import networkx as nx
import numpy as np
import pytest
from samples import sampled, seeds
from search_kernels import assert_walked

from coverable import plane
from feasibility.roadmap.graph import Roadmap
from feasibility.roadmap.walk import covering_walk


def roadmap_of(graph, cells, cell_of=None, rng=None):
    """A roadmap with the nodes 0 .. n - 1 and edges of a graph, and each node's component."""
    rng, roadmap, of = np.random.default_rng(0) if rng is None else rng, Roadmap(cells), {}
    for members in nx.connected_components(graph):
        of |= dict.fromkeys(members, roadmap.add_component())
    for x in range(len(graph)):
        cell = x if cell_of is None else int(cell_of[x])
        roadmap.add_node(cell, rng.random(6), np.zeros(6), of[x])
    for x, y in graph.edges:
        motion = rng.random((int(rng.integers(1, 5)), 6))
        motion[-1] = roadmap.q[y]
        roadmap.add_edge(x, y, motion)
    return roadmap, of


def visits(graph, cells, **options):
    roadmap, _ = roadmap_of(graph, cells, **options)
    order = assert_walked(roadmap, covering_walk(roadmap, 0))
    assert set(order) == set(range(cells))
    return order


@pytest.mark.parametrize("n", [1, 2, 3, 50])
def test_a_line_is_walked_once_and_a_star_from_leaf_to_leaf(n):
    backwards = nx.relabel_nodes(nx.path_graph(n), {k: n - 1 - k for k in range(n)})
    for graph in (nx.path_graph(n), backwards):
        assert visits(graph, n) in (list(range(n)), list(range(n))[::-1])
    assert len(visits(nx.star_graph(n), n + 1)) == max(2 * n - 1, 2)  # the fewest there are


def test_a_grid_of_eight_neighbours_takes_few_detours():
    """Grids up to 12 x 12: at most 15 per cent more visits than cells."""
    for nu, nv in ((1, 12), (2, 2), (3, 3), (9, 10), (12, 12)):
        graph = nx.empty_graph(nu * nv)
        graph.add_edges_from(plane((0, 1), (0, 1)).cells(nu, nv).pairs.tolist())
        assert len(visits(graph, nu * nv)) <= 1.15 * nu * nv + 1


@sampled("seed", seeds(5, all=60))
def test_random_trees_and_graphs(seed):
    """A tree of n nodes takes at most twice its edges; more edges never hurt a valid walk."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 120))
    tree = nx.Graph([(k, int(rng.integers(0, k))) for k in range(1, n)])
    assert len(visits(tree, n, rng=rng)) <= 2 * (n - 1) + 1
    tree.add_edges_from((int(a), int(b)) for a, b in rng.integers(0, n, (n, 2)) if a != b)
    assert len(visits(tree, n, rng=rng)) <= 2 * (n - 1) + 1


@sampled("seed", seeds(3, all=40))
def test_several_nodes_over_one_cell(seed):
    """Cells, not nodes, have to be visited: some nodes are left out, no cell is."""
    rng = np.random.default_rng(seed)
    n, cells = 90, 30
    cell_of = np.concatenate([np.arange(cells), rng.integers(0, cells, n - cells)])
    tree = nx.Graph([(k, int(rng.integers(max(0, k - 6), k))) for k in range(1, n)])
    roadmap, _ = roadmap_of(tree, cells, cell_of=cell_of, rng=rng)
    order = assert_walked(roadmap, covering_walk(roadmap, 0))
    assert set(order) == set(range(cells))
    assert len(order) <= 2 * (n - 1) + 1


def test_only_the_component_asked_for():
    graph = nx.disjoint_union_all([nx.path_graph(4), nx.path_graph(5), nx.empty_graph(1)])
    roadmap, of = roadmap_of(graph, 10)
    for first, expected in ((0, range(4)), (4, range(4, 9)), (9, range(9, 10))):
        order = assert_walked(roadmap, covering_walk(roadmap, of[first]))
        assert sorted(order) == list(expected)


def test_a_component_that_is_not_connected_gives_no_covering_walk():
    """Nodes marked as one component without motions between them: no motion is invented."""
    graph = nx.disjoint_union(nx.path_graph(3), nx.path_graph(3))
    roadmap, _ = roadmap_of(graph, 6)
    roadmap.component, roadmap.cover = [0] * 6, [np.ones(6, dtype=bool)]
    order = assert_walked(roadmap, covering_walk(roadmap, 0))
    assert set(order) != set(range(6))
