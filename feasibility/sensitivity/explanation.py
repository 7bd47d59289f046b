"""What would make a case feasible, and how large the margins of a feasible one are."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from coverable_arrays import Array
from coverable_errors import ArgumentError
from feasibility.checking import check
from feasibility.clock import Clock, OutOfTime
from feasibility.demands import refuse_start
from feasibility.division import divide
from feasibility.roadmap import HERE, Exploration, margin_shares, place
from feasibility.search import Progress, Search
from feasibility.sensitivity.far_sides import settle
from feasibility.sensitivity.limited_search import (
    LimitedAttempt,
    attempt_of,
    held,
    known_configurations,
)
from feasibility.sensitivity.pairs import PairSearch
from feasibility.sensitivity.probes import Prober
from feasibility.sensitivity.quantities import Kind, Quantity, Variant, quantities
from feasibility.sensitivity.threshold_search import BEYOND, ThresholdSearch
from feasibility.sensitivity.thresholds import Dropped, Explanation, Finding, Threshold
from feasibility.speed import check_requirements, rate_figures
from feasibility.task import Task
from feasibility.treated import shortfall
from feasibility.verdict import Evidence, Verdict, Walk
from robots import Robot
from surfaces import Cells

SHARE = 24  # verdicts' worth of evaluations that all thresholds together may take
FEW, EACH = 200, 20  # evaluations, and those for each cell, that any search should have
EXTRA = 3  # the same, for margins that are still wide once the others have had their share
ALL_IN_ALL = 35  # verdicts of the case itself: all, with what `check` alone finds at thresholds
LEAST = 20_000  # evaluations that they may always take
PAIRS = 24  # verdicts' worth of evaluations that the search for two changes may take
CHECKED = 0.75  # [1] of that, spent at most before `check` itself looks at a threshold
GUESSES = 64  # configurations from which other covering motions may begin
POSTURES = 6  # of these, as far apart as can be
SAME = 0.05  # [1], postures nearer than that are taken for one, see `_posture`
NEAREST = 4  # changed cases whose motions are tried on the case as given
VERDICT_SHARE = 0.5  # of the time limit, at most, for the verdict of the case as given

NOT_EVEN = "not even without any collisions"
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
        robot: the arm, with its limits.
        cells: the surface, cut into cells.
        task: standoff, cone and tolerance.
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
            f"explain needs the complete search: method must be 'complete', got {search.method!r}"
        )

    clock = (Clock(search.time_limit) if clock is None else clock).start()
    reporting = progress and (lambda *_: progress(0, None, AS_GIVEN))
    first = clock.part(VERDICT_SHARE, reporting)
    refuse_start(robot, "but with other numbers it is not over the surface")
    check_requirements(robot, task, search)
    verdict = check(robot, cells, task, search, clock=first)
    began = time.monotonic()
    if len(cells) == 0 or (verdict.treated is not None and shortfall(task, verdict.treated)):
        return Explanation(verdict, (), (), None, 0, 0.0)
    found, motion = _explained(verdict, began, clock, progress)
    if motion is not None:
        seeded = check(robot, cells, task, search, seeds=motion, clock=clock.part(1.0))
        if seeded.feasible:
            again, _ = _explained(seeded, began, clock, progress)
            evaluations = found.evaluations + again.evaluations
            found = replace(again, alone=verdict, evaluations=evaluations)
    rates = None
    with suppress(OutOfTime), clock.enforced():
        rates = rate_figures(found.verdict, clock, more=task.speed is not None)
    return replace(found, rates=rates)


def _explained(
    verdict: Verdict, began: float, clock: Clock, progress: Progress | None
) -> tuple[Explanation, Walk | None]:
    """The thresholds of a case, and a motion over it as given that was found on the way."""
    variant = Variant(verdict.robot, verdict.cells, verdict.task)
    varied = quantities(variant, widen=not verdict.feasible)
    done: list[Threshold] = []

    def tick() -> None:
        if progress is not None:
            progress(len(done), len(varied), "looking for thresholds")

    try:
        with clock.enforced():
            prober = Prober(variant, verdict.seed, clock, tick)
            q = known_configurations(verdict)
    except OutOfTime:
        names = tuple(quantity.name for quantity in varied)
        return Explanation(verdict, (), names, None, 0, time.monotonic() - began), None
    dropped = None if verdict.covered.all() else drop(prober, verdict, q)
    motions = _motions(prober, verdict, q) if verdict.feasible else []
    searches: list[ThresholdSearch] = []
    for made, threshold in _thresholds(prober, verdict, q, motions, varied):
        searches.append(made)
        done.append(threshold)  # one by one: `tick` counts them
    _refine(prober, verdict, searches, done)
    asked = settle(prober, verdict, cost_of(verdict), searches, done)
    motion = None if verdict.feasible else _over_given(prober, verdict, searches)
    if motion is None:
        most = max(ALL_IN_ALL * float(verdict.statistics["fk"]), 2.0 * LEAST)
        stops = asked + CHECKED * most, asked + most
        done = [_alone(made, found, *stops) for made, found in zip(searches, done, strict=True)]
    left_out = tuple(quantity.name for quantity in varied[len(done) :])
    pair, spent = None, prober.spent
    helped = any(t.feasible for t in done if t.quantity.kind is not Kind.WITHOUT)
    if not verdict.feasible and motion is None and not helped:
        cost = cost_of(verdict)
        most = max(PAIRS * cost, LEAST)
        pairs = PairSearch(variant, verdict, q, cost, most, clock, tick)
        pair, spent = pairs.find(varied), spent + pairs.spent
    seconds = time.monotonic() - began
    found = Explanation(verdict, tuple(done), left_out, dropped, spent, seconds, pair)
    return found, motion


def _alone(made: ThresholdSearch, found: Threshold, checks: float, searches: float) -> Threshold:
    """The same threshold; its feasible side says whether `check` alone finds it, if known.

    What a short search misses, `check` itself looks for; neither is begun once the prober has spent
    so many evaluations.
    """
    found, prober = made.alone(found, searches), made.prober
    if found.feasible is None or found.feasible.unaided is not False or made.good is None:
        return found
    left, unaided = prober.clock.left, None
    if prober.spent < checks and left > 0.0:
        limit = left if np.isfinite(left) else None
        variant = made.quantity.applied(prober.given, made.good.k)
        verdict = check(*variant, Search(seed=prober.seed, time_limit=limit))
        prober.spent_before += int(verdict.statistics["fk"])
        unaided = verdict.feasible
    return replace(found, feasible=replace(found.feasible, unaided=unaided))


def _over_given(
    prober: Prober, verdict: Verdict, searches: Sequence[ThresholdSearch]
) -> Walk | None:
    """A motion over the case as given, from those found near it; None where there is none.

    A search that was exhausted may have missed it.
    """
    if verdict.evidence is Evidence.PROOF:
        return None
    good = sorted((made.good for made in searches if made.good is not None), key=lambda g: g.k)
    for probe in good:  # limits that were widened need not be used
        attempt = prober.confirmed(prober.given, replace(probe.attempt, angle=None))
        if attempt.walk is not None:
            return attempt.walk
    for probe in good[:NEAREST]:
        attempt = prober.attempt(prober.arrays, probe.attempt.q, cost_of(verdict), deep=True)
        attempt = prober.confirmed(prober.given, attempt)
        if attempt.walk is not None:
            return attempt.walk
    return None


def cost_of(verdict: Verdict) -> int:
    """Evaluations of the arm that one verdict of the case is taken to cost.

    An early proof makes a verdict cheap; the searches that follow are no cheaper for that.
    """
    return max(int(verdict.statistics["fk"]), FEW + EACH * len(verdict.cells))


def _thresholds(
    prober: Prober,
    verdict: Verdict,
    q: Array,
    motions: Sequence[LimitedAttempt],
    varied: Sequence[Quantity],
) -> Iterator[tuple[ThresholdSearch, Threshold]]:
    """The thresholds one by one, each with a fair share of what is left; until the deadline."""
    cost = cost_of(verdict)
    total = max(SHARE * cost, LEAST)
    bare: Threshold | None = None  # the case without collisions
    for index, quantity in enumerate(varied):
        if prober.clock.out_of_time:
            return
        prober.tick()
        fair = (total - prober.spent) // (len(varied) - index)
        made = ThresholdSearch(prober, quantity, cost, prober.spent + fair, motions)
        if verdict.feasible:
            yield made, made.tighten()
            continue
        if quantity.obstacle and bare is not None and bare.feasible is None:
            yield made, replace(bare, quantity=quantity, tried=NOT_EVEN)
            continue
        here = Finding(quantity.given, verdict.answer, verdict.evidence, verdict.message)
        found = made.widen(here, q)
        if quantity.kind is Kind.WITHOUT and not quantity.obstacle:
            bare = found
        yield made, found


def _motions(prober: Prober, verdict: Verdict, q: Array) -> list[LimitedAttempt]:
    """The witness of a feasible case, and covering motions in other postures."""
    start = attempt_of(verdict)
    if prober.clock.out_of_time:
        return [start]
    return [start, *other_motions(prober, GUESSES, POSTURES)]


def other_motions(prober: Prober, guesses: int, most: int) -> list[LimitedAttempt]:
    """Covering motions of the case as given, from up to `most` postures far from each other.

    They are chosen among random `guesses` that are projected onto a cell in the middle.
    """
    robot, cells, _ = prober.given
    exploration = Exploration(robot, cells, prober.arrays, prober.seed + 1)
    tried = exploration.guesses(guesses)
    margins = margin_shares(prober.arrays, prober.work, cells.middle, tried)
    order = np.argsort(-margins, kind="stable")
    found = []
    tried = tried[order[margins[order] >= 0.0]]
    for k in apart(np.array([_posture(prober, q) for q in tried]), most):
        seeds = np.full((len(cells), robot.n), np.nan)
        seeds[cells.middle] = tried[k]
        attempt = prober.attempt(prober.arrays, seeds, np.inf, deep=False)
        found.append(held(prober.given, attempt))
    return [attempt for attempt in found if attempt.found]


def _posture(prober: Prober, q: Array) -> Array:
    """(7 n,) numbers that differ where postures do: where the joints are, most of all.

    Joint values alone say little: wrists turned by half turns change them much.
    """
    place(prober.arrays, prober.work, HERE, q)
    origins, axes = prober.work.origins[0] / prober.arrays.scale, prober.work.axes[0]
    return np.concatenate([origins.ravel(), 0.1 * axes.ravel(), 0.02 * q])


def apart(features: Array, most: int, first: int = 0, same: float = SAME) -> list[int]:
    """Rows of (k, m) features, each as far as can be from those chosen before it; up to `most`.

    Rows nearer than `same` to a chosen one are left out.
    """
    chosen = [first] if len(features) else []
    while chosen and len(chosen) < min(most, len(features)):
        away = np.linalg.norm(features[:, None] - features[chosen], axis=2).min(axis=1)
        if away.max() < same:
            break
        chosen.append(int(away.argmax()))
    return chosen


def _refine(
    prober: Prober, verdict: Verdict, searches: Sequence[ThresholdSearch], found: list[Threshold]
) -> None:
    """Spend what others left over on margins whose sides are still far apart, in place."""
    cost = cost_of(verdict)
    most = (SHARE + EXTRA) * cost
    wide = [k for k, t in enumerate(found) if verdict.feasible and t.steps_apart > max(BEYOND)]
    for done, k in enumerate(sorted(wide, key=lambda k: -found[k].steps_apart)):
        left = most - prober.spent
        if left < EXTRA * cost or prober.clock.out_of_time:
            return
        searches[k].stop = prober.spent + left // (len(wide) - done)
        found[k] = searches[k].tighter(found[k])


def drop(prober: Prober, verdict: Verdict, q: Array) -> Dropped:
    """What the best motion misses, and one motion over all the rest, if that can be certified.

    Where a short search for it fails, the largest patch of a division has a motion of its own.
    """
    covered = verdict.covered
    rest = prober.attempt(prober.arrays, q, 2 * cost_of(verdict), deep=False, needed=covered)
    walk = prober.confirmed(prober.given, rest, covered).walk
    divisible = covered.any() and not verdict.cells.in_order  # a toolpath is not divided
    if walk is None and divisible and not prober.clock.out_of_time:
        patches = []
        with suppress(OutOfTime):
            division = divide(
                *prober.given, Search(seed=verdict.seed), clock=prober.clock.part(1.0)
            )
            patches = [patch for patch in division.patches if patch.accepted]
        if patches:
            largest = max(patches, key=lambda patch: patch.area)
            walk, covered = largest.walk, np.zeros(len(covered), dtype=bool)
            covered[largest.cells] = True
    cells, areas = np.flatnonzero(~covered), verdict.cells.areas
    return Dropped(
        cells=cells,
        area=float(areas[cells].sum()),
        share=float(areas[cells].sum() / areas.sum()),
        waypoints=None if walk is None else len(walk.q),
        witness=walk,
    )
