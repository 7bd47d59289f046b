"""Cells that collisions keep the arm from, proved: by the tool alone, or by boxes of the joints."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from feasibility.collisions import gather
from feasibility.roadmap.branch_and_bound import root_box
from feasibility.roadmap.joint_boxes.prover import ALL_BOXES, ArmBlocked, JointBoxes
from feasibility.roadmap.motions import PROJECTION_STEPS, SearchArrays, Work, project_near_cell
from feasibility.roadmap.tool_alone import ToolAlone, ToolBlocked
from feasibility.task import Task
from robots import Robot
from surfaces import Surface

GUESSES = 30  # guesses at a configuration over the cell, of which none may be seen to be clear


@dataclass(eq=False)
class Blockers:
    """Proofs that collisions keep an arm from cells of one problem."""

    alone: ToolAlone
    boxes: JointBoxes
    tool: dict[int, ToolBlocked | None] = field(default_factory=dict)
    """By cell: what keeps the tool from it in every pose; None where that is not proved."""
    arm: dict[int, ArmBlocked | None] = field(default_factory=dict)
    """The same of all of the arm."""

    @property
    def left(self) -> int:
        """Boxes of joint values that may still be looked at."""
        return max(self.boxes.left, 0)

    def tool_collides(self, arrays: SearchArrays, cell: int) -> bool:
        """Is it proved that the tool collides in every pose over a cell, whatever the arm does?"""
        if cell not in self.tool:
            point, approach = arrays.points[cell], arrays.approaches[cell]
            self.tool[cell] = self.alone.blocking(point, approach)
        return self.tool[cell] is not None

    def arm_collides(
        self, arrays: SearchArrays, work: Work, cell: int, tick: Callable[[], object]
    ) -> bool:
        """Is it proved that something of the arm collides wherever the tool is over a cell?

        `tick` is called now and then; it may raise.
        """
        if cell not in self.arm:
            self.arm[cell] = self._blocking(arrays, work, cell, tick)
        return self.arm[cell] is not None

    def _blocking(
        self, arrays: SearchArrays, work: Work, cell: int, tick: Callable[[], object]
    ) -> ArmBlocked | None:
        boxes = root_box(arrays)
        low, high = boxes.low[0], boxes.high[0]
        if not np.isfinite(high - low).all() or not self.boxes.tests:
            return None
        # Random numbers of its own: whether it is tried does not change the search.
        guesses = np.random.default_rng(cell).uniform(low, high, (GUESSES, len(low)))
        found = [q for q in guesses if project_near_cell(arrays, work, cell, q, PROJECTION_STEPS)]
        if not found or self.boxes.any_clear(np.array(found)):
            return None
        reference = arrays.references[cell] if arrays.roll[1] < np.inf else None
        target = self.boxes.target(arrays.points[cell], arrays.approaches[cell], reference)
        return self.boxes.blocking(target, low, high, tick)


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
