"""How far one J-cell step goes: its size, the tolerance that fits it, and the margin between them.

Between two J-cells the arm moves on a straight line in joint space, s_j the step of joint j and r_j
the longest lever arm the tool point can have about it. Along that line

    |p''| <= D  = sum_j r_j s_j (s_j + 2 sum_{i<j} s_i)    (revolute i; a prismatic joint j adds
                                                            2 s_j sum_{i<j} s_i instead)
    |a''| <= Da = sum_j s_j (s_j + 2 sum_{i<j} s_i)        (revolute i and j)
    |p'|  <= L  = sum_j r_j s_j                            (s_j for a prismatic joint)

With k and b the surface's bounds on the first and second derivative of its normals, the height of
the tool point and the chord |a - approach direction| leave the values at the two ends by at most

    sag = (D + k L^2) / 8    and    turn = (Da + b L^2 + k D) / 8

so J-cells that keep this margin hold the constraints between them, too. It is small: of the second
order in the step, where the tolerance is of the first.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from feasibility.cone import chord_of
from feasibility.search import Search
from feasibility.task import Task
from robots import Robot
from surfaces.patches import ClosedFormPatch

TOLERANCE_STEPS = 0.5
"""Default tolerance, in steps times reach: half of what the tool can move in one step."""


@dataclass(frozen=True, eq=False, slots=True)
class Steps:
    """Moves between neighbouring J-cells."""

    size: NDArray[np.float64]
    """(n,) delta q, rad; for a prismatic joint the length (m) that angle sweeps at the reach."""
    moves: Literal["single", "all"]
    tolerance: float
    """m, the task's; where it has none, step times reach times `TOLERANCE_STEPS`. The offset
    surface is never met exactly on a grid of joint values (paper, eq. 5)."""
    sag: float
    """m, margin for the tool point between J-cells; inf where it cannot be bounded."""
    turn: float
    """Margin for |a - approach direction| between J-cells."""
    cone_cosine: float
    """Least cosine of the angle between axis and approach direction at a J-cell: -2 where any angle
    will do, 2 where the cone is too narrow for a step."""

    @staticmethod
    def of(robot: Robot, surface: ClosedFormPatch, task: Task, search: Search) -> Steps:
        """The steps of a search."""
        step = math.radians(search.step_deg)
        reach = _extent(robot)
        size = np.where(robot.prismatic, step * reach, step)
        tolerance = TOLERANCE_STEPS * step * reach if task.tolerance is None else task.tolerance
        sag, turn = _margins(robot, surface, task, size, tolerance, search.moves == "all")
        chord = chord_of(task.cone) - turn
        cosine = 1.0 - 0.5 * chord * chord if chord > 0.0 else 2.0
        if task.cone_deg >= 180.0:
            cosine = -2.0
        return Steps(size, search.moves, tolerance, sag, turn, cosine)


def _extent(robot: Robot) -> float:
    """The reach (m); where an endless rail makes that infinite, the sum of the link lengths."""
    if math.isfinite(robot.reach):
        return robot.reach
    return float(np.linalg.norm(robot.chain.translations[1:], axis=1).sum())


def _margins(
    robot: Robot,
    surface: ClosedFormPatch,
    task: Task,
    size: NDArray[np.float64],
    tolerance: float,
    together: bool,
) -> tuple[float, float]:
    """Sag (m) and turn between J-cells, as in the module's docstring."""
    prismatic = robot.prismatic
    stroke = np.where(prismatic, np.maximum(np.abs(robot.lower), np.abs(robot.upper)), 0.0)
    links = np.linalg.norm(robot.chain.translations[1:], axis=1)
    # The lever about joint j: all links after it, and all strokes after it.
    lever = np.cumsum((links + np.append(stroke[1:], 0.0))[::-1])[::-1]
    angle = np.where(prismatic, 0.0, size)
    before = np.cumsum(angle) - angle if together else np.zeros(robot.n)
    reach = np.where(prismatic, 1.0, lever)
    point = size * np.where(prismatic, 2.0 * before, lever * (size + 2.0 * before))
    axis = angle * (angle + 2.0 * before)
    total = np.sum if together else np.max
    d, da, length = float(total(point)), float(total(axis)), float(total(reach * size))
    bounds = surface.bounds(surface.side_sign * task.standoff, tolerance)
    if not math.isfinite(d + bounds.curvature + bounds.bend):
        return math.inf, math.inf  # the offset surface folds, or a rail has no end
    return (
        (d + bounds.curvature * length**2) / 8.0,
        (da + bounds.bend * length**2 + bounds.curvature * d) / 8.0,
    )
