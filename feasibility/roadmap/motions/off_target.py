"""Targets that the tool point cannot reach exactly, but within the tolerance.

A target may lie beyond the reach, or beyond a joint's limit, by less than the tolerance; covered
means within it. Where the projection onto the exact target fails, the tool point is brought as near
to it as limits and cone allow.
"""

import numpy as np

from coverable.arrays import Array
from coverable.kernels import entry, kernel
from feasibility.roadmap.motions.linear_steps import least_step
from feasibility.roadmap.motions.projection import (
    POINT,
    add_row,
    linearise,
    move,
    project_onto_cell,
    roll_change,
)
from feasibility.roadmap.motions.search_arrays import SearchArrays
from feasibility.roadmap.motions.working_memory import (
    NEXT,
    OF_CONE,
    OF_ROLL,
    Work,
    cone_used,
    off_target,
    place,
    put,
    roll_lost,
    roll_used,
)

SLACK = 1e-3  # [1] share of cone and roll that is kept free
GAIN = 1e-4  # [1] a step that brings the tool point nearer by a smaller share is the last
STEPS = np.int64(40)  # from a guess
STEPS_FROM_NEAR = np.int64(15)  # from the step before, of a track or a self-motion
LEAST, FIRST, MOST = 1e-9, 1e-4, 10.0  # [1] damping, a share of the rows' squares
WEIGHT = 10.0  # [1] of the rows of cone and roll beside those of the tool point
CLOSE = 0.98  # [1] of what they may use: from there on they are rows of a step


@kernel
def project_off_target(arrays, work, q, most):
    """Bring the tool point as near to `work.target` as limits and cone allow, from q (in place).

    For targets that the tool point cannot reach exactly, but within the tolerance. A damped
    (Levenberg-Marquardt) iteration on the distance, with cone and roll as rows of large weight.
    Slot 1 holds the placement of q, before and after. Returns True when tool point, axis and roll
    are inside what tolerance, cone and range leave, see `cone_used`.
    """
    n = q.shape[0]
    inner, inner_roll = work.allowance[1], work.allowance[2]
    goal, roll_goal = (1.0 - SLACK) * inner, (1.0 - SLACK) * inner_roll
    damping = FIRST
    best = np.inf
    for it in range(most):
        excess = max(cone_used(arrays, work, NEXT) - goal, 0.0)
        if arrays.roll[1] < np.inf:
            excess += max(roll_used(arrays, work, NEXT) - roll_goal, 0.0)
        merit = work.error[1, 0] + arrays.scale * WEIGHT * excess
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
        at_target = work.error[1, 0] <= arrays.near and work.error[1, 1] <= goal
        if at_target and abs(work.error[1, 2]) <= roll_goal:
            return True
        linearise(arrays, work, NEXT)
        for j in range(n):
            work.secondary_step[j] = 0.0
        rows = _weighted_rows(arrays, work, goal, roll_goal)
        if not least_step(arrays, work, q, rows, damping):
            break
        move(arrays, work, q)
    put(q, work.kept)
    place(arrays, work, NEXT, q)
    if arrays.roll[1] < np.inf and not roll_used(arrays, work, NEXT) <= inner_roll:
        return False
    return work.error[1, 0] <= work.allowance[0] and cone_used(arrays, work, NEXT) <= inner


@kernel
def _weighted_rows(arrays, work, goal, roll_goal):
    """Rows of a step with cone and roll where they are nearly used; returns how many."""
    m = POINT
    off = off_target(arrays, work, NEXT)
    chord_goal = max(goal - arrays.off_target_cost * work.derivative_bound[2] * off, 0.5 * goal)
    norm = 0.0
    for j in range(work.step.shape[0]):
        norm += work.gradients[OF_CONE, j] ** 2
    if np.sqrt(norm) > 1e-9 and work.error[1, 1] > CLOSE * chord_goal:
        m = add_row(work, m, OF_CONE, chord_goal - work.error[1, 1])
    if arrays.roll[1] < np.inf:
        within = max(roll_goal - roll_lost(arrays, work, NEXT), 0.5 * roll_goal)
        if abs(work.error[1, 2]) > CLOSE * within:
            m = add_row(work, m, OF_ROLL, roll_change(work, within))
    for i in range(POINT, m):
        work.rhs[i] *= WEIGHT
        for j in range(work.step.shape[0]):
            work.rows[i, j] *= WEIGHT
    return m


@entry
def _project_off_target(arrays, work, q, most):
    """`project_off_target` for Python."""
    return project_off_target(arrays, work, q, most)


def project_near_cell(
    arrays: SearchArrays, work: Work, cell: int, q: Array, most: int | np.int64
) -> bool:
    """`project_onto_cell`, or failing that, to within the tolerance of the cell's centre."""
    onto = project_onto_cell(arrays, work, cell, q, most)
    return bool(onto or _project_off_target(arrays, work, q, STEPS))
