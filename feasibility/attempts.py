"""Attempts at an answer: a search, and the replay of its motion, within the time limit."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from feasibility.clock import Clock, OutOfTime
from feasibility.found import Found
from feasibility.problem import Problem
from feasibility.search import Search
from feasibility.verdict import Replay

if TYPE_CHECKING:
    import networkx as nx

NOT_BEGUN = "The time limit of {:g} s ran out while the search was prepared; nothing was searched."
NOT_REPLAYED = (
    "A motion over every cell was found, but the time limit of {:g} s ran out before the "
    "independent replay had judged it."
)

Method = Callable[[Problem, Search, Clock], Found]


class Attempt(NamedTuple):
    """One search, and the replay of the motion that it found."""

    found: Found
    replayed: Replay | None
    search_s: float
    certify_s: float

    @property
    def accepted(self) -> bool:
        """Was a motion over all cells accepted?"""
        return self.replayed is not None and self.replayed.accepted

    @property
    def decided(self) -> bool:
        """Is there a motion that was accepted, or a proof?"""
        return self.accepted or self.found.proof is not None

    @property
    def blocked(self) -> bool:
        """Is nothing decided, and were convex bodies of the arm in the way?"""
        return not self.decided and self.found.hindered


def attempts_at(problem: Problem, search: Search, clock: Clock, method: Method) -> list[Attempt]:
    """The attempt that counts, and then others that were made."""
    first = _attempt(problem, search, clock, method)
    if first.replayed is None or not first.replayed.narrowly_refused:
        return [first]
    # The replay measures the deviation between its samples, and may find a little more.
    narrower = _attempt(problem.narrowed, search, clock, method)
    return [narrower, first] if narrower.accepted else [first, narrower]


def _attempt(problem: Problem, search: Search, clock: Clock, method: Method) -> Attempt:
    """Search, and have the motion certified, both within the time limit."""
    called = time.monotonic()
    replayed = None
    try:
        found = method(problem, search, clock)
    except OutOfTime:
        found = _nothing(problem, clock)
    searched = time.monotonic()
    try:
        if found.replay is not None:
            with clock.enforced():
                replayed = found.replay()
    except OutOfTime:
        found = replace(found, unfinished=NOT_REPLAYED.format(clock.limit))
    search_s = searched - float(np.fmax(called, clock.loaded))
    return Attempt(found, replayed, search_s, time.monotonic() - searched)


def with_pieces(problem: Problem, clock: Clock) -> Problem | None:
    """The problem with links cut into pieces, where that differs and there is time for it."""
    try:
        with clock.enforced():
            return None if clock.out_of_time else problem.in_pieces
    except OutOfTime:
        return None


def _nothing(problem: Problem, clock: Clock) -> Found:
    """What a search found whose time ran out before it began."""
    covered = np.zeros(len(problem.cells), dtype=bool)

    def make_graph() -> nx.Graph:
        from feasibility.cell_graph import cell_graph

        return cell_graph(problem.cells, covered)

    return Found(
        covered=covered,
        components=(),
        start=None,
        n_edges=0,
        counts={"fk": 0},
        unfinished=NOT_BEGUN.format(clock.limit),
        make_graph=make_graph,
        make_causes=tuple,
    )
