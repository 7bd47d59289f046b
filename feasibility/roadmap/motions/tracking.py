"""One certified motion along the surface, from one cell's centre to its neighbour's.

The target moves along the curve between the centres (`surfaces.cell_curves`), so that nothing here
depends on the kind of surface.

The arm follows: a predictor step, Newton on the tool point, and the free directions used to stay
away from limits and from the boundaries of cone and roll, or to head for a goal configuration. A
step is kept only when `feasibility.roadmap.motions.segment_bound` shows that the straight joint
segment obeys every constraint between its ends too; otherwise it is shortened. Where no step is
short enough, the tool point may leave its target, within the tolerance.
"""

import numpy as np

from coverable.arrays import Array
from coverable.kernels import entry, kernel, spliced
from feasibility.roadmap.motions import self_motion
from feasibility.roadmap.motions.aiming import aim, bounds_between, look_at
from feasibility.roadmap.motions.off_target import STEPS_FROM_NEAR, project_off_target
from feasibility.roadmap.motions.projection import linearise, project
from feasibility.roadmap.motions.search_arrays import FOLD, LONG, SINGULAR, STOPPED, SearchArrays
from feasibility.roadmap.motions.segment_bound import segment_holds
from feasibility.roadmap.motions.working_memory import (
    HERE,
    NEXT,
    Work,
    accept,
    copy_slot,
    place,
    put,
)

SMALLEST_STEP = 2.0**-7  # [1] of the curve between two centres: a shorter step ends the motion
OFF_TARGET_STEP = 2.0**-4  # [1] of the curve: the first step with the tool point off its target
MOST_STEPS = 400  # of one motion
FOLLOWING = 4.0  # [1] times the turn of a direction: the tool is to follow before it has to
NEWTON_AHEAD = np.int64(8)  # Newton steps onto the target ahead
NOWHERE = -1  # in place of a cell


def track(
    arrays: SearchArrays,
    work: Work,
    curve: int,
    ends: tuple[float, float],
    q: Array,
    goal: Array | None = None,
    heading: bool = True,
    cell: int = NOWHERE,
) -> tuple[Array | None, bool]:
    """Follow a curve from a configuration q (n,), and go on to a goal.

    Args:
        arrays, work: what the kernels read, and the working memory of this thread.
        curve: which curve.
        ends: parameters in [0, 1]: where q is, and where to go, in either direction.
        q: where the motion starts.
        goal: (n,) configuration to head for, where there is one.
        heading: False where it is a goal at the end of the curve alone.
        cell: there, over whose centre a self-motion, see `connect`, is to reach it.

    Returns:
        (k, n) waypoints, the start left out; None when the motion stopped short on the curve
        (`work.stop_reason` holds the reason). And whether the self-motion, which is among them
        then, reached the goal.
    """
    here, waypoints = q.copy(), np.empty((MOST_STEPS + self_motion.CONNECT_STEPS, len(q)))
    heading, goal = (False, q) if goal is None else (heading, goal)
    goal = goal.copy()  # for one that is read-only, numba would compile all once more
    rows, more = _track(arrays, work, curve, *ends, here, goal, heading, cell, waypoints)
    return None if rows == STOPPED else waypoints[: rows + more].copy(), more > 0


@kernel
def span_of(arrays, work, curve, begin, end):
    """Distance of two targets of a curve over `arrays.scale`; and FOLLOWING turns on the spot."""
    aim(arrays, work, curve, begin)
    x, y, z = work.target[0, 0], work.target[0, 1], work.target[0, 2]
    u, v, w = work.target[1, 0], work.target[1, 1], work.target[1, 2]
    aim(arrays, work, curve, end)
    dx, dy, dz = work.target[0, 0] - x, work.target[0, 1] - y, work.target[0, 2] - z
    du, dv, dw = work.target[1, 0] - u, work.target[1, 1] - v, work.target[1, 2] - w
    on_the_spot = arrays.settled_chord < arrays.cone_chord
    turn = np.sqrt(du * du + dv * dv + dw * dw) if on_the_spot else 0.0
    return np.sqrt(dx * dx + dy * dy + dz * dz) / arrays.scale + FOLLOWING * turn


@spliced
def _step_from(arrays, work, q, dt, off_target):
    """Project q, with its secondary step, onto the target ahead; `work.trial` is the result.

    Returns what `segment_holds` does, inf where the projection failed.
    """
    put(work.trial, q)
    slack = self_motion.CONE_SLACK * dt
    good = project(arrays, work, work.trial, slack, work.error[0, 1], NEWTON_AHEAD)
    if not good and off_target:
        put(work.trial, q)
        copy_slot(arrays, work)
        good = project_off_target(arrays, work, work.trial, STEPS_FROM_NEAR)
    if not good:
        return np.inf, np.inf
    # Slot 0's errors are against the previous target: stored when that step was accepted.
    return segment_holds(arrays, work, q, work.trial)


@kernel
def _something_left(arrays, work):
    """Is anything left of tolerance, cone and roll on the present step?"""
    left = work.allowance[0] > 0.0 and work.allowance[1] > 0.0
    return left and (work.allowance[2] > 0.0 or not arrays.roll[1] < np.inf)


@kernel
def _starts_inside(arrays, work):
    """Does slot 0 obey tolerance, cone and roll?"""
    inside = work.error[0, 0] <= work.allowance[0] and work.error[0, 1] <= work.allowance[1]
    return inside and (abs(work.error[0, 2]) <= work.allowance[2] or not arrays.roll[1] < np.inf)


@entry
def _track(arrays, work, curve, begin, end, q, goal, heading, cell, waypoints):
    """Write the waypoints of `track` and move q along; returns the numbers on curve and cell."""
    rows = _along_curve(arrays, work, curve, begin, end, q, goal, heading, waypoints)
    if rows == STOPPED or cell == NOWHERE:
        return rows, 0
    look_at(arrays, work, cell)
    more, reached = self_motion.move_towards(arrays, work, q, goal, waypoints[rows:])
    return rows, more if reached else 0


@spliced
def _along_curve(arrays, work, curve, begin, end, q, goal, heading, waypoints):
    """Those on the curve; returns their number, or STOPPED."""
    n = q.shape[0]
    size = span_of(arrays, work, curve, begin, end)
    aim(arrays, work, curve, begin)
    place(arrays, work, HERE, q)
    bounds_between(arrays, work, curve, begin, begin)
    if not _starts_inside(arrays, work):
        work.stop_reason[0] = SINGULAR if _something_left(arrays, work) else FOLD
        return STOPPED
    t, dt, written = 0.0, 1.0, 0
    off_target = work.error[HERE, 0] > arrays.near
    for _ in range(MOST_STEPS):
        dt = min(dt, 1.0 - t)
        if 1.0 - t - dt < 0.1 * dt:
            dt = 1.0 - t  # no tiny step at the end
        here, there = begin + t * (end - begin), begin + (t + dt) * (end - begin)
        bounds_between(arrays, work, curve, here, there)
        if not (work.derivative_bound[0] < np.inf and _something_left(arrays, work)):
            work.stop_reason[0] = FOLD
            return STOPPED
        aim(arrays, work, curve, there)
        copy_slot(arrays, work)
        if heading:
            for j in range(n):
                work.secondary_step[j] = dt / (1.0 - t) * (goal[j] - q[j])
        else:
            linearise(arrays, work, NEXT)
            self_motion.margin_objective(arrays, work, q, 2.0 * size * dt)
        position, cone = _step_from(arrays, work, q, dt, off_target)
        if position <= 1.0 and cone <= 1.0:
            for j in range(n):
                q[j] = work.trial[j]
                waypoints[written, j] = q[j]
            written += 1
            t += dt
            if t >= 1.0 - 1e-12:
                return written
            accept(work)
            dt *= min(2.0, 0.85 / np.sqrt(max(position, 0.1)))
            continue
        if 1.0 < position < np.inf:
            dt *= max(0.2, min(0.7, 0.85 / np.sqrt(position)))
        else:
            dt *= 0.5
        if dt < SMALLEST_STEP:
            if off_target:
                return STOPPED
            off_target, dt = True, OFF_TARGET_STEP
    work.stop_reason[0] = LONG
    return STOPPED
