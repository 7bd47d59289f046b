"""`check` itself: what a verdict promises, its repeatability, its budgets and its interruption."""

from __future__ import annotations

import hashlib
import os
import pickle
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from functools import cache

import networkx as nx
import numpy as np
import pytest
from dense_replay import assert_motion, assert_over, assert_witness
from guards import GUARD_S
from oracle_build import built
from oracle_cases import Problem
from random_arms import question
from random_cases import draw, draw_ur5

from feasibility import Answer, CauseKind, Evidence, Search, Task, Verdict, check
from feasibility.cases import load_case
from feasibility.roadmap import warm_up
from feasibility.roadmap.exploration import BUDGET
from robots import load_robot
from surfaces import plane, sphere

ALL = [("puma560", number) for number in range(24)] + [("ur5", number) for number in range(12)]
DRAWN = ALL[::2]  # all: make campaign NAME=larger_samples


def drawn(arm: str, number: int) -> Problem:
    rng = np.random.default_rng([7, number])
    return draw(rng) if arm == "puma560" else draw_ur5(rng)


@cache
def verdict_of(arm: str, number: int) -> Verdict:
    return check(*built(drawn(arm, number), load_robot(arm)))


# what a verdict promises


@pytest.mark.parametrize(("arm", "number"), DRAWN)
def test_the_verdict_fits_together(arm: str, number: int) -> None:
    verdict = verdict_of(arm, number)
    total = len(verdict.cells)
    covered = set(np.flatnonzero(verdict.covered).tolist())
    missed = [cause.cell for cause in verdict.causes]
    assert missed == sorted(set(range(total)) - covered)
    assert verdict.n_covered == len(covered)

    assert verdict.feasible == (len(covered) == total) == (verdict.witness is not None)
    assert (verdict.certificate is not None) == verdict.feasible
    evidence = {
        Answer.FEASIBLE: {Evidence.WITNESS},
        Answer.INFEASIBLE: {Evidence.PROOF, Evidence.EXHAUSTED},
        Answer.UNDECIDED: {Evidence.BUDGET},
    }
    assert verdict.evidence in evidence[verdict.answer]
    proved = any(cause.proved for cause in verdict.causes)
    assert proved == (verdict.evidence is Evidence.PROOF)

    components = [set(component.tolist()) for component in verdict.components]
    sizes = [len(component) for component in components]
    assert sizes == sorted(sizes, reverse=True)
    assert (components[0] if components else set()) == covered
    reached = set().union(*components)
    apart = {c.cell for c in verdict.causes if c.kind is CauseKind.DISCONNECTED}
    assert apart == reached - covered
    assert all(cause.detail for cause in verdict.causes)


@pytest.mark.parametrize(("arm", "number"), DRAWN)
def test_the_graph_is_one_component_of_motions_that_hold(arm: str, number: int) -> None:
    verdict = verdict_of(arm, number)
    graph, covered = verdict.graph, np.flatnonzero(verdict.covered)
    assert list(graph) == list(range(len(verdict.cells)))
    assert verdict.n_edges == graph.number_of_edges()
    pairs = {tuple(pair) for pair in verdict.cells.pairs.tolist()}
    assert {(min(e), max(e)) for e in graph.edges} <= pairs
    held = [k for k, q in graph.nodes(data="q") if q is not None]
    assert held == covered.tolist()
    if len(covered):
        assert nx.is_connected(graph.subgraph(held))
        assert_over(verdict, covered, np.array([graph.nodes[k]["q"] for k in held]))
    for a, b, motion in graph.edges(data="motion"):
        assert_over(verdict, np.array([min(a, b), max(a, b)]), motion[[0, -1]])
        assert_motion(verdict, motion)
    if verdict.feasible:
        assert_witness(verdict)


@pytest.mark.parametrize(("arm", "number"), DRAWN)
def test_the_certificate_bounds_what_the_witness_does(arm: str, number: int) -> None:
    verdict = verdict_of(arm, number)
    if verdict.witness is None or verdict.certificate is None:
        assert not verdict.feasible
        return
    q, certificate, robot = verdict.witness.q, verdict.certificate, verdict.robot
    assert certificate.waypoints == len(q)
    assert certificate.max_position_error <= 1e-3
    assert certificate.max_angle <= verdict.task.cone
    margin = np.minimum(q - robot.lower, robot.upper - q).min()
    assert certificate.min_limit_margin == pytest.approx(margin, abs=1e-12)
    assert margin >= 0.0


def test_random_cases_are_of_every_kind() -> None:
    """What is checked above says something only if both answers and all evidence occur."""
    seen = {(verdict_of(*case).answer, verdict_of(*case).evidence) for case in DRAWN}
    assert (Answer.FEASIBLE, Evidence.WITNESS) in seen
    assert (Answer.INFEASIBLE, Evidence.PROOF) in seen
    assert len({len(verdict_of(*case).components) for case in DRAWN}) > 2


# the same question has the same answer


def same(one: Verdict, other: Verdict) -> None:
    """Equal to the last bit."""
    assert (one.answer, one.evidence, one.message) == (other.answer, other.evidence, other.message)
    np.testing.assert_array_equal(one.covered, other.covered)
    assert (one.witness is None) == (other.witness is None)
    if one.witness is not None and other.witness is not None:
        np.testing.assert_array_equal(one.witness.q, other.witness.q)
        np.testing.assert_array_equal(one.witness.cell, other.witness.cell)
    assert one.statistics == other.statistics
    assert one.causes == other.causes


@pytest.mark.parametrize(("arm", "number"), DRAWN[::3])
def test_a_seed_fixes_the_verdict_and_the_motion(arm: str, number: int) -> None:
    same(verdict_of(arm, number), check(*built(drawn(arm, number), load_robot(arm))))


def test_threads_do_not_disturb_each_other() -> None:
    def ask(case: tuple[str, int]) -> Verdict:
        return check(*built(drawn(*case), load_robot(case[0])))

    cases = DRAWN[:4] + DRAWN[-4:]
    with ThreadPoolExecutor(4) as pool:
        for case, verdict in zip(cases, pool.map(ask, cases), strict=True):
            same(verdict_of(*case), verdict)


PRINT_WITNESS = """
import hashlib
from feasibility import Task, check
from robots import load_robot
from surfaces import plane
patch = plane((0.4, 0.6), (-0.1, 0.1), position=(0, 0, 0.3), side="outside")
walk = check(load_robot("ur5"), patch.cells(3, 4), Task(standoff=0.02, cone_deg=30)).witness
print(hashlib.sha256(walk.q.tobytes() + walk.cell.tobytes()).hexdigest())
"""


def test_another_process_finds_the_same_motion() -> None:
    patch = plane((0.4, 0.6), (-0.1, 0.1), position=(0, 0, 0.3), side="outside")
    walk = check(load_robot("ur5"), patch.cells(3, 4), Task(standoff=0.02, cone_deg=30)).witness
    assert walk is not None
    here = hashlib.sha256(walk.q.tobytes() + walk.cell.tobytes()).hexdigest()
    other = subprocess.run(
        [sys.executable, "-c", PRINT_WITNESS],
        env={**os.environ, "PYTHONHASHSEED": "1"},
        capture_output=True,
        text=True,
        check=True,
        timeout=GUARD_S,
    )
    assert other.stdout.strip() == here


@pytest.mark.parametrize(("arm", "number"), DRAWN[::3])
def test_the_seed_does_not_decide(arm: str, number: int) -> None:
    first = verdict_of(arm, number)
    for seed in (1, 2):
        verdict = check(*built(drawn(arm, number), load_robot(arm)), Search(seed=seed))
        assert verdict.answer is first.answer
        assert verdict.n_covered == first.n_covered


PUMA = load_robot("puma560", limits="set-2")
TASK = Task(standoff=0.005, cone_deg=25)
ONE_PATCH = {
    "as it is": (sphere(1.0, (20, 80), (-30, 150)).cells(5, 7), False, False),
    "turned about z": (
        sphere(1.0, (20, 80), (-120, 60), rpy_deg=(0, 0, 90)).cells(5, 7),
        False,
        False,
    ),
    "upside down": (
        sphere(1.0, (100, 160), (-150, 30), rpy_deg=(180, 0, 0)).cells(5, 7),
        True,
        True,
    ),
    "back to front": (
        sphere(1.0, (100, 160), (30, 210), rpy_deg=(0, 180, 0)).cells(5, 7),
        True,
        True,
    ),
}


@cache
def on_one_patch(name: str, limits: str) -> Verdict:
    cells, _, _ = ONE_PATCH[name]
    return check(PUMA.with_limits(limits), cells, TASK)


def aligned(name: str, limits: str) -> np.ndarray:
    """Covered cells (5, 7) in the order of the first description."""
    _, flip_u, flip_v = ONE_PATCH[name]
    grid = on_one_patch(name, limits).covered.reshape(5, 7)
    return grid[:: -1 if flip_u else 1, :: -1 if flip_v else 1]


@pytest.mark.parametrize("limits", ["set-1", "set-3"])
@pytest.mark.parametrize("name", list(ONE_PATCH)[1:])
def test_the_order_of_cells_does_not_decide(name: str, limits: str) -> None:
    """One patch, parametrised in four ways."""
    cells, flip_u, flip_v = ONE_PATCH[name]
    order = np.arange(35).reshape(5, 7)[:: -1 if flip_u else 1, :: -1 if flip_v else 1].ravel()
    original = ONE_PATCH["as it is"][0]
    np.testing.assert_allclose(cells.centres[order], original.centres, atol=1e-12)
    one, other = on_one_patch("as it is", limits), on_one_patch(name, limits)
    assert (one.answer, one.evidence) == (other.answer, other.evidence)
    np.testing.assert_array_equal(aligned("as it is", limits), aligned(name, limits))
    assert one.n_edges == other.n_edges


# budgets and interruption

LIMITS = (-180.0, 180.0)
HARD = Problem(
    kind="hyperboloid",
    size=(0.22, 0.48),
    u=(-91.0, 134.0),
    v=(-0.39, 0.376),
    position=(-0.4, -0.69, -0.466),
    rpy_deg=(-45.7, 111.4, -144.1),
    side="outside",
    cells=(240, 200),
    standoff=0.0,
    cone_deg=20.7,
    limits_deg=(LIMITS, LIMITS, LIMITS, (-140.6, 65.3), (-180.0, 123.7), LIMITS),
)
"""All of it is reached, in several components that nothing joins; too many cells to end soon."""


@cache
def hard():
    return built(HARD, load_robot("puma560"))


class Clock:
    """The search's clock, on which the time limit passes at the k-th look."""

    def __init__(self, looks: int) -> None:
        self.looks = -1  # the first one starts it
        self.enough = looks

    def monotonic(self) -> float:
        self.looks += 1
        return 0.0 if self.looks < self.enough else np.inf


@pytest.mark.parametrize("looks", [1, 2, 5, 40])
def test_a_time_limit_is_honoured(looks: int, monkeypatch) -> None:
    warm_up()
    clock = Clock(looks)
    monkeypatch.setattr("feasibility.clock.time", clock)
    verdict = check(*hard(), Search(time_limit=3600.0))
    assert (verdict.answer, verdict.evidence) == (Answer.UNDECIDED, Evidence.BUDGET)
    assert "time limit" in verdict.message
    assert (verdict.witness, verdict.certificate) == (None, None)
    # The compiled loops come back soon, and nothing goes on once the time is up.
    assert clock.looks <= looks + 2
    assert verdict.statistics["fk"] <= 1.1 * BUDGET * looks
    # What was found until then stands.
    assert (verdict.n_covered > 0) == (looks > 1)
    assert verdict.n_covered < len(verdict.cells)
    covered = np.flatnonzero(verdict.covered)[::97]
    graph = verdict.graph
    motion = np.array([graph.nodes[int(k)]["q"] for k in covered]).reshape(-1, 6)
    assert_over(verdict, covered, motion)


@pytest.mark.parametrize("time_limit", [1e-9, 1e-4, 1e-2, 5e-2])
def test_hardly_any_time_gives_undecided_and_no_error(time_limit: float) -> None:
    verdict = check(*hard(), Search(time_limit=time_limit))
    assert (verdict.answer, verdict.evidence) == (Answer.UNDECIDED, Evidence.BUDGET)
    assert len(verdict.graph) == len(verdict.cells)
    for component in verdict.components:
        assert len(component) > 0


def test_a_time_limit_that_is_not_reached_changes_nothing() -> None:
    for case in DRAWN[:3]:
        setup = built(drawn(*case), load_robot(case[0]))
        same(verdict_of(*case), check(*setup, Search(time_limit=600.0)))


def test_an_interrupt_in_the_progress_report_gets_through_at_once() -> None:
    calls = 0

    def interrupt(done: int, total: int | None, text: str) -> None:
        nonlocal calls
        calls += 1
        assert 0 <= done <= (len(hard()[1]) if total is None else total)
        assert text
        if calls == 4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        check(*hard(), progress=interrupt)
    assert calls == 4


def test_reporting_progress_changes_nothing() -> None:
    told: list[tuple[int, int | None]] = []
    for case in DRAWN[:6]:
        setup = built(drawn(*case), load_robot(case[0]))
        verdict = check(*setup, progress=lambda done, total, text: told.append((done, total)))
        same(verdict_of(*case), verdict)
    assert told


HARD_CASE = """
robot = { name = "puma560", limits_deg = [
    [-180, 180], [-180, 180], [-180, 180], [-140.6, 65.3], [-180, 123.7], [-180, 180]] }
surface.kind = "hyperboloid"
surface.radius = 0.22
surface.flare = 0.48
surface.u_deg = [-91, 134]
surface.v = [-0.39, 0.376]
surface.position = [-0.4, -0.69, -0.466]
surface.rpy_deg = [-45.7, 111.4, -144.1]
surface.side = "outside"
surface.cells = [400, 300]
task = { standoff = 0, cone_deg = 20.7 }
"""
TELL_WHEN_SEARCHING = """
import sys
from feasibility.cli.main import main
from feasibility.clock import Clock
tick, ticks = Clock.tick, []
def told(*given):
    ticks.append(given)
    if len(ticks) == 3:  # the search itself is under way, its kernels are loaded
        print("searching", flush=True)
    tick(*given)
Clock.tick = told
sys.exit(main(["check", sys.argv[1]]))
"""


def test_ctrl_c_ends_a_hard_search(tmp_path) -> None:
    case = tmp_path / "hard.toml"
    case.write_text(HARD_CASE)
    child = subprocess.Popen(
        [sys.executable, "-c", TELL_WHEN_SEARCHING, str(case)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert child.stdout is not None
    assert child.stdout.readline() == "searching\n"
    child.send_signal(signal.SIGINT)
    out, err = child.communicate(timeout=GUARD_S)
    assert (child.returncode, out) == (130, "")
    # Before it there may be a word about kernels that had to be compiled.
    assert err.endswith("coverable: interrupted\n")
    assert "Traceback" not in err


def test_a_motion_refused_by_a_hair_is_looked_for_again(monkeypatch):
    """The search is made to use more than the tolerance; the second time it keeps to less."""
    from feasibility import checking
    from feasibility.roadmap import search

    made, asked, most = search.arrays_of, [], 1
    warm_up()

    def generous(robot, cells, task):
        given = made(robot, cells, task)
        asked.append(given.tolerance)
        return given._replace(tolerance=2.0 * given.tolerance) if len(asked) <= most else given

    robot, cells, task = question("puma, tube")
    monkeypatch.setattr(search, "arrays_of", generous)
    verdict = checking.check(robot, cells, task)
    assert asked == pytest.approx([1e-3, 0.9e-3])
    assert verdict.feasible
    assert_witness(verdict)
    asked, most = [], 2
    again = checking.check(robot, cells, task)
    assert again.answer == "undecided"
    assert "off its surface" in again.message
    assert again.witness is None


@pytest.mark.parametrize("method", ["complete", "greedy"])
def test_a_verdict_pickles(method):
    """With all that it makes when it is read, which are properties that completion shows."""
    robot, cells, task, _ = load_case("paper/4d").build()
    verdict = check(robot, cells, task, Search(method=method, step_deg=0.5, moves="all", starts=1))
    again = pickle.loads(pickle.dumps(verdict))
    assert (again.answer, again.message, again.causes) == (
        verdict.answer, verdict.message, verdict.causes
    )  # fmt: skip
    assert again.graph.edges == verdict.graph.edges
    assert (again.tree is None) == (method == "complete")
    assert np.array_equal(again.covered, verdict.covered)
    assert all(isinstance(vars(Verdict)[name], property) for name in ("graph", "causes", "tree"))
    assert {"graph", "causes", "tree"} <= set(dir(verdict))
