"""The task: how the tool is to be held over the surface (eqs. 1 to 4 of the paper)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coverable_errors import Checks
from feasibility.collisions import Collision
from feasibility.cone import chord_of
from surfaces import Cells

DEFAULT_TOLERANCE = 1e-3  # [m]


class Targets(NamedTuple):
    """A task applied to cells: where the tool point has to be, and which way its axis points."""

    points: NDArray[np.float64]
    """(N, 3) m, in the root frame: centre -+ standoff * normal."""
    approaches: NDArray[np.float64]
    """(N, 3) unit: +normal for the inside of a surface, -normal for the outside."""


@dataclass(frozen=True, slots=True)
class Task:
    """Hold the tool point at a standoff from the surface, the axis within a cone, the arm clear.

    Example:
        >>> task = Task(standoff=0.005, cone_deg=45)
        >>> round(task.cone, 4)
        0.7854
        >>> task.effective_tolerance
        0.001

    Raises:
        ArgumentError: standoff or tolerance is negative or not finite, or the cone is outside
            0 to 180 degrees; all that is wrong is named.
    """

    standoff: float
    """d, metres between surface and tool point."""
    cone_deg: float
    """alpha, the largest angle in degrees between tool axis and approach direction."""
    tolerance: float | None = None
    """How far the tool point may deviate from its target surface, metres. None leaves it to the
    method: `DEFAULT_TOLERANCE` for the complete search, step times reach for the greedy one; the
    verdict states what was used."""
    collision: Collision | None = None
    """What the arm has to stay clear of; None where collisions are not checked."""

    def __post_init__(self) -> None:
        """Refuse numbers that describe no task; keep them as plain floats."""
        checks = Checks("task")
        kept: dict[str, float | None] = {
            "standoff": checks.number(
                "standoff", self.standoff, "must be a finite number >= 0 (metres)", low=0.0
            ),
            "cone_deg": checks.number(
                "cone_deg", self.cone_deg, "must lie in 0 .. 180 (degrees)", 0.0, 180.0
            ),
            "tolerance": None
            if self.tolerance is None
            else checks.positive("tolerance", self.tolerance),
        }
        if not isinstance(self.collision, Collision | None):
            expected = "must be a Collision, such as Collision(clearance=0.005), or None"
            checks.wrong("collision", self.collision, expected)
        checks.done()
        for name, value in kept.items():
            object.__setattr__(self, name, value)

    @property
    def cone(self) -> float:
        """The half angle alpha of the cone, radians."""
        return math.radians(self.cone_deg)

    @property
    def effective_tolerance(self) -> float:
        """The tolerance, m; where it is left to the method, that of the complete search."""
        return DEFAULT_TOLERANCE if self.tolerance is None else self.tolerance

    @property
    def cone_chord(self) -> float:
        """|a - b| at the boundary of the cone, 0 .. 2; inf where any axis will do."""
        return chord_of(self.cone)

    def targets(self, cells: Cells) -> Targets:
        """Targets c_p(u, v), eq. (1), and approaches b(u, v), eq. (3), of the cell centres."""
        sign = cells.surface.side_sign
        return Targets(
            points=cells.centres + sign * self.standoff * cells.normals,
            approaches=-sign * cells.normals,
        )
