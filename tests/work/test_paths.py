"""Coverage paths: replayed, judged and measured by others, their choices against brute force."""

from dataclasses import replace
from functools import cache
from itertools import pairwise, product
from pathlib import Path

import networkx as nx
import numpy as np
import pytest
from displaced_parts import singular
from path_cases import BEST, FEASIBLE, PATCHES, path_of, verdict_of
from plain import arm_of, faults_of
from referee import evenly
from samples import sampled, seeds, spread

import coverable
from coverable import PathError, Task, check, coverage_path, cylinder, load_robot, plane, replay
from feasibility.paths.ladder import joint_route
from feasibility.paths.metrics import revisiting, unwound
from feasibility.paths.motion_graph import MotionGraph
from feasibility.paths.order import GRID_ORDERS, closed_sides, grid_order
from feasibility.roadmap.motions.search_arrays import arrays_of
from feasibility.roadmap.motions.working_memory import work_for
from feasibility.verdict import Walk
from robots.kinematics import Kinematics

ASKED = [
    *product(("4a", "4e", "5c", *PATCHES), (*GRID_ORDERS, "shortest")),
    *((name, BEST[name]) for name in FEASIBLE if name not in ("4a", "4e", "5c")),
]
MARGIN = Path(__file__).with_name("demanded_margin.toml")
UR5 = load_robot("ur5")  # whose joints turn by a turn either way


def accepted(verdict, walk):
    """The certificate of a walk that the product's replay and the foreign referee accept."""
    needed = np.ones(len(verdict.cells), dtype=bool)
    found = replay(verdict.robot, verdict.cells, verdict.task, walk, needed)
    assert found.accepted, found.refusal
    assert set(walk.cell[walk.cell >= 0].tolist()) == set(range(len(needed)))
    assert faults_of(verdict, walk.q, walk.cell) == []
    return found.certificate


def test_a_path_and_a_division_keep_the_margin_that_is_demanded():
    case = coverable.load_case(MARGIN).build()
    for one in coverage_path(check(*case)), *coverable.divide(*case[:3]).patches:
        assert one.certificate.placement_margin.position >= case[2].placement_error.position


def beginnings(cells, order):
    """An order of a grid begun anywhere that it can be."""
    shape, closed = cells.shape, closed_sides(cells)
    rows, columns = (range(n if close else 1) for n, close in zip(shape, closed, strict=True))
    for begin in product(rows, columns):
        for upside in product((False, True), repeat=2):
            yield grid_order(order, *shape, begin, upside).tolist()


@sampled(("name", "order"), spread(ASKED, 14))
def test_a_path_is_one_motion_through_every_cell_in_its_order(name, order):
    """It holds between its waypoints too, and revisits little in the order that suits it best."""
    verdict, path = verdict_of(name), path_of(name, order)
    assert accepted(verdict, path.walk) == path.certificate
    firsts = list(dict.fromkeys(path.visits.tolist()))
    assert sorted(firsts) == list(range(len(verdict.cells)))
    if path.figures.revisited == 0.0 and order != "shortest":
        assert firsts in beginnings(verdict.cells, order)
    if order == BEST.get(name, "rows"):
        assert path.figures.revisited_share <= 0.01


TUBES = {
    # Joints that turn on with the surface, and stop at their limits somewhere on the way.
    "ur5 around": ("ur5", 0.48, "outside", (0, 0.32), 0.19, 60, 0.1),
    "ur5 within": ("ur5", 0.203, "inside", (0.37, 0.46), 0.14, 60, 0.1),
    "stops at 180": ("ur5_limited", 0.157, "inside", (0.54, -0.04), 0.23, 60, 0.05),
    "panda": ("panda", 0.217, "inside", (0, 0.37), 0.25, 45, 0.05),
}


@cache
def tube(name):
    arm, radius, side, (x, z), height, cone, standoff = TUBES[name]
    ring = cylinder(radius, (0, 360), (0, height), position=(x, 0, z), side=side)
    return check(load_robot(arm), ring.cells(12, 6), Task(standoff=standoff, cone_deg=cone))


@sampled(("name", "order"), spread([*product(TUBES, (*GRID_ORDERS, "shortest"))], 6))
def test_a_closed_surface_is_not_gone_over_twice(name, order):
    """Some joint cannot turn on where the surface does: the path begins there."""
    path = coverage_path(tube(name), order)
    accepted(tube(name), path.walk)
    assert path.figures.revisited_share <= 0.01
    if order != "shortest":
        assert list(dict.fromkeys(path.visits.tolist())) in beginnings(path.cells, order)


def test_where_no_motion_leads_on_all_until_there_is_run_a_turn_earlier():
    """By hand: on from the second of three cells it goes a turn further alone."""
    verdict = verdict_of("ur5")
    arrays = arrays_of(verdict.robot, verdict.cells, verdict.task)
    graph = MotionGraph(arrays, work_for(6), {(0, 1): 0, (1, 2): 1}, grows=False)
    q = np.linspace(-1.0, -0.5, 4)[:, None] * np.ones(6)
    q[2] = q[1] + 2 * np.pi * np.eye(6)[0]
    over = [graph.node(cell, row) for cell, row in zip((0, 1, 1, 2), q, strict=True)]
    for x, y in ((0, 1), (2, 3)):
        graph.join(over[x], over[y], q[[x, y]])
    found = joint_route(graph, verdict.cells, np.arange(3))
    assert found.stuck == []
    assert found.revisited == 0.0
    assert graph.walk(found.nodes).q == pytest.approx(np.vstack([q[0] + q[2] - q[1], q[2:]]))


def test_what_leads_to_a_cell_visited_before_is_revisited():
    walk = Walk(np.zeros((5, 1)), np.array([0, 1, -1, 0, 2]))
    assert revisiting(walk).tolist() == [False, True, True, False]


@pytest.mark.parametrize("name", ["4c", "5c", *PATCHES])
def test_the_figures_of_a_path_measured_again(name):
    verdict, path = verdict_of(name), path_of(name)
    robot, walk, figures = verdict.robot, path.walk, path.figures
    # Lengths: straight from closest point to closest point along a much denser walk.
    points, _ = Kinematics(robot).tools(evenly(walk.q, 16))
    on = verdict.cells.surface.closest(points)
    feet = points - on.height[:, None] * on.normal
    way = np.linalg.norm(np.diff(feet, axis=0), axis=1)
    assert figures.length == pytest.approx(way.sum(), rel=1e-3)
    by_mark, seen, start = [0.0, 0.0], {int(walk.cell[0])}, 0
    for k in np.flatnonzero(walk.cell >= 0)[1:].tolist():
        by_mark[int(walk.cell[k]) in seen] += way[16 * start : 16 * k].sum()
        seen.add(int(walk.cell[k]))
        start = k
    assert [figures.covered, figures.revisited] == pytest.approx(by_mark, rel=1e-3, abs=1e-9)
    # A path through the centres is no shorter; this one passes them within the tolerance.
    assert figures.travel == pytest.approx(np.abs(np.diff(walk.q, axis=0)).sum(axis=0))
    assert figures.turn_margin == np.minimum(walk.q - robot.lower, robot.upper - walk.q).min()
    assert figures.slide_margin == np.inf
    assert -1e-9 <= figures.cone_margin <= verdict.task.cone
    least = singular(robot, arm_of(robot), walk.q).min()
    assert figures.singular_value == pytest.approx(least, rel=1e-4)


def hand_made(rng, cells, nodes, density, wide=3.0):
    """A graph over cells in a row: some nodes over each, random motions between neighbours."""
    verdict = verdict_of("ur5")
    arrays = arrays_of(verdict.robot, verdict.cells, verdict.task)
    pairs = {(k, k + 1): k for k in range(cells - 1)}
    graph = MotionGraph(arrays, work_for(2), pairs, grows=False)
    for cell in range(cells):
        for _ in range(nodes):
            graph.node(cell, wide * rng.random(2))
    for a, b in product(range(cells * nodes), repeat=2):
        if abs(graph.cell[a] - graph.cell[b]) <= 1 and a < b and rng.random() < density:
            graph.join(a, b, np.vstack([graph.q[a], wide * rng.random((1, 2)), graph.q[b]]))
    return graph, verdict.cells


@sampled("seed", seeds(10, all=200))
def test_nodes_are_chosen_for_the_least_travel(seed):
    graph, cells = hand_made(np.random.default_rng(seed), cells=5, nodes=3, density=1.0)
    nodes = joint_route(graph, cells, np.arange(5), wind=False).nodes
    assert [graph.cell[x] for x in nodes] == list(range(5))
    choices = product(*(graph.over[cell] for cell in range(5)))
    travel = [sum(graph.length(x, y) for x, y in pairwise(c)) for c in (nodes, *choices)]
    assert travel[0] == pytest.approx(min(travel), rel=1e-12)


def test_detours_go_through_known_motions_to_every_cell():
    """And are given up where they revisit more than is allowed."""
    rng, reached, refused, given_up = np.random.default_rng(7), 0, 0, 0
    while reached < 30 or refused < 10 or given_up < 5:
        graph, cells = hand_made(rng, 6, 3, density=float(rng.choice([0.2, 0.4, 0.6])))
        order = rng.permutation(6)
        joined = [{graph.cell[x] for x in part} for part in nx.connected_components(graph.edges)]
        if not any(len(part) == 6 for part in joined):
            with pytest.raises(PathError, match="no known motion leads from"):
                joint_route(graph, cells, order, wind=False)
            refused += 1
        elif all(len(part) == 6 for part in joined):
            found = joint_route(graph.copy(), cells, order, wind=False)
            nodes = found.nodes
            assert {graph.cell[x] for x in nodes} == set(range(6))
            assert graph.cell[nodes[0]] == order[0]
            assert all(graph.edges.has_edge(x, y) for x, y in pairwise(nodes))
            walk = graph.walk(nodes)
            assert walk.cell[walk.cell >= 0].tolist() == [graph.cell[x] for x in nodes]
            assert np.array_equal(walk.q[walk.cell >= 0], [graph.q[x] for x in nodes])
            reached += 1
            most = found.revisited * (1 + 1e-9)
            same = joint_route(graph.copy(), cells, order, wind=False, most_revisited=most)
            assert same.nodes == nodes
            if found.revisited > 0.0:
                half = 0.5 * found.revisited
                less = joint_route(graph.copy(), cells, order, wind=False, most_revisited=half)
                assert (less.nodes, less.revisited) == ([], np.inf)
                assert less.stuck == found.stuck[: len(less.stuck)] != []
                given_up += 1


@pytest.mark.parametrize(("share", "over"), [(0.8, [0, 1, 2, 3]), (1.2, [0, 1, 2, 1, 2, 3])])
def test_a_detour_goes_back_where_that_saves_more_travel_than_it_costs(share, over):
    """From the third of four cells on at once, with some travel; or back, and on with none."""
    graph, cells = hand_made(np.random.default_rng(0), cells=4, nodes=0, density=0.0)
    row = (0, 1, 2, 1, 2, 3)
    nodes = [graph.node(cell, 1e-6 * k * np.ones(2)) for k, cell in enumerate(row)]
    for x, y in pairwise(nodes):
        graph.join(x, y, np.stack([graph.q[x], graph.q[y]]))
    apart = np.linalg.norm(cells.centres[2] - cells.centres[1])
    travel = share * 2.0 * 20.0 * apart / graph.arrays.scale
    turned = np.array([0.5 * travel, 0.0])
    graph.join(nodes[2], nodes[5], np.stack([graph.q[nodes[2]], turned, graph.q[nodes[5]]]))
    found = joint_route(graph, cells, np.array([0, 3]), wind=False)
    assert [graph.cell[x] for x in found.nodes] == over


@pytest.fixture(scope="module")
def small():
    cells = plane((0.4, 0.6), (-0.1, 0.1), "outside", (0.0, 0.0, 0.2)).cells(2, 2)
    return check(UR5, cells, Task(standoff=0.02, cone_deg=20))


@pytest.mark.parametrize("turns", [[0, 1, 0, 0, 0, 0], [1, 0, 0, 1, 0, 1]])
def test_full_turns_are_undone_and_the_replay_accepts_it(small, turns):
    walk = small.witness
    middle = 0.5 * (walk.q.min(axis=0) + walk.q.max(axis=0))
    far = Walk(walk.q - 2.0 * np.pi * np.sign(middle) * turns, walk.cell)
    assert (far.q >= UR5.lower).all()
    assert (far.q <= UR5.upper).all()
    found = unwound(UR5, small.task, far)
    assert np.abs(0.5 * (found.q.min(axis=0) + found.q.max(axis=0))).max() <= np.pi + 1e-9
    accepted(small, found)
    assert np.abs(coverage_path(replace(small, witness=far)).walk.q).max() <= 1.5 * np.pi


def test_home_says_which_turn_and_a_start_is_kept(small):
    walk = small.witness
    home = np.degrees(walk.q[0])
    home[1] += 360.0 if home[1] < 0 else -360.0
    task = replace(small.task, home_deg=tuple(home.tolist()))
    found = unwound(UR5, task, walk)
    assert np.allclose(np.degrees(found.q[0]), home)
    accepted(small, found)
    assert unwound(load_robot("ur5", start=walk.q[0].tolist()), task, walk) is walk
    home[1] += 1800.0  # beyond the limits: as near as they allow
    accepted(small, unwound(UR5, replace(task, home_deg=tuple(home.tolist())), walk))
    free = replace(UR5, lower=np.full(6, -np.inf), upper=np.full(6, np.inf))
    far = unwound(free, small.task, Walk(walk.q + 2.0 * np.pi, walk.cell))  # no numpy warning
    assert np.abs(0.5 * (far.q.min(axis=0) + far.q.max(axis=0))).max() <= np.pi + 1e-9


def test_what_has_no_path_is_said(approved):
    verdict, patch = verdict_of("4d"), verdict_of("ur5")
    undecided = replace(verdict, answer=coverable.Answer.UNDECIDED, graph=None, causes=())
    greedy = replace(patch, method="greedy")
    empty = check(patch.robot, patch.cells.surface.cells(0, 3), patch.task)
    said = []
    asked = [(one, None) for one in (verdict, undecided, greedy, empty)]
    for one, order in [*asked, (patch, "snake")]:
        with pytest.raises(PathError) as caught:
            coverage_path(one, order)
        said.append(str(caught.value))
    approved("what has no path", "\n".join(said))
