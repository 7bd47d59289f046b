"""Search for a configuration that a cut tree says there is none of: Newton, inside the region.

What is found is judged as every other configuration is (`stretches`): a refusal that names one is
right, whatever the bounds say. What is not found proves nothing.
"""

from __future__ import annotations

import numpy as np

from coverable.arrays import Array, Ints
from feasibility.certification.cells_reached import at_targets
from feasibility.certification.cut_proofs.box_exclusion import JointRegion, nearest
from feasibility.certification.cut_proofs.linear_models import ANY_AXIS, Models
from feasibility.certification.lever_bounds import jacobians
from feasibility.certification.stretches import Judge, Samples
from feasibility.task import Task
from robots.kinematics import Kinematics
from robots.robot import Robot
from surfaces.cells import Cells

STEPS = 15  # of Newton's method
LONGEST = 0.7  # [rad], [m] of a joint in one step
SWEEPS = 20  # of the descent to where a step goes
AIMS = np.array([0.5, 0.95])  # shares of tolerance and cone that the steps aim at


class Refuter:
    """Looks for configurations with the tool on the surface, or at one cell's target."""

    def __init__(self, robot: Robot, cells: Cells, task: Task, length: float) -> None:
        """Work for one arm, over one surface; differences of axes weigh `length` (m)."""
        self._judge = Judge(robot, task, cells.surface, cells, np.zeros((0, robot.n)))
        self._kinematics, self._targets = Kinematics(robot), task.targets(cells)
        self._task, self._length = task, length

    def find(
        self, starts: Array, at: list[tuple[JointRegion, int | None]]
    ) -> tuple[int, Array] | None:
        """Which start (m, n) leads to a configuration that keeps to the constraints; and that.

        For each the region that it has to lie in is given, and the cell whose target the tool has
        to be at, None where it may be anywhere on the surface.
        """
        low = np.array([region.low for region, _ in at])
        high = np.array([region.high for region, _ in at])
        cell = np.array([-1 if one is None else one for _, one in at])
        q = np.clip(starts, low, high)
        for _ in range(STEPS):
            here = self._judge.along(q).at_rows()
            kept, over = self._judge.within(here), cell >= 0
            held = here.points[over], here.axes[over], here.x[over]
            chord, _ = at_targets(self._task, self._targets, cell[over], *held)
            kept[over] = np.isfinite(chord)
            if kept.any():
                first = int(np.argmax(kept))
                return first, q[first]
            q = np.clip(q + self._step(q, here, cell, low, high), low, high)
        return None

    def _step(self, q: Array, here: Samples, cell: Ints, low: Array, high: Array) -> Array:
        """The steps (m, n) inside low .. high that bring tool point and axis nearest to their aims.

        On a surface the aim is the place that the tool is over; no step where there is none.
        """
        task, over = self._task, (cell >= 0)[:, None]
        target, approach, _ = self._judge.targets(here.places)
        target = np.where(over, self._targets.points[cell], target)
        approach = np.where(over, self._targets.approaches[cell], approach)
        at, aims = jacobians(self._kinematics, q), [task.effective_tolerance, task.cone_chord]
        models = Models(
            np.hstack([here.points - target, self._length * (here.axes - approach)]),
            np.concatenate([at.point, self._length * at.axis], axis=1).transpose(0, 2, 1),
            np.tile(np.minimum(aims, ANY_AXIS) * AIMS * [1.0, self._length], (len(q), 1)),
            np.maximum(low - q, -LONGEST),
            np.minimum(high - q, LONGEST),
            np.zeros_like(q),
        )
        return np.nan_to_num(nearest(models, SWEEPS)[0])
