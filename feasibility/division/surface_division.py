"""How a surface is divided: `divide` collects components, shares the cells out, and walks them."""

import time
from dataclasses import dataclass, field, replace

import numpy as np

from coverable.arrays import Ints
from coverable.errors import ArgumentError, counted
from feasibility.clock import Clock, OutOfTime
from feasibility.demands.every_demand import (
    OF_EACH,
    check_requirements,
    further,
    required_words,
    unjudged,
)
from feasibility.demands.fast_motions import keep_fast_motions
from feasibility.division.division import Division, Plan
from feasibility.division.plans import collect_components, plan_of
from feasibility.division.proved_bound import ProvedBound, prove_apart
from feasibility.notices import compiling_notice
from feasibility.problem import Problem
from feasibility.roadmap.causes.diagnosis import causes_of, diagnose
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
        robot, cells, task, progress, clock: as for `check`.
        search: settings of the complete search; where its time limit strikes, the patches are the
            fewest known.

    Raises:
        OutOfTime: a command's time ran out before the search began.
        ArgumentError: the search is the greedy one; or the cells are a toolpath; or the task has a
            speed that this arm cannot have.
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
    if search.method != "complete":
        raise ArgumentError(
            f"a division needs search.method 'complete', got {search.method!r}: the greedy search "
            "keeps one tree of motions, not all components"
        )
    if cells.in_order:
        raise ArgumentError(
            "a toolpath is run in its order and not divided into patches; to divide its poses, "
            "give them a radius as neighbours"
        )
    check_requirements(robot, task, search)
    called = time.monotonic()
    with compiling_notice():
        warm_up()
    clock = (Clock(search.time_limit, progress) if clock is None else clock).start()
    clock.allow(search.evaluations)
    began = time.monotonic()
    exploration = exploration_of(robot, cells, task, search.seed, clock)
    work = _Work(exploration, task, Plan((), (), 0), ProvedBound(min(1, len(cells))))
    _search(work)
    searched = time.monotonic()
    _share_out(work, clock)
    now = time.monotonic()
    timing = {
        "load_s": began - called,
        "search_s": searched - began,
        "divide_s": now - searched,
        "total_s": now - called,
    }
    return _division(work, timing)


@dataclass
class _Work:
    """A division in progress."""

    exploration: Exploration
    task: Task
    plan: Plan
    apart: ProvedBound
    ended: bool = True
    """Did the search run to its end?"""
    slow: dict[int, Cause] = field(default_factory=dict)
    """Cells that no motion leads to at the required speed or distance from singularities."""
    causes: tuple[Cause, ...] = ()
    """Of cells in no patch."""
    lacking: str = ""
    """See `Division.lacking`."""
    late: bool = False
    """Did a command's time run out meanwhile?"""
    blocked: str = ""
    """Why no motion can be certified anywhere, see `blocked_curves`."""

    @property
    def missing(self) -> Ints:
        """Cells in no patch."""
        return np.flatnonzero(self.plan.patch_of(len(self.exploration.cells)) < 0)


def _search(work: _Work) -> None:
    """Search for all components of motions that can be found, and for a bound."""
    exploration, task = work.exploration, work.task
    try:
        _explore(exploration, task)
        if not _no_motion(exploration.arrays):
            work.apart = prove_apart(exploration, task)
    except OutOfTime:
        work.ended = False
    if task.requires_rates:
        work.slow = keep_fast_motions(exploration, task)
    exploration.clock = Clock()


def _share_out(work: _Work, clock: Clock) -> None:
    """A plan for what the search found, and why cells are in none, as far as there is time."""
    exploration, task = work.exploration, work.task
    if len(exploration.cells) and _no_motion(exploration.arrays):
        work.blocked = blocked_curves(exploration.cells, task)
    try:
        with clock.enforced():
            if not work.blocked:
                work.plan = plan_of(exploration, task, clock.left)
                work.plan = _with_room(exploration, task, clock, work.plan)
            work.causes = _causes(work)
            work.lacking = _lacking(work)
    except OutOfTime:
        work.late = True


def _division(work: _Work, timing: dict[str, float]) -> Division:
    """What was found."""
    exploration, plan, ended = work.exploration, work.plan, work.ended and not work.late
    folded = bool(np.isinf(exploration.arrays.derivative_bounds).any())
    apart = work.apart if plan.patches else ProvedBound(0)
    return Division(
        robot=exploration.robot,
        cells=exploration.cells,
        task=work.task,
        seed=exploration.seed,
        patches=plan.patches,
        moves=plan.moves,
        bound=plan.bound,
        left_out=work.causes,
        unsettled=np.setdiff1d(work.missing, [cause.cell for cause in work.causes]),
        ended=ended and not work.blocked and not folded,
        message=work.blocked or _message(work, ended, folded),
        at_least=min(apart.number, len(plan.patches)),
        proof=apart.proof,
        apart=apart.apart,
        lacking=work.lacking,
        timing=timing,
    )


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


def _lacking(work: _Work) -> str:
    """What the case demands that the motions do not hold together; see `Division`."""
    robot, cells = work.exploration.robot, work.exploration.cells
    left = unjudged(robot, work.task, OF_EACH)
    if not left or not len(cells):
        return ""
    if len(work.missing) or not work.plan.accepted:
        return f"not judged, since not every cell is in a patch: {', '.join(left)}"
    walks = [patch.walk for patch in work.plan.patches]
    return further(robot, cells, work.task, walks, OF_EACH).refusal


def _explore(exploration: Exploration, task: Task) -> None:
    """Search for components of motions; in finer cells, too, or `check` would know larger ones."""
    explore(exploration)
    refine(exploration, task, COARSE)
    collect_components(exploration)


def _causes(work: _Work) -> tuple[Cause, ...]:
    """Why cells are in no patch; of a search that did not end, only what is proved or too slow."""
    exploration, missing = work.exploration, work.missing.tolist()
    if not work.ended:
        proved = [c for c in missing if exploration.rulings.get(c) is Ruling.PROVED]
        found = [diagnose(exploration, cell) for cell in proved[:MOST_EXPLAINED]]
        return tuple(sorted([*found, *work.slow.values()], key=lambda cause: cause.cell))
    pairs = Problem.of(exploration.robot, exploration.cells, work.task).pairs
    known = {cause.cell: cause for cause in causes_of(exploration, None, pairs)} | work.slow
    # A cell that the best motion covers is in no patch only where no motion can be certified.
    return tuple(known.get(c) or disconnected(exploration, c, None, pairs) for c in missing)


def _no_motion(arrays: SearchArrays) -> bool:
    """Can no motion at all be certified?"""
    folds = np.isinf(arrays.derivative_bounds).any(axis=1)
    rough = ~within(arrays)
    nowhere = any(np.size(places) > 0 and np.all(places) for places in (folds, rough))
    return nowhere or not arrays.cone_chord > 0.0


def _message(work: _Work, ended: bool, folded: bool) -> str:
    """One or two sentences: what was found, and on what it rests."""
    plan, task, at_least = work.plan, work.task, work.apart.number
    cells = len(work.exploration.cells)
    refused = [patch.refusal for patch in plan.patches if not patch.accepted]
    if refused:
        return (
            f"{len(refused)} patch{'es have' if len(refused) > 1 else ' has'} a walk that the "
            f"independent replay refuses: {refused[0]}."
        )
    number, how = len(plan.patches), f" {required_words(task)}" * task.requires_rates
    if cells == 0:
        return "There are no cells to cover."
    if number == 0 and not ended:
        return "The time limit ran out before any patch was found." + LATE * work.late
    if number == 0:
        found = f"No motion was found that covers any cell{how}."
        return found if how else "No motion covers any cell."
    what = counted(number, "continuous motion")
    proof = f"; at least {at_least}, proved" if min(number, at_least) > 1 else ""
    if plan.bound > max(at_least, 1):
        proof += f"; at least {plan.bound} among the motions found"
    covered = f"{cells - len(work.missing)} of {cells} cells{how}"
    sentence = f"{what} cover{'' if number > 1 else 's'} {covered}{proof}."
    blocked = [k for k, move in enumerate(plan.moves, start=1) if move.refusal]
    if blocked:
        named = ", ".join(f"{k} to {k + 1}" for k in blocked)
        sentence += f" No move clear of collisions was found from patch {named}."
    if folded:
        sentence += (
            " Where the standoff reaches the surface's radius of curvature its offset folds and no "
            "motion can be certified: these are the fewest known."
        )
    if work.lacking:
        sentence += f" But {work.lacking}"
    if not ended:
        sentence += " The time limit ran out: these are the fewest known."
    return sentence
