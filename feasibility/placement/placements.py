"""Where may the surface stand? A search over the poses of a region.

1. Where the reach bound shows that every placement in it has a target out of reach, that is the
   answer, and no search is run.
2. Poses are spread evenly over the region (Sobol) and improved by differential evolution (Storn and
   Price, 1997): larger covered share first, then larger margin. A pose with a target out of reach
   costs nothing, and is the worse the further out it is; at the others `check` has a quick look.
3. Where none is found, the best placements are checked with all effort.

The poses tried depend on the region, the counts and the seed alone, not on the evaluator.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

from coverable.errors import Checks, Fault, at_least, counted
from feasibility.clock import Clock
from feasibility.collisions.asked_bodies import said_of
from feasibility.demands.every_demand import refuse_start
from feasibility.placement.evolution import INTERRUPTED, SMALLEST, Evolution, distinct
from feasibility.placement.reach_bound import Reach
from feasibility.placement.region import PlacementError, Region
from feasibility.placement.trials import Evaluator, Trial, evaluator_here
from feasibility.search_settings import Progress, Search
from feasibility.targets.blocked import blocked_curves, smoothing_offer
from feasibility.task import Task
from feasibility.verdict import Answer, CauseKind, Evidence
from robots.robot import Robot
from surfaces.cells import Cells

COUNT = 64  # poses spread over the region, and tried again in each round
ROUNDS = 6
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
    """fk: evaluations of the arm; drawn, bound: placements, and those that the reach bound
    discards; tried: with `check`; boxes: of the region's bound."""
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
    rounds: int = ROUNDS,
    keep: int = KEEP,
    time_limit: float | None = None,
    evaluator: Evaluator | None = None,
    progress: Progress | None = None,
    clock: Clock | None = None,
    interruptible: bool = False,
) -> Placements:
    """Where in a region may the surface stand, so that one continuous motion covers it?

    Args:
        robot, cells, task: the question, as for `check`, wherever the surface stands now.
        region: the poses of the surface's frame to search.
        search: of each verdict; its seed also spreads the poses.
        count: poses spread over the region (five at least), and tried again in each round.
        rounds: of better ones.
        keep: feasible placements that are given, at most.
        time_limit: s, for all of it; looked at between placements, and in a command within them.
        evaluator: tries placements; default in this process.
        progress: called as progress(done, total, text); what it raises ends the search.
        clock: of the command that this is a part of; its limit counts instead of `time_limit`.
        interruptible: whether a Ctrl-C ends the search as the time limit does, and is not raised.

    Raises:
        PlacementError: there is nothing to place, or the settings make no sense.
        ArgumentError: the arm has a start.

    Example:
        >>> from coverable import Pose
        >>> from coverable import load_robot
        >>> from coverable import plane
        >>> plate = plane((-0.1, 0.1), (-0.1, 0.1), position=(1.2, 0, 0.3), side="outside")
        >>> region = Region.around(Pose.of_surface(plate), {"x": (0.3, 1.2), "yaw_deg": (0, 90)})
        >>> task = Task(standoff=0.02, cone_deg=30)
        >>> placements = place(load_robot("ur5"), plate.cells(3, 3), task, region, count=8, keep=1)
        >>> placements.answer, region.holds(placements.best.pose)
        (<Answer.FEASIBLE: 'feasible'>, True)
    """
    search = Search() if search is None else search
    _check_settings(cells, search, count, rounds, keep, time_limit)
    refuse_start(robot, "but where the surface stands elsewhere it is not over it")
    began = time.monotonic()
    clock = clock or Clock(time_limit).start()
    reach = Reach.of(robot, cells, task)
    answered = partial(Placements, robot, cells, task, region)
    if (beyond := reach.beyond(region)) is not None:
        return _ruled_out(answered, *beyond, reach.reach, time.monotonic() - began)
    evaluator = evaluator or evaluator_here(robot, cells, task, search)
    tried = Evolution(evaluator, reach, region, clock, progress)
    try:
        tried.run(max(count, SMALLEST), rounds, search.seed)
    except KeyboardInterrupt:
        if not interruptible:
            raise
        tried.stopped = INTERRUPTED
    found = distinct((trial for trial in tried.ranked if trial.feasible), region, keep)
    return _finished(_searched(answered, tried, found, task.requires_rates), clock, began)


def _finished(answer: Placements, clock: Clock, began: float) -> Placements:
    """The same with its time; where it is undecided, with what no placement helps, and what may."""
    cells, task = answer.cells, answer.task
    closed = blocked_curves(cells, task) if answer.answer is Answer.UNDECIDED else ""
    if closed:
        said = f"Wherever it stands: {closed} {smoothing_offer(cells, task, clock)}".rstrip()
        answer = replace(answer, message=f"{answer.message} {said}")
    answer.timing["total_s"] = time.monotonic() - began
    return answer


def _check_settings(
    cells: Cells, search: Search, count: int, rounds: int, keep: int, time_limit: float | None
) -> None:
    """Refuse what makes no question."""
    checks = Checks("place", PlacementError)
    if len(cells) == 0:
        checks.keep(Fault("", "there are no cells to cover; cut the surface into some"))
    checks.choice("method", search.method, ("complete",))
    checks.whole("count", count, 1, MOST)
    checks.whole("rounds", rounds, 0, MOST)
    checks.whole("keep", keep, 1, MOST)
    if time_limit is not None:
        checks.positive("time_limit", time_limit, "seconds")
    checks.done()


def _ruled_out(
    answered: Callable[..., Placements], distance: float, boxes: int, most: float, seconds: float
) -> Placements:
    """The answer where the reach bound leaves no placement, which took some seconds."""
    message = (
        f"No placement in the region: wherever the surface stands in it, some target is at least "
        f"{distance:.3f} m from the first joint, and the arm reaches at most {most:.3f} m (proved "
        f"for the whole region, {counted(boxes, 'box', 'boxes')})."
    )
    none = dict.fromkeys(("fk", "drawn", "bound", "tried"), 0)
    return answered(
        answer=Answer.INFEASIBLE, evidence=Evidence.PROOF, message=message, found=(), trials=(),
        cause=CauseKind.OUT_OF_REACH, statistics={**none, "boxes": boxes},
        timing={"total_s": seconds},
    )  # fmt: skip


def _searched(
    answered: Callable[..., Placements], search: Evolution, found: Sequence[Trial], rated: bool
) -> Placements:
    """The answer of a search; of an undecided one at a speed (`rated`) its message is the cause."""
    trials = search.ranked
    failed = [trial for trial in trials if trial.failed]
    tried = (
        f"{counted(search.drawn, 'placement')} drawn: {search.bound} have a target out of reach, "
        f"{len(trials) - len(failed)} were tried"
    ) + (f", {len(failed)} could not be tried ({failed[0].message})" if failed else "")
    answered = partial(
        answered, found=tuple(found), trials=tuple(trials), stopped=search.stopped,
        statistics={
            "fk": sum(int(trial.result.get("fk", 0)) for trial in trials), "drawn": search.drawn,
            "bound": search.bound, "tried": len(trials), "boxes": 0,
        },
    )  # fmt: skip
    if found:
        message = (
            f"{counted(len(found), 'feasible placement')}, each with a replayed motion; "
            f"the best leaves a margin of {at_least(1e3 * found[0].margin, 3)} mm. {tried}"
            + (f"; this is the best so far: {search.stopped}." if search.stopped else ".")
        )
        feasible = {"answer": Answer.FEASIBLE, "evidence": Evidence.WITNESS}
        return answered(**feasible, message=message, cause=None)
    closely = [trial for trial in trials if trial.effort == "fully" and not trial.failed]
    doubtful = [trial for trial in closely if trial.answer is Answer.UNDECIDED]
    undecided = bool(search.stopped or failed or doubtful or not closely)
    told = [trial for trial in closely if not (rated and trial in doubtful)]
    causes = next((dict(t.result["causes"]) for t in told if t.result["causes"]), {})
    cause = CauseKind(max(causes, key=lambda kind: causes[kind])) if causes else None
    best = trials[0].share if trials else 0.0
    message = (
        f"None found in the region: {tried}; the best covers {100.0 * best:.1f} % of the area"
        + (f", and most of the rest is missed ({cause.replace('_', ' ')})" if cause else "")
        + (f"; {search.stopped}." if search.stopped else ". This is no proof.")
        + "".join(f" Of the best, `check` says: {trial.message}" for trial in doubtful[:1])
    )
    return answered(
        answer=Answer.UNDECIDED if undecided else Answer.INFEASIBLE,
        evidence=Evidence.BUDGET if undecided else Evidence.EXHAUSTED,
        message=message, cause=cause, causes=causes,
    )  # fmt: skip
