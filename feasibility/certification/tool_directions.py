"""How a task wants the tool held over places of a surface: its approach direction.

Where the roll about that is limited, `roll_held.py` says what has to hold of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coverable.arrays import Array
from feasibility.task import Task
from surfaces.cells import Cells
from surfaces.places.places import PlacePaths

ROLL_CLOSE = 1e-9  # [1], [rad]: u directions are known by differences to about this


@dataclass(frozen=True, eq=False, slots=True)
class Held:
    """Approach directions over the places of one surface."""

    sign: float
    """The approach is this times the outward normal, unless it is fixed."""
    approach: Array | None
    """(3,) where it is one direction."""

    @staticmethod
    def of(task: Task, cells: Cells) -> Held:
        """What `task` wants over the surface of `cells`, or that under them."""
        return Held(-cells.surface.side_sign, task.fixed_approach(cells))

    def approaches(self, normals: Array) -> Array:
        """Approach directions (..., 3) where the surface has these normals."""
        if self.approach is None:
            return self.sign * normals
        return np.where(np.isnan(normals), np.nan, self.approach)

    def deviations(self, path: PlacePaths) -> Array:
        """d_b (k, 3) of the pieces of paths."""
        off = path.deviations[..., 1]
        return off if self.approach is None else np.zeros_like(off)
