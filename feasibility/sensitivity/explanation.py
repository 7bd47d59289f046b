"""What would make a case feasible, and how much room a feasible one has left."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from coverable_errors import ArgumentError
from feasibility.checking import check
from feasibility.search import Progress, Search
from feasibility.sensitivity.parameters import Quantity, Setup, quantities
from feasibility.sensitivity.thresholds import Finding, Threshold
from feasibility.task import Task
from feasibility.verdict import Verdict
from robots import Robot
from surfaces import Cells

if TYPE_CHECKING:
    from feasibility.sensitivity.limited_search import Trial
    from feasibility.sensitivity.probes import Prober
    from feasibility.sensitivity.threshold_search import Turning

SHARE = 24  # verdicts' worth of evaluations that all thresholds together may take
FEW, EACH = 200, 20  # evaluations, and those for each cell, that any search should have
EXTRA = 3  # the same, for margins that are still wide once the others have had their share
LEAST = 20_000  # evaluations that they may always take
GUESSES = 64  # configurations from which other covering motions may begin
POSTURES = 6  # of these, as far apart as can be
PATIENCE = 20.0  # times the time limit of the verdict

AS_IS = "asking about the case as it stands"


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
        ArgumentError: the method is the greedy one, whose "no" does not depend on the case alone.
        RobotError: the arm is no serial chain of one-dof joints.

    Example:
        >>> from robots import load_robot
        >>> from surfaces import plane
        >>> patch = plane((0.4, 0.6), (-0.1, 0.1), position=(0, 0, 0.3), side="outside")
        >>> found = explain(load_robot("ur5"), patch.cells(2, 2), Task(standoff=0.02, cone_deg=30))
        >>> f"{np.degrees(found.thresholds[0].feasible.value):.1f}"
        '3.0'
    """
    search = Search() if search is None else search
    if search.method != "complete":
        raise ArgumentError(
            f"explain asks the complete search: method must be 'complete', got {search.method!r}"
        )

    verdict = check(robot, cells, task, search, progress and (lambda *_: progress(0, None, AS_IS)))
    began = time.monotonic()
    if len(cells) == 0:
        return Explanation(verdict, (), (), None, 0, 0.0)
    from feasibility.sensitivity.probes import Prober

    setup = Setup(robot, cells, task)
    asked = quantities(setup, widen=not verdict.feasible)
    done: list[Threshold] = []

    def tick() -> None:
        if progress is not None:
            progress(len(done), len(asked), "looking for thresholds")

    deadline = np.inf if search.time_limit is None else began + PATIENCE * search.time_limit
    prober = Prober(setup, search.seed, deadline, tick)
    q = known_configurations(verdict)
    dropped = None if verdict.feasible else drop(prober, verdict, q)
    motions = _motions(prober, verdict, q) if verdict.feasible else []
    turnings: list[Turning] = []
    for turning, threshold in _thresholds(prober, verdict, q, motions, asked):
        turnings.append(turning)
        done.append(threshold)  # one by one: `tick` counts them
    _refine(prober, verdict, turnings, done)
    left_out = tuple(quantity.name for quantity in asked[len(done) :])
    seconds = time.monotonic() - began
    return Explanation(verdict, tuple(done), left_out, dropped, prober.spent, seconds)


def cost_of(verdict: Verdict) -> int:
    """Evaluations of the arm that one verdict of the case is taken to cost.

    An early proof makes a verdict cheap; the searches that follow are no cheaper for that.
    """
    return max(int(verdict.statistics["fk"]), FEW + EACH * len(verdict.cells))


def _thresholds(
    prober: Prober,
    verdict: Verdict,
    q: NDArray[np.float64],
    motions: Sequence[Trial],
    asked: Sequence[Quantity],
) -> Iterator[tuple[Turning, Threshold]]:
    """The thresholds one by one, each with a fair share of what is left; until the deadline."""
    from feasibility.sensitivity.threshold_search import Turning

    cost = cost_of(verdict)
    total = max(SHARE * cost, LEAST)
    for index, quantity in enumerate(asked):
        if time.monotonic() > prober.deadline:
            return
        prober.tick()
        fair = (total - prober.spent) // (len(asked) - index)
        turning = Turning(prober, quantity, cost, prober.spent + fair, motions)
        if verdict.feasible:
            yield turning, turning.tighten()
        else:
            here = Finding(quantity.given, verdict.answer, verdict.evidence, verdict.message)
            yield turning, turning.widen(here, q)


def _motions(prober: Prober, verdict: Verdict, q: NDArray[np.float64]) -> list[Trial]:
    """The witness of a feasible case, and covering motions in other postures."""
    from feasibility.sensitivity.limited_search import Trial

    angle = None if verdict.certificate is None else verdict.certificate.max_angle
    start = Trial(verdict.answer, verdict.evidence, verdict.message, q, verdict.witness, angle)
    if time.monotonic() > prober.deadline:
        return [start]
    return [start, *prober.others(GUESSES, POSTURES)]


def _refine(
    prober: Prober, verdict: Verdict, turnings: Sequence[Turning], found: list[Threshold]
) -> None:
    """Spend what others left over on margins whose sides are still far apart, in place."""
    from feasibility.sensitivity.threshold_search import BEYOND

    cost = cost_of(verdict)
    most = (SHARE + EXTRA) * cost
    wide = [k for k, t in enumerate(found) if verdict.feasible and t.steps_apart > max(BEYOND)]
    for done, k in enumerate(sorted(wide, key=lambda k: -found[k].steps_apart)):
        left = most - prober.spent
        if left < EXTRA * cost or time.monotonic() > prober.deadline:
            return
        turnings[k].stop = prober.spent + left // (len(wide) - done)
        found[k] = turnings[k].tighter(found[k])


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


def drop(prober: Prober, verdict: Verdict, q: NDArray[np.float64]) -> Dropped:
    """What the best motion misses, and whether one motion covers all the rest."""
    covered, areas = verdict.covered, verdict.cells.areas
    most = 2 * cost_of(verdict)
    rest = prober.attempt(prober.problem, q, most, deep=False, needed=covered)
    rest = prober.confirmed(prober.setup, rest, covered)
    cells = np.flatnonzero(~covered)
    return Dropped(
        cells=cells,
        area=float(areas[cells].sum()),
        share=float(areas[cells].sum() / areas.sum()),
        waypoints=None if rest.walk is None else len(rest.walk.q),
    )
