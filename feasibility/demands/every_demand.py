"""What a case demands of the arm's motion: one list, each demand with its keys and its judge.

"Feasible" and "holds" are said where every demand of the case was judged. How the tool is held, the
limits of the joints, and that bodies stay clear, the replay of a motion judges (`certification`);
all else is judged by `further`. What has no judge of something asks `unjudged`, and refuses, or
does not say it. So a demand that is new in the list is not forgotten anywhere.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from coverable.errors import ArgumentError, Fault
from feasibility.certification.faults import Judged, MotionFault
from feasibility.search_settings import Search
from feasibility.task import Task
from feasibility.verdict import Walk
from robots.robot import Robot
from surfaces.cells import Cells

if TYPE_CHECKING:
    from feasibility.demands.area import TreatedArea

AT_START = 1e-9  # [rad] or [m]: a first row this near to the start is at it


@dataclass(frozen=True, slots=True)
class Findings(Judged):
    """What was found of motions that the replay accepted."""

    faults: tuple[MotionFault, ...] = ()
    """What they do not hold of the case's demands; none where they hold all."""
    treated: TreatedArea | None = None
    """What they treat together; None where no coverage is required."""


Judge = Callable[[Robot, Cells, Task, Sequence[Walk]], Findings]


@dataclass(frozen=True, slots=True)
class Demand:
    """One thing that a case may demand."""

    name: str
    """What answers call it."""
    keys: tuple[str, ...]
    """Of the case file, which say it; "collision.*" stands for all of a table."""
    attribute: str = ""
    """Of the task, or of the arm ("start"), that is None where a case does not demand it; empty
    where every case does."""
    judge: Judge | None = None
    """Of motions one after the other that the replay accepted; None where it is the replay that
    judges it."""
    together: bool = False
    """Do several motions hold it together? Otherwise each of them has to."""


def _at_start(robot: Robot, cells: Cells, task: Task, walks: Sequence[Walk]) -> Findings:
    """Does the first motion begin at the arm's start?"""
    off = np.inf if robot.start is None else float(np.abs(walks[0].q[0] - robot.start).max())
    if off <= AT_START:
        return Findings()
    return Findings((MotionFault(f"it begins {off:.3g} rad or m off the start", 0),))


def _at_rates(robot: Robot, cells: Cells, task: Task, walks: Sequence[Walk]) -> Findings:
    """Does each motion keep the speed, and its distance from singularities?"""
    from feasibility.certification.rate_replay import check_rates, replay_rates

    check_rates(robot, task)
    found = [replay_rates(robot, cells, task, walk).faults for walk in walks]
    return Findings(tuple(MotionFault(text) for texts in found for text in texts))


def _treating(robot: Robot, cells: Cells, task: Task, walks: Sequence[Walk]) -> Findings:
    """Do the motions treat enough of the area?"""
    from feasibility.demands.area import treated_by_walk
    from feasibility.demands.treated_words import shortfall

    treated = treated_by_walk(robot, cells, task, *walks)
    short = shortfall(task, treated)
    return Findings((MotionFault(short),) if short else (), treated)


DEMANDS = (
    Demand("standoff", ("task.standoff",)),
    Demand("tolerance", ("task.tolerance",)),
    Demand("cone", ("task.cone_deg", "task.approach")),
    Demand("roll", ("task.roll_deg", "task.roll_reference"), "roll"),
    Demand("limits", ("robot.limits", "robot.limits_deg", "robot.limits_m")),
    Demand("collisions", ("collision.*",), "collision"),
    Demand("start", ("robot.start", "robot.start_deg"), "start", _at_start, together=True),
    Demand("speed", ("task.speed",), "speed", _at_rates),
    Demand(
        "distance from singularities", ("task.min_manipulability",), "min_manipulability", _at_rates
    ),
    Demand("placement error", ("task.placement_error",), "placement_error"),
    Demand("coverage", ("task.coverage",), "coverage", _treating, together=True),
)
NAMES = tuple(demand.name for demand in DEMANDS)
BY_REPLAY = tuple(demand.name for demand in DEMANDS if demand.judge is None)
TOGETHER = tuple(demand.name for demand in DEMANDS if demand.together)
OF_EACH = tuple(demand.name for demand in DEMANDS if not demand.together)
RATES = ("speed", "distance from singularities")
OF_TREE = ("standoff", "tolerance", "cone", "roll", "limits", "start")
"""What the replay of the paper's tree judges, which knows nothing of the others."""


def asked_of(robot: Robot, task: Task) -> tuple[Demand, ...]:
    """What a case demands."""
    return tuple(
        demand
        for demand in DEMANDS
        if not demand.attribute
        or getattr(robot if demand.attribute == "start" else task, demand.attribute) is not None
    )


def unjudged(robot: Robot, task: Task, judged: Collection[str]) -> tuple[str, ...]:
    """Names of what a case demands, less what is judged."""
    return tuple(demand.name for demand in asked_of(robot, task) if demand.name not in judged)


def further(
    robot: Robot, cells: Cells, task: Task, walks: Sequence[Walk], judged: Collection[str] = ()
) -> Findings:
    """Judge what the replay does not, of motions that it accepted, run one after the other.

    Demands whose names are among `judged` were judged before.

    Raises:
        ArgumentError: the speed cannot be judged of this arm.
    """
    wanted = [demand.judge for demand in asked_of(robot, task) if demand.name not in judged]
    found = [judge(robot, cells, task, walks) for judge in dict.fromkeys(wanted) if judge]
    treated = [one.treated for one in found if one.treated is not None]
    faults = tuple(fault for one in found for fault in one.faults)
    return Findings(faults, treated[0] if treated else None)


def refuse_start(robot: Robot, why: str) -> None:
    """Refuse an arm that has to begin somewhere, where that cannot be judged.

    Raises:
        ArgumentError: it has a start.
    """
    if robot.start is not None:
        expected = "leave it out (--set robot.start= or robot.start_deg=)"
        raise ArgumentError(Fault("start", f"is given, {why}", expected=expected), "robot")


def check_requirements(robot: Robot, task: Task, search: Search) -> None:
    """Refuse a speed, a distance from singularities or a home that this arm cannot have.

    Raises:
        ArgumentError: joints without velocity limits, a speed beyond all of them, the greedy
            search, or a home that is no configuration of the arm.
    """
    if task.home_deg is not None:
        what, home, names = "", np.radians(task.home_deg), robot.joint_names
        if len(home) != robot.n:
            what = f"has {len(home)} values; expected one for each of {', '.join(names)}"
        elif robot.prismatic.any():
            what = f"gives degrees, but {names[int(np.argmax(robot.prismatic))]} slides"
        elif not ((home >= robot.lower) & (home <= robot.upper)).all():
            past = int(np.argmax(np.maximum(robot.lower - home, home - robot.upper)))
            low, high = np.degrees([robot.lower[past], robot.upper[past]])
            what = (
                f"puts {names[past]} at {task.home_deg[past]:g} deg, outside its limits "
                f"{low:.4g} to {high:.4g} deg"
            )
        if what:
            raise ArgumentError(Fault("home_deg", what), "task")
    if not task.requires_rates:
        return
    if search.method != "complete":
        what = "needs the complete search: the greedy one has no motion over the cells' centres"
        raise ArgumentError(Fault("speed" if task.speed else "min_manipulability", what), "task")
    from feasibility.certification.rate_replay import check_rates

    check_rates(robot, task)


def required_words(task: Task) -> str:
    """What a task requires of speed and singular values, as a sentence goes on; maybe nothing."""
    words = [] if task.speed is None else [f"at {task.speed:g} m/s"]
    if task.min_manipulability is not None:
        words.append(f"with singular values of {task.min_manipulability:g} at least")
    return " and ".join(words)
