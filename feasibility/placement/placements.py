"""Where may the surface stand? A search over the poses of a region, coarse to fine.

1. The reach bound is evaluated over the region; where it shows that every placement has a target
   out of reach, that is the answer, and no search is run.
2. Poses are spread evenly over the region (Sobol). The same bound discards most of those that are
   out of reach; of the others, Newton's method is tried at a few cells that differ most. A short
   search is run only where it succeeds at all of them.
3. Around the best few, more poses are tried in ever smaller boxes: larger covered share first, then
   larger margin (see `feasibility.placement.quick_search`).
4. The best placements are decided as any other case: `feasibility.check` searches and replays.
   Only what it calls feasible is an answer.

The poses tried depend on the region, the counts and the seed alone, not on the evaluator.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

from coverable_errors import Checks, Fault, counted
from feasibility.clock import Clock
from feasibility.collisions import said_of
from feasibility.demands import refuse_start
from feasibility.notices import compiling_notice
from feasibility.placement.evaluator import LocalEvaluator, Stage, Trial
from feasibility.placement.reach_bound import Beyond, Reach
from feasibility.placement.refinement import INTERRUPTED, Evaluator, Refinement
from feasibility.placement.region import PlacementError, Pose, Region
from feasibility.roadmap import warm_up
from feasibility.search import Progress, Search
from feasibility.targets import blocked_curves, smoothing_offer
from feasibility.task import Task
from feasibility.verdict import Answer, CauseKind, Evidence
from robots import Robot
from surfaces import Cells

MISSED = {
    CauseKind.OUT_OF_REACH: "out of reach",
    CauseKind.JOINT_LIMITS: "missed for joint limits",
    CauseKind.ORIENTATION: "missed for orientation",
    CauseKind.COLLISION: "missed for collision",
    CauseKind.DISCONNECTED: "reachable by another motion only",
}

COUNTS = ("fk", "drawn", "bound", "probe", "search", "check", "boxes")  # see `statistics`

COUNT = 256  # poses spread over the region
AROUND = 8  # poses tried around each of the best, a round
KEEP = 5
MOST = 100_000  # of any of these


@dataclass(frozen=True, eq=False, slots=True)
class Placements:
    """What a search for placements found."""

    robot: Robot
    cells: Cells
    task: Task
    region: Region
    answer: Answer
    evidence: Evidence
    message: str
    """What was found or tried, and on what it rests."""
    found: tuple[Trial, ...]
    """Placements that `feasibility.check` calls feasible, the largest margin first; they differ
    from each other by some share of the region."""
    trials: tuple[Trial, ...]
    """All placements tried, the best first."""
    cause: CauseKind | None
    """What dominates where there is none: the cause of most missed cells of the best placement, or
    out of reach where the bound leaves none."""
    causes: dict[str, int] = field(default_factory=dict)
    """Missed cells of the best placement by cause."""
    timing: dict[str, float] = field(default_factory=dict)
    """Seconds: total_s."""
    statistics: dict[str, Any] = field(default_factory=dict)
    """fk: evaluations of the arm; drawn, bound, probe, search, check: placements by the stage that
    they came to; boxes: of the region's bound."""
    stopped: str = ""
    """Why the search did not go on to its end, in words; empty where it did."""

    @property
    def interrupted(self) -> bool:
        """Did a Ctrl-C end the search?"""
        return self.stopped == INTERRUPTED

    @property
    def best(self) -> Trial | None:
        """The feasible placement with the largest margin, or else the one that covers most."""
        return self.found[0] if self.found else (self.trials[0] if self.trials else None)

    @property
    def share(self) -> float:
        """The largest share of the area that one motion was found to cover."""
        return 0.0 if self.best is None else self.best.share

    def __repr__(self) -> str:
        """One line."""
        found = counted(len(self.found), "placement")
        line = f"{self.answer} ({self.evidence}): {found}. {self.message}"
        return f"{line} {said_of(self.robot, self.task.collision).capitalize()}."


def place(
    robot: Robot,
    cells: Cells,
    task: Task,
    region: Region,
    search: Search | None = None,
    *,
    count: int = COUNT,
    around: int = AROUND,
    keep: int = KEEP,
    early: bool = True,
    time_limit: float | None = None,
    evaluator: Evaluator | None = None,
    progress: Progress | None = None,
    clock: Clock | None = None,
    interruptible: bool = False,
) -> Placements:
    """Where in a region may the surface stand, so that one continuous motion covers it?

    Args:
        robot: the arm.
        cells: the surface, wherever it stands now, cut into cells.
        task: standoff, cone and tolerance.
        region: the poses of the surface's frame to search.
        search: of each verdict; its seed also spreads the poses.
        count: poses spread over the region; refinement comes on top.
        around: poses tried around each of the best, a round; 0 for no refinement.
        keep: feasible placements to verify, at most.
        early: whether bounds and probes may discard placements before a search is run.
        time_limit: s, for all of it; looked at between batches, and in a command within them.
        evaluator: tries placements; default in this process.
        progress: called as progress(done, total, text); what it raises ends the search.
        clock: of the command that this is a part of; its limit counts instead of `time_limit`.
        interruptible: whether a Ctrl-C ends the search as the time limit does, and is not raised.

    Returns:
        The placements. That there are none is a result, not an error.

    Raises:
        PlacementError: there is nothing to place, or the settings make no sense.
        ArgumentError: the arm has a start.

    Example:
        >>> from robots import load_robot
        >>> from surfaces import plane
        >>> plate = plane((-0.1, 0.1), (-0.1, 0.1), position=(1.2, 0, 0.3), side="outside")
        >>> region = Region.around(Pose.of_surface(plate), {"x": (0.3, 1.2), "yaw_deg": (0, 90)})
        >>> task = Task(standoff=0.02, cone_deg=30)
        >>> placements = place(load_robot("ur5"), plate.cells(3, 3), task, region, count=8, keep=1)
        >>> placements.answer, region.holds(placements.best.pose)
        (<Answer.FEASIBLE: 'feasible'>, True)
    """
    search = Search() if search is None else search
    _check_settings(cells, search, count, around, keep, time_limit)
    refuse_start(robot, "but where the surface stands elsewhere it is not over it")
    began = time.monotonic()
    clock = clock or Clock(time_limit).start()
    reach = Reach.of(robot, cells, task)
    answered = partial(Placements, robot, cells, task, region)
    if (beyond := reach.beyond(region)) is not None:
        return _timed(_ruled_out(answered, region, reach, beyond), began)
    if evaluator is None:
        with compiling_notice():
            warm_up()
        evaluator = LocalEvaluator(robot, cells, task, search)
    refinement = Refinement(evaluator, reach, region, search.seed, early, clock, progress)
    found = refinement.searched(count, around, keep, interruptible)
    return _timed(_with_blocked(_searched(answered, refinement, found), clock), began)


def _with_blocked(placements: Placements, clock: Clock) -> Placements:
    """The same; where it is undecided, with what no placement helps, and what may."""
    cells, task = placements.cells, placements.task
    closed = blocked_curves(cells, task) if placements.answer is Answer.UNDECIDED else ""
    if not closed:
        return placements
    offer = smoothing_offer(cells, task, clock)
    message = f"{placements.message} Wherever it stands: {closed} {offer}".rstrip()
    return replace(placements, message=message)


def _timed(placements: Placements, began: float) -> Placements:
    """The same, with the seconds since then."""
    placements.timing["total_s"] = time.monotonic() - began
    return placements


def _check_settings(
    cells: Cells, search: Search, count: int, around: int, keep: int, time_limit: float | None
) -> None:
    """Refuse what makes no question."""
    checks = Checks("place", PlacementError)
    if len(cells) == 0:
        checks.keep(Fault("", "there are no cells to cover; cut the surface into some"))
    checks.choice("method", search.method, ("complete",))
    checks.whole("count", count, 1, MOST)
    checks.whole("around", around, 0, MOST)
    checks.whole("keep", keep, 1, MOST)
    if time_limit is not None:
        checks.positive("time_limit", time_limit, "seconds")
    checks.done()


def _ruled_out(
    answered: Callable[..., Placements], region: Region, reach: Reach, beyond: Beyond
) -> Placements:
    """The answer where the reach bound leaves no placement."""
    middle = region.samples(0, 0)
    trial = Trial(Pose.of_values(middle[0]), Stage.BOUND, float(reach.share(middle)[0]))
    message = (
        f"No placement in the region: wherever the surface stands in it, some target is at least "
        f"{beyond.distance:.3f} m from the first joint, and the arm reaches at most "
        f"{beyond.reach:.3f} m (proved for the whole region, "
        f"{counted(beyond.boxes, 'box', 'boxes')})."
    )
    return answered(
        answer=Answer.INFEASIBLE,
        evidence=Evidence.PROOF,
        message=message,
        found=(),
        trials=(trial,),
        cause=CauseKind.OUT_OF_REACH,
        statistics={**dict.fromkeys(COUNTS, 0), "boxes": beyond.boxes},
    )


def _searched(
    answered: Callable[..., Placements], refinement: Refinement, found: list[Trial]
) -> Placements:
    """The answer of a search."""
    trials = sorted(refinement.trials, key=lambda trial: trial.rank, reverse=True)
    failed = [trial for trial in trials if trial.stage is Stage.FAILED]
    stages = Counter(trial.stage for trial in trials)
    searched = stages[Stage.SEARCH] + stages[Stage.CHECK]
    tried = (
        f"{refinement.drawn} placements were drawn: {refinement.bound} have a target out of reach, "
        f"{stages[Stage.PROBE]} failed a few Newton starts, {searched} were searched"
    ) + (f", {len(failed)} could not be tried ({failed[0].message})" if failed else "")
    causes: dict[str, int] = {}
    cause = None
    if found:
        answer, evidence = Answer.FEASIBLE, Evidence.WITNESS
        message = (
            f"{counted(len(found), 'feasible placement')}, each with a replayed motion; "
            f"the best leaves a margin of {found[0].margin:.3f}. {tried}"
            + (f"; this is the best so far: {refinement.stopped}." if refinement.stopped else ".")
        )
    else:
        undecided = bool(refinement.stopped or failed)
        undecided |= any(trial.answer is Answer.UNDECIDED for trial in trials)
        answer = Answer.UNDECIDED if undecided else Answer.INFEASIBLE
        evidence = Evidence.BUDGET if undecided else Evidence.EXHAUSTED
        causes = next((dict(t.causes) for t in trials if t.causes), {})
        cause = CauseKind(max(causes, key=lambda kind: causes[kind])) if causes else None
        best = trials[0].share if trials else 0.0
        message = (
            f"None found in the region: {tried}; the best covers {100.0 * best:.1f} % of the area"
            + (f", and most of the rest is {MISSED[cause]}" if cause else "")
            + (f"; {refinement.stopped}." if refinement.stopped else ". This is no proof.")
        )
        checked = [trial for trial in trials if trial.answer is Answer.UNDECIDED][:1]
        message += "".join(f" Of the best, `check` says: {trial.message}" for trial in checked)
    return answered(
        answer=answer,
        evidence=evidence,
        message=message,
        found=tuple(found),
        trials=tuple(trials),
        cause=cause,
        causes=causes,
        stopped=refinement.stopped,
        statistics={
            "fk": sum(trial.fk for trial in trials),
            "drawn": refinement.drawn,
            "bound": refinement.bound,
            **{str(stage): stages[stage] for stage in (Stage.PROBE, Stage.SEARCH, Stage.CHECK)},
            "boxes": 0,
        },
    )
