"""Does a tile hold: is there a continuous map of configurations over it, from a given one?

The lemma is that of `feasibility.area.kernels.lemma`, where it is proved; here it is evaluated anew
by NumPy from Pinocchio's Jacobians. What is given is a configuration q and a matrix G for each
tile, and neither is trusted: G is brought to J G = I, and every number computed from q and G again.
"""

from __future__ import annotations

import numpy as np

from coverable_arrays import Array, Mask
from feasibility.certification.jacobians import Jacobians, jacobians
from feasibility.certification.lever_bounds import largest_levers, second_derivative_bound
from feasibility.certification.rolls import Held
from feasibility.task import Task
from robots import Kinematics, Robot
from surfaces.cell_tiles import CellTiles, TileBounds, Tiles

ROUNDING = 1.0 + 1e-9
CLOSE_TO_ZERO = 1e-12  # [1]: rounding of double arithmetic on unit vectors
CLOSE_TO_LIMIT = 1e-12  # rad or m, likewise on joint values
WORST_CONDITION = 1e6  # of J G: beyond it G is refused
ROUNDS = 3  # in which the radius of the solutions is narrowed


def tiles_hold(
    robot: Robot, task: Task, cut: CellTiles, tiles: Tiles, q: Array, gains: Array
) -> Mask:
    """Which tiles hold.

    Args:
        robot: the arm.
        task: its cone is used exactly; the roll has to be free.
        cut: the surface of the tiles, at the height of the task's targets.
        tiles: k tiles.
        q: (k, n) configurations, rad or m.
        gains: (k, n, 3) right inverses of the Jacobians there, or nearly so.
    """
    bounds = cut.bounds(tiles)
    held = Held.of(task, cut.cells, cut.offset)
    corners = np.array(bounds.corners)
    corners[:, :, 1] = held.approaches(bounds.corners[:, :, 1])
    lean = bounds.radii[:, 1] if held.approach is None else np.zeros(len(q))
    one, slides = jacobians(Kinematics(robot), q), robot.prismatic
    found = one.point @ gains
    with np.errstate(all="ignore"):
        known = np.where(np.isfinite(found).all(axis=(1, 2), keepdims=True), found, 0.0)
        regular = np.less(np.linalg.cond(known), WORST_CONDITION).reshape(len(q))
        exact = gains @ np.linalg.inv(np.where(regular[:, None, None], known, np.eye(3)))
        rate = np.linalg.norm(exact, axis=2) * ROUNDING
        off = np.linalg.norm(corners[:, :, 0] - one.points[:, None], axis=2)
        rho = off.max(axis=1) * ROUNDING + bounds.radii[:, 0]
        radius, second = _solutions(one, slides, rate, rho)
        away = rate * radius[:, None]
        inside = (q - away >= robot.lower - CLOSE_TO_LIMIT) & (
            q + away <= robot.upper + CLOSE_TO_LIMIT
        )
        good = regular & np.isfinite(radius) & inside.all(axis=1)
        if task.cone_chord < np.inf:
            axis_second = _second(one.sines, slides, rate, radius, 1.0)
            most = _tilts(one, exact, radius, second, axis_second, corners, bounds, lean)
            good &= most <= task.cone_chord + CLOSE_TO_ZERO
    return np.asarray(good)


def _solutions(one: Jacobians, slides: Mask, rate: Array, rho: Array) -> tuple[Array, Array]:
    """(k,) the radius y that holds all solutions, inf where none is known; and M."""
    radius, second = 2.0 * rho, np.zeros_like(rho)
    for _ in range(ROUNDS):
        second = _second(one.levers, slides, rate, radius, np.inf)
        left = 1.0 - 2.0 * second * rho
        known = left > 0.0
        root = np.sqrt(np.where(known, left, 1.0))
        radius = np.where(known, ROUNDING * 2.0 * rho / (1.0 + root), np.inf)
    return radius, second


def _second(levers: Array, slides: Mask, rate: Array, radius: Array, cap: float) -> Array:
    """(k,) M of tool points, or of axes with the cap 1, on the balls of these radii."""
    largest = largest_levers(levers, rate * radius[:, None], slides, cap)
    return second_derivative_bound(largest, rate, slides)


def _tilts(
    one: Jacobians,
    gains: Array,
    radius: Array,
    second: Array,
    axis_second: Array,
    corners: Array,
    bounds: TileBounds,
    lean: Array,
) -> Array:
    """(k,) the largest |a - b| over each tile, from M of tool points and of axes."""
    turn = one.axis @ gains
    ahead = corners[:, :, 0] - one.points[:, None]
    off = one.axes[:, None] + ahead @ turn.transpose(0, 2, 1) - corners[:, :, 1]
    half = 0.5 * radius**2
    size = np.linalg.norm(turn, axis=(1, 2))
    lost = size * (bounds.radii[:, 0] + second * half) + axis_second * half + lean
    return np.asarray(np.linalg.norm(off, axis=2).max(axis=1) + ROUNDING * lost)
