"""How a surface is divided: `divide` collects components, shares the cells out, and walks them."""

import time
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from coverable.arrays import Ints
from coverable.errors import ArgumentError, counted
from feasibility.clock import Clock, OutOfTime
from feasibility.collisions.problem_bodies import Pair
from feasibility.demands.every_demand import OF_EACH, further, unjudged
from feasibility.demands.fast_motions import keep_fast_motions
from feasibility.demands.requirements import check_requirements, required_words
from feasibility.division.division import Division, Plan
from feasibility.division.plans import collect_components, plan_of
from feasibility.division.proved_bound import ProvedBound, prove_apart
from feasibility.notices import compiling_notice
from feasibility.problem import Problem
from feasibility.roadmap.causes.diagnosis import cause_of, causes_of, diagnose
from feasibility.roadmap.causes.disconnection import disconnected
from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.motions.search_arrays import SearchArrays, within
from feasibility.roadmap.proofs.ruling import Ruling
from feasibility.roadmap.refinement import COARSE, refine
from feasibility.roadmap.rounds import explore
from feasibility.roadmap.search import exploration_of
from feasibility.roadmap.warmup import warm_up
from feasibility.search_settings import Progress, Search
from feasibility.targets.blocked import blocked_curves
from feasibility.task import Task
from feasibility.verdict import Cause
from robots.robot import Robot
from surfaces.cells import Cells

NOT_GREEDY = (
    "a division needs search.method 'complete', got {!r}: the greedy search keeps one tree of "
    "motions, not all components"
)
NOT_IN_ORDER = (
    "a toolpath is run in its order and not divided into patches; to divide its poses, give them a "
    "radius as neighbours"
)
LATE = " Patches were not planned and replayed: the time limit ran out first."
MOST_EXPLAINED = 400  # proved cells that are explained although the search did not end


def divide(
    robot: Robot,
    cells: Cells,
    task: Task,
    search: Search | None = None,
    progress: Progress | None = None,
    clock: Clock | None = None,
) -> Division:
    """Divide a surface into the fewest patches that one continuous motion each covers.

    Every cell that some motion covers is in exactly one patch; the others are left out, each with
    its cause. "Fewest" is proved for the components that the search found; that there are no
    larger ones is as certain as the search is exhaustive. At a speed, or a distance from
    singularities, only motions of the search count that hold it.

    Args:
        robot, cells, task: the question, as for `check`.
        search: settings of the complete search; where its time limit strikes, the patches are the
            fewest known.
        progress: called as progress(done, total, text) some times a second.
        clock: of the command that this is a part of: its limit and its progress callback count, not
            those given here.

    Raises:
        OutOfTime: a command's time ran out before the search began.
        ArgumentError: the search is the greedy one, which keeps a single tree of motions; or the
            cells are a toolpath; or the task has a speed that this arm cannot have.
        RobotError: the arm is no serial chain of one-dof joints.

    Example:
        >>> from coverable import load_robot
        >>> from coverable import plane
        >>> patch = plane((0.4, 0.6), (-0.1, 0.1), position=(0, 0, 0.3), side="outside")
        >>> division = divide(load_robot("ur5"), patch.cells(3, 3), Task(0.02, cone_deg=30))
        >>> len(division.patches), division.optimal, division.whole
        (1, True, True)
    """
    search = Search() if search is None else search
    _refuse_others(robot, cells, task, search)
    called = time.monotonic()
    with compiling_notice():
        warm_up()
    clock = (Clock(search.time_limit, progress) if clock is None else clock).start()
    clock.allow(search.evaluations)
    began = time.monotonic()
    exploration, apart, ended, slow = _searched(robot, cells, task, search.seed, clock)
    searched = time.monotonic()
    folded = bool(np.isinf(exploration.arrays.derivative_bounds).any())
    blocked = blocked_curves(cells, task) if len(cells) and _no_motion(exploration.arrays) else ""
    shared = _shared(exploration, task, clock, blocked, ended, slow)
    plan, ended = shared.plan, ended and not shared.late
    found = _message(shared, task, apart.number, len(cells), ended, folded)
    return Division(
        robot=robot,
        cells=cells,
        task=task,
        seed=search.seed,
        plan=plan,
        left_out=shared.causes,
        unsettled=np.setdiff1d(shared.missing, [cause.cell for cause in shared.causes]),
        ended=ended and not blocked and not folded,
        message=blocked or found,
        at_least=min(apart.number, len(plan.patches)),
        proof=apart.proof if plan.patches else None,
        apart=apart.apart if plan.patches else (),
        lacking=shared.lacking,
        timing=_timing(called, began, searched),
        statistics=_statistics(exploration),
    )


class _Shared(NamedTuple):
    """The cells shared out among patches."""

    plan: Plan
    missing: Ints
    """Cells in no patch."""
    causes: tuple[Cause, ...]
    late: bool
    """Did a command's time run out meanwhile?"""
    lacking: str = ""
    """See `Division.lacking`."""


def _refuse_others(robot: Robot, cells: Cells, task: Task, search: Search) -> None:
    """Refuse the greedy search, toolpaths, and speeds that this arm cannot have.

    Raises:
        ArgumentError: it is one of them.
    """
    if search.method != "complete":
        raise ArgumentError(NOT_GREEDY.format(search.method))
    if cells.in_order:
        raise ArgumentError(NOT_IN_ORDER)
    check_requirements(robot, task, search)


def _shared(
    exploration: Exploration,
    task: Task,
    clock: Clock,
    blocked: str,
    ended: bool,
    slow: dict[int, Cause],
) -> _Shared:
    """A plan for what the search found, and why cells are in none, as far as there is time."""
    total = len(exploration.cells)
    shared = _Shared(Plan((), (), 0), np.arange(total), (), False)
    try:
        with clock.enforced():
            if not blocked:
                plan = plan_of(exploration, task, clock.left)
                missing = np.flatnonzero(plan.patch_of(total) < 0)
                shared = shared._replace(plan=plan, missing=missing)
                shared = shared._replace(plan=_with_room(exploration, task, clock, plan))
            causes = _causes(exploration, task, shared.missing, ended, slow)
            return shared._replace(causes=causes, lacking=_lacking(exploration, task, shared))
    except OutOfTime:
        return shared._replace(late=True)


def _with_room(exploration: Exploration, task: Task, clock: Clock, plan: Plan) -> Plan:
    """A plan for the same cells whose motions leave room for the error of the placement.

    Where none is found, or none is needed, it is the plan that is known.

    Raises:
        OutOfTime: the deadline passed.
    """
    robot, cells = exploration.robot, exploration.cells
    if plan.accepted or task.placement_error is None:
        return plan
    covered = plan.patch_of(len(cells)) >= 0
    for held in Problem.of(robot, cells, task).with_room:
        found = exploration_of(held.robot, cells, held.searched, exploration.seed, clock)
        _explore(found, held.searched)
        if task.requires_rates:
            keep_fast_motions(found, task)
        other = plan_of(found, task, clock.left, exploration)
        if other.accepted and (other.patch_of(len(cells)) >= 0)[covered].all():
            return replace(other, bound=plan.bound)
    return plan


def _lacking(exploration: Exploration, task: Task, shared: _Shared) -> str:
    """What the case demands that the motions do not hold together; see `Division`."""
    robot, cells = exploration.robot, exploration.cells
    left = unjudged(robot, task, OF_EACH)
    if not left or not len(cells):
        return ""
    if len(shared.missing) or not shared.plan.accepted:
        return f"not judged, since not every cell is in a patch: {', '.join(left)}"
    walks = [patch.walk for patch in shared.plan.patches]
    return further(robot, cells, task, walks, OF_EACH).refusal


def _timing(called: float, began: float, searched: float) -> dict[str, float]:
    """Seconds by phase."""
    now = time.monotonic()
    return {
        "load_s": began - called,
        "search_s": searched - began,
        "divide_s": now - searched,
        "total_s": now - called,
    }


def _statistics(exploration: Exploration) -> dict[str, int]:
    """Counts of the work done."""
    return {
        "fk": int(exploration.work.counts[0]),
        "nodes": len(exploration.roadmap.cell),
        "components": len(exploration.roots()),
        "boxes": exploration.boxes,
        "rounds": exploration.rounds,
    }


def _explore(exploration: Exploration, task: Task) -> None:
    """Search for components of motions; in finer cells, too, or `check` would know larger ones."""
    explore(exploration)
    refine(exploration, task, COARSE)
    collect_components(exploration)


class _Searched(NamedTuple):
    """What a search found."""

    exploration: Exploration
    apart: ProvedBound
    ended: bool
    """Did it run to its end?"""
    slow: dict[int, Cause]
    """Cells that no motion leads to at the required speed or distance from singularities."""


def _searched(robot: Robot, cells: Cells, task: Task, seed: int, clock: Clock) -> _Searched:
    """The search with all components that it found, and a bound."""
    exploration = exploration_of(robot, cells, task, seed, clock)
    ended, apart = True, ProvedBound(min(1, len(cells)))
    try:
        _explore(exploration, task)
        if not _no_motion(exploration.arrays):
            apart = prove_apart(exploration, task)
    except OutOfTime:
        ended = False
    slow = keep_fast_motions(exploration, task) if task.requires_rates else {}
    exploration.clock = Clock()
    return _Searched(exploration, apart, ended, slow)


def _causes(
    exploration: Exploration,
    task: Task,
    missing: Ints,
    ended: bool,
    slow: dict[int, Cause],
) -> tuple[Cause, ...]:
    """Why cells are in no patch; of a search that did not end, only what is proved or too slow."""
    if not ended:
        proved = [c for c in missing.tolist() if exploration.rulings.get(c) is Ruling.PROVED]
        found = [diagnose(exploration, cell) for cell in proved[:MOST_EXPLAINED]]
        return tuple(sorted([*found, *slow.values()], key=lambda cause: cause.cell))
    pairs = Problem.of(exploration.robot, exploration.cells, task).pairs
    known = {cause.cell: cause for cause in causes_of(exploration, None, pairs)}
    return tuple(
        slow.get(c) or known.get(c) or _cause(exploration, c, pairs) for c in missing.tolist()
    )


def _cause(exploration: Exploration, cell: int, pairs: tuple[Pair, ...]) -> Cause:
    """Why a cell that the best motion covers is in no patch all the same."""
    if exploration.reached[cell]:
        return disconnected(exploration, cell, None, pairs)
    return cause_of(exploration, cell, pairs)


def _no_motion(arrays: SearchArrays) -> bool:
    """Can no motion at all be certified?"""
    folds = np.isinf(arrays.derivative_bounds).any(axis=1)
    rough = ~within(arrays)
    nowhere = any(np.size(places) > 0 and np.all(places) for places in (folds, rough))
    return nowhere or not arrays.cone_chord > 0.0


def _message(
    shared: _Shared, task: Task, at_least: int, cells: int, ended: bool, folded: bool
) -> str:
    """One or two sentences: what was found, and on what it rests."""
    plan, total = shared.plan, (cells - len(shared.missing), cells)
    refused = [patch.refusal for patch in plan.patches if not patch.accepted]
    if refused:
        return (
            f"{len(refused)} patch{'es have' if len(refused) > 1 else ' has'} a walk that the "
            f"independent replay refuses: {refused[0]}."
        )
    number, how = len(plan.patches), f" {required_words(task)}" * task.requires_rates
    if total[1] == 0:
        return "There are no cells to cover."
    if number == 0:
        return (
            (
                f"No motion was found that covers any cell{how}."
                if how
                else "No motion covers any cell."
            )
            if ended
            else "The time limit ran out before any patch was found." + LATE * shared.late
        )
    what = counted(number, "continuous motion")
    proof = f"; at least {at_least}, proved" if min(number, at_least) > 1 else ""
    if plan.bound > max(at_least, 1):
        proof += f"; at least {plan.bound} among the motions found"
    sentence = (
        f"{what} cover{'' if number > 1 else 's'} {total[0]} of {total[1]} cells{how}{proof}."
    )
    blocked = [k for k, move in enumerate(plan.moves, start=1) if move.refusal]
    if blocked:
        named = ", ".join(f"{k} to {k + 1}" for k in blocked)
        sentence += f" No move clear of collisions was found from patch {named}."
    if folded:
        sentence += (
            " Where the standoff reaches the surface's radius of curvature its offset folds and no "
            "motion can be certified: these are the fewest known."
        )
    if shared.lacking:
        sentence += f" But {shared.lacking}"
    if not ended:
        sentence += " The time limit ran out: these are the fewest known."
    return sentence
