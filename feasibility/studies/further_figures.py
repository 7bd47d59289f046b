"""What may be wanted of a case besides its verdict: the motions it takes, the smallest cone."""

import math
from bisect import bisect_left
from dataclasses import replace
from typing import Any

from feasibility.cases.case import Case
from feasibility.checking import check
from feasibility.clock import Clock, OutOfTime
from feasibility.division.surface_division import divide
from feasibility.sensitivity.quantities import LEAST_CONE_DEG
from feasibility.verdict import Verdict

MOST_DIVIDED = 400  # cells of a surface that is divided: a division takes several verdicts
CONE_STEP_DEG = 0.5  # resolution of the critical cone


def further_figures(
    verdict: Verdict, case: Case, clock: Clock, patches: bool, critical: bool
) -> dict[str, Any]:
    """Further values of an outcome; None where the time has run out, or they are not wanted.

    Args:
        verdict: of the case.
        case: its search is used.
        clock: of all that is done for the case.
        patches: how many continuous motions together cover all that can be covered, and what share
            of the area that is.
        critical: the smallest cone with a covering motion.
    """
    motions, share, cone = None, None, None
    if patches and verdict.feasible:
        motions, share = 1, 1.0
    elif patches and 0 < len(verdict.cells) <= MOST_DIVIDED and not clock.out_of_time:
        motions, share = _patches(verdict, case, clock)
    if critical and not clock.out_of_time:
        cone = critical_cone(verdict, case, clock)
    return {"patches": motions, "patches_share": share, "critical_cone_deg": cone}


def _patches(verdict: Verdict, case: Case, clock: Clock) -> tuple[int, float] | tuple[None, None]:
    """How many motions there have to be, and the share of the area that they cover."""
    robot, cells, task = verdict.robot, verdict.cells, verdict.task
    try:
        division = divide(robot, cells, task, case.search, clock=clock)
    except OutOfTime:
        return None, None
    accepted = [patch for patch in division.patches if patch.accepted]
    total = float(cells.areas.sum())
    return len(accepted), sum(patch.area for patch in accepted) / total if total > 0.0 else 1.0


def critical_cone(verdict: Verdict, case: Case, clock: Clock) -> float | None:
    """The smallest cone, deg, with which a covering motion is found; None where none is.

    A wider cone allows all that a narrower one does, so halving finds it. What a search cannot
    decide counts as not found.
    """
    task, given = verdict.task, verdict.task.cone_deg / CONE_STEP_DEG

    def holds(step: int) -> bool:
        tried = replace(task, cone_deg=step * CONE_STEP_DEG)
        return check(verdict.robot, verdict.cells, tried, case.search, clock=clock).feasible

    first, last = round(LEAST_CONE_DEG / CONE_STEP_DEG), math.ceil(given)
    if not verdict.feasible:
        first = max(first, math.floor(given) + 1)
        last = round((180.0 if task.roll is None else 90.0) / CONE_STEP_DEG)
        if last < first or not holds(last):
            return None
    found = first + bisect_left(range(first, last), True, key=holds)
    return min(found * CONE_STEP_DEG, task.cone_deg if verdict.feasible else math.inf)
