"""How a task wants the tool held over places of a surface: its approach direction.

Here the roll about that is free; where it is limited, `roll_held.py` says what has to hold of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coverable.arrays import Array
from feasibility.task import Task
from robots.robot import Robot
from surfaces.cells import Cells
from surfaces.places.places import OffsetSurface, PlacePaths, Places

ROLL_CLOSE = 1e-9  # [1], [rad]: u directions are known by differences to about this


@dataclass(frozen=True, eq=False, slots=True)
class Held:
    """Approach directions over the places of one surface; the roll is free."""

    offset: OffsetSurface
    sign: float
    """The approach is this times the outward normal, unless it is fixed."""
    approach: Array | None
    """(3,) where it is one direction."""

    @staticmethod
    def of(task: Task, cells: Cells, offset: OffsetSurface) -> Held:
        """What `task` wants over the surface of `cells`, or that under them, by its `offset`."""
        return Held(offset, -cells.surface.side_sign, task.fixed_approach(cells))

    def approaches(self, normals: Array) -> Array:
        """Approach directions (..., 3) where the surface has these normals."""
        if self.approach is None:
            return self.sign * normals
        return np.where(np.isnan(normals), np.nan, self.approach)

    def deviations(self, path: PlacePaths) -> Array:
        """d_b (k, 3) of the pieces of paths."""
        off = path.deviations[..., 1]
        return off if self.approach is None else np.zeros_like(off)

    def axes_x(self, robot: Robot, q: Array) -> Array:
        """Reference axes (k, 3) of the tool at configurations q (k, n); 0 where none counts."""
        return np.zeros((len(q), 3))

    def second_derivatives(self, robot: Robot, q: Array, axes: Array, x: Array) -> Array:
        """(m - 1,) D_x + D_y between rows q (m, n), see `roll_bounds`; 0 where none counts."""
        return np.zeros(max(len(q) - 1, 0))

    def rolls(self, x: Array, axes: Array, approaches: Array, places: Places) -> Array:
        """(k,) rad, how far rolls are off the middle of their range; 0 where it is free.

        Args:
            x, axes: (k, 3) of the tool.
            approaches: (k, 3) at the places.
            places: k of them.
        """
        return np.zeros(len(x))

    def rolls_between(
        self,
        x: tuple[Array, Array],
        axes: tuple[Array, Array],
        second: Array,
        path: PlacePaths,
        approaches: Array,
    ) -> Array:
        """(k,) rad, bounds on that along stretches; inf where the roll may leave its range.

        Args:
            x, axes: (k, 3) of the tool at both ends.
            second: (k,) D_x + D_y along the stretch.
            path: of places.
            approaches: (k, 4, 3) at its four places.
        """
        return np.zeros(len(second))
