"""Statements to be proved by branch and bound, under a budget of boxes.

Batches of boxes are short enough for Ctrl-C and time limits.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from coverable.arrays import Array
from feasibility.roadmap.motions.search_arrays import SearchArrays
from feasibility.roadmap.motions.working_memory import Work
from feasibility.roadmap.proofs.branching import BoxStack, PlaceParts, examine
from feasibility.roadmap.proofs.regions import JointRegion
from feasibility.roadmap.proofs.ruling import Ruling

BATCH = 4000  # boxes between two ticks
LEAST = 500  # boxes of a statement before it is compared with others
MORE = 0.5  # [1] of its boxes so far that a statement is given at a time


@dataclass(eq=False)
class Budget:
    """What an attempt may still spend, and on which arm."""

    arrays: SearchArrays
    work: Work
    left: int
    """Boxes."""
    tick: Callable[[], None]
    """Called between batches; may raise."""
    spent: int = 0

    def examine(self, statement: Statement, most: int) -> None:
        """Go on with a statement for so many boxes, or until it is settled."""
        boxes = statement.boxes
        while statement.ruling is Ruling.OPEN and most > 0 and self.left > 0:
            before = int(boxes.counts[1])
            batch = min(most, self.left, BATCH)
            statement.ruling, statement.found = examine(
                self.arrays, self.work, statement.places, boxes, batch
            )
            used = int(boxes.counts[1]) - before
            self.spent += used
            self.left -= used
            most -= used
            self.tick()

    def settle_one(self, statements: list[Statement], most: int) -> Statement | None:
        """Go on until one of some statements is newly settled.

        After a first look at each, always with the one that has fewest boxes left to examine.

        Args:
            statements: settled ones are left alone.
            most: boxes to spend, or a little more.

        Returns:
            The one that is settled now; None where the boxes are spent, or all were settled.
        """
        end = self.spent + most
        open_ones = [s for s in statements if s.ruling is Ruling.OPEN]
        while open_ones and self.left > 0 and self.spent < end:
            new = [s for s in open_ones if s.boxes.counts[1] < LEAST]
            best = new[0] if new else min(open_ones, key=lambda s: s.boxes_left)
            self.examine(best, max(LEAST, int(MORE * best.boxes.counts[1])))
            if best.ruling is not Ruling.OPEN:
                return best
        return None


@dataclass(eq=False)
class Statement:
    """'In this region the tool is at none of these places', and how far its proof has come."""

    region: JointRegion
    places: PlaceParts
    parameters: int
    """2 on a surface, 0 at a target at rest."""
    ruling: Ruling = Ruling.OPEN
    found: Array = field(default_factory=lambda: np.empty(0))
    """(n,) the configuration that refutes it, where REACHED; nearly so where UNKNOWN."""
    boxes: BoxStack = field(init=False)

    def __post_init__(self) -> None:
        """Start with all of the region."""
        self.boxes = self.region.boxes(self.parameters)
        if self.region.empty:
            self.boxes.counts[0] = 0

    @property
    def boxes_left(self) -> float:
        """An estimate of the boxes still to be examined, from the share that is done."""
        count, examined = self.boxes.counts
        left = float(self.boxes.weight[:count].sum())
        return float(examined) * left / max(1.0 - left, 1e-9)
