"""The twelve published cases under the greedy search, and what is stored of them replayed."""

from __future__ import annotations

import math
from functools import cache

import networkx as nx
import numpy as np
import pytest
import samples
from asked import names, question
from samples import sampled

from feasibility import Answer, Evidence, Search, Verdict, greedy_check
from feasibility.paper.jcell_steps import Steps
from feasibility.paper.starts import starts
from robots import Kinematics

STEP_DEG = {"single": 0.02, "all": 0.5}

# (cells touched by the best tree, edges of its G), with seed 0: regression anchors.
KNOWN = {
    ("4a", "all"): (90, 305),
    ("4b", "all"): (90, 305),
    ("4c", "all"): (90, 305),
    ("4d", "all"): (70, 231),
    ("4e", "all"): (90, 305),
    ("5a", "all"): (90, 305),
    ("5b", "all"): (90, 305),
    ("5d", "all"): (90, 305),
    ("4a", "single"): (90, 305),
    ("4b", "single"): (90, 305),
    ("5a", "single"): (90, 305),
}


@cache
def verdict_of(name: str, moves: str) -> Verdict:
    _, _, robot, cells, task, _ = question(f"paper {name}")
    search = Search(method="greedy", moves=moves, step_deg=STEP_DEG[moves], cap=5000)
    if moves == "all":
        search = Search(method="greedy", moves="all", step_deg=0.5)
    return greedy_check(robot, cells, task, search)


def test_sphere_as_published() -> None:
    """4a: 90 cells, 305 calls, 305 edges, at the paper's step."""
    _, _, robot, cells, task, _ = question("paper 4a")
    verdict = greedy_check(robot, cells, task, Search(method="greedy"))
    assert verdict.answer is Answer.FEASIBLE
    assert (verdict.n_covered, verdict.n_edges) == (90, 305)
    assert (verdict.statistics["calls"], verdict.statistics["capped"]) == (305, 0)
    assert verdict.statistics["starts"] == 1
    # No branch is worth more than another to the paper, yet two of seven are cut here.
    points, approaches, _ = task.targets(cells)
    first = verdict.start
    branches = list(starts(robot, points[first], approaches[first], task.cone, 0))
    assert len(branches) >= 6
    search = Search(method="greedy", step_deg=0.05)
    touched = [greedy_check(robot, cells, task, search, start=q).n_covered for q in branches]
    assert max(touched) == 90
    assert min(touched) < 90


DEAR = {"single": ("4c", "4e", "4f", "5b", "5c", "5d", "5e", "5f"), "all": ("4f", "5c", "5e")}
"""Cases whose many calls take most of the time: a campaign asks them too."""
PAPER = [name.removeprefix("paper ") for name in names("paper")]
CHEAP = [(name, moves) for moves in STEP_DEG for name in PAPER if name not in DEAR[moves]]
BOTH = [(name, moves) for moves in STEP_DEG for name in PAPER]


@sampled
@pytest.mark.parametrize(("name", "moves"), BOTH if samples.EVERYTHING else CHEAP)
def test_case(name: str, moves: str) -> None:
    verdict = verdict_of(name, moves)
    if (name, moves) in KNOWN:
        assert (verdict.n_covered, verdict.n_edges) == KNOWN[name, moves]
    if verdict.n_covered == 90:
        assert (verdict.answer, verdict.evidence) == (Answer.FEASIBLE, Evidence.WITNESS)
        assert verdict.certificate is not None
    else:
        assert (verdict.answer, verdict.evidence) == (Answer.INFEASIBLE, Evidence.EXHAUSTED)
        assert "not found by the greedy search" in verdict.message
    assert verdict.witness is None
    # 4d and 4f are infeasible by an independent computation, whatever the search.
    assert (verdict.answer is Answer.FEASIBLE) <= (name not in ("4d", "4f"))
    assert len(verdict.causes) == 90 - verdict.n_covered
    assert nx.is_arborescence(verdict.tree)
    assert verdict.tree.in_degree(verdict.start) == 0
    assert set(verdict.tree) == set(np.flatnonzero(verdict.covered).tolist())
    assert set(verdict.graph) == set(range(90))
    assert {tuple(sorted(e)) for e in verdict.tree.edges} <= {
        tuple(sorted(e)) for e in verdict.graph.edges
    }
    assert {tuple(sorted(e)) for e in verdict.graph.edges} <= {
        tuple(pair) for pair in verdict.cells.pairs.tolist()
    }


@pytest.mark.parametrize(("name", "moves"), [("4a", "all"), ("4d", "single")])
def test_every_stored_path_replays(name: str, moves: str) -> None:
    """Written out without the project's replay: J-cell steps, limits, cone, tolerance, cells."""
    verdict = verdict_of(name, moves)
    robot, cells, task = verdict.robot, verdict.cells, verdict.task
    search = Search(method="greedy", moves=moves, step_deg=STEP_DEG[moves])
    steps = Steps.of(robot, cells, task, search)
    kinematics = Kinematics(robot)
    stored = [(a, b, d["motion"]) for a, b, d in verdict.tree.edges(data=True)]
    for a, b, _ in stored:
        np.testing.assert_array_equal(verdict.tree.nodes[a]["q"], verdict.graph.nodes[a]["q"])
        np.testing.assert_array_equal(verdict.tree.edges[a, b]["motion"][0], q_of(verdict, a))
        np.testing.assert_array_equal(verdict.tree.edges[a, b]["motion"][-1], q_of(verdict, b))
    stored += [(min(a, b), max(a, b), d["motion"]) for a, b, d in verdict.graph.edges(data=True)]
    rng = np.random.default_rng(0)
    if len(stored) > 30:  # keeps the test short; which ones, the seed says
        stored = [stored[k] for k in rng.choice(len(stored), 30, replace=False)]
    for a, b, motion in stored:
        moved = np.diff(motion, axis=0) / steps.size
        np.testing.assert_allclose(moved, np.round(moved), atol=1e-8)
        per_step = np.abs(np.round(moved))
        assert per_step.max() == 1
        assert (per_step.sum(axis=1) >= 1).all()
        if moves == "single":
            assert (per_step.sum(axis=1) == 1).all()
        assert (motion >= robot.lower).all()
        assert (motion <= robot.upper).all()
        found = []
        for q in motion:
            point, axis = kinematics.tool(q)
            closest_point = cells.surface.closest(point)
            assert abs(closest_point.height + task.standoff) <= steps.tolerance
            assert axis @ closest_point.normal >= math.cos(task.cone)
            assert closest_point.inside
            found.append(cell_at(verdict, float(closest_point.u), float(closest_point.v)))
        assert {found[0], found[-1]} == {a, b}


def q_of(verdict: Verdict, cell: int) -> np.ndarray:
    return np.asarray(verdict.tree.nodes[cell]["q"])


def cell_at(verdict: Verdict, u: float, v: float) -> int:
    surface, (nu, nv) = verdict.cells.surface, verdict.cells.shape
    (u0, u1), (v0, v1) = surface.u_range, surface.v_range
    i = min(int((u - u0) / (u1 - u0) * nu), nu - 1)
    return i * nv + min(int((v - v0) / (v1 - v0) * nv), nv - 1)
