"""The margins that the motion over a placement leaves, as shares from 0 (none) to 1 (all).

- limits: over every cell, how far a joint stays from the nearer end of its range, by half the range
- cone: over every cell, how far the tool axis stays inside the cone, by its angle
- reach: how far the furthest target stays inside the reach bound, by the reach

The measure of a placement is the least of the three. Each cell counts with the configuration of the
covering motion's component that leaves most of limits and cone, after self-motions over the cell's
centre away from both; each such step is certified, as those of the search are.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from feasibility.compiled import kernel
from feasibility.roadmap import (
    CONE_SLACK,
    HERE,
    NEWTON_STEPS,
    NEXT,
    NODES,
    Exploration,
    accept,
    copy_slot,
    linearise,
    look_at,
    margin_objective,
    place,
    project,
    root_of,
    segment_holds,
)

NARROW = 0.1  # [1] of the cone: no axis is led further inside
MARGIN_STEPS = np.int64(80)  # over one cell's centre, away from limits and boundary of the cone
STALE = 8  # of them without gain end it
MOST_SETTLED = 2  # configurations over one cell from which margins are widened


@kernel
def _margins_at(problem, work, q, out):  # type: ignore[no-untyped-def]
    """Shares of half range and of cone that q leaves (slot 0 holds it)."""
    out[0] = 1.0
    for j in range(q.shape[0]):
        half = 0.5 * (problem.upper[j] - problem.lower[j])
        if half > 0.0 and half < np.inf:
            out[0] = min(out[0], 1.0 - abs((q[j] - problem.lower[j]) / half - 1.0))
    out[1] = max(0.0, 1.0 - work.error[0, 1] / problem.cone_chord)


@kernel
def _widen_margins(problem, aimed, work, target, approach, q, best):  # type: ignore[no-untyped-def]
    """Self-motion over one target away from limits and boundary of the cone; changes q and `best`.

    As `self_motion.settle`, but further: each step leads the axis inwards by a part of its angle,
    down to the cone of `aimed`. Every step is certified. `best` gets the margins.
    """
    n = q.shape[0]
    here = np.empty(2)
    look_at(problem, work, target, approach)
    place(problem, work, HERE, q)
    _margins_at(problem, work, q, best)
    size, stale = 0.3, 0
    for _ in range(MARGIN_STEPS):
        copy_slot(work)
        linearise(problem, work, NEXT, problem.cone_chord)
        margin_objective(problem, work, q, size)
        for j in range(n):
            work.trial[j] = q[j]
        slack = CONE_SLACK * size / 0.3
        good = project(aimed, work, work.trial, slack, work.error[1, 1], NEWTON_STEPS)
        if good:
            position, cone = segment_holds(problem, work, q, work.trial)
            good = position <= 1.0 and cone <= 1.0
        if not good:
            size *= 0.5
            if size < 0.01:
                return
            continue
        for j in range(n):
            q[j] = work.trial[j]
        accept(work)
        _margins_at(problem, work, q, here)
        stale += 1
        if min(here[0], here[1]) > min(best[0], best[1]) + 1e-3:
            best[0], best[1], stale = here[0], here[1], 0
        if stale > STALE:
            return


def least_margins(exploration: Exploration) -> NDArray[np.float64]:
    """(2,) shares of limits and of cone that the best component leaves over every cell."""
    problem, roadmap, work = exploration.arrays, exploration.roadmap, exploration.work
    # Steps over a centre head for a cone that is next to nothing, and keep to the task's.
    aimed = problem._replace(
        cone_chord=NARROW * problem.cone_chord if problem.cone_chord < np.inf else np.inf
    )
    here = np.empty(2)
    best = np.full((len(exploration.cells), 2), -1.0)  # limits and cone, the widest so far
    settled = np.zeros(len(exploration.cells), dtype=np.int64)
    for x in range(int(roadmap.counters[NODES])):
        cell = int(roadmap.cell[x])
        if root_of(roadmap, roadmap.component[x]) != exploration.best:
            continue
        if settled[cell] == MOST_SETTLED:
            continue
        settled[cell] += 1
        q = roadmap.q[x].copy()
        _widen_margins(
            problem, aimed, work, problem.points[cell], problem.approaches[cell], q, here
        )
        if here.min() > best[cell].min():
            best[cell] = here
    return np.clip(best.min(axis=0), 0.0, 1.0)
