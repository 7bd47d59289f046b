"""What the compiled search reads: arm, surface and task as plain arrays, and its working memory."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from feasibility.kernels import kernel
from feasibility.task import DEFAULT_TOLERANCE, Task
from robots import Robot
from robots.chain import Chain, frames
from surfaces import Cells
from surfaces.chart import EDGE, SPHERE, Chart, foot, spot

NEWTON = 0.02  # [1] share of the tolerance that the Newton iteration leaves at a waypoint
NEWTON_RIM = 2e-4  # [1] share of the cone that it costs, by way of the surface's curvature

# Why a motion stopped: the constraint that left no room.
NOTHING, LIMIT, CONE, SINGULAR, LONG = 0, 1, 2, 3, 4

HERE, NEXT = np.int64(0), np.int64(1)  # slots of `Work`: where the arm is, where it tries to go


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
        # A gantry may have no links at all: its strokes are as good as any length then.
        scale=float(np.linalg.norm(chain.translations, axis=1).sum()) or 1.0,
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
    course: NDArray[np.float64]
    """(5,) parameters u, v where a motion begins, how much they change, and 1.0 where it is the
    straight line's foot that is followed instead, over a pole."""
    counts: NDArray[np.int64]
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
        course=np.zeros(5),
        counts=np.zeros(1, dtype=np.int64),
        blame=np.zeros(2, dtype=np.int64),
    )


@kernel
def place(problem, work, slot, q):  # type: ignore[no-untyped-def]
    """Evaluate the arm at q into a slot, and its errors against `work.target`."""
    frames(problem.chain, q, work.origins[slot], work.axes[slot], work.point[slot], work.axis[slot])
    work.counts[0] += 1
    distance = 0.0
    chord = 0.0
    for k in range(3):
        distance += (work.point[slot, k] - work.target[0, k]) ** 2
        chord += (work.axis[slot, k] - work.target[1, k]) ** 2
    work.error[slot, 0] = np.sqrt(distance)
    work.error[slot, 1] = np.sqrt(chord)


@kernel
def look_at(work, target, approach):  # type: ignore[no-untyped-def]
    """Set `work.target`."""
    for k in range(3):
        work.target[0, k] = target[k]
        work.target[1, k] = approach[k]


@kernel
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


@kernel
def set_course(problem, work, start, end):  # type: ignore[no-untyped-def]
    """Lay the line from target point `start` to `end` that `aim` follows: see `Work.course`.

    It is straight in the surface's parameters, so that it stays on a patch which the straight line
    through space would leave: the rim of a dome, the far side of a pipe. A closed parameter runs
    the shorter way round. Only over a pole the straight line is the one that stays.
    """
    chart = problem.chart
    u0, v0, _, _, _, _ = foot(chart, start[0], start[1], start[2])
    u1, v1, _, _, _, _ = foot(chart, end[0], end[1], end[2])
    du, dv = u1 - u0, v1 - v0
    if chart.closed[0]:
        du -= 2.0 * np.pi * np.round(du / (2.0 * np.pi))
    if chart.closed[1]:
        dv -= 2.0 * np.pi * np.round(dv / (2.0 * np.pi))
    work.course[0], work.course[1], work.course[2], work.course[3] = u0, v0, du, dv
    over_a_pole = False
    if chart.code == SPHERE and chart.closed[1] and abs(dv) > 0.5 * np.pi:
        # The cap through both places is on the patch if its pole is, and is convex if small.
        if u0 + u1 < np.pi - EDGE:
            over_a_pole = chart.low[0] <= EDGE
        elif u0 + u1 > np.pi + EDGE:
            over_a_pole = chart.high[0] >= np.pi - EDGE
    work.course[4] = 1.0 if over_a_pole else 0.0


@kernel
def aim(problem, work, start, end, t):  # type: ignore[no-untyped-def]
    """Set `work.target` to the place on the course that `set_course` has laid, at t in [0, 1]."""
    if work.course[4] > 0.0:
        x = (1.0 - t) * start[0] + t * end[0]
        y = (1.0 - t) * start[1] + t * end[1]
        z = (1.0 - t) * start[2] + t * end[2]
        _, _, height, nx, ny, nz = foot(problem.chart, x, y, z)
        off = problem.height - height
    else:
        u = work.course[0] + t * work.course[2]
        v = work.course[1] + t * work.course[3]
        x, y, z, nx, ny, nz = spot(problem.chart, u, v)
        off = problem.height
    work.target[0, 0] = x + off * nx
    work.target[0, 1] = y + off * ny
    work.target[0, 2] = z + off * nz
    sign = -problem.chart.side_sign
    work.target[1, 0] = sign * nx
    work.target[1, 1] = sign * ny
    work.target[1, 2] = sign * nz


@kernel
def copy_slot(work):  # type: ignore[no-untyped-def]
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
