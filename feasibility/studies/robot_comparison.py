"""Arms compared: the same surface and task, one arm after the other."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

from coverable_errors import Fault
from feasibility.cases import Case, CaseError, CollisionPart, absolute, as_read, is_urdf
from feasibility.clock import Clock, OutOfTime
from feasibility.search import Progress
from feasibility.sensitivity import LEAST_CONE_DEG
from feasibility.studies.built_cases import (
    arm_of,
    case_of,
    clock_of,
    cut_of,
    mounted_as,
    mounting_fault,
)
from feasibility.studies.outcome import finite, merit, outcome_of
from feasibility.studies.pool import Tables, Workers
from feasibility.studies.run import StudyTask, run_tasks
from feasibility.studies.stored import arm_fault

if TYPE_CHECKING:
    from feasibility.studies.store import Store
    from feasibility.task import Task
    from robots import Robot
    from surfaces import Cells

MOST_DIVIDED = 400  # cells of a surface that is divided: a division takes several verdicts
CONE_STEP_DEG = 0.5  # resolution of the critical cone


@dataclass(frozen=True, slots=True)
class Arm:
    """What one arm can do about the surface; the defaults are those of an arm whose task failed."""

    robot: str
    """As it was named: two files may hold arms of the same name."""
    joints: int
    reach_m: float | None
    """Upper bound on the distance of the tool from the first joint; None where there is none."""
    verdict: str
    """'feasible', 'infeasible' or 'undecided'."""
    evidence: str
    message: str
    share: float = 0.0
    """Of the area, 0..1, that the best single motion covers."""
    covered: int = 0
    """Cells of it."""
    cells: int = 0
    cause: str | None = None
    """The most frequent cause of missed cells; None without any."""
    patches: int | None = None
    """Continuous motions that together cover all that can be covered; None where not requested."""
    patches_share: float | None = None
    """Of the area, 0..1, that these cover together."""
    critical_cone_deg: float | None = None
    """The smallest cone with a covering motion, to `CONE_STEP_DEG`; narrower ones than
    `LEAST_CONE_DEG` are not tested. None where there is none, or it was not requested."""
    margins: dict[str, float | None] | None = None
    """What the covering motion leaves: limit_deg, limit_m, cone_deg, reach_m, placement_m."""
    unchecked_links: Sequence[str] = ()
    """What has no body, where collisions are checked; see `Verdict`."""
    seconds: float = 0.0
    """Time that the work took."""


@dataclass(frozen=True, slots=True)
class Comparison:
    """Arms in the order in which they were named."""

    case: str
    arms: tuple[Arm, ...]
    divided: bool
    """Were patches counted?"""
    critical: bool
    """Were critical cones searched for?"""
    collision: CollisionPart | None = None
    """What was checked of collisions; None where nothing was."""

    @property
    def ranked(self) -> tuple[Arm, ...]:
        """The best first: feasible ones by their margin to the limits, the others by share."""
        return tuple(sorted(self.arms, key=lambda arm: merit(asdict(arm))))


def compare(
    case: Case,
    robots: Sequence[str],
    workers: Workers,
    *,
    divide: bool = True,
    critical: bool = False,
    store: Store | None = None,
    progress: Progress | None = None,
) -> Comparison:
    """The same case for several arms, each mounted where the case's arm is: on its base and axes.

    Args:
        case: surface, task and search; its own arm keeps its limits and tool if it is among the
            robots.
        robots: names of the library, and paths of URDF or xacro files.
        workers: where they run, see `open_workers`.
        divide: count the patches that an arm needs where one motion will not do, on surfaces of
            up to `MOST_DIVIDED` cells.
        critical: look for the smallest cone that each arm can do with; some ten verdicts each.
        store: where finished arms are kept.
        progress: called as progress(done, total, text); what it raises ends the work.

    Raises:
        CaseError: an arm cannot be loaded, or is named twice; all of them together.

    Example:
        >>> from feasibility.cases import load_case
        >>> from feasibility.studies import open_workers
        >>> with open_workers(0) as workers:
        ...     found = compare(load_case("paper/4a"), ["puma560", "ur5"], workers, divide=False)
        >>> [(arm.robot, arm.verdict) for arm in found.ranked]
        [('puma560', 'feasible'), ('ur5', 'infeasible')]
    """
    tasks = []
    for name, tables in zip(robots, _tables_of(case, robots), strict=True):
        tables["compare"] = {"divide": divide, "critical": critical}
        tasks.append(StudyTask(tables, {"robot": name}, assess, arm_fault))
    rows = run_tasks(tasks, workers, store, progress)
    arms = []
    for task, row in zip(tasks, rows, strict=True):
        robot = arm_of(case_of(task.tables))
        known = {"joints": robot.n, "reach_m": finite(robot.reach)}
        arms.append(Arm(**{**known, **row.result, **task.parameters}, seconds=row.seconds))
    return Comparison(case.name, tuple(arms), divide, critical, case.collision)


def _tables_of(case: Case, robots: Sequence[str]) -> list[Tables]:
    """The case with each of the arms, checked.

    Raises:
        CaseError: see `compare`.
    """
    from robots import RobotError

    base = {title: as_read(table) for title, table in case.to_tables().items()}
    if case.search.method != "complete":
        kept = ("seed", "time_limit")
        base["search"] = {key: base["search"][key] for key in kept if key in base["search"]}
    faults, made = [], []
    if not robots:
        faults.append(Fault("--robots", "is empty; expected such as ur5,panda,my_arm.urdf"))
    for k, name in enumerate(robots):
        place = f"--robots[{k}]"
        if name in robots[:k]:
            faults.append(Fault(place, f"{name!r} is named twice"))
            continue
        given = {"urdf": absolute(name)} if is_urdf(name) else {"name": name}
        own = given.items() <= base["robot"].items()
        arm = base["robot"] if own else mounted_as(given, base["robot"])
        tables = {**base, "robot": arm}
        other = None if own else mounting_fault(given, base["robot"])
        if other is not None:
            faults.append(Fault(place, f"{name} {other}"))
            continue
        try:
            arm_of(case_of(tables))
        except CaseError as error:
            faults += [fault._replace(key=f"{place}: {fault.key}") for fault in error.faults]
        except RobotError as error:
            faults.append(Fault(place, str(error)))
        else:
            made.append(tables)
    if faults:
        raise CaseError(faults, case.name)
    return made


def assess(tables: Tables) -> dict[str, Any]:
    """In a worker: everything in the row of one arm, but for the time that it took.

    A time limit is for all of it; patches and cone are None where it has run out before.

    Args:
        tables: of a case, and `compare`: what is requested.
    """
    from feasibility.checking import check

    request = tables["compare"]
    case = case_of(tables)
    clock = clock_of(case)
    robot, cells = arm_of(case), cut_of(case)
    verdict = check(robot, cells, case.built_task(), case.search, clock=clock)
    outcome = outcome_of(verdict)
    patches, patches_share = (1, 1.0) if request["divide"] and verdict.feasible else (None, None)
    if request["divide"] and not verdict.feasible and 0 < len(cells) <= MOST_DIVIDED:
        patches, patches_share = _patches(robot, cells, case, clock)
    cone = None
    if request["critical"] and not clock.out_of_time:
        cone = critical_cone(robot, cells, case, verdict.feasible, clock)
    kept = ["verdict", "evidence", "message", "share", "covered", "cells", "margins"]
    kept.append("unchecked_links")
    return {
        "robot": robot.name,
        "joints": robot.n,
        "reach_m": finite(robot.reach),
        **{key: outcome[key] for key in kept},
        "cause": next(iter(outcome["causes"]), None),
        "patches": patches,
        "patches_share": patches_share,
        "critical_cone_deg": cone,
    }


def _patches(
    robot: Robot, cells: Cells, case: Case, clock: Clock
) -> tuple[int, float] | tuple[None, None]:
    """How many motions there have to be, and the share of the area that they cover."""
    from feasibility.division import divide

    if clock.out_of_time:
        return None, None
    try:
        division = divide(robot, cells, case.built_task(), case.search, clock=clock)
    except OutOfTime:
        return None, None
    accepted = [patch for patch in division.patches if patch.accepted]
    total = float(cells.areas.sum())
    return len(accepted), sum(patch.area for patch in accepted) / total if total > 0.0 else 1.0


def critical_cone(
    robot: Robot, cells: Cells, case: Case, feasible: bool, clock: Clock | None = None
) -> float | None:
    """The smallest cone, deg, with which a covering motion is found; None where none is.

    A wider cone allows all that a narrower one does, so halving finds it. What a search cannot
    decide counts as not found.

    Args:
        robot: the arm.
        cells: of the surface.
        case: its task and search.
        feasible: is the case, with its own cone?
        clock: of all that is done for this arm, if there is one.
    """
    from feasibility.checking import check
    from feasibility.sensitivity import last_true

    own = case.built_task()

    def holds(step: int) -> bool:
        task: Task = replace(own, cone_deg=step * CONE_STEP_DEG)
        return check(robot, cells, task, case.search, clock=clock).feasible

    # Steps below the first one tested count as failed; the case's own cone may lie between two.
    below = round(LEAST_CONE_DEG / CONE_STEP_DEG) - 1
    if feasible:
        good = math.ceil(case.task.cone_deg / CONE_STEP_DEG)
        if good <= below + 1:
            return case.task.cone_deg
        return min(last_true(holds, good, below) * CONE_STEP_DEG, case.task.cone_deg)
    widest = round((180.0 if own.roll is None else 90.0) / CONE_STEP_DEG)
    failed = max(below, math.floor(case.task.cone_deg / CONE_STEP_DEG))
    if failed >= widest or not holds(widest):
        return None
    return last_true(holds, widest, failed) * CONE_STEP_DEG
