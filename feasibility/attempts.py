"""Attempts at an answer: a search and the replay of its motion, again where that may help."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from feasibility.certification.faults import Replay
from feasibility.clock import Clock, OutOfTime
from feasibility.problem import Problem
from feasibility.search_result import SearchResult
from feasibility.search_settings import Search
from feasibility.verdict import Bound, PlacementMargin

if TYPE_CHECKING:
    import networkx as nx

NOT_BEGUN = "The time limit of {:g} s ran out while the search was prepared; nothing was searched."
NOT_REPLAYED = (
    "A motion over every cell was found, but the time limit of {:g} s ran out before the "
    "independent replay had judged it."
)
IN_PIECES = (
    " (With one convex hull for each shape of a link, {} of {} cells were covered; so the links "
    "were cut into convex pieces.)"
)
START_IN_PIECES = (
    " (With one convex hull for each shape of a link, the start would collide; so the links were "
    "cut into convex pieces.)"
)
NOT_IN_PIECES = " (With the links cut into convex pieces no more was found: {} of {} cells.)"

Method = Callable[[Problem, Search, Clock], SearchResult]


class Attempt(NamedTuple):
    """One search, and the replay of the motion that it found."""

    problem: Problem
    found: SearchResult
    replayed: Replay | None
    search_s: float
    certify_s: float

    @property
    def accepted(self) -> bool:
        """Was a motion over all cells accepted?"""
        return self.replayed is not None and self.replayed.accepted

    @property
    def margin(self) -> PlacementMargin | None:
        """That of the placement, where it is known."""
        return None if self.replayed is None else self.replayed.certificate.placement_margin

    @property
    def used(self) -> float:
        """The share of its margin that the task's error of the placement uses; inf without one."""
        error, margin = self.problem.task.placement_error, self.margin
        return np.inf if error is None or margin is None else margin.share(*error)

    @property
    def lacks_room(self) -> bool:
        """Is all but the margin of the placement met, which something else than bodies bounds?"""
        return self.margin is not None and self.margin.bound_by is not Bound.CLEARANCE

    @property
    def decided(self) -> bool:
        """Is there a motion that was accepted, or a proof?"""
        return self.accepted or self.found.proof is not None


def attempts_at(
    problem: Problem, search: Search, clock: Clock, method: Method
) -> tuple[list[Attempt], str]:
    """All attempts, that which counts first; and a remark on the shapes of the links, or "".

    Where nothing is decided and convex hulls of links kept the search from going on, or from
    beginning at the arm's start, the links are cut into convex pieces.
    """
    if search.method == "complete":
        begun = _with_clear_start(problem, clock)
        if begun is not problem:
            return _with_these_shapes(begun, search, clock, method), START_IN_PIECES
    tried = _with_these_shapes(problem, search, clock, method)
    if tried[0].decided or tried[0].lacks_room or not tried[0].found.hindered:
        return tried, ""
    finer = _in_pieces(problem, clock)
    if finer is None:
        return tried, ""
    more, total = _with_these_shapes(finer, search, clock, method), len(problem.cells)
    before, count = (int(some[0].found.covered.sum()) for some in (tried, more))
    if more[0].decided or count > before:
        return more + tried, IN_PIECES.format(before, total)
    return tried + more, "" if clock.out_of_time else NOT_IN_PIECES.format(count, total)


def _with_these_shapes(
    problem: Problem, search: Search, clock: Clock, method: Method
) -> list[Attempt]:
    """An attempt, and a second one with a narrower task where the first is narrowly refused."""
    first = _attempt(problem, search, clock, method)
    if first.replayed is None or not first.replayed.narrowly_refused:
        return [first]
    if first.margin is not None:
        return _with_room(first, search, clock, method)
    # The replay measures the deviation between its samples, and may find a little more.
    narrower = _attempt(problem.narrowed, search, clock, method)
    return [narrower, first] if narrower.accepted else [first, narrower]


def _with_room(first: Attempt, search: Search, clock: Clock, method: Method) -> list[Attempt]:
    """Attempts at a motion that leaves room for the task's error of the placement, best first."""
    tried = [first]
    for held in first.problem.with_room:
        found = _attempt(held, search, clock, method, first.problem)
        if found.accepted or found.used < tried[0].used:
            tried.insert(0, found)
        if found.accepted or clock.out_of_time:
            break
    return tried


def _attempt(
    problem: Problem, search: Search, clock: Clock, method: Method, asked: Problem | None = None
) -> Attempt:
    """Search, and have the motion certified, both within the time limit.

    Args:
        problem, search, clock, method: of the search.
        asked: what the motion is certified for, where that is another problem.
    """
    called = time.monotonic()
    replayed = None
    try:
        found = method(problem, search, clock)
    except OutOfTime:
        found = _nothing(problem, clock)
    if asked is not None:
        walk = found.motion
        found = replace(
            found, proof=None, replay=None if walk is None else partial(asked.replayed, walk)
        )
        problem = asked
    searched = time.monotonic()
    try:
        if found.replay is not None:
            with clock.enforced():
                replayed = found.replay()
    except OutOfTime:
        found = replace(found, unfinished=NOT_REPLAYED.format(clock.limit))
    search_s = searched - float(np.fmax(called, clock.loaded))
    return Attempt(problem, found, replayed, search_s, time.monotonic() - searched)


def _in_pieces(problem: Problem, clock: Clock) -> Problem | None:
    """The problem with links cut into pieces, where that differs and there is time for it."""
    try:
        with clock.enforced():
            return None if clock.out_of_time else problem.in_pieces
    except OutOfTime:
        return None


def _with_clear_start(problem: Problem, clock: Clock) -> Problem:
    """The problem, with links cut into pieces if only their hulls collide at the arm's start."""
    start = problem.robot.start
    if start is None or _is_clear(problem, start):
        return problem
    finer = _in_pieces(problem, clock)
    return problem if finer is None or not _is_clear(finer, start) else finer


def _is_clear(problem: Problem, q: NDArray[np.float64]) -> bool:
    """Are the convex bodies of the search as far apart at q (n,) as they have to be?"""
    from feasibility.collisions.kernels.clearance import segment_clear
    from feasibility.collisions.kernels.memory import collision_buffer

    bodies = problem.bodies
    if bodies is None:
        return True
    return bool(segment_clear(collision_buffer(bodies, problem.robot), q, q) > 0.0)


def _nothing(problem: Problem, clock: Clock) -> SearchResult:
    """What a search found whose time ran out before it began."""
    covered = np.zeros(len(problem.cells), dtype=bool)

    def make_graph() -> nx.Graph:
        from feasibility.cell_graph import cell_graph

        return cell_graph(problem.cells, covered)

    return SearchResult(
        covered=covered,
        components=(),
        start=None,
        n_edges=0,
        counts={"fk": 0},
        unfinished=NOT_BEGUN.format(clock.limit),
        make_graph=make_graph,
        make_causes=tuple,
    )
