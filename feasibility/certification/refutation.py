"""Search for a configuration that a cut tree says there is none of: Gauss and Newton, with bounds.

What is found is checked against the surface itself: a refusal that names a configuration is right,
whatever the bounds say. What is not found proves nothing.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from feasibility.certification.box_exclusion import excess
from feasibility.certification.linear_models import Arm, Array, Models, derivatives
from feasibility.certification.region import Region
from feasibility.task import Task
from surfaces import Cells

STEPS = 20  # of Newton's method
LONGEST = 0.7  # [rad], [m] of a joint in one step
DAMPING = 1e-4  # of the sum of squares
SLIDE = 0.3  # [m] of the place on the surface in one step
INNER_TOLERANCE, INNER_CONE = 0.5, 0.95  # what the steps aim at, as shares


class Refuter:
    """Looks for configurations with the tool on the surface, or at one cell's target."""

    def __init__(self, arm: Arm, cells: Cells, task: Task, length: float) -> None:
        """Work for one arm; axes weigh `length` (m)."""
        self.arm = arm
        self.cells = cells
        self.task = task
        self.length = length
        self.targets = task.targets(cells)

    def find(self, starts: Array, region: Region, cell: int | None = None) -> Array | None:
        """A configuration (n,) of the region that keeps to the constraints, from starts (m, n).

        Args:
            starts: rad or m.
            region: what it has to lie in.
            cell: at this cell's target; anywhere on the surface by default.
        """
        q = np.clip(starts, region.low, region.high)
        for _ in range(STEPS):
            points, axes = self.arm.kinematics.tools(q)
            target, approach, on_surface = self._targets(points, cell)
            error, tilt = points - target, axes - approach
            kept = on_surface & (np.linalg.norm(error, axis=1) <= self.task.effective_tolerance)
            kept &= np.linalg.norm(tilt, axis=1) <= self.task.cone_chord
            kept &= region.holds(q)
            if kept.any():
                return np.array(q[np.argmax(kept)])
            residual = np.concatenate([error, self.length * tilt], axis=1)
            slides = _tangents(approach) * (SLIDE if cell is None else 0.0)
            q = self._stepped(q, residual, slides, region)
        return None

    def _targets(self, points: Array, cell: int | None) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Target points and approaches (m, 3) for tool points, and where they are on the patch."""
        if cell is not None:
            shape = points.shape
            return (
                np.broadcast_to(self.targets.points[cell], shape),
                np.broadcast_to(self.targets.approaches[cell], shape),
                np.ones(len(points), dtype=bool),
            )
        surface = self.cells.surface
        found = surface.closest(points)
        sign, height = surface.side_sign, found.height[:, None]
        target = points + (sign * self.task.standoff - height) * found.normal
        away = np.linalg.norm(points[:, None] - self.targets.points, axis=2)
        near = np.argmin(away, axis=1)
        inside = found.inside[:, None]
        return (
            np.where(inside, target, self.targets.points[near]),
            np.where(inside, -sign * found.normal, self.targets.approaches[near]),
            found.inside,
        )

    def _stepped(self, q: Array, residual: Array, slides: Array, region: Region) -> Array:
        """Configurations one step nearer to the constraints, inside the region."""
        n, m = self.arm.n, len(q)
        by_joint = derivatives(self.arm.kinematics, q, self.length)[0]
        columns = np.concatenate([by_joint, np.pad(-slides, ((0, 0), (0, 0), (0, 3)))], axis=1)
        aim = [
            INNER_TOLERANCE * self.task.effective_tolerance,
            self.length * INNER_CONE * min(self.task.cone_chord, 4.0),
        ]
        low = np.append(np.maximum(region.low - q, -LONGEST), -np.ones((m, 2)), axis=1)
        high = np.append(np.minimum(region.high - q, LONGEST), np.ones((m, 2)), axis=1)
        models = Models(residual, columns, np.tile(aim, (m, 1)), low, high, np.zeros((m, n + 2)))
        step = least_step(region.with_sums(models, q))
        return np.asarray(np.clip(q + step[:, :n], region.low, region.high))


def least_step(models: Models) -> Array:
    """The short steps d (m, n + 2) inside low .. high that undo what is missed, by damped squares.

    A second solution goes without the variables that the first one put at an end.
    """
    missed = excess(models.residual.T, models.radius.T).T
    step, may_move = np.zeros_like(models.low), models.low < models.high
    for _ in range(2):
        columns = models.columns * may_move[..., None]
        squares = np.einsum("mjk,mjl->mkl", columns, columns)
        size = np.einsum("mkk->m", squares)[:, None, None]
        damped = squares + (DAMPING * size + 1e-12) * np.eye(missed.shape[1])
        left = missed + np.einsum("mjk,mj->mk", models.columns, np.where(may_move, 0.0, step))
        solved = np.linalg.solve(damped, left[..., None])[..., 0]
        found = np.where(may_move, -np.einsum("mjk,mk->mj", columns, solved), step)
        step = np.clip(found, models.low, models.high)
        may_move &= step == found
    return step


def _tangents(normals: Array) -> Array:
    """(m, 2, 3) unit vectors across each of the unit vectors (m, 3), and across each other."""
    least = np.eye(3)[np.argmin(np.abs(normals), axis=1)]
    first = np.cross(normals, least)
    first /= np.maximum(np.linalg.norm(first, axis=1, keepdims=True), 1e-300)
    return np.stack([first, np.cross(normals, first)], axis=1)
