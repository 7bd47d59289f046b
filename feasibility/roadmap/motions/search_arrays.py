"""What the compiled search reads: arm, surface and task as plain arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from coverable.arrays import Array, Ints, Mask
from feasibility.targets.curves import target_curves
from feasibility.task import Task
from robots.chain import Chain
from robots.robot import Robot
from surfaces.cells import Cells
from surfaces.surface import Surface

if TYPE_CHECKING:
    from feasibility.targets.frames import FrameCurves

NEWTON = 0.02  # [1] share of the tolerance that the Newton iteration leaves at a waypoint
# [1] share of the cone chord, and of the roll's half range, that this may cost, by how the
# surface curves and the frame turns along it
NEWTON_CONE = 1e-4
ORDINARY = 0.01  # [1] share of the same that an ordinary curve may deviate by
# The replay matches a waypoint to the curve's closest point, up to twice `near` from the one aimed
# at, and wants the cone to hold at the tool point's closest point on the surface.
NEAR_COST = 3.0  # [1], times `near` and the curvature: what that may cost of the cone chord
MESH_FACTOR = 1.1  # [1] larger deviation of curves over a mesh at the replay's samples

# Why a motion stopped: the constraint that left no margin.
NOTHING, LIMIT, CONE, SINGULAR, LONG, FOLD, COLLISION, ROLL = 0, 1, 2, 3, 4, 5, 6, 7

STOPPED = -1  # in place of a number of waypoints


class SearchArrays(NamedTuple):
    """Everything the compiled search reads: arm, surface and task as plain arrays."""

    chain: Chain
    lower: Array
    """(n,) rad or m, -inf where free."""
    upper: Array
    """(n,) rad or m, +inf where free."""
    points: Array
    """(N, 3) target points of the cell centres."""
    approaches: Array
    """(N, 3) approach directions of the cell centres."""
    references: Array
    """(N, 3) the directions that roll is measured from, across these; (0, 3) where it is free."""
    first_piece: Ints
    """(M + 1,) where the pieces of each curve begin, see `surfaces.cell_curves`."""
    targets: Array
    """(P, 4, 6) cubics of target point and approach direction along each piece."""
    derivative_bounds: Array
    """(P, 3) largest second derivatives of both (m, 1) by t, inf where the offset folds; and the
    curvature of the target surface (1/m): how fast the approach direction turns along it."""
    deviations: Array
    """(M, 2) bounds on how far both deviate from the surface's own on each curve (m, 1)."""
    frames: Array
    """(P, 4, 3) cubics of the reference direction along each piece; (0, 4, 3) where roll is free,
    and so the next two."""
    frame_bounds: Array
    """(P, 3) largest first and second derivative of the same by t; and how much roll may change for
    each metre that the tool point is off its target (rad/m), inf at a pole."""
    frame_deviations: Array
    """(M, 2) bounds on how far the reference direction deviates (1), and roll by that (rad)."""
    cone_chord: float
    """2 sin(alpha / 2): the largest |a - b|; inf when every direction is allowed."""
    tolerance: float
    """m."""
    roll: Array
    """(2,) rad, middle and half width of the range of roll; the half is inf where it is free."""
    inner_cone_chord: float
    """The part of the cone chord that self-motions over a cell's centre may use: less what
    ordinary curves deviate, and less what `near` costs."""
    settled_chord: float
    """That within which configurations settle: less what turns at inner creases take of it, which
    they could not begin from nearer to its boundary."""
    roll_lost: float
    """rad, the part of the roll's half range that they may not use, for the same reasons."""
    curvature: float
    """1/m, the largest curvature of the target surface next to the cells' centres."""
    roll_rate: float
    """rad/m, the same of `frame_bounds`."""
    near: float
    """m, how near its target the tool point is at a waypoint; see NEWTON and NEWTON_CONE."""
    off_target_cost: float
    """[1], times the curvature: what a tool point off its target costs of the cone chord for each
    metre. NEAR_COST where the cone is to hold at its closest point on the surface too, 0 where only
    at its target, which is all that the task requires."""
    scale: float
    """m, the length that makes metres comparable to radians (the arm's reach)."""
    collisions: Array
    """Bodies and pairs with the bounds between them, see `feasibility.collisions.buffer`; empty
    where collisions are not checked."""


def arrays_of(robot: Robot, cells: Cells, task: Task) -> SearchArrays:
    """Arm, cells and task as arrays for the compiled search."""
    tolerance = task.effective_tolerance
    targets = task.targets(cells)
    curves, rolls = target_curves(cells, task), targets.references
    cone_chord = task.cone_chord
    near = NEWTON * tolerance
    if curves.centre_curvature > 0.0 and cone_chord < np.inf:
        near = min(near, NEWTON_CONE * cone_chord / curves.centre_curvature)
    deviations = curves.deviations * (MESH_FACTOR if cells.surface.mean_edge_length else 1.0)
    frames = _frames(curves.frames, deviations[:, 1], cone_chord)
    half = np.inf if task.roll is None else task.roll.half
    if frames.rate > 0.0:
        near = min(near, NEWTON_CONE * half / frames.rate)
    lost = _ordinary(curves.deviations[:, 1], cone_chord)
    leans = cells.at_height(cells.surface.side_sign * task.standoff).curves.leans
    turned = curves.deviations[(leans > 0.0) & (curves.deviations[:, 1] < cone_chord), 1]
    lost_roll = _ordinary(frames.deviations[:, 1], half) + NEAR_COST * frames.rate * near
    return SearchArrays(
        chain=robot.chain,
        lower=np.array(robot.lower),
        upper=np.array(robot.upper),
        points=np.array(targets.points, order="C"),
        approaches=np.array(targets.approaches, order="C"),
        references=np.array(np.zeros((0, 3)) if rolls is None else rolls, order="C"),
        first_piece=_read_only(curves.first),
        targets=_read_only(curves.cubics),
        derivative_bounds=np.column_stack([curves.derivative_bounds, curves.curvature]),
        deviations=deviations,
        frames=frames.cubics,
        frame_bounds=frames.bounds,
        frame_deviations=frames.deviations,
        cone_chord=cone_chord,
        tolerance=float(tolerance),
        roll=np.array([0.0 if task.roll is None else task.roll.middle, half]),
        inner_cone_chord=float(cone_chord - lost - NEAR_COST * curves.centre_curvature * near),
        settled_chord=float(cone_chord - turned.max(initial=0.0)),
        roll_lost=float(lost_roll),
        curvature=curves.centre_curvature,
        roll_rate=frames.rate,
        near=float(near),
        off_target_cost=NEAR_COST,
        # A gantry may have no links: any length will do then.
        scale=float(np.linalg.norm(robot.chain.translations, axis=1).sum()) or 1.0,
        collisions=collisions_of(robot, cells.surface, task),
    )


def _read_only(array: NDArray[Any]) -> NDArray[Any]:
    """The same numbers, in order and not to be written.

    To numba an array that may be written is of another type, and kernels are compiled for each.
    """
    view = np.ascontiguousarray(array).view()
    view.flags.writeable = False
    return view


def _ordinary(deviations: Array, most: float) -> float:
    """The largest deviation (M,) of ordinary curves, see ORDINARY; 0 where any will do."""
    if not most < np.inf:
        return 0.0
    return float(deviations[deviations <= ORDINARY * most].max(initial=0.0))


class _Frames(NamedTuple):
    """What roll is measured from along curves, see the fields of `SearchArrays`."""

    cubics: Array
    bounds: Array
    deviations: Array
    rate: float


def _frames(curves: FrameCurves | None, tilts: Array, cone_chord: float) -> _Frames:
    """Frames along curves as arrays, of length 0 where roll is free.

    Frames that differ by a small angle e differ in roll by e / cos(theta / 2) at a tilt theta.

    Args:
        curves: the frames.
        tilts: (M,) how far the approach direction deviates.
        cone_chord: 2 sin(alpha / 2).
    """
    if curves is None:
        return _Frames(np.zeros((0, 4, 3)), np.zeros((0, 3)), np.zeros((0, 2)), 0.0)
    stretch = 1.0 / np.sqrt(1.0 - 0.25 * min(cone_chord, np.sqrt(2.0)) ** 2)
    return _Frames(
        cubics=np.array(curves.cubics, order="C"),
        bounds=np.column_stack([curves.derivative_bounds, stretch * curves.curvature]),
        deviations=np.column_stack([curves.deviations, stretch * (curves.deviations + tilts)]),
        rate=float(stretch * curves.centre_curvature),
    )


def collisions_of(robot: Robot, surface: Surface, task: Task) -> Array:
    """Bodies and pairs as the compiled search reads them; empty where they are not checked."""
    from feasibility.collisions.asked_bodies import gather

    bodies = gather(robot, surface, task.collision, task.standoff)
    if bodies is None:
        return np.zeros(0)
    from feasibility.collisions.kernels.memory import collision_buffer

    return collision_buffer(bodies, robot)


def with_free_roll(arrays: SearchArrays) -> SearchArrays:
    """The same arrays with any roll."""
    return arrays._replace(roll=np.array([0.0, np.inf]))


def within(arrays: SearchArrays) -> Mask:
    """(M,) curves whose deviations leave something of tolerance, cone and roll."""
    most = np.array([arrays.tolerance, arrays.cone_chord])
    usable = (arrays.deviations < most).all(axis=1)
    if arrays.roll[1] < np.inf:
        usable &= arrays.frame_deviations[:, 1] < arrays.roll[1]
    return np.asarray(usable, dtype=np.bool_)


def passable(arrays: SearchArrays) -> Mask:
    """(M,) curves along which a motion can be certified, as far as the surface goes."""
    bent = np.isinf(arrays.derivative_bounds[:, :2]).any(axis=1)
    curve = np.repeat(np.arange(len(arrays.deviations)), np.diff(arrays.first_piece))
    usable = within(arrays)
    usable[curve[bent]] = False
    if arrays.roll[1] < np.inf:
        usable[curve[np.isinf(arrays.frame_bounds).any(axis=1)]] = False
    return usable
