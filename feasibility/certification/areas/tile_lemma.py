"""Does a tile hold: is there a continuous map of configurations over it, from a given one?

The lemma is that of `feasibility.area.kernels.lemma`, where it is proved; here it is evaluated anew
by NumPy from Pinocchio's Jacobians. What is given is a configuration q and a matrix G for each
tile, and neither is trusted: G is brought to J G = I, and every number computed from q and G again.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from feasibility.certification.rolls import Held
from feasibility.task import Task
from robots import Kinematics, Robot
from surfaces.cell_tiles import CellTiles, TileBounds, Tiles

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

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
    one = _Jacobians.at(robot, q)
    found = one.point @ gains
    with np.errstate(all="ignore"):
        known = np.where(np.isfinite(found).all(axis=(1, 2), keepdims=True), found, 0.0)
        regular = np.less(np.linalg.cond(known), WORST_CONDITION).reshape(len(q))
        exact = gains @ np.linalg.inv(np.where(regular[:, None, None], known, np.eye(3)))
        rate = np.linalg.norm(exact, axis=2) * ROUNDING
        off = np.linalg.norm(corners[:, :, 0] - one.points[:, None], axis=2)
        rho = off.max(axis=1) * ROUNDING + bounds.radii[:, 0]
        radius, bent = one.solutions(rate, rho)
        away = rate * radius[:, None]
        inside = (q - away >= robot.lower - CLOSE_TO_LIMIT) & (
            q + away <= robot.upper + CLOSE_TO_LIMIT
        )
        good = regular & np.isfinite(radius) & inside.all(axis=1)
        if task.cone_chord < np.inf:
            most = one.tilts(exact, rate, radius, bent, corners, bounds, lean)
            good &= most <= task.cone_chord + CLOSE_TO_ZERO
    return np.asarray(good)


@dataclass(frozen=True, eq=False, slots=True)
class _Jacobians:
    """Tool points, axes and their derivatives at k configurations."""

    points: Array
    """(k, 3) m."""
    axes: Array
    """(k, 3)"""
    point: Array
    """(k, 3, n)"""
    axis: Array
    """(k, 3, n)"""
    slides: Mask
    """(n,) prismatic joints."""

    @staticmethod
    def at(robot: Robot, q: Array) -> _Jacobians:
        """By Pinocchio."""
        kinematics = Kinematics(robot)
        points, axes = kinematics.tools(q)
        linear, angular = np.split(kinematics.twists(q).transpose(0, 2, 1), 2, axis=2)
        point = linear + np.cross(angular, points[:, None])
        axis = np.cross(angular, axes[:, None])
        return _Jacobians(
            points, axes, point.transpose(0, 2, 1), axis.transpose(0, 2, 1),
            np.asarray(robot.prismatic),
        )  # fmt: skip

    def solutions(self, rate: Array, rho: Array) -> tuple[Array, Array]:
        """(k,) the radius y that holds all solutions, inf where none is known; and M."""
        radius, bent = 2.0 * rho, np.zeros_like(rho)
        for _ in range(ROUNDS):
            bent = self._bent(self.point, rate, radius, np.inf)
            left = 1.0 - 2.0 * bent * rho
            known = left > 0.0
            root = np.sqrt(np.where(known, left, 1.0))
            radius = np.where(known, ROUNDING * 2.0 * rho / (1.0 + root), np.inf)
        return radius, bent

    def _bent(self, rows: Array, rate: Array, radius: Array, cap: float) -> Array:
        """(k,) M of tool points, or of axes with the cap 1, on the balls of these radii."""
        turns = np.where(self.slides, 0.0, rate)
        before = np.cumsum(turns, axis=1) - turns
        levers = np.linalg.norm(rows, axis=1)
        behind, total = np.zeros(len(rate)), np.zeros(len(rate))
        for j in reversed(range(rate.shape[1])):
            if self.slides[j]:
                if cap > 1.0:
                    total += 2.0 * rate[:, j] * before[:, j]
                    behind += rate[:, j] * radius
                continue
            lever = np.minimum(levers[:, j] + behind, cap)
            total += lever * rate[:, j] * (rate[:, j] + 2.0 * before[:, j])
            behind += lever * rate[:, j] * radius
        return total

    def tilts(
        self,
        gains: Array,
        rate: Array,
        radius: Array,
        bent: Array,
        corners: Array,
        bounds: TileBounds,
        lean: Array,
    ) -> Array:
        """(k,) the largest |a - b| over each tile."""
        turn = self.axis @ gains
        ahead = corners[:, :, 0] - self.points[:, None]
        off = self.axes[:, None] + ahead @ turn.transpose(0, 2, 1) - corners[:, :, 1]
        half = 0.5 * radius**2
        own = self._bent(self.axis, rate, radius, 1.0)
        size = np.linalg.norm(turn, axis=(1, 2))
        lost = size * (bounds.radii[:, 0] + bent * half) + own * half + lean
        return np.asarray(np.linalg.norm(off, axis=2).max(axis=1) + ROUNDING * lost)
