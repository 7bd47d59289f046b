"""What would make a case feasible, and how much room a feasible one has left."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from feasibility.checking import check
from feasibility.quantities import Setup, quantities
from feasibility.search import Search
from feasibility.task import Task
from feasibility.thresholds import Finding, Threshold
from feasibility.verdict import Verdict
from robots import Robot
from surfaces import Cells

if TYPE_CHECKING:
    from feasibility.probing import Trial

SHARE = 27  # verdicts' worth of evaluations that all thresholds together may take
FEW, EACH = 2000, 32  # evaluations, and those for each cell, that any search should have
LEAST = 100_000  # evaluations that they may always take
GUESSES = 64  # configurations from which other covering motions may begin
POSTURES = 6  # of these, as far apart as can be
PATIENCE = 20.0  # times the time limit of the verdict

Progress = Callable[[int, int | None, str], None]


@dataclass(frozen=True, eq=False, slots=True)
class Dropped:
    """The cells without which one motion covers the rest: those that the best one misses."""

    cells: NDArray[np.int64]
    """(k,) flat indices."""
    area: float
    """m^2."""
    share: float
    """Of the whole area, 0..1."""
    waypoints: int | None
    """Of the motion that covers all others, which the replay accepted; None where there is none."""

    def __post_init__(self) -> None:
        """Copy and write-protect the cells."""
        cells = np.array(self.cells, dtype=np.int64)
        cells.flags.writeable = False
        object.__setattr__(self, "cells", cells)


@dataclass(frozen=True, eq=False, slots=True)
class Explanation:
    """The thresholds of a case; see `explain`."""

    verdict: Verdict
    thresholds: tuple[Threshold, ...]
    """One for each quantity that was looked at, in the order of `quantities`."""
    left_out: tuple[str, ...]
    """Names of the quantities that the time limit left no time for."""
    dropped: Dropped | None
    """None for a feasible case."""
    evaluations: int
    """Evaluations of the arm that the thresholds took, a box of a proof counting as one."""
    seconds: float
    """Time that they took."""


def explain(
    robot: Robot,
    cells: Cells,
    task: Task,
    search: Search | None = None,
    progress: Progress | None = None,
) -> Explanation:
    """Find what would make a case feasible, or by how much a feasible one may be tightened.

    One quantity is varied at a time: the cone, each limit of each joint, the standoff, the
    surface's place along six directions. Where the verdict turns, it is looked at on both sides;
    "feasible" is said only of a motion that the replay accepts.

    Args:
        robot: the arm, with its limits.
        cells: the surface, cut into cells.
        task: standoff, cone and tolerance.
        search: settings of the complete search. With a time limit for the verdict, everything
            after it takes at most `PATIENCE` times that.
        progress: called as progress(done, total, text); what it raises ends the work.

    Returns:
        The verdict of the case as it stands, and the thresholds.

    Raises:
        ValueError: the method is the greedy one, whose "no" does not depend on the case alone.
        RobotError: the arm is no serial chain of one-dof joints.
    """
    search = Search() if search is None else search
    if search.method != "complete":
        raise ValueError(
            f"explain asks the complete search: method must be 'complete', got {search.method!r}"
        )
    verdict = check(robot, cells, task, search)
    began = time.monotonic()
    if len(cells) == 0:
        return Explanation(verdict, (), (), None, 0, 0.0)
    from feasibility.probing import Prober, Trial
    from feasibility.turning import Turning

    setup = Setup(robot, cells, task)
    asked = quantities(setup, widen=not verdict.feasible)
    done = 0

    def tick() -> None:
        if progress is not None:
            progress(done, len(asked), "looking for thresholds")

    deadline = np.inf if search.time_limit is None else began + PATIENCE * search.time_limit
    prober = Prober(setup, search.seed, deadline, tick)
    # An early proof makes a verdict cheap, but the searches that follow are no cheaper for that.
    cost = max(int(verdict.statistics["fk"]), FEW + EACH * len(cells))
    total = max(SHARE * cost, LEAST)
    q = known_configurations(verdict)
    here = Finding(0.0, verdict.answer, verdict.evidence, verdict.message)
    angle = None if verdict.certificate is None else verdict.certificate.max_angle
    start = Trial(verdict.answer, verdict.evidence, verdict.message, q, verdict.witness, angle)
    dropped, motions = None, [start] if verdict.feasible else []
    if verdict.feasible:
        motions += prober.others(GUESSES, POSTURES)
    else:
        covered = verdict.covered
        rest = prober.attempt(prober.problem, q, 2 * cost, deep=False, needed=covered)
        dropped = drop(verdict, prober.confirmed(setup, rest, covered))
    thresholds: list[Threshold] = []
    for done, quantity in enumerate(asked):
        if time.monotonic() > deadline:
            break
        fair = (total - prober.spent) // (len(asked) - done)
        turning = Turning(prober, quantity, cost, prober.spent + fair, motions)
        if verdict.feasible:
            thresholds.append(turning.tighten())
        else:
            thresholds.append(turning.widen(replace(here, value=quantity.given), q))
    return Explanation(
        verdict=verdict,
        thresholds=tuple(thresholds),
        left_out=tuple(quantity.name for quantity in asked[len(thresholds) :]),
        dropped=dropped,
        evaluations=prober.spent,
        seconds=time.monotonic() - began,
    )


def known_configurations(verdict: Verdict) -> NDArray[np.float64]:
    """(N, n) a configuration over each cell that the best motion covers; NaN over the others."""
    q = np.full((len(verdict.cells), verdict.robot.n), np.nan)
    if verdict.witness is not None:
        at = np.flatnonzero(verdict.witness.cell >= 0)[::-1]
        q[verdict.witness.cell[at]] = verdict.witness.q[at]
        return q
    for cell, found in verdict.graph.nodes(data="q"):
        if found is not None:
            q[cell] = found
    return q


def drop(verdict: Verdict, rest: Trial) -> Dropped:
    """What the best motion misses; `rest` is a search for a motion over all others."""
    areas = verdict.cells.areas
    cells = np.flatnonzero(~verdict.covered)
    return Dropped(
        cells=cells,
        area=float(areas[cells].sum()),
        share=float(areas[cells].sum() / areas.sum()),
        waypoints=None if rest.walk is None else len(rest.walk.q),
    )
