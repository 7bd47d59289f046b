"""Projection onto the constraint manifold: tool point at its target, cone and limits obeyed.

Newton's method, each step the least one that corrects tool point and cone inside the limits: joints
that would pass a limit are held at it. The first step follows a secondary objective in the free
directions.
"""

from __future__ import annotations

import numpy as np

from feasibility.compiled import inlined, kernel
from feasibility.roadmap.arrays import (
    CONE,
    LIMIT,
    NEXT,
    SINGULAR,
    look_at,
    place,
)
from robots import jacobians

COMFORT = 0.7  # [1] share of the cone chord that a step keeps to where it can
LARGEST_STEP = 0.35  # [rad] or [m], largest change of one joint in one Newton step
# Rows of a step: the tool point; and the cone; and, where that is narrow, both tilts.
POINT, POINT_AND_CONE, POINT_AND_TILTS = np.int64(3), np.int64(4), np.int64(5)
NARROW = 0.06  # [1] a cone chord below which a step across the cone's row would leave the cone
HALF = 0.5  # [1] of a narrow cone's chord: where both tilts are led
DAMPING = 1e-9  # [1] of the rows' squares: at a singularity the step stays finite
PROJECTION_SLACK = 1e-6  # [1] share of the cone chord that the projection of a guess keeps free
PROJECTION_STEPS = np.int64(60)


@kernel
def cholesky_solve(a, b, m):  # type: ignore[no-untyped-def]
    """Solve the m x m symmetric a y = b in place; False when a is not positive definite."""
    for i in range(m):
        for j in range(i + 1):
            total = a[i, j]
            for k in range(j):
                total -= a[i, k] * a[j, k]
            if i == j:
                if not total > 0.0:
                    return False
                a[i, i] = np.sqrt(total)
            else:
                a[i, j] = total / a[j, j]
    for i in range(m):
        for k in range(i):
            b[i] -= a[i, k] * b[k]
        b[i] /= a[i, i]
    for i in range(m - 1, -1, -1):
        for k in range(i + 1, m):
            b[i] -= a[k, i] * b[k]
        b[i] /= a[i, i]
    return True


@kernel
def least_step(arrays, work, q, m, damping):  # type: ignore[no-untyped-def]
    """The step nearest to `work.secondary_step` with rows @ step = rhs, inside the limits.

    Only the first m rows count. Joints that would pass a limit are held at it, the furthest first,
    and the others take over. Returns False when too few joints are left. With a larger `damping`
    (a share of the rows' squares) the step is shorter, and the rows hold as nearly as they can.
    """
    n = q.shape[0]
    a = np.empty((5, 5))
    y = np.empty(5)
    for j in range(n):
        work.held[j] = False
        work.step[j] = 0.0
    for _ in range(n + 1):
        trace = 0.0
        for i in range(m):
            y[i] = work.rhs[i]
            for j in range(n):
                y[i] -= work.rows[i, j] * (work.step[j] if work.held[j] else work.secondary_step[j])
            for k in range(i + 1):
                total = 0.0
                for j in range(n):
                    if not work.held[j]:
                        total += work.rows[i, j] * work.rows[k, j]
                a[i, k] = total
            trace += a[i, i]
        if not trace > 1e-14:
            return False
        for i in range(m):
            a[i, i] += damping * trace
        if not cholesky_solve(a, y, m):
            return False
        worst, furthest = -1, 1e-14
        for j in range(n):
            if work.held[j]:
                continue
            s = work.secondary_step[j]
            for i in range(m):
                s += work.rows[i, j] * y[i]
            work.step[j] = s
            over = max(q[j] + s - arrays.upper[j], arrays.lower[j] - q[j] - s)
            if over > furthest:
                worst, furthest = j, over
        if worst < 0:
            return True
        work.stop_reason[1] = worst
        limit = arrays.upper[worst] if work.step[worst] > 0.0 else arrays.lower[worst]
        work.step[worst] = limit - q[worst]
        work.held[worst] = True
    return False


@kernel
def linearise(arrays, work, slot, chord_goal):  # type: ignore[no-untyped-def]
    """Linearise at a slot: three position rows, and a cone row; returns the norm of the cone row.

    The cone row is the derivative of c = |a - b|, which is well scaled for narrow cones too.
    """
    jacobians(
        arrays.chain,
        work.origins[slot],
        work.axes[slot],
        work.point[slot],
        work.axis[slot],
        work.point_rows,
        work.axis_rows,
    )
    n = work.step.shape[0]
    chord = work.error[slot, 1]
    for k in range(3):
        work.rhs[k] = work.target[0, k] - work.point[slot, k]
        for j in range(n):
            work.rows[k, j] = work.point_rows[k, j]
    work.rhs[3] = chord_goal - chord
    norm = 0.0
    if chord > 1e-12:
        for j in range(n):
            total = 0.0
            for k in range(3):
                total += (work.axis[slot, k] - work.target[1, k]) * work.axis_rows[k, j]
            work.rows[3, j] = total / chord
            norm += work.rows[3, j] ** 2
    else:
        for j in range(n):
            work.rows[3, j] = 0.0
    return np.sqrt(norm)


@inlined
def tilts(work, goal):  # type: ignore[no-untyped-def]
    """Replace the cone row by two: the tilts of the axis along two directions across the target's.

    A step across the row of |a - b| leaves a narrow cone; these two rows hold the axis in both
    directions. They lead the chord to `goal`, or hold it where it is smaller. Needs `linearise`.
    """
    bx, by, bz = work.target[1, 0], work.target[1, 1], work.target[1, 2]
    # Two unit vectors across b: b x e for the axis e that is furthest from b, and b x that.
    tx, ty, tz = 0.0, bz, -by
    if abs(bx) > 0.6:
        tx, ty, tz = -bz, 0.0, bx
    length = np.sqrt(tx * tx + ty * ty + tz * tz)
    tx, ty, tz = tx / length, ty / length, tz / length
    sx, sy, sz = by * tz - bz * ty, bz * tx - bx * tz, bx * ty - by * tx
    chord = work.error[1, 1]
    back = 1.0 - goal / chord if chord > goal else 0.0
    ax, ay, az = work.axis[1, 0] - bx, work.axis[1, 1] - by, work.axis[1, 2] - bz
    work.rhs[3] = -back * (tx * ax + ty * ay + tz * az)
    work.rhs[4] = -back * (sx * ax + sy * ay + sz * az)
    for j in range(work.step.shape[0]):
        rx, ry, rz = work.axis_rows[0, j], work.axis_rows[1, j], work.axis_rows[2, j]
        work.rows[3, j] = tx * rx + ty * ry + tz * rz
        work.rows[4, j] = sx * rx + sy * ry + sz * rz


@kernel
def cone_step(arrays, work, q, goal, narrow):  # type: ignore[no-untyped-def]
    """`least_step` with the cone: by both tilts where it is narrow, as long as joints suffice."""
    if narrow:
        tilts(work, goal)
        if least_step(arrays, work, q, POINT_AND_TILTS, DAMPING):
            free = 0
            for j in range(q.shape[0]):
                if not work.held[j]:
                    free += 1
            if free >= POINT_AND_TILTS:
                return True
        if not linearise(arrays, work, NEXT, goal) > 0.0:
            return False
    return least_step(arrays, work, q, POINT_AND_CONE, DAMPING)


@inlined
def predicted_chord(work):  # type: ignore[no-untyped-def]
    """|a - b| after `work.step`, to first order."""
    square = 0.0
    for k in range(3):
        change = work.axis[1, k] - work.target[1, k]
        for j in range(work.step.shape[0]):
            change += work.axis_rows[k, j] * work.step[j]
        square += change * change
    return np.sqrt(square)


@kernel
def move(arrays, work, q):  # type: ignore[no-untyped-def]
    """Take `work.step` from q (in place), shortened if it is long, and evaluate the arm there."""
    largest = 0.0
    n = q.shape[0]
    for j in range(n):
        largest = max(largest, abs(work.step[j]))
    shrink = 1.0 if largest <= LARGEST_STEP else LARGEST_STEP / largest
    for j in range(n):
        q[j] = min(max(q[j] + shrink * work.step[j], arrays.lower[j]), arrays.upper[j])
        work.secondary_step[j] = 0.0
    place(arrays, work, NEXT, q)


@kernel
def project(arrays, work, q, slack, before, most):  # type: ignore[no-untyped-def]
    """Project q (in place) onto the constraints over `work.target`; slot 1 holds the result.

    The first step starts from slot 1's placement of q, heads for `work.secondary_step`, and keeps
    well inside the cone; `before` is |a - b| at the start of the step, from where the axis is led
    inwards gradually (inf where that does not matter). Later steps are the least ones that correct
    the errors. Returns True when the tool point is within `arrays.near` of its target, and the axis
    inside the cone.
    """
    inner = work.allowance[1]
    hard = inner * (1.0 - slack)
    narrow = inner < NARROW
    last = np.inf
    for it in range(most):
        if it > 0 and work.error[1, 0] <= arrays.near and work.error[1, 1] <= inner:
            return True
        chord = work.error[1, 1]
        goal = hard
        if narrow:
            goal = HALF * hard
        elif it == 0:
            # Lead the axis inwards by a part of what the target's motion costs anyway.
            inwards = max(0.5 * (chord - before), 150.0 * slack * before)
            goal = min(hard, max(COMFORT * arrays.cone_chord, before - inwards))
        usable = linearise(arrays, work, NEXT, goal) > 1e-9 or narrow
        work.stop_reason[1] = -1
        cone = chord > goal and usable
        if cone:
            done = cone_step(arrays, work, q, goal, narrow)
        else:
            done = least_step(arrays, work, q, POINT, DAMPING)
        # Would the step leave the cone? Then repeat it along the boundary of the cone.
        near = narrow or chord > 0.3 * goal
        if done and not cone and usable and near and predicted_chord(work) > goal:
            cone = True
            done = cone_step(arrays, work, q, goal, narrow)
        if not done and cone and goal < hard and chord > 1e-12:
            if narrow:
                linearise(arrays, work, NEXT, hard)
            work.rhs[3] = hard - chord
            done = least_step(arrays, work, q, POINT_AND_CONE, DAMPING)
        if not done:
            work.stop_reason[0] = (
                LIMIT if work.stop_reason[1] >= 0 else (CONE if cone else SINGULAR)
            )
            return False
        move(arrays, work, q)
        error = work.error[1, 0] / arrays.scale + max(work.error[1, 1] - inner, 0.0)
        work.stop_reason[0] = LIMIT if work.stop_reason[1] >= 0 else (CONE if cone else SINGULAR)
        if not error < np.inf or (it > 2 and error > 2.0 * last and most < 20):
            return False
        last = error
    return work.error[1, 0] <= arrays.near and work.error[1, 1] <= inner


@kernel
def project_onto_cell(arrays, work, cell, q, most):  # type: ignore[no-untyped-def]
    """Project a guess q (in place) onto the constraints over a cell's centre; True on success."""
    look_at(arrays, work, arrays.points[cell], arrays.approaches[cell])
    place(arrays, work, NEXT, q)
    for j in range(q.shape[0]):
        work.secondary_step[j] = 0.0
    return project(arrays, work, q, PROJECTION_SLACK, np.inf, most)
