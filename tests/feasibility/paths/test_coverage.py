"""Coverage paths: all replayed, their figures measured again, their choices against brute force."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise, product

import networkx as nx
import numpy as np
import pytest
from dense_replay import assert_motion, assert_over, dense
from path_cases import BEST, FEASIBLE, PATCHES, path_of, verdict_of
from small_cases import empty_verdict, paper_verdict, small_case, small_verdict

from feasibility import Task, check
from feasibility.certification import replay
from feasibility.paths import PathError, coverage_path
from feasibility.paths import ladder as joint_routes
from feasibility.paths.ladder import joint_route
from feasibility.paths.metrics import revisiting
from feasibility.paths.motion_graph import (
    MotionGraph,
    joint_length,
    motion_graph_of,
    rewound,
    windings,
)
from feasibility.paths.order import ORDERS, closed_sides, grid_order
from feasibility.results import load_result, save_result
from feasibility.roadmap import arrays_of, work_for
from feasibility.verdict import Answer, Walk
from robots import Kinematics, load_robot
from surfaces import cylinder

NAMES = (*FEASIBLE, *PATCHES)


@pytest.mark.parametrize(
    ("name", "order"),
    [
        *product(("4a", "4e", "5c", *PATCHES), ORDERS),
        *((name, BEST[name]) for name in FEASIBLE if name not in ("4a", "4e", "5c")),
    ],
)
def test_a_path_is_one_motion_through_every_cell_in_its_order(name, order):
    verdict, path = verdict_of(name), path_of(name, order)
    every = np.ones(len(verdict.cells), dtype=bool)
    replayed = replay(verdict.robot, verdict.cells, verdict.task, path.walk, every)
    assert replayed.accepted, replayed.refusal
    assert replayed.certificate == path.certificate
    firsts = list(dict.fromkeys(path.visits.tolist()))
    assert sorted(firsts) == list(range(len(verdict.cells)))
    if path.figures.revisited == 0.0 and order != "shortest":
        assert firsts in [visits.tolist() for visits in beginnings(verdict.cells, order)]
    marks = path.walk.cell >= 0
    assert_over(verdict, path.walk.cell[marks], path.walk.q[marks])


def beginnings(cells, order):
    """An order of a grid begun anywhere that it can be."""
    shape, closed = cells.shape, closed_sides(cells)
    rows, columns = (range(n if close else 1) for n, close in zip(shape, closed, strict=True))
    for begin in product(rows, columns):
        for upside in product((False, True), repeat=2):
            yield grid_order(order, *shape, begin, upside)


@pytest.mark.parametrize("name", NAMES)
def test_a_path_holds_between_its_waypoints_by_formulas_of_its_own(name):
    assert_motion(verdict_of(name), path_of(name).walk.q)


@pytest.mark.parametrize("name", NAMES)
def test_the_best_order_revisits_little(name):
    shares = [path_of(name, order).figures.revisited_share for order in ORDERS]
    assert max(shares) <= 0.01


TUBES = {
    # Joints that turn on with the surface, and stop at their limits somewhere on the way.
    "ur5 around": ("ur5", 0.48, "outside", (0, 0.32), 0.19, 60, 0.1),
    "ur5 within": ("ur5", 0.203, "inside", (0.37, 0.46), 0.14, 60, 0.1),
    "stops at 180": ("ur5_limited", 0.157, "inside", (0.54, -0.04), 0.23, 60, 0.05),
    "panda": ("panda", 0.217, "inside", (0, 0.37), 0.25, 45, 0.05),
}


@cache
def tube(name):
    """The verdict of a closed cylinder."""
    arm, radius, side, (x, z), height, cone, standoff = TUBES[name]
    ring = cylinder(radius, (0, 360), (0, height), position=(x, 0, z), side=side)
    return check(load_robot(arm), ring.cells(12, 6), Task(standoff=standoff, cone_deg=cone))


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("name", ["ur5 around", "stops at 180"])
def test_a_closed_surface_is_not_gone_over_twice(name, order):
    """Some joint cannot turn on where the surface does: the path begins there."""
    verdict = tube(name)
    path = coverage_path(verdict, order)
    every = np.ones(len(verdict.cells), dtype=bool)
    replayed = replay(verdict.robot, verdict.cells, verdict.task, path.walk, every)
    assert replayed.accepted, replayed.refusal
    assert path.figures.revisited_share <= 0.01
    assert_motion(verdict, path.walk.q)
    if order != "shortest":
        firsts = list(dict.fromkeys(path.visits.tolist()))
        assert firsts in [visits.tolist() for visits in beginnings(verdict.cells, order)]


def test_a_motion_in_another_winding_is_the_same_work():
    verdict = tube("ur5 around")
    path = coverage_path(verdict, "rows")
    graph = motion_graph_of(verdict)
    nodes = joint_route(graph, verdict.cells, np.arange(3)).nodes
    walk = graph.walk(nodes)
    found = windings(graph, nodes)
    lower, upper = verdict.robot.lower, verdict.robot.upper
    for joint, times in product(range(6), (-2, -1, 1, 2)):
        turn = 2 * np.pi * times * np.eye(6)[joint]
        fits = (walk.q + turn >= lower).all() and (walk.q + turn <= upper).all()
        assert fits == any(np.array_equal(turn, one) for one in found)
    assert found
    assert path.figures.revisited == 0.0
    needed = np.isin(np.arange(len(verdict.cells)), [0, 1, 2])
    for turn in found:
        moved = graph.walk(rewound(graph, nodes, turn))
        assert np.array_equal(moved.cell, walk.cell)
        assert moved.q == pytest.approx(walk.q + turn, abs=1e-12)
        assert replay(verdict.robot, verdict.cells, verdict.task, moved, needed).accepted


def test_a_path_is_given_up_when_it_revisits_too_much(stored_motions_only):
    rng, cells = np.random.default_rng(3), small_verdict("plate").cells
    given_up = 0
    for _ in range(20):
        graph, order = hand_made(rng, 6, 3, 0.6), rng.permutation(6)
        whole = joint_route(graph.copy(), cells, order, wind=False)
        most = whole.revisited * (1 + 1e-9)
        same = joint_route(graph.copy(), cells, order, wind=False, most_revisited=most)
        assert same.nodes == whole.nodes
        if whole.revisited > 0.0:
            half = 0.5 * whole.revisited
            less = joint_route(graph.copy(), cells, order, wind=False, most_revisited=half)
            assert (less.nodes, less.revisited) == ([], np.inf)
            assert less.stuck == whole.stuck[: len(less.stuck)] != []
            given_up += 1
    assert given_up >= 5


@pytest.mark.parametrize("name", ["4c", "5c", *PATCHES])
def test_the_figures_of_a_path_measured_again(name):
    verdict, path = verdict_of(name), path_of(name)
    robot, walk, figures = verdict.robot, path.walk, path.figures
    # Lengths: straight from closest point to closest point along a much denser walk.
    points, _ = Kinematics(robot).tools(dense(walk.q, 16))
    closest_point = verdict.cells.surface.closest(points)
    way = np.linalg.norm(
        np.diff(points - closest_point.height[:, None] * closest_point.normal, axis=0), axis=1
    )
    assert figures.length == pytest.approx(way.sum(), rel=1e-3)
    by_mark, seen, start = [0.0, 0.0], {int(walk.cell[0])}, 0
    for k in np.flatnonzero(walk.cell >= 0)[1:].tolist():
        by_mark[int(walk.cell[k]) in seen] += way[16 * start : 16 * k].sum()
        seen.add(int(walk.cell[k]))
        start = k
    assert [figures.covered, figures.revisited] == pytest.approx(by_mark, rel=1e-3, abs=1e-9)
    # A path through the centres is no shorter; this one passes them within the tolerance.
    slack = 2 * 1e-3 * len(verdict.cells)
    assert figures.length >= figures.least_length - slack
    assert figures.travel == pytest.approx(np.abs(np.diff(walk.q, axis=0)).sum(axis=0))
    margins = np.minimum(walk.q - robot.lower, robot.upper - walk.q)
    assert figures.turn_margin == margins.min()
    assert figures.slide_margin == np.inf
    assert -1e-9 <= figures.cone_margin <= verdict.task.cone
    assert figures.singular_value == pytest.approx(_singular_value(robot, walk.q), rel=1e-4)


def _singular_value(robot, q, step=1e-6):
    """The smallest of five singular values, by finite differences of the tool's place."""
    kinematics, reach, smallest = Kinematics(robot), robot.reach, np.inf
    for row in q:
        columns = []
        for j in range(robot.n):
            shift = step * np.eye(robot.n)[j]
            ahead, behind = kinematics.tool(row + shift), kinematics.tool(row - shift)
            columns.append([*(ahead[0] - behind[0]) / reach, *(ahead[1] - behind[1])])
        values = np.linalg.svd(np.array(columns).T / (2 * step), compute_uv=False)
        smallest = min(smallest, float(values[4]))
    return smallest


def test_segments_that_lead_to_a_known_cell():
    cell = np.array([0, -1, 1, -1, 0, 0, -1, 2])
    walk = Walk(q=np.zeros((8, 2)), cell=cell)
    assert revisiting(walk).tolist() == [False, False, True, True, True, False, False]


def test_cells_of_an_infeasible_surface_that_one_motion_covers():
    verdict = paper_verdict("4d")
    covered = np.flatnonzero(verdict.covered)
    path = coverage_path(verdict, "rows", only=covered.tolist())
    assert set(path.visits.tolist()) >= set(covered.tolist())
    replayed = replay(verdict.robot, verdict.cells, verdict.task, path.walk, verdict.covered)
    assert replayed.accepted, replayed.refusal
    assert_motion(verdict, path.walk.q)


def test_some_cells_only():
    verdict = paper_verdict("4c")
    wanted = [0, 1, 2, 12, 22, 88]
    path = coverage_path(verdict, "shortest", only=wanted)
    assert set(path.visits.tolist()) >= set(wanted)
    assert len(path.visits) < 30
    single = coverage_path(verdict, "rows", only=[7])
    assert single.visits.tolist() == [7]
    assert (single.figures.length, single.figures.revisited_share) == (0.0, 0.0)


def test_the_same_question_has_the_same_path():
    verdict = verdict_of("ur5")
    first, second = coverage_path(verdict, "spiral"), coverage_path(verdict, "spiral")
    assert np.array_equal(first.walk.q, second.walk.q)
    assert np.array_equal(first.walk.cell, second.walk.cell)


# -- the choice of nodes, on hand-made graphs ---------------------------------------------------


def hand_made(rng, cells, nodes, density):
    """A graph over cells in a row: some nodes over each, random motions between neighbours."""
    verdict = small_verdict("plate")
    arrays = arrays_of(verdict.robot, verdict.cells, verdict.task)
    graph = MotionGraph(arrays, work_for(2), {(k, k + 1): k for k in range(cells - 1)})
    for cell in range(cells):
        for _ in range(nodes):
            graph.node(cell, rng.random(2))
    for a, b in product(range(cells * nodes), repeat=2):
        if abs(graph.cell[a] - graph.cell[b]) <= 1 and a < b and rng.random() < density:
            graph.join(a, b, np.vstack([graph.q[a], rng.random((1, 2)), graph.q[b]]))
    return graph


@pytest.fixture
def stored_motions_only(monkeypatch):
    """No new motions: what is known decides, so that brute force can know it too."""
    monkeypatch.setattr(
        joint_routes,
        "step_to",
        lambda graph, x, cell: [y for y in graph.edges[x] if graph.cell[y] == cell],
    )
    monkeypatch.setattr(joint_routes, "join_self_motions", lambda graph, x: None)
    monkeypatch.setattr(joint_routes, "APART", 0.0)  # no node is a copy of another


@pytest.mark.parametrize("seed", range(10))
def test_nodes_are_chosen_for_the_least_travel(seed, stored_motions_only):
    graph = hand_made(np.random.default_rng(seed), cells=5, nodes=3, density=1.0)
    cells = small_verdict("plate").cells
    nodes = joint_route(graph, cells, np.arange(5), wind=False).nodes
    assert [graph.cell[x] for x in nodes] == list(range(5))
    travel = sum(graph.length(x, y) for x, y in pairwise(nodes))
    choices = product(*(graph.over[cell] for cell in range(5)))
    least = min(sum(graph.length(x, y) for x, y in pairwise(c)) for c in choices)
    assert travel == pytest.approx(least, rel=1e-12)


def test_detours_go_through_known_motions_to_every_cell(stored_motions_only):
    rng = np.random.default_rng(7)
    cells = small_verdict("plate").cells
    reached = refused = 0
    while reached < 30 or refused < 10:
        graph = hand_made(rng, cells=6, nodes=3, density=float(rng.choice([0.2, 0.4, 0.6])))
        order = rng.permutation(6)
        joined = [{graph.cell[x] for x in part} for part in nx.connected_components(graph.edges)]
        if not any(len(part) == 6 for part in joined):
            with pytest.raises(PathError, match="no known motion leads from"):
                joint_route(graph, cells, order, wind=False)
            refused += 1
        elif all(len(part) == 6 for part in joined):
            nodes = joint_route(graph, cells, order, wind=False).nodes
            assert {graph.cell[x] for x in nodes} == set(range(6))
            assert graph.cell[nodes[0]] == order[0]
            assert all(graph.edges.has_edge(x, y) for x, y in pairwise(nodes))
            walk = graph.walk(nodes)
            assert walk.cell[walk.cell >= 0].tolist() == [graph.cell[x] for x in nodes]
            assert np.array_equal(walk.q[walk.cell >= 0], [graph.q[x] for x in nodes])
            reached += 1


def test_a_detour_is_the_cheapest(stored_motions_only):
    rng = np.random.default_rng(5)
    cells = small_verdict("plate").cells
    for _ in range(40):
        graph = hand_made(rng, cells=5, nodes=2, density=0.5)
        weighted = nx.Graph()
        weighted.add_nodes_from(range(len(graph.cell)))
        for x, y in graph.edges.edges:
            apart = np.linalg.norm(cells.centres[graph.cell[x]] - cells.centres[graph.cell[y]])
            cost = joint_length(graph.motion(x, y))
            cost += joint_routes.REVISIT * apart / graph.arrays.scale
            weighted.add_edge(x, y, weight=cost)
        lengths = [
            nx.dijkstra_path_length(weighted, x, y)
            for x in graph.over[0]
            for y in graph.over[4]
            if nx.has_path(weighted, x, y)
        ]
        if not lengths:
            continue
        nodes = joint_route(graph, cells, np.array([0, 4]), wind=False).nodes
        length = nx.path_weight(weighted, nodes, "weight")
        assert length == pytest.approx(min(lengths), rel=1e-12)


# -- what cannot be asked -----------------------------------------------------------------------


def test_a_path_of_an_infeasible_surface():
    with pytest.raises(PathError, match=r"infeasible with 60 of 90 cells covered.*divide"):
        coverage_path(paper_verdict("4d"))


def test_a_path_of_an_undecided_surface():
    verdict = replace_answer(paper_verdict("4d"), Answer.UNDECIDED)
    with pytest.raises(PathError, match="the verdict is undecided"):
        coverage_path(verdict)


def replace_answer(verdict, answer):
    """The same verdict with another answer."""
    return replace(verdict, answer=answer, graph=None, causes=())


def test_a_path_of_the_greedy_search():
    with pytest.raises(PathError, match=r"greedy search.*method = 'complete'"):
        coverage_path(small_verdict("greedy dome"))


def test_a_path_of_no_cells():
    with pytest.raises(PathError, match="no cells to cover"):
        coverage_path(empty_verdict())
    with pytest.raises(PathError, match="no cells are named"):
        coverage_path(small_verdict("plate"), only=[])


def test_cells_that_cannot_be_reached_and_cells_that_are_none():
    verdict = paper_verdict("4d")
    missed = int(np.flatnonzero(~verdict.covered)[0])
    with pytest.raises(PathError, match=r"(?s)no cell -1, 90;.*0 to 89.*cell .*cannot be reached"):
        coverage_path(verdict, only=[missed, -1, 90])


@pytest.mark.parametrize("only", [[1.5], ["0"], [None], [10**30]])
def test_cells_that_are_no_indices(only):
    with pytest.raises(PathError, match="must be whole numbers"):
        coverage_path(small_verdict("plate"), only=only)


def test_a_verdict_from_a_file_has_the_same_path(tmp_path):
    verdict = small_verdict("plate")
    file = save_result(verdict, small_case("plate"), tmp_path / "plate.cover")
    loaded = load_result(file).verdict
    for order in ORDERS:
        first, second = coverage_path(verdict, order), coverage_path(loaded, order)
        assert np.array_equal(first.walk.q, second.walk.q)


def test_an_unknown_order():
    with pytest.raises(PathError, match=r"'snake'.*rows, columns, spiral, shortest"):
        coverage_path(small_verdict("plate"), "snake")
