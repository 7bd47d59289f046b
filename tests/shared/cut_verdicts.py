"""Verdicts with cut proofs: stored disconnected problems of the PUMA."""

from __future__ import annotations

from functools import cache

import numpy as np
from random_cases import built, read

from feasibility.checking import check
from feasibility.clock import Clock
from feasibility.problem import Problem
from feasibility.roadmap import Exploration, arrays_of, explore
from feasibility.roadmap.causes import causes_of
from feasibility.roadmap.cuts import Prover, components_of, places_on
from feasibility.verdict import Answer, Evidence, Verdict
from robots import load_robot

ONE_CUT, TWO_CUTS = 4, 0  # numbers of problems, by the cuts of the proof that is found
ATTEMPTS, BOXES = 6, 200_000


def disconnected_problem(number: int):
    """The stored disconnected problem of that number: robot, cells, task."""
    apart = [
        problem
        for problem, said in read("puma560")
        if not said.feasible and said.reachable == np.prod(problem.cells)
    ]
    return built(apart[number], load_robot("puma560"))


@cache
def explored(number: int) -> tuple[Exploration, Prover]:
    """A search that ended without a motion, and a prover of its problem."""
    robot, cells, task = disconnected_problem(number)
    arrays = arrays_of(robot, cells, Problem.of(robot, cells, task).searched)
    exploration = Exploration(robot, cells, arrays, 0, Clock())
    explore(exploration)
    return exploration, Prover(arrays, places_on(cells.surface, task), np.random.default_rng(0))


@cache
def cut_verdict(number: int) -> Verdict:
    """Its verdict, with a cut tree as proof."""
    robot, cells, task = disconnected_problem(number)
    verdict = check(robot, cells, task)
    exploration, prover = explored(number)
    for _ in range(ATTEMPTS):
        attempt = prover.attempt(components_of(exploration.roadmap), BOXES, lambda: None)
        if attempt.tree is not None:
            break
        for cell, q in attempt.seeds:
            exploration.add_seeds(cell, q[None])
    assert attempt.tree is not None
    fields = dict(
        {name.removeprefix("_"): value for name, value in vars(verdict).items()},
        answer=Answer.INFEASIBLE,
        evidence=Evidence.PROOF,
        proof=attempt.tree,
        covered=exploration.covered,
        components=tuple(np.flatnonzero(exploration.covers(r)) for r in exploration.roots()),
        postures=np.array([exploration.posture(r) for r in exploration.roots()]),
        causes=causes_of(exploration, attempt.tree),
    )
    return Verdict(**fields)
