"""What would make a case feasible, and how large the margins of a feasible one are.

Where no single change does, two are looked for. Wider limits, a wider cone and smaller clearances
only ever help. So they are all opened at once; if that is feasible, they are put back one after
another as long as it stays feasible, and what cannot be put back is needed. A shift of the surface,
which may do harm too, is tried in a few sizes, alone with the others opened, and with a second one.
"""

import itertools
import math
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from coverable.errors import ArgumentError
from feasibility.checking import check
from feasibility.clock import Clock, OutOfTime
from feasibility.demands.every_demand import check_requirements, refuse_start
from feasibility.demands.fast_motions import rate_figures
from feasibility.demands.treated_words import shortfall
from feasibility.division.plans import motion_over
from feasibility.search_settings import Progress, Search
from feasibility.sensitivity.probes import REMEDIES, Prober, Steps, last_true
from feasibility.sensitivity.quantities import Kind, Quantity, Variant, quantities
from feasibility.sensitivity.thresholds import Change, ChangePair, Dropped, Explanation, Threshold
from feasibility.task import Task
from feasibility.verdict import Evidence, Verdict
from robots.robot import Robot
from surfaces.cells import Cells

EFFORT, MOST = 2, 15_000  # of one verdict: times that of the case as given, but not above ...
FEW, EACH = 8_000, 20  # ... or so many evaluations, and for each cell, where that is more
NEAREST = 4  # changed cases whose motions are tried on the case as given
VERDICT_SHARE = 0.5  # of the time limit, at most, for the verdict of the case as given

SHIFTS = (0.2, 0.5, 1.0)  # [1] of the largest shift: sizes that are tried
LAST_PUT_BACK = (Kind.ROLL, Kind.CONE, Kind.CLEARANCE, Kind.TOOL_CLEARANCE)

NOT_EVEN = "not even without any collisions"  # of one object where all together are not in the way
AS_GIVEN = "checking the case as given"


def explain(
    robot: Robot,
    cells: Cells,
    task: Task,
    search: Search | None = None,
    progress: Progress | None = None,
    clock: Clock | None = None,
) -> Explanation:
    """Find what would make a case feasible, or by how much a feasible one may be tightened.

    One quantity is varied at a time: the cone, each limit of each joint, the standoff, the
    surface's place along six directions; where collisions are checked, also the clearances, and one
    object of the scene is left out at a time. On both sides of a threshold the verdict is given;
    "feasible" is said only of a motion that holds all that the case demands.

    Args:
        robot, cells, task: the case, as for `check`.
        search: settings of the complete search. The time limit is for everything; the verdict of
            the case as given gets half of it at most.
        progress: called as progress(done, total, text); what it raises ends the work.
        clock: of the command that this is a part of; its limit counts instead of the search's.

    Returns:
        The verdict of the case as given, and the thresholds; none where a covering motion is known
        that treats too little, which depends on the cells and hardly on these quantities.

    Raises:
        ArgumentError: the method is the greedy one, whose "no" does not depend on the case alone;
            or the arm has a start.
        RobotError: the arm is no serial chain of one-dof joints.

    Example:
        >>> from coverable import load_robot
        >>> from coverable import plane
        >>> patch = plane((0.4, 0.6), (-0.1, 0.1), position=(0, 0, 0.3), side="outside")
        >>> found = explain(load_robot("ur5"), patch.cells(2, 2), Task(standoff=0.02, cone_deg=30))
        >>> f"{np.degrees(found.thresholds[0].feasible.value):.1f}"
        '3.0'
    """
    search = Search() if search is None else search
    if search.method != "complete":
        raise ArgumentError(
            f"explain needs the complete search: method must be 'complete', got {search.method!r}"
        )
    clock = (Clock(search.time_limit) if clock is None else clock).start()
    reporting = progress and (lambda *_: progress(0, None, AS_GIVEN))
    first = clock.part(VERDICT_SHARE, reporting)
    refuse_start(robot, "but with other numbers it is not over the surface")
    check_requirements(robot, task, search)
    verdict = check(robot, cells, task, search, clock=first)
    if len(cells) == 0 or (verdict.treated is not None and shortfall(task, verdict.treated)):
        return Explanation(verdict, (), (), None, 0, 0.0)
    found = _explained(verdict, search, clock, progress)
    if not verdict.feasible and (seeded := _over_given(found, search, clock)) is not None:
        found = replace(_explained(seeded, search, clock, progress), alone=verdict)
    rates = None
    with suppress(OutOfTime), clock.enforced():
        rates = rate_figures(found.verdict, clock, more=task.speed is not None)
    return replace(found, rates=rates)


def _explained(
    verdict: Verdict, search: Search, clock: Clock, progress: Progress | None
) -> Explanation:
    """The thresholds of a case, as far as the time allows."""
    began, done = time.monotonic(), list[Threshold]()
    given = Variant(verdict.robot, verdict.cells, verdict.task)
    varied = quantities(given, widen=not verdict.feasible)

    def tick() -> None:
        if progress is not None:
            progress(len(done), len(varied), "looking for thresholds")

    most = min(EFFORT * int(verdict.statistics["fk"]), MOST)
    most = max(most, FEW + EACH * len(given.cells))
    most = most if search.evaluations is None else min(most, search.evaluations)
    limited = replace(search, evaluations=most, time_limit=None, early=True)
    prober = Prober(given, verdict, limited, clock, tick)
    dropped = pair = None
    with suppress(OutOfTime):
        if not verdict.covered.all():
            left, walk = ~verdict.covered, None
            if verdict.covered.any() and not given.cells.in_order:  # a toolpath is not run in part
                tick()
                again = Search(seed=verdict.seed)
                walk, _ = motion_over(*given, again, verdict.covered, clock.part(1.0))
            area = float(given.cells.areas[left].sum())
            share = area / float(given.cells.areas.sum())
            dropped = Dropped(np.flatnonzero(left), area, share, walk)
        for quantity in varied:
            bare = next((t for t in done if t.quantity.kind is Kind.WITHOUT), None)
            if quantity.obstacle and bare is not None and bare.feasible is None:
                done.append(replace(bare, quantity=quantity, tried=NOT_EVEN))
            else:
                done.append(prober.threshold(quantity))
        helpful = [t for t in done if t.feasible and t.quantity.kind is not Kind.WITHOUT]
        if not verdict.feasible and not helpful:
            pair = changes_together(prober, varied)
    left_out = tuple(quantity.name for quantity in varied[len(done) :])
    seconds = time.monotonic() - began
    return Explanation(verdict, tuple(done), left_out, dropped, prober.spent, seconds, pair)


def _over_given(found: Explanation, search: Search, clock: Clock) -> Verdict | None:
    """The case as given with a motion from those found near it; None where none leads to one.

    A search that was exhausted may have missed it.
    """
    verdict, near = found.verdict, sorted(found.thresholds, key=lambda t: t.effort)
    if verdict.evidence is Evidence.PROOF:
        return None
    given = Variant(verdict.robot, verdict.cells, verdict.task)
    for known in [t.feasible.witness for t in near if t.feasible is not None][:NEAREST]:
        if clock.out_of_time:
            return None
        again = check(*given, search, seeds=known, clock=clock.part(1.0))
        if again.feasible:
            return again
    return None


def changes_together(prober: Prober, varied: Sequence[Quantity]) -> ChangePair | None:
    """Two changes, each as small as it was found to do; None where none were found.

    Raises:
        OutOfTime: the deadline passed.
    """
    for steps in _sets(prober, varied):
        if len(steps) == 2:
            return _narrowed(prober, steps)
    return None


def _sets(prober: Prober, varied: Sequence[Quantity]) -> Iterator[Steps]:
    """Sets of changes that were found to be feasible, no member of which can be left out."""
    shifts = [q for q in varied if q.kind is Kind.SHIFT]
    # The cone is put back last: of two pairs the one with it needs fewer new joint limits.
    helpers = [q for q in varied if q.kind in (Kind.LOWER, Kind.UPPER)]
    helpers += [q for q in varied if q.kind in LAST_PUT_BACK]
    opened = tuple((quantity, quantity.last) for quantity in helpers)
    if prober.at(opened).walk:
        yield _needed(prober, opened, opened)
    for share in SHIFTS:
        moved = [(shift, max(1, round(share * shift.last))) for shift in shifts]
        for step in moved:
            if prober.at((step, *opened)).walk:
                yield _needed(prober, (step, *opened), opened)
        for one, other in itertools.combinations(moved, 2):
            opposite = one[0].axis == tuple(-x for x in other[0].axis)
            if not opposite and prober.at((one, other)).walk:
                yield one, other


def _needed(prober: Prober, steps: Steps, removable: Steps) -> Steps:
    """Those of some changes that are feasible together which cannot be left out."""
    needed = steps
    for step in removable:
        rest = tuple(other for other in needed if other is not step)
        if len(needed) < 2:
            break
        # A motion that uses all of them may lead to none with fewer, and a search alone to one.
        if prober.at(rest, prober.at(needed).walk).walk or prober.at(rest, judged=True).walk:
            needed = rest
    return needed


def _narrowed(prober: Prober, steps: Steps) -> ChangePair | None:
    """Both changes made as small as they were found to do, one after the other.

    None where `check` does not accept the motion, of the small ones nor of those given.
    """
    narrow = steps
    for quantity, k in steps:
        narrow = _smaller(prober, narrow, quantity, k)
    for found in (narrow, steps):
        walk = prober.at(found, prober.at(found).walk, judged=True).walk
        if walk is not None:
            changes = tuple(Change(quantity, quantity.value(k)) for quantity, k in found)
            return ChangePair(changes, walk)
    return None


def _smaller(prober: Prober, steps: Steps, quantity: Quantity, k: int) -> Steps:
    """The same with one of them as small as was found to do."""
    seeds = prober.at(steps).walk

    def changed(k: int) -> Steps:
        return tuple((other, k if other is quantity else j) for other, j in steps)

    def holds(k: int) -> bool:
        nonlocal seeds
        found = prober.at(changed(k), seeds)
        seeds = found.walk or seeds
        return found.walk is not None

    return changed(last_true(holds, k, 0, math.ceil(k / REMEDIES))[0])
