"""How much of the surface one motion reaches, found in a few steps: what a quick look shows.

It is the beginning of the complete search: seeds over the middle, then over cells that none has
reached, spread along certified motions; then a few attempts to join the largest parts. Proofs,
graph and replay are left to the certified answer.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Mask
from feasibility.clock import Clock, OutOfTime
from feasibility.notices import compiling_notice
from feasibility.paper.greedy import greedy_search
from feasibility.problem import Problem
from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.motions.search_arrays import arrays_of
from feasibility.roadmap.rounds import evenly, improve
from feasibility.roadmap.search import seed_middle
from feasibility.roadmap.warmup import warm_up
from feasibility.search_settings import Search
from feasibility.targets.starting import start_cell

SEEDS = 2  # guesses at a cell that is not reached
ROUNDS = 3
LARGEST = 3  # parts that a round tries to join


class QuickAnswer(NamedTuple):
    """What a quick look found."""

    covered: Mask
    """(N,) cells that one motion reaches."""
    q: Array | None
    """(n,) a configuration of that motion; None where it reaches nothing."""


def quick_search(problem: Problem, search: Search, clock: Clock) -> QuickAnswer:
    """Search until all is reached, the clock ends it, or the few rounds are over.

    Args:
        problem: arm, cells and task.
        search: its method, and its seed.
        clock: looked at between steps of 8,000 evaluations at most; may raise.

    Raises:
        ArgumentError: the arm's start is not on the motion set.
    """
    if search.method == "greedy":
        return _greedy(problem, search, clock)
    robot, cells = problem.robot, problem.cells
    begin = start_cell(robot, cells, problem.task)
    with compiling_notice():
        warm_up()
    arrays = arrays_of(robot, cells, problem.searched)
    exploration = Exploration(robot, cells, arrays, search.seed, clock)
    try:
        if begin is not None and robot.start is not None:
            exploration.begin_at(begin, np.array(robot.start))
        _explore(exploration)
    except OutOfTime:
        pass
    covered = exploration.covered
    return QuickAnswer(covered, exploration.posture(exploration.best) if covered.any() else None)


def _explore(exploration: Exploration) -> None:
    """Reach cells, then join what reaches them."""
    if seed_middle(exploration):
        return
    for cell in evenly(np.flatnonzero(~exploration.reached)).tolist():
        if not exploration.reached[cell]:
            exploration.tick("looking for configurations")
            exploration.add_seeds(cell, exploration.guesses(SEEDS))
    for _ in range(ROUNDS):
        if exploration.complete or not exploration.apart:
            return
        improve(exploration, exploration.roots()[:LARGEST])


def _greedy(problem: Problem, search: Search, clock: Clock) -> QuickAnswer:
    """What the paper's search reaches until the clock ends it."""
    try:
        found = greedy_search(problem, search, clock, problem.robot.start)
    except OutOfTime:  # before it had found anything
        return QuickAnswer(np.zeros(len(problem.cells), dtype=bool), None)
    known = found.postures is not None and len(found.postures)
    return QuickAnswer(found.covered, found.postures[0] if known else None)  # type: ignore[index]
