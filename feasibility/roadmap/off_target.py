"""Targets that the tool point cannot reach exactly, but within the tolerance.

A target may lie beyond the reach, or beyond a joint's limit, by less than the tolerance; covered
means within it. Where the projection onto the exact target fails, the tool point is brought as near
to it as limits and cone allow.
"""

from __future__ import annotations

import numpy as np

from feasibility.compiled import kernel, put
from feasibility.roadmap.arrays import NEXT, cone_used, place
from feasibility.roadmap.projection import (
    POINT,
    POINT_AND_CONE,
    least_step,
    linearise,
    move,
    project_onto_cell,
)

SLACK = 1e-3  # [1] share of the cone chord that is kept free
GAIN = 1e-4  # [1] a step that brings the tool point nearer by a smaller share is the last
STEPS = np.int64(40)  # from a guess
STEPS_FROM_NEAR = np.int64(15)  # from the step before, of a track or a self-motion
LEAST, FIRST, MOST = 1e-9, 1e-4, 10.0  # [1] damping, a share of the rows' squares
CONE_WEIGHT = 10.0  # [1] of the cone's row beside those of the tool point


@kernel
def project_off_target(arrays, work, q, most):  # type: ignore[no-untyped-def]
    """Bring the tool point as near to `work.target` as limits and cone allow, from q (in place).

    For targets that the tool point cannot reach exactly, but within the tolerance. A damped
    (Levenberg-Marquardt) iteration on the distance, with the cone as a row of large weight. Slot 1
    holds the placement of q, before and after. Returns True when tool point and axis are inside
    what tolerance and cone leave, see `cone_used`.
    """
    n = q.shape[0]
    inner = work.allowance[1]
    goal = (1.0 - SLACK) * inner
    damping = FIRST
    best = np.inf
    for it in range(most):
        excess = max(cone_used(arrays, work, NEXT) - goal, 0.0)
        merit = work.error[1, 0] + arrays.scale * CONE_WEIGHT * excess
        if merit < best:
            if it > 0 and best - merit < GAIN * best and excess <= 0.0:
                break
            best = merit
            put(work.kept, q)
            damping = max(0.1 * damping, LEAST)
        else:
            # Back to the best configuration, and a shorter step.
            put(q, work.kept)
            place(arrays, work, NEXT, q)
            damping = 10.0 * damping
            if not damping < MOST:
                break
        if work.error[1, 0] <= arrays.near and work.error[1, 1] <= goal:
            return True
        off = max(work.error[1, 0] - arrays.near, 0.0)
        chord_goal = max(goal - arrays.off_target_cost * work.derivative_bound[2] * off, 0.5 * goal)
        usable = linearise(arrays, work, NEXT, chord_goal) > 1e-9
        for j in range(n):
            work.secondary_step[j] = 0.0
        rows = POINT
        if usable and work.error[1, 1] > 0.98 * chord_goal:
            rows = POINT_AND_CONE
            work.rhs[3] *= CONE_WEIGHT
            for j in range(n):
                work.rows[3, j] *= CONE_WEIGHT
        if not least_step(arrays, work, q, rows, damping):
            break
        move(arrays, work, q)
    put(q, work.kept)
    place(arrays, work, NEXT, q)
    return work.error[1, 0] <= work.allowance[0] and cone_used(arrays, work, NEXT) <= inner


@kernel
def project_near_cell(arrays, work, cell, q, most):  # type: ignore[no-untyped-def]
    """`project_onto_cell`, or failing that, to within the tolerance of the cell's centre."""
    if project_onto_cell(arrays, work, cell, q, most):
        return True
    return project_off_target(arrays, work, q, STEPS)
