"""Branch and bound under a budget of boxes, in batches short enough for Ctrl-C and time limits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from feasibility.roadmap.arrays import SearchArrays, Work
from feasibility.roadmap.boxes import Boxes, Places
from feasibility.roadmap.branch_and_bound import Ruling, examine
from feasibility.roadmap.cuts.regions import Region

BATCH = 4000  # boxes between two ticks
TURNS = (500, 1500, 6000, 25_000, 100_000, 400_000)  # boxes of a statement in its turns


@dataclass(eq=False)
class Counted:
    """What an attempt may still spend, and on what arm."""

    arrays: SearchArrays
    work: Work
    left: int
    """Boxes."""
    tick: Callable[[], None]
    """Called between batches; may raise."""
    spent: int = 0

    def examine(self, statement: Statement, most: int) -> Ruling:
        """Go on with a statement until so many boxes were spent on it, or none are left."""
        boxes = statement.boxes
        while statement.ruling is Ruling.OPEN and boxes.counts[1] < most and self.left > 0:
            before = int(boxes.counts[1])
            batch = min(most - before, self.left, BATCH)
            statement.ruling, q = examine(
                self.arrays, self.work, statement.places, statement.region.slabs, boxes, batch
            )
            statement.found = q
            self.spent += int(boxes.counts[1]) - before
            self.left -= int(boxes.counts[1]) - before
            self.tick()
        return statement.ruling


@dataclass(eq=False)
class Statement:
    """'In this region the tool is at none of these places', and how far its proof has come."""

    region: Region
    places: Places
    parameters: int
    """2 on a surface, 0 at a target at rest."""
    ruling: Ruling = Ruling.OPEN
    found: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    """(n,) the configuration that refutes it, where REACHED; nearly so where UNKNOWN."""
    boxes: Boxes = field(init=False)

    def __post_init__(self) -> None:
        """Start with the whole region."""
        self.boxes = self.region.boxes(self.parameters)
        if self.region.empty:
            self.boxes.counts[0] = 0
