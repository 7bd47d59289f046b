"""Self-motions over one cell: motions on the manifold of the configurations that are valid there.

The tool point stays at one target, axis and roll stay inside cone and range, and the free
directions (roll, tilt, redundancy) move. A motion that `connect` returns is certified as it is
made, see `feasibility.roadmap.motions.segment_bound`.
"""

import numpy as np

from coverable.arrays import Array
from coverable.kernels import entry, kernel, spliced
from feasibility.collisions.kernels.clearance import clearance_gradient
from feasibility.roadmap.motions.aiming import look_at
from feasibility.roadmap.motions.off_target import STEPS_FROM_NEAR, project_off_target
from feasibility.roadmap.motions.projection import (
    PROJECTION_STEPS,
    linearise,
    project,
    project_onto_cell,
)
from feasibility.roadmap.motions.search_arrays import SearchArrays
from feasibility.roadmap.motions.segment_bound import segment_holds
from feasibility.roadmap.motions.working_memory import (
    HERE,
    NEXT,
    OF_CONE,
    OF_ROLL,
    Work,
    accept,
    copy_slot,
    place,
    put,
)

CONE_SLACK = 1e-3  # [1] share of cone and roll kept free by a full step; less by a shorter one
NEWTON_AT_REST = np.int64(6)  # Newton steps of one step of a self-motion
CONNECT_STEPS = 60  # of one self-motion towards a goal
SETTLE_STEPS = np.int64(40)  # of `settle`


@entry
def effects(arrays, work, q, out):  # noqa: ANN001, ANN201
    """How much a radian (or metre) of each joint moves the tool at q: lever over scale, plus sine.

    Joint differences weighted in this way measure how much a motion moves the tool: the free roll
    of a wrist, or opposite turns of two joints about a common axis at a singularity, weigh little.
    Where roll is limited, a joint that turns it weighs by as much; so windings are far apart.
    """
    place(arrays, work, NEXT, q)
    for j in range(out.shape[0]):
        if arrays.chain.prismatic[j]:
            out[j] = 1.0 / arrays.scale
            continue
        zx, zy, zz = work.axes[NEXT, j, 0], work.axes[NEXT, j, 1], work.axes[NEXT, j, 2]
        x = work.point[NEXT, 0] - work.origins[NEXT, j, 0]
        y = work.point[NEXT, 1] - work.origins[NEXT, j, 1]
        z = work.point[NEXT, 2] - work.origins[NEXT, j, 2]
        r = (zy * z - zz * y) ** 2 + (zz * x - zx * z) ** 2 + (zx * y - zy * x) ** 2
        x, y, z = work.axis[NEXT, 0], work.axis[NEXT, 1], work.axis[NEXT, 2]
        s = (zy * z - zz * y) ** 2 + (zz * x - zx * z) ** 2 + (zx * y - zy * x) ** 2
        out[j] = np.sqrt(r) / arrays.scale + np.sqrt(s)
        if arrays.roll[1] < np.inf:
            out[j] += abs(zx * x + zy * y + zz * z)


@kernel
def _push_back(work, which, size, share):  # noqa: ANN001, ANN202
    """Add to `work.secondary_step` a step down a gradient, by its share (-1 to 1) of a range."""
    norm = 0.0
    for j in range(work.step.shape[0]):
        norm += work.gradients[which, j] ** 2
    if norm > 1e-12 and abs(share) < np.inf:
        push = size * min(max(share, -1.0), 1.0) ** 5 / np.sqrt(norm)
        for j in range(work.step.shape[0]):
            work.secondary_step[j] -= push * work.gradients[which, j]


@kernel
def margin_objective(arrays, work, q, size):  # noqa: ANN001, ANN201
    """Set `work.secondary_step` away from limits, boundaries, and what the arm may hit.

    The boundaries are those of cone and roll; their gradients are those of slot 1.
    """
    n = q.shape[0]
    for j in range(n):
        half = 0.5 * (arrays.upper[j] - arrays.lower[j])
        work.secondary_step[j] = 0.0
        if half < np.inf and half > 0.0:
            x = (q[j] - arrays.lower[j]) / half - 1.0
            x2 = x * x
            work.secondary_step[j] = -size * x * x2 * x2
    _push_back(work, OF_CONE, size, work.error[1, 1] / arrays.settled_chord)
    if arrays.roll[1] < np.inf:
        _push_back(work, OF_ROLL, size, work.error[1, 2] / arrays.roll[1])
    if arrays.collisions.shape[0] > 0:
        clearance_gradient(arrays.collisions, q, work.secondary_step, size)


@spliced
def _step_towards(arrays, work, q, goal, share, slack, off_target):  # noqa: ANN001, ANN202
    """Put a share of the way from q to the goal, projected, into `work.trial`; True on success."""
    copy_slot(arrays, work)
    for j in range(q.shape[0]):
        work.trial[j] = q[j]
        work.secondary_step[j] = share * (goal[j] - q[j])
    if project(arrays, work, work.trial, slack, np.inf, NEWTON_AT_REST):
        return True
    if not off_target:
        return False
    for j in range(q.shape[0]):
        work.trial[j] = q[j] + share * (goal[j] - q[j])
    place(arrays, work, NEXT, work.trial)
    return project_off_target(arrays, work, work.trial, STEPS_FROM_NEAR)


def connect(arrays: SearchArrays, work: Work, q: Array, goal: Array) -> tuple[Array, bool]:
    """Self-motion over `work.target`, at rest, from a configuration q (n,) towards another one.

    Each step heads for the goal and is projected back onto the manifold. The motion ends early when
    it falls behind: a step that brings the goal nearer by only a small part of its length means
    that the manifold bends away, and other nodes have to be tried. The motion up to there is kept,
    and is certified.

    Returns:
        (k, n) waypoints, the start left out; and whether the last one is `goal`.
    """
    waypoints = np.empty((CONNECT_STEPS, len(q)))
    rows, reached = move_towards(arrays, work, q.copy(), goal.copy(), waypoints)
    return waypoints[:rows].copy(), bool(reached)


@entry
def move_towards(arrays, work, q, goal, waypoints):  # noqa: ANN001, ANN201
    """Write the waypoints of `connect` and move q along; returns their number, and `reached`."""
    n = q.shape[0]
    place(arrays, work, HERE, q)
    size, written = 0.3, 0
    left = 0.0
    for j in range(n):
        left += (goal[j] - q[j]) ** 2
    left = np.sqrt(left)
    allowed = 1.5 * left + 0.1
    off_target = work.error[HERE, 0] > arrays.near
    for _ in range(CONNECT_STEPS):
        if left <= size:
            for j in range(n):
                work.trial[j] = goal[j]
            place(arrays, work, NEXT, work.trial)
            position, cone = segment_holds(arrays, work, q, work.trial)
            if position <= 1.0 and cone <= 1.0:
                for j in range(n):
                    q[j] = goal[j]
                    waypoints[written, j] = q[j]
                return written + 1, True
            size = 0.5 * left
        position, cone = np.inf, np.inf
        remaining, moved = np.inf, 0.0
        slack = 0.25 * CONE_SLACK * min(1.0, size / 0.1)
        share = min(1.0, size / max(left, 1e-12))
        if _step_towards(arrays, work, q, goal, share, slack, off_target):
            position, cone = segment_holds(arrays, work, q, work.trial)
            remaining = 0.0
            for j in range(n):
                remaining += (goal[j] - work.trial[j]) ** 2
                moved += (work.trial[j] - q[j]) ** 2
            remaining = np.sqrt(remaining)
            moved = np.sqrt(moved)
        if position <= 1.0 and cone <= 1.0:
            allowed -= moved
            if left - remaining < 0.05 * size or allowed < remaining:
                return written, False
            for j in range(n):
                q[j] = work.trial[j]
                waypoints[written, j] = q[j]
            written += 1
            left = remaining
            accept(work)
            size = min(0.5, 1.6 * size)
        else:
            size *= 0.5
            if size < 1e-3:
                return written, False
    return written, False


@entry
def settle(arrays, work, cell, q, most):  # noqa: ANN001, ANN201
    """Self-motion over a cell's centre (q in place) away from limits and boundaries."""
    n = q.shape[0]
    look_at(arrays, work, cell)
    place(arrays, work, HERE, q)
    off_target = work.error[HERE, 0] > arrays.near
    size = 0.3
    for _ in range(most):
        copy_slot(arrays, work)
        linearise(arrays, work, NEXT)
        margin_objective(arrays, work, q, size)
        for j in range(n):
            work.trial[j] = q[j]
        good = project(arrays, work, work.trial, CONE_SLACK, np.inf, NEWTON_AT_REST)
        if not good and off_target:
            put(work.trial, q)
            place(arrays, work, NEXT, work.trial)
            good = project_off_target(arrays, work, work.trial, STEPS_FROM_NEAR)
        if good:
            position, cone = segment_holds(arrays, work, q, work.trial)
            good = position <= 1.0 and cone <= 1.0
        if good:
            moved = 0.0
            for j in range(n):
                moved = max(moved, abs(work.trial[j] - q[j]))
                q[j] = work.trial[j]
            accept(work)
            if moved < 0.02 * size:
                return
        else:
            size *= 0.5
            if size < 0.02:
                return


def margin_shares(arrays: SearchArrays, work: Work, cell: int, guesses: Array) -> Array:
    """Project guesses (in place) onto the constraints over a cell, and measure their margins.

    Returns:
        (k,) the share of its half range, or of the cone, that the tightest constraint leaves free:
        1 in the middle of all ranges, 0 at a limit or at the boundary of the cone, -1 where the
        projection failed.
    """
    margins = np.full(len(guesses), -1.0)
    for g, q in enumerate(guesses):
        if project_onto_cell(arrays, work, cell, q, PROJECTION_STEPS):
            settle(arrays, work, cell, q, SETTLE_STEPS)
            margins[g] = _margin(arrays, work, q)
    return margins


@np.errstate(divide="ignore", invalid="ignore")  # of a cone or a roll without room nothing is free
def _margin(arrays: SearchArrays, work: Work, q: Array) -> float:
    """What the tightest constraint leaves free where `settle` has ended."""
    half = 0.5 * (arrays.upper - arrays.lower)
    limited = (half > 0.0) & (half < np.inf)
    off = np.abs((q - arrays.lower)[limited] / half[limited] - 1.0)
    chord, turn = work.error[HERE, 1] / arrays.cone_chord, abs(work.error[HERE, 2]) / arrays.roll[1]
    return float(min(max(0.0, 1.0 - chord), max(0.0, 1.0 - turn), *(1.0 - off)))
