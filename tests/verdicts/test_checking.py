"""`check` itself: the same question has the same answer; budgets, progress and interruption."""

import math
import pickle
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from unittest.mock import Mock

import networkx as nx
import numpy as np
import plain
import pytest
from asked import case_of, question, verdict_of
from jobs import EndingClock

import coverable
from coverable import Answer, Evidence, Search, check, load_result, save_result, verify
from coverable.errors import ArgumentError
from feasibility.problem import Problem
from feasibility.reports.verdict_json import as_json
from feasibility.roadmap.exploration import BUDGET
from feasibility.roadmap.warmup import warm_up

FEW = ("paper 5d", "puma560 190", "ur5 12", "dome of halves", "beside a post")


def same(one, other, causes=True):
    assert (one.answer, one.evidence, one.message) == (other.answer, other.evidence, other.message)
    np.testing.assert_array_equal(one.covered, other.covered)
    assert (one.witness is None) == (other.witness is None)
    if one.witness is not None:
        np.testing.assert_array_equal(one.witness.q, other.witness.q)
        np.testing.assert_array_equal(one.witness.cell, other.witness.cell)
    assert one.statistics == other.statistics
    assert not causes or one.causes == other.causes


def ask(name, **given):
    _, _, robot, cells, task, search = question(name)
    return check(robot, cells, task, given.pop("search", search), **given)


@pytest.mark.parametrize("name", FEW)
def test_a_seed_fixes_the_verdict_and_the_motion(name):
    """Nor does it matter who looks on, or a time limit that is not reached."""
    told = []
    progress = lambda done, total, text: told.append((done, total, text))  # noqa: E731
    seed = question(name).search.seed
    same(verdict_of(name), ask(name, search=Search(seed=seed, time_limit=3600), progress=progress))
    total = len(question(name).cells)
    assert told
    assert all(0 <= done <= (total if most is None else most) for done, most, _ in told)
    assert all(text for _, _, text in told)


def test_threads_do_not_disturb_each_other():
    with ThreadPoolExecutor(4) as pool:
        for name, verdict in zip(FEW, pool.map(ask, FEW), strict=True):
            same(verdict_of(name), verdict)


# Budgets and interruption: all cells are reached, in several components that nothing joins, and
# there are too many of them to end soon.


@pytest.fixture(scope="module")
def hard():
    _, _, robot, cells, task, _ = question("puma560 207")
    return robot, cells.surface.cells(50, 40), task


@pytest.mark.parametrize("looks", [1, 5, 12])
def test_a_time_limit_is_honoured(looks, hard):
    warm_up()
    clock = EndingClock(at=looks)
    verdict = check(*hard, clock=clock)
    assert (verdict.answer, verdict.evidence) == (Answer.UNDECIDED, Evidence.BUDGET)
    assert "time limit" in verdict.message
    assert (verdict.witness, verdict.certificate) == (None, None)
    # The compiled loops come back soon, and nothing goes on once the time is up.
    assert clock.looks[0] <= looks + 2
    assert verdict.statistics["fk"] <= 1.1 * BUDGET * looks
    # What was found until then stands.
    assert (verdict.n_covered > 0) == (looks > 1)
    assert verdict.n_covered < len(verdict.cells) == len(verdict.graph)
    covered = np.flatnonzero(verdict.covered)[::97]
    q = np.array([verdict.graph.nodes[int(k)]["q"] for k in covered]).reshape(-1, 6)
    points, _, _ = plain.arm_of(verdict.robot).tool(q)
    aims, _ = plain.targets_of(verdict.cells, verdict.task)
    assert (np.linalg.norm(points - aims[covered], axis=1) <= 1e-3).all()


@pytest.mark.parametrize("most", [300, 5_000, 60_000])
def test_a_limit_of_evaluations_is_kept_and_the_same_every_time(most, hard):
    warm_up()
    progress = Mock()
    first, second = (check(*hard, Search(evaluations=most), progress) for _ in range(2))
    same(first, second, causes=False)  # of thousands of cells, which take their time
    assert (first.answer, first.evidence) == (Answer.UNDECIDED, Evidence.BUDGET)
    assert "limit of evaluations" in first.message
    assert most < first.statistics["fk"] <= most + BUDGET
    assert progress.call_count <= 2 * (most // BUDGET + 12)


@pytest.mark.parametrize("name", FEW)
def test_an_effort_that_is_enough_changes_nothing(name):
    """Nor is more spent than what a limit allows, over finer cells and on proofs too."""
    asked = question(name)
    fk = int(verdict_of(name).statistics["fk"])
    same(verdict_of(name), ask(name, search=replace(asked.search, evaluations=50 * fk + 10**6)))
    less = ask(name, search=replace(asked.search, evaluations=max(fk // 2, 1)))
    assert less.statistics["fk"] <= fk
    assert less.answer in (verdict_of(name).answer, Answer.UNDECIDED)


def test_an_interrupt_in_the_progress_report_gets_through_at_once(hard):
    progress = Mock(side_effect=[None, None, None, KeyboardInterrupt])
    with pytest.raises(KeyboardInterrupt):
        check(*hard, progress=progress)
    assert progress.call_count == 4


def test_a_motion_refused_by_a_hair_is_looked_for_again(monkeypatch):
    """The search is made to use more than the tolerance; the second time it keeps to less."""
    from feasibility.roadmap import search

    made, asked, most = search.arrays_of, [], 1
    warm_up()

    def generous(robot, cells, task):
        given = made(robot, cells, task)
        asked.append(given.tolerance)
        return given._replace(tolerance=2.0 * given.tolerance) if len(asked) <= most else given

    monkeypatch.setattr(search, "arrays_of", generous)
    verdict = ask("paper 4c")
    assert asked == pytest.approx([1e-3, 0.9e-3])
    assert verdict.feasible
    assert plain.faults_of(verdict) == []
    asked, most = [], 2
    again = ask("paper 4c")
    assert again.answer == "undecided"
    assert again.witness is None


@pytest.mark.parametrize("name", ["plate", "long plate", "greedy dome", "loaded", "pickled"])
def test_the_graph_is_what_people_draw_and_networkx_writes(name, tmp_path):
    verdict = verdict_of({"loaded": "plate", "pickled": "long plate"}.get(name, name))
    if name == "loaded":
        verdict = load_result(save_result(verdict, case_of("plate"), tmp_path / "a")).verdict
    if name == "pickled":
        verdict = pickle.loads(pickle.dumps(verdict))
        assert not any("Deferred" in type(kept).__name__ for kept in vars(verdict).values())
        assert {"graph", "causes", "tree"} <= set(dir(verdict))
    cells, nodes = verdict.cells, verdict.graph.nodes
    assert list(nodes) == list(range(len(cells)))
    assert np.array([nodes[k]["point"] for k in nodes]) == pytest.approx(cells.centres, abs=1e-12)
    assert np.array([nodes[k]["normal"] for k in nodes]) == pytest.approx(cells.normals, abs=1e-12)
    assert [nodes[k]["index"] for k in nodes] == [tuple(cells.unravel(k)) for k in nodes]
    assert [nodes[k]["covered"] for k in nodes] == verdict.covered.tolist()
    nx.write_graphml(verdict.graph, tmp_path / "g.graphml")
    back = nx.read_graphml(tmp_path / "g.graphml", node_type=int)
    assert set(back.edges) == set(verdict.graph.edges)
    for k, node in verdict.graph.nodes.items():
        for key in ("point", "normal", "q"):
            if node[key] is not None:  # every digit
                assert [float(x) for x in back.nodes[k][key].split()] == node[key].tolist()
    for a, b, motion in verdict.graph.edges(data="motion"):
        rows = [[float(x) for x in row.split()] for row in back.edges[a, b]["motion"].split(";")]
        assert rows == motion.tolist()


@pytest.mark.parametrize("shape", [(0, 0), (0, 5), (5, 0)])
def test_no_cells_at_all_are_covered(shape):
    asked = question("small dome")
    verdict = check(asked.robot, asked.cells.surface.cells(*shape), asked.task)
    assert (verdict.answer, verdict.evidence) == (Answer.FEASIBLE, Evidence.WITNESS)
    assert (verdict.n_covered, verdict.n_edges, verdict.causes) == (0, 0, ())


def test_joints_with_limits_of_no_width_are_joints_that_are_held():
    locked, asked = verdict_of("beside held joints"), question("small dome")
    held = asked.robot.with_limits(dict.fromkeys(("joint1", "joint4", "joint6"), (0.0, 0.0)))
    verdict = check(held, locked.cells, locked.task)
    assert (verdict.answer, verdict.evidence) == (locked.answer, locked.evidence)
    assert verdict.covered.reshape(4, 3).tolist() == [[False, True, False]] * 4


def test_what_collides_is_refused_and_nothing_asked_is_no_collision():
    """A motion that was found without a roof leads through it; the greedy search knows none."""
    _, _, robot, cells, task, _ = question("under a roof")
    free = check(robot, cells, replace(task, collision=None))
    assert verify(robot, cells, free.task, free.witness.q).holds
    judged = verify(robot, cells, task, free.witness.q)
    assert not judged.holds
    assert any("roof" in fault.text for fault in judged.faults)
    assert not verify(replace(free, task=task)).holds
    assert not check(robot, cells, task, seeds=free.witness).feasible
    none = check(robot, cells, task, collision=coverable.Collision(self_=False, surface=False))
    one, other = (as_json(answer) for answer in (none, free))
    assert {k: v for k, v in one.items() if k != "timing"} == {
        k: v for k, v in other.items() if k != "timing"
    }
    with pytest.raises(ArgumentError, match="knows no collisions"):
        coverable.greedy_check(robot, cells, task)


def test_links_are_cut_into_pieces_only_where_hulls_are_in_the_way():
    verdict = verdict_of("beside a hull")
    assert verdict.task.collision.shapes == "pieces"
    assert "so the links were cut into convex pieces" in verdict.message
    for name in ("clear of itself", "too near itself"):
        assert verdict_of(name).task.collision.shapes == "hulls"
    robot, cells, task = question("beside a hull")[2:5]
    problem = Problem.of(robot, cells, replace(task, placement_error=(0.01, 0.0)))
    assert problem.in_pieces.tried is problem.tried  # what the judge's shapes say holds there, too
    assert next(problem.with_room).tried is not problem.tried


@pytest.mark.parametrize("seed", [16, 80])
def test_over_hollows_as_round_as_the_standoff_the_replay_follows_the_motion(seed):
    rng = np.random.default_rng(seed)
    away, turn = rng.uniform(0.4, 0.75), rng.uniform(0, math.tau)
    away = rng.uniform(0.8, 1.25) if seed == 80 else away
    position = [away * math.cos(turn), away * math.sin(turn), rng.uniform(-0.2, 0.4)]
    tilt = rng.uniform(-40, 40, 3).tolist()
    x, y = np.meshgrid(*[np.linspace(-0.2, 0.2, 6)] * 2, indexing="ij")
    z = 0.06 * rng.normal(size=(6, 6)) * rng.uniform(0.2, 1)
    net, weights = np.stack([x, y, z], 2), rng.uniform(0.5, 2, (6, 6)) if seed == 16 else None
    pose = {"position": position, "rpy_deg": tilt, "side": "outside"}
    cells = coverable.bspline(net, (3, 3), None, weights, **pose).cells(5, 5)
    task = coverable.Task(standoff=0.05, cone_deg=float(rng.uniform(5, 60)))
    asked = coverable.load_robot("puma560"), cells, task
    verdict = check(*asked)
    assert verdict.feasible
    assert seed == 80 or coverable.verify(*asked, verdict.witness.q).holds  # without its marks
