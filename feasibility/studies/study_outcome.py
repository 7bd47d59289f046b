"""What a study keeps of one verdict: plain numbers and words, computed where the task runs."""

import math
import time
from bisect import bisect_left
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from feasibility.clock import Clock, OutOfTime
from feasibility.division.set_covering import undominated
from feasibility.search_settings import Search
from feasibility.sensitivity.quantities import LEAST_CONE_DEG
from feasibility.studies.built_cases import arm_of, case_of, cut_of
from feasibility.studies.pool import Tables
from feasibility.studies.stored import Divided, Margins, Outcome, bits_of
from feasibility.verdict import Verdict

CONE_STEP_DEG = 0.5  # resolution of the critical cone
MOST_DIVIDED = 400  # cells of a surface that is divided: a division takes several verdicts


def evaluate(tables: Tables) -> Outcome | Divided:
    """Decide one case, given as by `Case.to_tables`.

    The outcome depends on the tables alone, as long as the search has no time limit; a limit
    counts from here on, for loading and cutting too. A table `wanted`, where it is there, says
    whether to look for `causes` of missed cells, to count `patches` (motions that together cover
    all that can be covered), and for the `critical` cone, the smallest with which one covers all.

    Raises:
        CaseError: the case cannot be used.
    """
    from feasibility.checking import check

    case = case_of(tables)
    clock = Clock(case.search.time_limit).begin(time.monotonic())  # kernels are loaded before
    wanted = tables.get("wanted", {})
    verdict = check(arm_of(case), cut_of(case), case.built_task(), case.search, clock=clock)
    found = outcome_of(verdict, wanted.get("causes", True))
    if not wanted.get("patches"):
        return found
    motions, share = (1, 1.0) if verdict.feasible else _patches(verdict, case.search, clock)
    sought = wanted["critical"] and not clock.out_of_time
    cone = critical_cone(verdict, case.search, clock) if sought else None
    return {**found, "patches": motions, "patches_share": share, "critical_cone_deg": cone}


def _patches(
    verdict: Verdict, search: Search, clock: Clock
) -> tuple[int, float] | tuple[None, None]:
    """The least number of motions, and the share of the area that they cover; None if not known."""
    from feasibility.division.surface_division import divide

    if len(verdict.cells) > MOST_DIVIDED or clock.out_of_time:
        return None, None
    try:
        found = divide(verdict.robot, verdict.cells, verdict.task, search, clock=clock)
    except OutOfTime:
        return None, None
    accepted = [patch for patch in found.patches if patch.accepted]
    return len(accepted), sum(patch.area for patch in accepted) / float(verdict.cells.areas.sum())


def critical_cone(verdict: Verdict, search: Search, clock: Clock) -> float | None:
    """The smallest cone, deg, with which a covering motion is found; None where none is.

    A wider cone allows all that a narrower one does, so halving finds it. What a search cannot
    decide counts as not found.
    """
    from feasibility.checking import check

    task, given = verdict.task, verdict.task.cone_deg / CONE_STEP_DEG

    def holds(step: int) -> bool:
        tried = replace(task, cone_deg=step * CONE_STEP_DEG)
        return check(verdict.robot, verdict.cells, tried, search, clock=clock).feasible

    first, last = round(LEAST_CONE_DEG / CONE_STEP_DEG), math.ceil(given)
    if not verdict.feasible:
        first = max(first, math.floor(given) + 1)
        last = round((180.0 if task.roll is None else 90.0) / CONE_STEP_DEG)
        if last < first or not holds(last):
            return None
    found = first + bisect_left(range(first, last), True, key=holds)
    return min(found * CONE_STEP_DEG, task.cone_deg if verdict.feasible else math.inf)


def outcome_of(verdict: Verdict, causes: bool = True) -> Outcome:
    """A verdict as JSON values; no timing, so that the same case always has the same outcome.

    Causes of missed cells take some time; where they are not wanted there are none.
    """
    areas = np.asarray(verdict.cells.areas)
    total = float(areas.sum())
    kinds = Counter(cause.kind for cause in verdict.causes) if causes else Counter()
    covers = np.zeros((len(verdict.components), len(verdict.cells)), dtype=bool)
    for row, cells in zip(covers, verdict.components, strict=True):
        row[cells] = True
    return {
        "verdict": verdict.answer,
        "evidence": verdict.evidence,
        "message": verdict.message,
        "method": "greedy" if verdict.method == "greedy" else "complete",
        "seed": int(verdict.seed),
        "cells": len(verdict.cells),
        "covered": verdict.n_covered,
        "share": float(areas[verdict.covered].sum()) / total if total > 0.0 else 1.0,
        "edges": int(verdict.n_edges),
        "pairs": len(verdict.cells.pairs),
        "causes": dict(sorted(kinds.items(), key=lambda entry: (-entry[1], entry[0]))),
        "components": [bits_of(cover) for cover in covers[undominated(covers)]],
        "margins": margins_of(verdict),
        "unchecked_links": list(verdict.unchecked_links),
        "fk": int(verdict.statistics.get("fk", 0)),
    }


def merit(outcome: Mapping[str, Any]) -> tuple[bool, float, float]:
    """A key that sorts outcomes, the best first: feasible, by covered share, by margin to limits.

    The share is absent where the task failed.
    """
    margins = outcome.get("margins") or {}
    limit = margins.get("limit_deg")
    margin = 0.0 if not margins else 360.0 if limit is None else float(limit)
    share = float(outcome.get("share", -1.0))  # unknown is worse than nothing
    return outcome["verdict"] != "feasible", -share, -margin


def margins_of(verdict: Verdict) -> Margins | None:
    """What the covering motion keeps from every bound; None where no motion is certified."""
    certificate, robot, task = verdict.certificate, verdict.robot, verdict.task
    if certificate is None or not verdict.feasible or len(verdict.cells) == 0:
        return None
    revolute = prismatic = math.inf
    if verdict.witness is not None:
        q = verdict.witness.q
        least = np.minimum(q - robot.lower, robot.upper - q).min(axis=0, initial=np.inf)
        revolute = math.degrees(float(least[~robot.prismatic].min(initial=np.inf)))
        prismatic = float(least[robot.prismatic].min(initial=np.inf))
    points, margin = task.targets(verdict.cells).points, certificate.placement_margin
    away = float(robot.distance_from_base(points).max())
    return {
        "limit_deg": finite(revolute),
        "limit_m": finite(prismatic),
        "cone_deg": task.cone_deg - math.degrees(float(certificate.max_angle)),
        "reach_m": finite(robot.reach - away),
        "placement_m": None if margin is None else float(margin.position),
    }


def finite(value: float) -> float | None:
    """JSON has neither inf nor NaN."""
    return float(value) if math.isfinite(value) else None
