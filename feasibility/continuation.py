"""One certified motion: along the surface between neighbouring cells, or within one cell.

The target moves (or stands), the arm follows: a predictor step, Newton on the tool point, and the
free directions (roll, tilt inside the cone, redundancy) used to stay away from limits and from the
rim of the cone, or to head for a goal configuration. A step is kept only when the bound of
`segment_holds` shows that the straight joint segment obeys every constraint between its ends too;
otherwise it is halved. So a motion that `track` or `connect` returns is certified as it is made.

The bound between samples
-------------------------
On q(s) = q0 + s d, s in [0, 1], let r_j be the largest distance of the tool point from axis j. Then

    |p''| <= D = sum_j r_j |d_j| (|d_j| + 2 sum_{i<j, revolute} |d_i|)

for revolute j; a prismatic j adds 2 |d_j| sum_{i<j, revolute} |d_i|. (Differentiate
p' = sum_j d_j z_j x (p - o_j): joint j turns its own term, every earlier revolute joint turns it
once more, and the mixed term appears twice.) The distance to axis j changes only with the joints
behind it, so r_j <= max(r_j(0), r_j(1)) + 1/2 sum_{k>j} r_k |d_k|. The same with the sine
s_j = |z_j x a| in place of r_j bounds |a''| <= Da.

A vector function whose second derivative is at most M stays within s (1 - s) M / 2 of its chord, so
its norm is at most (1 - s) c0 + s c1 + s (1 - s) M / 2: see `peak`. With L = |p1 - p0| the tool
point moves at |p'| <= V = L + D/2. Let h be the signed distance from the surface; its gradient is
the unit normal m, |Dm| <= kappa and |D^2 m| <= beta (`Surface.bounds`). So

    |h(p(s)) - h*|  <= peak of both ends with M = kappa V^2 + D
    |a - b|(s)      <= peak of both ends with M = Da + beta V^2 + kappa D,   b = -+ m(p(s))

and |a - b| = 2 sin(angle / 2) compares with the cone exactly. Limits are convex: the ends decide.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from feasibility.task import DEFAULT_TOLERANCE, Task
from robots import Robot
from robots.chain import Chain, frames, jacobians
from surfaces import Cells
from surfaces.chart import Chart, foot

NEWTON = 0.02  # [1] share of the tolerance that the Newton iteration leaves at a waypoint
NEWTON_RIM = 2e-4  # [1] share of the cone that it costs, by way of the surface's curvature
COMFORT = 0.7  # [1] share of the cone that a step keeps to where it can
RIM_SLACK = 1e-3  # [1] share of the cone kept free by a full step; it shrinks with the step
LARGEST_STEP = 0.35  # [rad] or [m], largest change of one joint in one Newton step
SMALLEST_STEP = 2.0**-7  # [1] share of the way between two centres below which a track gives up
MOST_STEPS = 400  # accepted steps of one motion
FOLDED = 1e6  # [1/m] curvature above which the parallel surface is taken as folded

# Why a motion stopped: the constraint that left no room.
NOTHING, LIMIT, CONE, SINGULAR, LONG = 0, 1, 2, 3, 4


class Problem(NamedTuple):
    """Everything the compiled search reads: arm, surface and task as plain arrays."""

    chain: Chain
    lower: NDArray[np.float64]
    """(n,) rad or m, -inf where free."""
    upper: NDArray[np.float64]
    """(n,) rad or m, +inf where free."""
    chart: Chart
    points: NDArray[np.float64]
    """(N, 3) target points of the cell centres."""
    approaches: NDArray[np.float64]
    """(N, 3) approach directions of the cell centres."""
    height: float
    """Signed height of the target surface over the surface, m."""
    rim: float
    """2 sin(alpha / 2): the largest |a - b|; inf when every direction will do."""
    tolerance: float
    """m."""
    near: float
    """m, how near its target the tool point is at a waypoint; see NEWTON and NEWTON_RIM."""
    curvature: float
    """kappa, 1/m, over the band of the target surface."""
    bend: float
    """beta, 1/m^2, over the same band."""
    scale: float
    """m, length that turns metres into comparable radians (the arm's reach)."""


def problem_of(robot: Robot, cells: Cells, task: Task) -> Problem:
    """Gather arm, cells and task for the compiled search."""
    tolerance = DEFAULT_TOLERANCE if task.tolerance is None else task.tolerance
    targets = task.targets(cells)
    height = cells.surface.side_sign * task.standoff
    bounds = cells.surface.bounds(height, tolerance)
    chain = Chain.checked(robot)
    rim = np.inf if task.cone_deg >= 180.0 else float(2.0 * np.sin(0.5 * task.cone))
    near = NEWTON * tolerance
    if bounds.curvature > 0.0 and rim < np.inf:
        near = min(near, NEWTON_RIM * rim / bounds.curvature)
    return Problem(
        chain=chain,
        lower=np.array(robot.lower),
        upper=np.array(robot.upper),
        chart=cells.chart,
        points=np.ascontiguousarray(targets.points),
        approaches=np.ascontiguousarray(targets.approaches),
        height=float(height),
        rim=rim,
        tolerance=float(tolerance),
        near=float(near),
        curvature=float(bounds.curvature),
        bend=float(bounds.bend),
        scale=float(np.linalg.norm(chain.translations, axis=1).sum()),
    )


class Work(NamedTuple):
    """Working memory of one thread; slot 0 is where the arm is, slot 1 where it tries to go."""

    origins: NDArray[np.float64]
    """(2, n, 3)"""
    axes: NDArray[np.float64]
    """(2, n, 3)"""
    point: NDArray[np.float64]
    """(2, 3)"""
    axis: NDArray[np.float64]
    """(2, 3)"""
    error: NDArray[np.float64]
    """(2, 2) distance of the tool point from its target, and |a - b|, in each slot."""
    point_rows: NDArray[np.float64]
    """(3, n)"""
    axis_rows: NDArray[np.float64]
    """(3, n)"""
    rows: NDArray[np.float64]
    """(4, n) constraint rows of the step."""
    rhs: NDArray[np.float64]
    """(4,)"""
    wish: NDArray[np.float64]
    """(n,) where the free directions would like to go."""
    step: NDArray[np.float64]
    """(n,)"""
    held: NDArray[np.bool_]
    """(n,) joints that the step holds at a limit."""
    trial: NDArray[np.float64]
    """(n,)"""
    target: NDArray[np.float64]
    """(2, 3) target point and approach direction."""
    count: NDArray[np.int64]
    """(1,) forward kinematics evaluated."""
    blame: NDArray[np.int64]
    """(2,) why the last motion stopped: a code, and the joint for LIMIT."""


def work_for(n: int) -> Work:
    """Working memory for an arm of n joints."""
    return Work(
        origins=np.zeros((2, n, 3)),
        axes=np.zeros((2, n, 3)),
        point=np.zeros((2, 3)),
        axis=np.zeros((2, 3)),
        error=np.zeros((2, 2)),
        point_rows=np.zeros((3, n)),
        axis_rows=np.zeros((3, n)),
        rows=np.zeros((4, n)),
        rhs=np.zeros(4),
        wish=np.zeros(n),
        step=np.zeros(n),
        held=np.zeros(n, dtype=np.bool_),
        trial=np.zeros(n),
        target=np.zeros((2, 3)),
        count=np.zeros(1, dtype=np.int64),
        blame=np.zeros(2, dtype=np.int64),
    )


@njit(cache=True, error_model="numpy")
def place(problem, work, slot, q):  # type: ignore[no-untyped-def]
    """Evaluate the arm at q into a slot, and its errors against `work.target`."""
    frames(problem.chain, q, work.origins[slot], work.axes[slot], work.point[slot], work.axis[slot])
    work.count[0] += 1
    distance = 0.0
    chord = 0.0
    for k in range(3):
        distance += (work.point[slot, k] - work.target[0, k]) ** 2
        chord += (work.axis[slot, k] - work.target[1, k]) ** 2
    work.error[slot, 0] = np.sqrt(distance)
    work.error[slot, 1] = np.sqrt(chord)


@njit(cache=True, error_model="numpy")
def accept(work):  # type: ignore[no-untyped-def]
    """Make the trial slot the current one."""
    for i in range(work.axes.shape[1]):
        for k in range(3):
            work.origins[0, i, k] = work.origins[1, i, k]
            work.axes[0, i, k] = work.axes[1, i, k]
    for k in range(3):
        work.point[0, k] = work.point[1, k]
        work.axis[0, k] = work.axis[1, k]
    work.error[0, 0] = work.error[1, 0]
    work.error[0, 1] = work.error[1, 1]


@njit(cache=True, error_model="numpy")
def aim(problem, work, start, end, t):  # type: ignore[no-untyped-def]
    """Set `work.target` to the point of the target surface nearest to the chord at t in [0, 1]."""
    x = (1.0 - t) * start[0] + t * end[0]
    y = (1.0 - t) * start[1] + t * end[1]
    z = (1.0 - t) * start[2] + t * end[2]
    _, _, height, nx, ny, nz = foot(problem.chart, x, y, z)
    off = problem.height - height
    work.target[0, 0] = x + off * nx
    work.target[0, 1] = y + off * ny
    work.target[0, 2] = z + off * nz
    sign = -problem.chart.side_sign
    work.target[1, 0] = sign * nx
    work.target[1, 1] = sign * ny
    work.target[1, 2] = sign * nz


@njit(cache=True, error_model="numpy")
def _cholesky_solve(a, b, m):  # type: ignore[no-untyped-def]
    """Solve the m x m symmetric positive definite a y = b in place; False when it is not definite."""
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


@njit(cache=True, error_model="numpy")
def least_step(problem, work, q, m):  # type: ignore[no-untyped-def]
    """The step nearest to `work.wish` with rows @ step = rhs (first m rows), inside the limits.

    Joints that would pass a limit are held at it, the furthest first, and the others take over.
    Returns False when too few joints are left.
    """
    n = q.shape[0]
    a = np.empty((4, 4))
    y = np.empty(4)
    for j in range(n):
        work.held[j] = False
        work.step[j] = 0.0
    for _ in range(n + 1):
        trace = 0.0
        for i in range(m):
            y[i] = work.rhs[i]
            for j in range(n):
                y[i] -= work.rows[i, j] * (work.step[j] if work.held[j] else work.wish[j])
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
            a[i, i] += 1e-9 * trace  # damping: at a singularity the step stays finite
        if not _cholesky_solve(a, y, m):
            return False
        worst, furthest = -1, 1e-14
        for j in range(n):
            if work.held[j]:
                continue
            s = work.wish[j]
            for i in range(m):
                s += work.rows[i, j] * y[i]
            work.step[j] = s
            over = max(q[j] + s - problem.upper[j], problem.lower[j] - q[j] - s)
            if over > furthest:
                worst, furthest = j, over
        if worst < 0:
            return True
        work.blame[1] = worst
        limit = problem.upper[worst] if work.step[worst] > 0.0 else problem.lower[worst]
        work.step[worst] = limit - q[worst]
        work.held[worst] = True
    return False


@njit(cache=True, error_model="numpy")
def _rows(problem, work, slot, chord_goal):  # type: ignore[no-untyped-def]
    """Linearise at a slot: three position rows, and a cone row; returns its direction's norm.

    The cone row is the derivative of c = |a - b|, which is well scaled for narrow cones too.
    """
    jacobians(
        problem.chain,
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


@njit(cache=True, error_model="numpy")
def correct(problem, work, q, slack, before, most):  # type: ignore[no-untyped-def]
    """Newton from q (in place) onto the fibre over `work.target`; slot 1 holds the result.

    The first step starts at what slot 1 holds for q, heads for `work.wish`, and keeps well inside
    the cone where it was so `before` (|a - b| at the start of the step, inf for no matter); later ones are the least steps that mend the errors. Returns
    True when the tool point is at its target to `problem.near`, and the axis inside the cone.
    """
    n = q.shape[0]
    inner = problem.rim - problem.curvature * problem.near
    hard = inner * (1.0 - slack)
    last = np.inf
    for it in range(most):
        if it > 0 and work.error[1, 0] <= problem.near and work.error[1, 1] <= inner:
            return True
        chord = work.error[1, 1]
        goal = hard
        if it == 0:
            # Come in from the rim by a part of what the target's motion costs anyway.
            inwards = max(0.5 * (chord - before), 150.0 * slack * before)
            goal = min(hard, max(COMFORT * problem.rim, before - inwards))
        norm = _rows(problem, work, 1, goal)
        usable = norm > 1e-9
        work.blame[1] = -1
        cone = chord > goal and usable
        done = least_step(problem, work, q, 4 if cone else 3)
        if done and not cone and usable and chord > 0.3 * goal:
            # Would the step leave the cone? Then do it again along the rim.
            predicted = 0.0
            for k in range(3):
                change = work.axis[1, k] - work.target[1, k]
                for j in range(n):
                    change += work.axis_rows[k, j] * work.step[j]
                predicted += change * change
            if np.sqrt(predicted) > goal:
                cone = True
                done = least_step(problem, work, q, 4)
        if not done and cone and goal < hard:
            work.rhs[3] = hard - chord
            done = least_step(problem, work, q, 4)
        if not done:
            work.blame[0] = LIMIT if work.blame[1] >= 0 else (CONE if cone else SINGULAR)
            return False
        largest = 0.0
        for j in range(n):
            largest = max(largest, abs(work.step[j]))
        shrink = 1.0 if largest <= LARGEST_STEP else LARGEST_STEP / largest
        for j in range(n):
            q[j] = min(max(q[j] + shrink * work.step[j], problem.lower[j]), problem.upper[j])
            work.wish[j] = 0.0
        place(problem, work, 1, q)
        error = work.error[1, 0] / problem.scale + max(work.error[1, 1] - inner, 0.0)
        work.blame[0] = LIMIT if work.blame[1] >= 0 else (CONE if cone else SINGULAR)
        if not error < np.inf or (it > 2 and error > 2.0 * last and most < 20):
            return False
        last = error
    return work.error[1, 0] <= problem.near and work.error[1, 1] <= inner


@njit(cache=True, error_model="numpy")
def spread(problem, work, q0, q1):  # type: ignore[no-untyped-def]
    """D and Da of the module's bound for the segment from q0 (slot 0) to q1 (slot 1)."""
    n = q0.shape[0]
    behind = 0.0  # how far the tool point moves by the joints behind j
    behind_axis = 0.0
    before = 0.0  # total turn of the revolute joints before j
    for j in range(n):
        if not problem.chain.prismatic[j]:
            before += abs(q1[j] - q0[j])
    total, total_axis = 0.0, 0.0
    for j in range(n - 1, -1, -1):
        d = abs(q1[j] - q0[j])
        if problem.chain.prismatic[j]:
            total += 2.0 * d * before
            behind += d
            continue
        before -= d
        r, s = 0.0, 0.0
        for slot in range(2):
            zx, zy, zz = work.axes[slot, j, 0], work.axes[slot, j, 1], work.axes[slot, j, 2]
            x = work.point[slot, 0] - work.origins[slot, j, 0]
            y = work.point[slot, 1] - work.origins[slot, j, 1]
            z = work.point[slot, 2] - work.origins[slot, j, 2]
            r = max(r, (zy * z - zz * y) ** 2 + (zz * x - zx * z) ** 2 + (zx * y - zy * x) ** 2)
            x, y, z = work.axis[slot, 0], work.axis[slot, 1], work.axis[slot, 2]
            s = max(s, (zy * z - zz * y) ** 2 + (zz * x - zx * z) ** 2 + (zx * y - zy * x) ** 2)
        r = np.sqrt(r) + 0.5 * behind
        s = min(np.sqrt(s) + 0.5 * behind_axis, 1.0)
        total += r * d * (d + 2.0 * before)
        total_axis += s * d * (d + 2.0 * before)
        behind += r * d
        behind_axis += s * d
    return total, total_axis


@njit(cache=True, error_model="numpy")
def peak(a, b, most):  # type: ignore[no-untyped-def]
    """Largest value of (1 - s) a + s b + s (1 - s) most / 2 over s in [0, 1]."""
    slope = abs(b - a)
    if 2.0 * slope >= most:
        return max(a, b)
    return 0.5 * (a + b) + most / 8.0 + slope * slope / (2.0 * most)


@njit(cache=True, error_model="numpy")
def segment_holds(problem, work, q0, q1):  # type: ignore[no-untyped-def]
    """Do point and cone hold on the whole straight segment from q0 (slot 0) to q1 (slot 1)?

    Returns the position bound over the tolerance and the cone bound over the rim: both must be
    at most 1. NaN compares false, so it never certifies.
    """
    total, total_axis = spread(problem, work, q0, q1)
    length = 0.0
    for k in range(3):
        length += (work.point[1, k] - work.point[0, k]) ** 2
    speed = np.sqrt(length) + 0.5 * total
    position = peak(work.error[0, 0], work.error[1, 0], problem.curvature * speed * speed + total)
    # The errors are against the targets of the two ends; the surface's own normal at the tool
    # point differs from the target's by at most kappa times the distance.
    cone = peak(
        work.error[0, 1] + problem.curvature * work.error[0, 0],
        work.error[1, 1] + problem.curvature * work.error[1, 0],
        total_axis + problem.bend * speed * speed + problem.curvature * total,
    )
    return position / problem.tolerance, cone / problem.rim


@njit(cache=True, error_model="numpy")
def effects(problem, work, slot, out):  # type: ignore[no-untyped-def]
    """How much a radian (or metre) of each joint moves the tool: lever over scale, plus sine.

    Joint differences weighted so measure what a motion does to the tool: the free roll of a wrist,
    or the swing of two joints about one common axis at a singularity, costs next to nothing.
    """
    for j in range(out.shape[0]):
        if problem.chain.prismatic[j]:
            out[j] = 1.0 / problem.scale
            continue
        zx, zy, zz = work.axes[slot, j, 0], work.axes[slot, j, 1], work.axes[slot, j, 2]
        x = work.point[slot, 0] - work.origins[slot, j, 0]
        y = work.point[slot, 1] - work.origins[slot, j, 1]
        z = work.point[slot, 2] - work.origins[slot, j, 2]
        r = (zy * z - zz * y) ** 2 + (zz * x - zx * z) ** 2 + (zx * y - zy * x) ** 2
        x, y, z = work.axis[slot, 0], work.axis[slot, 1], work.axis[slot, 2]
        s = (zy * z - zz * y) ** 2 + (zz * x - zx * z) ** 2 + (zx * y - zy * x) ** 2
        out[j] = np.sqrt(r) / problem.scale + np.sqrt(s)


@njit(cache=True, error_model="numpy")
def _wish_for_room(problem, work, q, size):  # type: ignore[no-untyped-def]
    """Set `work.wish` to lead away from limits and from the rim of the cone (slot 1's rows)."""
    n = q.shape[0]
    for j in range(n):
        half = 0.5 * (problem.upper[j] - problem.lower[j])
        work.wish[j] = 0.0
        if half < np.inf and half > 0.0:
            x = (q[j] - problem.lower[j]) / half - 1.0
            x2 = x * x
            work.wish[j] = -size * x * x2 * x2
    share = work.error[1, 1] / problem.rim
    norm = 0.0
    for j in range(n):
        norm += work.rows[3, j] ** 2
    if norm > 1e-12 and share < np.inf:
        push = size * min(share, 1.0) ** 5 / np.sqrt(norm)
        for j in range(n):
            work.wish[j] -= push * work.rows[3, j]


@njit(cache=True, error_model="numpy")
def _copy_slot(work):  # type: ignore[no-untyped-def]
    """Let slot 1 start from slot 0."""
    for i in range(work.axes.shape[1]):
        for k in range(3):
            work.origins[1, i, k] = work.origins[0, i, k]
            work.axes[1, i, k] = work.axes[0, i, k]
    chord = 0.0
    distance = 0.0
    for k in range(3):
        work.point[1, k] = work.point[0, k]
        work.axis[1, k] = work.axis[0, k]
        distance += (work.point[0, k] - work.target[0, k]) ** 2
        chord += (work.axis[0, k] - work.target[1, k]) ** 2
    work.error[1, 0] = np.sqrt(distance)
    work.error[1, 1] = np.sqrt(chord)


@njit(cache=True, error_model="numpy")
def connect(problem, work, target, approach, q, goal, ways, first, most):  # type: ignore[no-untyped-def]
    """Self-motion over one target from q (in place) towards the configuration `goal`.

    Each step heads for the goal and is put back onto the fibre. It gives up when the way lags:
    a step that does not bring the goal nearer by a good part of its length means that the fibre
    bends away, and other waypoints (other nodes) have to be tried. What was gone until then
    stands, and is certified.

    Returns:
        (rows, reached): number of waypoints written, -2 when `ways` is full; and whether the last
        one is `goal`.
    """
    n = q.shape[0]
    for k in range(3):
        work.target[0, k] = target[k]
        work.target[1, k] = approach[k]
    place(problem, work, 0, q)
    size, written = 0.3, 0
    left = 0.0
    for j in range(n):
        left += (goal[j] - q[j]) ** 2
    left = np.sqrt(left)
    allowed = 1.5 * left + 0.1
    for _ in range(most):
        if left <= size:
            for j in range(n):
                work.trial[j] = goal[j]
            place(problem, work, 1, work.trial)
            position, cone = segment_holds(problem, work, q, work.trial)
            if position <= 1.0 and cone <= 1.0:
                if first + written >= ways.shape[0]:
                    return -2, False
                for j in range(n):
                    q[j] = goal[j]
                    ways[first + written, j] = q[j]
                return written + 1, True
            size = 0.5 * left
        _copy_slot(work)
        for j in range(n):
            work.trial[j] = q[j]
            work.wish[j] = (goal[j] - q[j]) * min(1.0, size / max(left, 1e-12))
        position, cone = np.inf, np.inf
        remaining, moved = np.inf, 0.0
        slack = 0.25 * RIM_SLACK * min(1.0, size / 0.1)
        if correct(problem, work, work.trial, slack, np.inf, 6):
            position, cone = segment_holds(problem, work, q, work.trial)
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
            if first + written >= ways.shape[0]:
                return -2, False
            for j in range(n):
                q[j] = work.trial[j]
                ways[first + written, j] = q[j]
            written += 1
            left = remaining
            accept(work)
            size = min(0.5, 1.6 * size)
        else:
            size *= 0.5
            if size < 1e-3:
                return written, False
    return written, False


@njit(cache=True, error_model="numpy")
def track(problem, work, start, end, q, goal, has_goal, ways, first):  # type: ignore[no-untyped-def]
    """Follow the target surface from target point `start` to `end`, from q (in place).

    Args:
        problem: the `Problem`.
        work: the `Work` of this thread.
        start: (3,) target point that q holds now.
        end: (3,) target point to reach.
        q: (n,) configuration, moved to the end of the motion.
        goal: (n,) configuration to head for, read when `has_goal`.
        has_goal: whether there is a goal.
        ways: (m, n) receives the waypoints after the start, from row `first` on.
        first: first row to write.

    Returns:
        Number of waypoints written, or -1 when the motion stopped short (`work.blame` says why)
        and -2 when `ways` is full.
    """
    n = q.shape[0]
    aim(problem, work, start, end, 0.0)
    place(problem, work, 0, q)
    if not (work.error[0, 0] <= problem.tolerance and work.error[0, 1] <= problem.rim):
        work.blame[0] = SINGULAR
        return -1
    length = 0.0
    for k in range(3):
        length += (end[k] - start[k]) ** 2
    size = np.sqrt(length) / problem.scale
    t, dt, written = 0.0, 1.0, 0
    for _ in range(MOST_STEPS):
        dt = min(dt, 1.0 - t)
        if 1.0 - t - dt < 0.1 * dt:
            dt = 1.0 - t  # no sliver at the end
        aim(problem, work, start, end, t + dt)
        _copy_slot(work)
        if has_goal:
            share = dt / (1.0 - t)
            for j in range(n):
                work.wish[j] = share * (goal[j] - q[j])
        else:
            _rows(problem, work, 1, problem.rim)
            _wish_for_room(problem, work, q, 2.0 * size * dt)
        for j in range(n):
            work.trial[j] = q[j]
        position, cone = np.inf, np.inf
        if correct(problem, work, work.trial, RIM_SLACK * dt, work.error[0, 1], 8):
            # Slot 0's errors are against the old target; they were stored when it was accepted.
            position, cone = segment_holds(problem, work, q, work.trial)
        if position <= 1.0 and cone <= 1.0:
            if first + written >= ways.shape[0]:
                return -2
            for j in range(n):
                q[j] = work.trial[j]
                ways[first + written, j] = q[j]
            written += 1
            t += dt
            if t >= 1.0 - 1e-12:
                return written
            accept(work)
            dt *= min(2.0, 0.85 / np.sqrt(max(max(position, 0.1), 0.1)))
        else:
            if position < np.inf and position > 1.0:
                factor = max(0.2, min(0.7, 0.85 / np.sqrt(position)))
            else:
                factor = 0.5
                if position < np.inf:
                    work.blame[0] = CONE
            dt *= factor
            if dt < SMALLEST_STEP:
                return -1
    work.blame[0] = LONG
    return -1


@njit(cache=True, error_model="numpy")
def settle(problem, work, target, approach, q, most):  # type: ignore[no-untyped-def]
    """Self-motion over one target that makes room: away from limits and the rim (q in place)."""
    n = q.shape[0]
    for k in range(3):
        work.target[0, k] = target[k]
        work.target[1, k] = approach[k]
    place(problem, work, 0, q)
    size = 0.3
    for _ in range(most):
        _copy_slot(work)
        _rows(problem, work, 1, problem.rim)
        _wish_for_room(problem, work, q, size)
        for j in range(n):
            work.trial[j] = q[j]
        good = correct(problem, work, work.trial, RIM_SLACK, np.inf, 6)
        if good:
            position, cone = segment_holds(problem, work, q, work.trial)
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
