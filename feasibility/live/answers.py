"""Answers for a page: a quick look while something is dragged, the certified verdict afterwards.

The certified answer is that of `check`, in its words. A quick look colours the cells and calls
nothing feasible. It is the beginning of the complete search: seeds over the middle, then over cells
that none has reached, spread along certified motions; then a few attempts to join the largest
parts. Replay, proofs and causes are left to the certified answer.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Mask
from feasibility.cases.case import Case, Setup
from feasibility.checking import check
from feasibility.clock import Clock, OutOfTime
from feasibility.collisions.asked_bodies import said_of
from feasibility.notices import compiling_notice
from feasibility.paper.greedy import greedy_search
from feasibility.problem import Problem
from feasibility.reports import verdict as report
from feasibility.reports.shortfalls import causes_listed
from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.motions.search_arrays import arrays_of
from feasibility.roadmap.rounds import evenly, improve
from feasibility.roadmap.search import seed_middle
from feasibility.roadmap.warmup import warm_up
from feasibility.search_settings import Search
from feasibility.targets.starting import start_cell
from feasibility.verdict import Verdict
from feasibility.viewer.playback import Playback, motion_of
from feasibility.viewer.threejs import Colour
from feasibility.viewer.treated_map import area_layers, margin_layers
from feasibility.viewer.verdict_scene import (
    MISSED,
    Layer,
    filled,
    layers,
    missed_groups,
    missed_layer,
    trail,
)

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
    tree = found.make_tree()
    return QuickAnswer(found.covered, None if tree is None else tree.nodes[found.start]["q"])


STEPS = 60  # looks at the clock, between which a search does 8,000 evaluations at most
STEPS_WITH_BODIES = 24  # the same where distances of bodies make an evaluation dearer
COVERED: Colour = (0.13, 0.60, 0.33)
PALE = 0.35  # [1] of white in the colours of what is not certified
DRAWN_ONCE = ("/surface/patch", "/surface/cell", "/cells")


class Superseded(Exception):
    """A newer question has come, or the page is gone: nobody waits for this answer."""


class Watch(Clock):
    """A clock that also ends a search after some steps, or when nobody waits for it any more."""

    def __init__(
        self,
        wanted: Callable[[], bool],
        said: Callable[[str], None],
        limit: float | None = None,
        steps: float = np.inf,
    ) -> None:
        """A clock that does not run yet.

        Args:
            wanted: does anybody wait for the answer?
            said: hears how far it is.
            limit: seconds, see `Clock`.
            steps: looks at the clock after which the search ends.
        """
        super().__init__(limit)
        self._wanted, self._said, self._left = wanted, said, steps

    def report(self, done: int, total: int | None, text: str) -> None:
        """Tell the page that waits."""
        cells = f"{done} of {total} cells" if total else f"{done} cells"
        self._said(f"{cells} so far; {text}")

    def tick(self, done: int, total: int | None, text: str, spent: int = 0) -> None:
        """Report, and stop where nobody waits or enough has been tried.

        Raises:
            OutOfTime: the steps are used up, or the deadline has passed.
            Superseded: nobody waits.
        """
        if not self._wanted():
            raise Superseded
        self._left -= 1
        if self._left < 0:
            raise OutOfTime
        super().tick(done, total, text, spent)

    @contextmanager
    def enforced(self) -> Generator[None]:
        """Nothing: the alarms that this is done with in commands belong to the main thread."""
        yield


@dataclass(frozen=True, eq=False, slots=True)
class Answer:
    """What a page shows."""

    kind: str
    """'quick', 'error', or the verdict's answer."""
    head: str
    state: str = ""
    """What kind of answer it is, in a few words."""
    paint: tuple[Layer, ...] = ()
    """The cells, by what became of them."""
    parts: tuple[Layer, ...] = ()
    """What only a certified answer has: graph, start, sides of a cut, treated area, the trail."""
    rows: tuple[tuple[str, str], ...] = ()
    causes: tuple[str, ...] = ()
    q: Array | None = None
    """(n,) where the arm is shown."""
    motion: Playback | None = None


def quick_look(setup: Setup, watch: Watch) -> Answer:
    """How much of the surface a short search reaches; neither certified nor complete."""
    robot, cells, task, search = setup
    covered, q = quick_search(Problem.of(robot, cells, task), search, watch)
    number, total = int(covered.sum()), len(cells)
    what = "cells" if not cells.in_order else "poses, in any order"
    groups = (("reached", COVERED, covered), ("not reached so far", MISSED, ~covered))
    paint = [
        filled(cells, np.flatnonzero(own), pale(colour), f"/cells/{k}", f"{name} ({own.sum()})")
        for k, (name, colour, own) in enumerate(groups)
        if own.any()
    ]
    head = f"quick look: one motion reaches {number:,} of {total:,} {what}"
    head += "" if number == total else " so far"
    note = (("collisions", said_of(robot, task.collision)),)
    return Answer("quick", head, "hold still for the certified answer", (*paint,), rows=note, q=q)


def steps_of(setup: Setup) -> int:
    """How long a quick look may take."""
    return STEPS if setup.task.collision is None else STEPS_WITH_BODIES


def certified(case: Case, setup: Setup, watch: Watch) -> Answer:
    """What `coverable check` says of the case, with the cells in the colours of their causes."""
    verdict = check(*setup, clock=watch)
    cells, motion = verdict.cells, motion_of(verdict)
    known = verdict.postures if verdict.witness is None else verdict.witness.q
    rows = [(name, text) for name, text in report.rows_of(verdict) if text]
    return Answer(
        kind=str(verdict.answer),
        head=report.as_text(verdict, case).splitlines()[0],
        state=f"certified · {verdict.n_covered} of {len(cells)} cells · "
        f"evidence: {verdict.evidence}",
        paint=tuple(_painted(verdict)),
        parts=tuple(_parts(verdict, motion)),
        rows=(*rows, ("collisions", said_of(verdict.robot, verdict.task.collision))),
        causes=tuple(causes_listed(verdict.causes, cells, hint="")),
        q=motion.walk[0] if motion else None if known is None or not len(known) else known[0],
        motion=motion,
    )


def _painted(verdict: Verdict) -> Iterator[Layer]:
    """The covered cells, and the missed ones in the colours of their causes."""
    cells, which = verdict.cells, np.flatnonzero(verdict.covered)
    if len(which):
        yield filled(cells, which, COVERED, "/cells/covered", f"covered ({len(which)})")
    for group in missed_groups(verdict.causes, np.flatnonzero(~verdict.covered)):
        yield missed_layer(cells, group)


def _parts(verdict: Verdict, motion: Playback | None) -> Iterator[Layer]:
    """What else is drawn of a verdict."""
    for part in layers(verdict):
        if part.entry.path is not None and not part.entry.path.startswith(DRAWN_ONCE):
            yield part
    if verdict.treated is not None:
        yield from area_layers(verdict.treated, verdict.cells.surface.side_sign)
    if motion is not None:
        yield trail(verdict.cells, motion)
    yield from margin_layers(verdict)


def pale(colour: Colour) -> Colour:
    """A colour mixed with white."""
    red, green, blue = (part + PALE * (1.0 - part) for part in colour)
    return red, green, blue
