"""Search for a configuration that a cut tree says there is none of: Newton, inside the region.

What is found is judged as every other configuration is (`stretches`): a refusal that names one is
right, whatever the bounds say. What is not found proves nothing.
"""

from __future__ import annotations

import numpy as np

from coverable.arrays import Array, Ints, Mask
from feasibility.certification.cells_reached import at_targets
from feasibility.certification.cut_proofs.box_cutting import JointRegion
from feasibility.certification.lever_bounds import jacobians
from feasibility.certification.stretches import Judge, Samples
from feasibility.task import Task
from robots.kinematics import Kinematics
from robots.robot import Robot
from surfaces.cells import Cells
from surfaces.places.offset_surfaces import offset_surface

STEPS = 15  # of Newton's method
LONGEST = 0.7  # [rad], [m] of a joint in one step
DAMPING = 1e-4  # of the sum of squares
INNER_TOLERANCE, INNER_CONE = 0.5, 0.95  # what the steps aim at, as shares


class Refuter:
    """Looks for configurations with the tool on the surface, or at one cell's target."""

    def __init__(self, robot: Robot, cells: Cells, task: Task, length: float) -> None:
        """Work for one arm, over one surface; differences of axes weigh `length` (m)."""
        height = cells.surface.side_sign * task.standoff
        self._judge = Judge(robot, task, offset_surface(cells.surface, height), cells)
        self._kinematics, self._targets = Kinematics(robot), task.targets(cells)
        self._task, self._length = task, length

    def find(
        self, starts: Array, at: list[tuple[JointRegion, int | None]]
    ) -> tuple[int, Array] | None:
        """Which start (m, n) leads to a configuration that keeps to the constraints; and that.

        Args:
            starts: rad or m.
            at: for each start the region that the configuration has to lie in, and the cell whose
                target the tool has to be at, None where it may be anywhere on the surface.
        """
        low = np.array([region.low for region, _ in at])
        high = np.array([region.high for region, _ in at])
        cell = np.array([-1 if one is None else one for _, one in at])
        q = np.clip(starts, low, high)
        for _ in range(STEPS):
            here = self._judge.sampled(np.zeros(len(q), dtype=np.int64), np.zeros(len(q)), q)
            kept, over = self._judge.within(here), cell >= 0
            held = here.points[over], here.axes[over], here.x[over]
            chord, _ = at_targets(self._task, self._targets, cell[over], *held)
            kept[over] = np.isfinite(chord)
            if kept.any():
                first = int(np.argmax(kept))
                return first, q[first]
            step = self._step(q, here, cell, low < high)
            step = np.nan_to_num(np.clip(step, -LONGEST, LONGEST))  # where there is no place
            q = np.clip(q + step, low, high)
        return None

    def _step(self, q: Array, here: Samples, cell: Ints, free: Mask) -> Array:
        """The short steps (m, n) of free joints that bring tool point and axis to their aims.

        Two numbers are to become small: how far the tool point is from its target, which on a
        surface is the nearest one, and the axis from its approach direction.
        """
        task, over = self._task, (cell >= 0)[:, None]
        target, approach = self._judge.targets(here.places)
        target = np.where(over, self._targets.points[cell], target)
        approach = np.where(over, self._targets.approaches[cell], approach)
        at, missed, rows = jacobians(self._kinematics, q), [], []
        for off, columns, aim in (
            (here.points - target, at.point, INNER_TOLERANCE * task.effective_tolerance),
            (self._length * (here.axes - approach), self._length * at.axis,
             self._length * INNER_CONE * min(task.cone_chord, 4.0)),
        ):  # fmt: skip
            size = np.linalg.norm(off, axis=1)
            along = off / np.maximum(size, 1e-300)[:, None]
            missed.append(np.maximum(size - aim, 0.0))
            rows.append(np.einsum("mkj,mk->mj", columns, along) * free)
        matrix, left = np.stack(rows, axis=1), np.stack(missed, axis=1)
        squares = matrix @ matrix.transpose(0, 2, 1)
        damped = squares + (DAMPING * np.trace(squares, axis1=1, axis2=2) + 1e-12)[
            :, None, None
        ] * np.eye(2)
        return -np.einsum("mij,mi->mj", matrix, np.linalg.solve(damped, left[..., None])[..., 0])
