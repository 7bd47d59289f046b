"""Does something collide wherever the tool is over a cell? The verifier's boxes, for the search.

The search asks this, and `never_clear`, where it cannot reach a cell: such proofs have one engine.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np

from coverable.arrays import Array
from feasibility.certification.collisions.every_pose import Collides
from feasibility.certification.collisions.everywhere import Overlapping
from feasibility.certification.cut_proofs.box_cutting import JointRegion
from feasibility.certification.cut_proofs.empty_region import Claim, Emptiness
from feasibility.certification.cut_proofs.linear_models import Allowed, ArmModel, cell_parts
from feasibility.certification.cut_proofs.refutation import Refuter
from feasibility.certification.lever_bounds import out_of_line
from feasibility.collisions.problem_bodies import Bodies
from feasibility.task import Task
from robots.robot import Robot
from surfaces.cells import Cells


class ArmCollisions:
    """Looks for proofs that bodies of one problem collide wherever the tool is over a cell."""

    def __init__(self, robot: Robot, cells: Cells, task: Task, bodies: Bodies) -> None:
        """Of `bodies` those pairs count that are checked."""
        self._robot, self._cells, self._task, self._bodies = robot, cells, task, bodies
        self._targets = task.targets(cells)
        self._region = JointRegion(robot.lower, robot.upper).folded(robot.prismatic)

    @cached_property
    def _overlapping(self) -> Overlapping:
        """Points are placed in bodies when they are first needed."""
        return Overlapping(self._robot, self._bodies)

    @property
    def possible(self) -> bool:
        """May anything be proved of this arm?"""
        finite = bool(np.isfinite(self._region.high - self._region.low).all())
        return finite and bool(self._bodies.pairs) and not out_of_line(self._robot)

    def any_clear(self, q: Array, cell: int) -> bool:
        """Is nothing known to overlap at one of some configurations (k, n) over a cell?

        Then nothing is proved there.
        """
        target = np.broadcast_to(self._targets.points[cell], (len(q), 3))
        off = np.full(len(q), self._task.effective_tolerance)
        return bool((self._overlapping.deepest(q, q, target, off).pair < 0).any())

    def check(self, cell: int, tick: Callable[[], object], most: int) -> Collides:
        """Is it confirmed that something collides wherever the tool is over a cell?

        Args:
            cell: the cell.
            tick: called between batches of boxes; may raise.
            most: how many boxes may be looked at.
        """
        arm = ArmModel(self._robot, self._region.low, self._region.high)
        allowed, parts = Allowed.by(self._task, arm), cell_parts(self._targets)
        engine = Emptiness(arm, parts, lambda _: cell, allowed, tick, self._overlapping)
        refuter = Refuter(self._robot, self._cells, self._task, allowed.length)
        found = engine.test([Claim("", self._region, cell)], refuter, most)
        if found.failed is not None:
            return Collides(False, found.boxes)
        pairs = [self._bodies.pairs[k] for k in sorted(engine.blamed)]
        return Collides(True, found.boxes, tuple((pair.first, pair.second) for pair in pairs))
