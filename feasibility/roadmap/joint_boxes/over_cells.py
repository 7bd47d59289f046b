"""Cells that collisions keep the arm from, proved: by the tool alone, or by boxes of the joints."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from feasibility.collisions import gather
from feasibility.roadmap.branch_and_bound import root_box
from feasibility.roadmap.joint_boxes.prover import ALL_BOXES, ArmBlocked, JointBoxes
from feasibility.roadmap.motions import PROJECTION_STEPS, SearchArrays, Work, project_near_cell
from feasibility.roadmap.tool_alone import Blocking, ToolAlone
from feasibility.task import Task
from robots import Robot
from surfaces import Surface

Array = NDArray[np.float64]

LANDINGS = 30  # guesses at a configuration over the cell, of which none may be seen to be clear


class Blockers:
    """What is proved to keep an arm from the cells of one problem, by cell."""

    def __init__(self, alone: ToolAlone, arm: JointBoxes) -> None:
        """Ask nothing yet."""
        self._alone, self._arm = alone, arm
        self.tool: dict[int, Blocking | None] = {}
        """What keeps the tool from a cell in every pose; None where that is not proved."""
        self.arm: dict[int, ArmBlocked | None] = {}
        """What keeps the whole arm from it."""

    @property
    def left(self) -> int:
        """Boxes of joint values that may still be looked at."""
        return max(self._arm.left, 0)

    def over(
        self,
        arrays: SearchArrays,
        work: Work,
        cell: int,
        tick: Callable[[], object] | None = None,
    ) -> bool:
        """Is it proved that collisions keep the arm from a cell?

        Args:
            arrays, work: the search.
            cell: the cell.
            tick: asks about all of the arm, and is called now and then meanwhile; may raise. None
                asks about the tool alone: does it collide in every pose, whatever the arm does?
        """
        if tick is None:
            if cell not in self.tool:
                place = arrays.points[cell], arrays.approaches[cell]
                self.tool[cell] = self._alone.blocking(*place)
            return self.tool[cell] is not None
        if cell not in self.arm:
            self.arm[cell] = self._blocking(arrays, work, cell, tick)
        return self.arm[cell] is not None

    def _blocking(
        self, arrays: SearchArrays, work: Work, cell: int, tick: Callable[[], object]
    ) -> ArmBlocked | None:
        boxes = root_box(arrays)
        low, high = boxes.low[0], boxes.high[0]
        if not np.isfinite(high - low).all() or not self._arm.way:
            return None
        # Random numbers of its own: whether it is tried does not change the search.
        guesses = np.random.default_rng(cell).uniform(low, high, (LANDINGS, len(low)))
        landed = [q for q in guesses if project_near_cell(arrays, work, cell, q, PROJECTION_STEPS)]
        if not landed or self._arm.hopeless(np.array(landed)):
            return None
        reference = arrays.references[cell] if arrays.roll[1] < np.inf else None
        target = self._arm.target(arrays.points[cell], arrays.approaches[cell], reference)
        return self._arm.blocking(target, low, high, tick)


def blockers_of(
    robot: Robot, surface: Surface, task: Task, boxes: int = ALL_BOXES
) -> Blockers | None:
    """What may keep an arm from cells of a surface; None where collisions are not checked.

    Args:
        robot, surface, task: the problem.
        boxes: of joint values that may be looked at for all its cells.
    """
    bodies = gather(robot, surface, task.collision, task.standoff)
    if bodies is None:
        return None
    alone = ToolAlone(robot, bodies, task.cone, task.effective_tolerance)
    return Blockers(alone, JointBoxes(robot, bodies, task, boxes))
