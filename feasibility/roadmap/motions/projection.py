"""Projection onto the constraint manifold: tool point at its target; cone, roll and limits obeyed.

Newton's method, each step the least one that corrects tool point, cone and roll inside the limits:
joints that would pass a limit are held at it. Cone and roll are rows of a step only where they are
violated, or would be. The first step follows a secondary objective in the free directions.
"""

import numpy as np

from coverable.kernels import entry, inlined, kernel
from feasibility.roadmap.motions.aiming import look_at
from feasibility.roadmap.motions.linear_steps import least_step
from feasibility.roadmap.motions.roll_kernels import roll_gradient
from feasibility.roadmap.motions.search_arrays import CONE, LIMIT, ROLL, SINGULAR
from feasibility.roadmap.motions.working_memory import HERE, NEXT, OF_CONE, OF_ROLL, place
from robots.chain import jacobians

COMFORT = 0.7  # [1] share of cone chord, and of the roll's range, that a step keeps to if it can
LARGEST_STEP = 0.35  # [rad] or [m], largest change of one joint in one Newton step
POINT = np.int64(3)  # rows of a step without cone and roll
NARROW = 0.06  # [1] a cone chord below which a step across the cone's row would leave the cone
HALF = 0.5  # [1] of a narrow cone's chord: where both tilts are led; and so of a narrow range
DAMPING = 1e-9  # [1] of the rows' squares: at a singularity the step stays finite
PROJECTION_SLACK = 1e-6  # [1] share of cone and roll that the projection of a guess keeps free
PROJECTION_STEPS = np.int64(60)


@kernel
def linearise(arrays, work, slot):
    """Linearise at a slot: three position rows, and the gradients of cone and roll.

    That of the cone is the derivative of c = |a - b|, which is well scaled for narrow cones too;
    its norm is returned.
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
    norm = 0.0
    if chord > 1e-12:
        for j in range(n):
            total = 0.0
            for k in range(3):
                total += (work.axis[slot, k] - work.target[1, k]) * work.axis_rows[k, j]
            work.gradients[OF_CONE, j] = total / chord
            norm += work.gradients[OF_CONE, j] ** 2
    else:
        for j in range(n):
            work.gradients[OF_CONE, j] = 0.0
    if arrays.roll[1] < np.inf:
        roll_gradient(
            work.target, work.axis[slot], work.axes[slot], arrays.chain.prismatic,
            work.gradients[OF_ROLL],
        )  # fmt: skip
    return np.sqrt(norm)


@kernel
def tilts(work, goal):
    """Rows 3 and 4: the tilts of the axis along two directions across the target's.

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
def add_row(work, m, which, change):
    """Make row m that of a gradient: 0 the cone's, 1 that of roll; returns the number of rows."""
    for j in range(work.step.shape[0]):
        work.rows[m, j] = work.gradients[which, j]
    work.rhs[m] = change
    return m + 1


@kernel
def roll_change(work, goal):
    """rad by which roll has to change in slot 1 to be `goal` off the middle of its range."""
    off = work.error[1, 2]
    return goal - off if off > 0.0 else -goal - off


@kernel
def enough_left(work, m):
    """Are as many joints left as there are rows?"""
    free = 0
    for j in range(work.held.shape[0]):
        if not work.held[j]:
            free += 1
    return free >= m


@kernel
def bounded_step(arrays, work, q, cone, roll, goal, roll_goal):
    """`least_step` with rows of cone and roll, where they are to be corrected.

    The cone by both tilts where it is narrow, as long as joints suffice.
    """
    m = POINT
    if cone and work.allowance[1] < NARROW:
        tilts(work, goal)
        m += 2
        if roll:
            m = add_row(work, m, OF_ROLL, roll_change(work, roll_goal))
        if least_step(arrays, work, q, m, DAMPING) and enough_left(work, m):
            return True
        norm = 0.0
        for j in range(q.shape[0]):
            norm += work.gradients[OF_CONE, j] ** 2
        if not norm > 0.0:
            return False
        m = POINT
    if cone:
        m = add_row(work, m, OF_CONE, goal - work.error[1, 1])
    if roll:
        m = add_row(work, m, OF_ROLL, roll_change(work, roll_goal))
    return least_step(arrays, work, q, m, DAMPING) and (not roll or enough_left(work, m))


@kernel
def predicted_chord(work):
    """|a - b| after `work.step`, to first order."""
    square = 0.0
    for k in range(3):
        change = work.axis[1, k] - work.target[1, k]
        for j in range(work.step.shape[0]):
            change += work.axis_rows[k, j] * work.step[j]
        square += change * change
    return np.sqrt(square)


@kernel
def predicted_roll(work):
    """Roll off the middle of its range after `work.step`, to first order."""
    roll = work.error[1, 2]
    for j in range(work.step.shape[0]):
        roll += work.gradients[OF_ROLL, j] * work.step[j]
    return abs(roll)


@kernel
def corrected(arrays, work, q, usable, goal, roll_goal):
    """The step with cone and roll where they are violated, or would be.

    Args:
        arrays, work: as everywhere; needs `linearise`.
        q: (n,) where the step starts; slot 1 holds its placement.
        usable: has the cone a gradient?
        goal, roll_goal: the chord, and how far roll may be off the middle of its range.

    Returns:
        (done, cone, roll): whether there is such a step, and which of the two it obeys.
    """
    chord = work.error[1, 1]
    narrow = work.allowance[1] < NARROW
    limited = arrays.roll[1] < np.inf
    near = narrow or chord > 0.3 * goal
    cone = chord > goal and usable
    roll = limited and abs(work.error[1, 2]) > roll_goal
    done = bounded_step(arrays, work, q, cone, roll, goal, roll_goal)
    for _ in range(2):
        if not done:
            break
        # Would the step leave the cone, or the roll's range? Repeat it along their boundaries.
        leaves = not cone and usable and near and predicted_chord(work) > goal
        turns = limited and not roll and predicted_roll(work) > roll_goal
        if not (leaves or turns):
            break
        cone, roll = cone or leaves, roll or turns
        done = bounded_step(arrays, work, q, cone, roll, goal, roll_goal)
    return done, cone, roll


@kernel
def first_roll_goal(arrays, work, hard, slack, before):
    """How far off the middle of its range the first step leads roll, as it does the chord."""
    comfort = COMFORT * arrays.roll[1]
    if before < np.inf:
        was = abs(work.error[HERE, 2])
        inwards = max(0.5 * (abs(work.error[NEXT, 2]) - was), 150.0 * slack * was)
        comfort = max(comfort, was - inwards)
    return min(hard, comfort)


@kernel
def inside(arrays, work):
    """Is slot 1 at its target, and inside what there is of cone and roll?"""
    return (
        work.error[1, 0] <= arrays.near
        and work.error[1, 1] <= work.allowance[1]
        and abs(work.error[1, 2]) <= work.allowance[2]
    )


@kernel
def move(arrays, work, q):
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


@inlined
def project(arrays, work, q, slack, before, most):
    """Project q (in place) onto the constraints over `work.target`; slot 1 holds the result.

    The first step starts from slot 1's placement of q, heads for `work.secondary_step`, and keeps
    well inside cone and roll; `before` is |a - b| at the start of the step, from where the axis is
    led inwards gradually (inf where that does not matter; otherwise slot 0 holds that start, and
    roll is led likewise). Later steps are the least ones that correct the errors. Returns True when
    the tool point is within `arrays.near` of its target, and the axis inside the cone.
    """
    inner = work.allowance[1]
    hard = inner * (1.0 - slack)
    hard_roll = work.allowance[2] * (1.0 - slack)
    narrow = inner < NARROW
    limited = arrays.roll[1] < np.inf
    last = np.inf
    for it in range(most):
        if it > 0 and inside(arrays, work):
            return True
        chord = work.error[1, 1]
        goal, roll_goal = hard, hard_roll
        if narrow:
            goal = HALF * hard
        elif it == 0:
            # Lead the axis inwards by a part of what the target's motion costs anyway.
            inwards = max(0.5 * (chord - before), 150.0 * slack * before)
            goal = min(hard, max(COMFORT * arrays.cone_chord, before - inwards))
        if limited and work.allowance[2] < NARROW:
            roll_goal = HALF * hard_roll
        elif limited and it == 0:
            roll_goal = first_roll_goal(arrays, work, hard_roll, slack, before)
        usable = linearise(arrays, work, NEXT) > 1e-9 or narrow
        work.stop_reason[1] = -1
        done, cone, roll = corrected(arrays, work, q, usable, goal, roll_goal)
        if not done and limited and (goal < hard or roll_goal < hard_roll):
            done, cone, roll = corrected(arrays, work, q, usable, hard, hard_roll)
        elif not done and cone and goal < hard and chord > 1e-12:
            add_row(work, POINT, OF_CONE, hard - chord)
            done = least_step(arrays, work, q, POINT + 1, DAMPING)
        reason = ROLL if roll else (CONE if cone else SINGULAR)
        work.stop_reason[0] = LIMIT if work.stop_reason[1] >= 0 else reason
        if not done:
            return False
        move(arrays, work, q)
        error = work.error[1, 0] / arrays.scale + max(work.error[1, 1] - inner, 0.0)
        error += max(abs(work.error[1, 2]) - work.allowance[2], 0.0)
        if not error < np.inf or (it > 2 and error > 2.0 * last and most < 20):
            return False
        last = error
    return inside(arrays, work)


@entry
def project_onto_cell(arrays, work, cell, q, most):
    """Project a guess q (in place) onto the constraints over a cell's centre; True on success."""
    look_at(arrays, work, cell)
    place(arrays, work, NEXT, q)
    for j in range(q.shape[0]):
        work.secondary_step[j] = 0.0
    return project(arrays, work, q, PROJECTION_SLACK, np.inf, most)
