"""The configuration near another with the tool where it is asked for, by Newton's method."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robots.kinematics import Kinematics

Floats = NDArray[np.float64]


def configuration_near(
    kinematics: Kinematics, q: Floats, point: Floats, axis: Floats, steps: int, close: float
) -> Floats | None:
    """The configuration near q (n,) with tool point and axis there; None where none is found.

    Newton's method with the shortest steps, clipped to the limits.

    Args:
        kinematics: of the arm.
        q: (n,) rad or m, where to begin.
        point: (3,) m, of the tool.
        axis: (3,) unit, its approach axis.
        steps: at most so many.
        close: m of the tool point, and 1 of the axis, how far it may be off.
    """
    robot = kinematics.robot
    for _ in range(steps):
        at, along = kinematics.tool(q)
        missed = np.concatenate([point - at, axis - along])
        if np.abs(missed).max() < close:
            return q
        rows = np.concatenate(kinematics.jacobians(q))
        step = np.linalg.lstsq(rows, missed, rcond=1e-6)[0]
        q = np.clip(q + step, robot.lower, robot.upper)
    return None
