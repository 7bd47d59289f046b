"""Proofs that collisions keep the arm from a cell, of the case given and of those nearby."""

from __future__ import annotations

from feasibility.roadmap.joint_boxes import Blockers, blockers_of
from feasibility.sensitivity.quantities import Quantity, Variant

MOST_BOXES = 10_000  # of joint values, for all cases of one explanation
Steps = tuple[Quantity, int]
"""A quantity, and how many steps from its value."""


class CollisionProofs:
    """What keeps an arm from cells; the latest case asked for is kept."""

    def __init__(self, given: Variant) -> None:
        """Prepare the case as given."""
        self._given = given
        self._left = MOST_BOXES
        self._asked: tuple[tuple[str, int], Blockers | None] | None = None

    def at(self, steps: Steps | None) -> Blockers | None:
        """Those of a case nearby, or of the one given; None where collisions are not checked."""
        if self._given.task.collision is None:
            return None
        key = ("", 0) if steps is None else (steps[0].name, steps[1])
        if self._asked is None or self._asked[0] != key:
            variant = self._given if steps is None else steps[0].applied(self._given, steps[1])
            robot, cells, task = variant
            if self._asked is not None and self._asked[1] is not None:
                self._left = self._asked[1].left
            self._asked = key, blockers_of(robot, cells.surface, task, self._left)
        return self._asked[1]
