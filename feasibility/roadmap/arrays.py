"""What the compiled search reads: arm, surface and task as plain arrays, and its working memory.

Here too are the kernels that set the target of a step, and evaluate the arm against it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from feasibility.collisions import collision_buffer, gather
from feasibility.compiled import kernel
from feasibility.targets import target_curves
from feasibility.task import Task
from robots import Chain, Robot, frames
from surfaces import Cells, Surface

NEWTON = 0.02  # [1] share of the tolerance that the Newton iteration leaves at a waypoint
NEWTON_CONE = 1e-4  # [1] share of the cone chord that this may cost, by the surface's curvature
ORDINARY = 0.01  # [1] share of the cone chord that an ordinary curve may deviate by
# The replay matches a waypoint to the curve's closest point, up to twice `near` from the one aimed
# at, and wants the cone to hold at the tool point's closest point on the surface.
BESIDE = 0.05  # [1] share of a piece by which that closest point may lie off the one aimed at
NEAR_COST = 3.0  # [1], times `near` and the curvature: what that may cost of the cone chord
CENTRE_SHARE = 0.999  # [1] of the tolerance, for self-motions: curves deviate at the centres too
MESH_FACTOR = 1.1  # [1] larger deviation of curves over a mesh at the replay's samples

# Why a motion stopped: the constraint that left no margin.
NOTHING, LIMIT, CONE, SINGULAR, LONG, FOLD, COLLISION = 0, 1, 2, 3, 4, 5, 6

# In place of a number of waypoints: the motion stopped short, or the array of waypoints is full.
STOPPED, OVERFLOW = -1, -2

HERE, NEXT = np.int64(0), np.int64(1)  # slots of `Work`: where the arm is, where it tries to go


class SearchArrays(NamedTuple):
    """Everything the compiled search reads: arm, surface and task as plain arrays."""

    chain: Chain
    lower: NDArray[np.float64]
    """(n,) rad or m, -inf where free."""
    upper: NDArray[np.float64]
    """(n,) rad or m, +inf where free."""
    points: NDArray[np.float64]
    """(N, 3) target points of the cell centres."""
    approaches: NDArray[np.float64]
    """(N, 3) approach directions of the cell centres."""
    first_piece: NDArray[np.int64]
    """(M + 1,) where the pieces of each curve begin, see `surfaces.cell_curves`."""
    targets: NDArray[np.float64]
    """(P, 4, 6) cubics of target point and approach direction along each piece."""
    derivative_bounds: NDArray[np.float64]
    """(P, 3) largest second derivatives of both (m, 1) by t, inf where the offset folds; and the
    curvature of the target surface (1/m): how fast the approach direction turns along it."""
    deviations: NDArray[np.float64]
    """(M, 2) bounds on how far both deviate from the surface's own on each curve (m, 1)."""
    cone_chord: float
    """2 sin(alpha / 2): the largest |a - b|; inf when every direction is allowed."""
    tolerance: float
    """m."""
    inner_cone_chord: float
    """The part of the cone chord that self-motions over a cell's centre may use: less what
    ordinary curves deviate, and less what `near` costs."""
    curvature: float
    """1/m, the largest curvature of the target surface next to the cells' centres."""
    near: float
    """m, how near its target the tool point is at a waypoint; see NEWTON and NEWTON_CONE."""
    off_target_cost: float
    """[1], times the curvature: what a tool point off its target costs of the cone chord for each
    metre. NEAR_COST where the cone is to hold at its closest point on the surface too, 0 where only
    at its target, which is all that the task asks."""
    scale: float
    """m, the length that makes metres comparable to radians (the arm's reach)."""
    collisions: NDArray[np.float64]
    """Bodies and pairs with the bounds between them, see `feasibility.collisions.buffer`; empty
    where collisions are not checked."""


def arrays_of(robot: Robot, cells: Cells, task: Task) -> SearchArrays:
    """Arm, cells and task as arrays for the compiled search."""
    tolerance = task.effective_tolerance
    targets = task.targets(cells)
    curves = target_curves(cells, task)
    cone_chord = task.cone_chord
    deviations = curves.deviations[:, 1]
    ordinary = (
        float(deviations[deviations <= ORDINARY * cone_chord].max(initial=0.0))
        if cone_chord < np.inf
        else 0.0
    )
    near = NEWTON * tolerance
    if curves.centre_curvature > 0.0 and cone_chord < np.inf:
        near = min(near, NEWTON_CONE * cone_chord / curves.centre_curvature)
    return SearchArrays(
        chain=robot.chain,
        lower=np.array(robot.lower),
        upper=np.array(robot.upper),
        points=np.ascontiguousarray(targets.points),
        approaches=np.ascontiguousarray(targets.approaches),
        first_piece=curves.first,
        targets=curves.cubics,
        derivative_bounds=np.column_stack([curves.derivative_bounds, curves.curvature]),
        deviations=curves.deviations * (MESH_FACTOR if cells.surface.mean_edge_length else 1.0),
        cone_chord=cone_chord,
        tolerance=float(tolerance),
        inner_cone_chord=float(cone_chord - ordinary - NEAR_COST * curves.centre_curvature * near),
        curvature=curves.centre_curvature,
        near=float(near),
        off_target_cost=NEAR_COST,
        # A gantry may have no links: any length will do then.
        scale=float(np.linalg.norm(robot.chain.translations, axis=1).sum()) or 1.0,
        collisions=collisions_of(robot, cells.surface, task),
    )


def collisions_of(robot: Robot, surface: Surface, task: Task) -> NDArray[np.float64]:
    """Bodies and pairs as the compiled search reads them; empty where they are not checked."""
    bodies = gather(robot, surface, task.collision, task.standoff)
    return np.zeros(0) if bodies is None else collision_buffer(bodies, robot)


def passable(arrays: SearchArrays) -> NDArray[np.bool_]:
    """(M,) curves along which a motion can be certified, as far as the surface goes."""
    bent = np.isinf(arrays.derivative_bounds[:, :2]).any(axis=1)
    curve = np.repeat(np.arange(len(arrays.deviations)), np.diff(arrays.first_piece))
    most = np.array([arrays.tolerance, arrays.cone_chord])
    usable = np.asarray((arrays.deviations < most).all(axis=1), dtype=np.bool_)
    usable[curve[bent]] = False
    return usable


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
    """(5, n) constraint rows of the step."""
    rhs: NDArray[np.float64]
    """(5,)"""
    secondary_step: NDArray[np.float64]
    """(n,) the step that the secondary objective asks for, to be taken in the free directions."""
    step: NDArray[np.float64]
    """(n,)"""
    held: NDArray[np.bool_]
    """(n,) joints that the step holds at a limit."""
    trial: NDArray[np.float64]
    """(n,)"""
    kept: NDArray[np.float64]
    """(n,) the best configuration of a projection off the target."""
    target: NDArray[np.float64]
    """(2, 3) target point and approach direction."""
    derivative_bound: NDArray[np.float64]
    """(5,) largest second derivatives of target point and approach direction over the present
    step, by its own parameter in 0..1, zero while the target is at rest; the curvature of the
    target surface there (1/m); and the target's speed by that parameter at both ends (m)."""
    allowance: NDArray[np.float64]
    """(2,) what the present step may use of the tolerance (m) and of the cone chord; 0 where
    nothing is left."""
    counts: NDArray[np.int64]
    """(1,) forward kinematics evaluated."""
    stop_reason: NDArray[np.int64]
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
        rows=np.zeros((5, n)),
        rhs=np.zeros(5),
        secondary_step=np.zeros(n),
        step=np.zeros(n),
        held=np.zeros(n, dtype=np.bool_),
        trial=np.zeros(n),
        kept=np.zeros(n),
        target=np.zeros((2, 3)),
        derivative_bound=np.zeros(5),
        allowance=np.zeros(2),
        counts=np.zeros(1, dtype=np.int64),
        stop_reason=np.zeros(2, dtype=np.int64),
    )


@kernel
def place(arrays, work, slot, q):  # type: ignore[no-untyped-def]
    """Evaluate the arm at q into a slot, and its errors against `work.target`."""
    frames(arrays.chain, q, work.origins[slot], work.axes[slot], work.point[slot], work.axis[slot])
    work.counts[0] += 1
    distance = 0.0
    chord = 0.0
    for k in range(3):
        distance += (work.point[slot, k] - work.target[0, k]) ** 2
        chord += (work.axis[slot, k] - work.target[1, k]) ** 2
    work.error[slot, 0] = np.sqrt(distance)
    work.error[slot, 1] = np.sqrt(chord)


@kernel
def cone_used(arrays, work, slot):  # type: ignore[no-untyped-def]
    """The part of the cone chord that a slot uses.

    That is |a - b|, and what a tool point off its target costs, because the surface's normal next
    to it is another (see NEAR_COST; the first `near` of it is taken off `Work.allowance`).
    """
    off = max(work.error[slot, 0] - arrays.near, 0.0)
    return work.error[slot, 1] + arrays.off_target_cost * work.derivative_bound[2] * off


@kernel
def look_at(arrays, work, target, approach):  # type: ignore[no-untyped-def]
    """Set `work.target`, at rest."""
    work.derivative_bound[0] = 0.0
    work.derivative_bound[1] = 0.0
    work.derivative_bound[2] = arrays.curvature
    work.derivative_bound[3] = 0.0
    work.derivative_bound[4] = 0.0
    work.allowance[0] = CENTRE_SHARE * arrays.tolerance
    work.allowance[1] = arrays.inner_cone_chord
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
def aim(arrays, work, curve, t):  # type: ignore[no-untyped-def]
    """Set `work.target` to the target of a curve at t in [0, 1]."""
    first = arrays.first_piece[curve]
    count = arrays.first_piece[curve + 1] - first
    piece = min(np.int64(t * count), count - 1)
    s = t * count - piece
    for k in range(3):
        for part in range(2):
            value = arrays.targets[first + piece, 3, 3 * part + k]
            for power in range(2, -1, -1):
                value = value * s + arrays.targets[first + piece, power, 3 * part + k]
            work.target[part, k] = value


@kernel
def speed_at(arrays, curve, t):  # type: ignore[no-untyped-def]
    """Speed of the target along a curve by t, at t in [0, 1], m."""
    first = arrays.first_piece[curve]
    count = arrays.first_piece[curve + 1] - first
    piece = min(np.int64(t * count), count - 1)
    s = t * count - piece
    square = 0.0
    for k in range(3):
        slope = 3.0 * s * arrays.targets[first + piece, 3, k]
        slope = arrays.targets[first + piece, 1, k] + s * (
            2.0 * arrays.targets[first + piece, 2, k] + slope
        )
        square += slope * slope
    return np.sqrt(square) * count


@kernel
def bounds_between(arrays, work, curve, t0, t1):  # type: ignore[no-untyped-def]
    """Set `work.derivative_bound` and `work.allowance` for a step along a curve.

    The step goes from t0 to t1, in either direction.
    """
    first = arrays.first_piece[curve]
    count = arrays.first_piece[curve + 1] - first
    low = min(np.int64(max(min(t0, t1) * count - BESIDE, 0.0)), count - 1)
    high = min(np.int64(max(t0, t1) * count + BESIDE), count - 1)
    for part in range(3):
        most = 0.0
        for piece in range(low, high + 1):
            most = max(most, arrays.derivative_bounds[first + piece, part])
        work.derivative_bound[part] = most * (t1 - t0) ** 2 if part < 2 else most
    work.derivative_bound[3] = speed_at(arrays, curve, t0) * abs(t1 - t0)
    work.derivative_bound[4] = speed_at(arrays, curve, t1) * abs(t1 - t0)
    # Never more than self-motions may use, and as much on an ordinary curve: every configuration
    # that is valid over a cell can start from it.
    lost = (
        arrays.cone_chord
        - arrays.deviations[curve, 1]
        - NEAR_COST * work.derivative_bound[2] * arrays.near
    )
    work.allowance[0] = max(arrays.tolerance - arrays.deviations[curve, 0], 0.0)
    work.allowance[1] = max(min(arrays.inner_cone_chord, lost), 0.0)


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
