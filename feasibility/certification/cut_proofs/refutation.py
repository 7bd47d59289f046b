"""Search for a configuration that a cut tree says there is none of: Gauss and Newton, with bounds.

What is found is checked against the surface itself: a refusal that names a configuration is right,
whatever the bounds say. What is not found proves nothing.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coverable_arrays import Array, Ints, Mask
from feasibility.certification.cut_proofs.box_exclusion import excess
from feasibility.certification.cut_proofs.linear_models import ArmModel, Models, derivatives
from feasibility.certification.cut_proofs.parts_agreement import closest_places
from feasibility.certification.cut_proofs.region import JointRegion
from feasibility.certification.rolls import off_middle, reference_axes, roll_vectors
from feasibility.roll import projected
from feasibility.targets import u_directions
from feasibility.task import Task
from surfaces import Cells

STEPS = 15  # of Newton's method
LONGEST = 0.7  # [rad], [m] of a joint in one step
DAMPING = 1e-4  # of the sum of squares
SLIDE = 0.3  # [m] of the place on the surface in one step
INNER_TOLERANCE, INNER_CONE = 0.5, 0.95  # what the steps aim at, as shares


class Refutation(NamedTuple):
    """A configuration that a tree says there is none of."""

    q: Array
    """(n,) rad or m."""
    start: int
    """Index of the start that led there."""


class Refuter:
    """Looks for configurations with the tool on the surface, or at one cell's target."""

    def __init__(self, arm: ArmModel, cells: Cells, task: Task, length: float) -> None:
        """Work for one arm; axes weigh `length` (m)."""
        self.arm = arm
        self.cells = cells
        self.task = task
        self.length = length
        self.targets = task.targets(cells)

    def find(
        self, starts: Array, at: list[tuple[JointRegion, int | None]], sums: JointRegion
    ) -> Refutation | None:
        """A configuration that keeps to the constraints, near one of the starts (m, n).

        Args:
            starts: rad or m.
            at: for each start the region that the configuration has to lie in, and the cell whose
                target the tool has to be at, None where it may be anywhere on the surface.
            sums: the region whose weighted sums bound all of them.
        """
        low = np.array([region.low for region, _ in at])
        high = np.array([region.high for region, _ in at])
        cell = np.array([-1 if one is None else one for _, one in at])
        q = np.clip(starts, low, high)
        for _ in range(STEPS):
            points, axes = self.arm.kinematics.tools(q)
            target, approach, on_surface, closest = self._targets(points, cell)
            error, tilt = points - target, axes - approach
            kept = on_surface & (np.linalg.norm(error, axis=1) <= self.task.effective_tolerance)
            kept &= np.linalg.norm(tilt, axis=1) <= self.task.cone_chord
            kept &= sums.sums_hold(q) & self._rolled(q, axes, approach, closest, cell)
            if kept.any():
                first = int(np.argmax(kept))
                return Refutation(q[first], first)
            residual = np.concatenate([error, self.length * tilt], axis=1)
            slides = _tangents(approach) * np.where(cell < 0, SLIDE, 0.0)[:, None, None]
            q = self._stepped(q, residual, slides, low - q, high - q, sums)
        return None

    def _targets(self, points: Array, cell: Ints) -> tuple[Array, Array, Mask, Array]:
        """Target points and approaches (m, 3) for tool points, and where they are on the patch.

        And the surface's points under them.
        """
        sign = self.cells.surface.side_sign
        found = closest_places(self.cells.surface, points)
        target = found.points + sign * self.task.standoff * found.normals
        away = np.linalg.norm(points[:, None] - self.targets.points, axis=2)
        near = np.where(cell < 0, np.argmin(away, axis=1), cell)
        slides = (found.on_patch & (cell < 0))[:, None]
        fixed = self.task.fixed_approach(self.cells)
        approaches = -sign * found.normals if fixed is None else fixed
        return (
            np.where(slides, target, self.targets.points[near]),
            np.where(slides, approaches, self.targets.approaches[near]),
            found.on_patch | (cell >= 0),
            found.points,
        )

    def _rolled(self, q: Array, axes: Array, approaches: Array, closest: Array, cell: Ints) -> Mask:
        """(m,) whose roll is in its range, over the surface or at cells' targets."""
        roll, at_cells = self.task.roll, self.targets.references
        if roll is None or at_cells is None:
            return np.ones(len(q), dtype=bool)
        fixed = self.task.fixed_reference(self.cells)
        along = u_directions(self.cells.surface, closest) if fixed is None else fixed
        if along is None:
            references = np.full_like(approaches, np.nan)
        else:
            references, _ = projected(np.broadcast_to(along, approaches.shape), approaches)
        references = np.where((cell < 0)[:, None], references, at_cells[np.maximum(cell, 0)])
        z = roll_vectors(reference_axes(self.arm.robot, q), axes, references, approaches, roll)
        return np.asarray(off_middle(z) <= roll.half)

    def _stepped(
        self, q: Array, residual: Array, slides: Array, low: Array, high: Array, sums: JointRegion
    ) -> Array:
        """Configurations one step of low .. high (m, n) nearer to the constraints."""
        n, m = self.arm.n, len(q)
        by_joint = derivatives(self.arm.kinematics, q, self.length)[0]
        columns = np.concatenate([by_joint, np.pad(-slides, ((0, 0), (0, 0), (0, 3)))], axis=1)
        aim = [
            INNER_TOLERANCE * self.task.effective_tolerance,
            self.length * INNER_CONE * min(self.task.cone_chord, 4.0),
        ]
        models = Models(
            residual,
            columns,
            np.tile(aim, (m, 1)),
            np.append(np.maximum(low, -LONGEST), -np.ones((m, 2)), axis=1),
            np.append(np.minimum(high, LONGEST), np.ones((m, 2)), axis=1),
            np.zeros((m, n + 2)),
        )
        step = least_step(sums.with_sums(models, q))[:, :n]
        return np.asarray(q + np.clip(step, low, high))


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
