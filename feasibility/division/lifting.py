"""A tool that touches the surface is lifted before the arm moves to another patch, and set down.

Where the standoff is 0, the pairs of tool and surface are not asked for while a patch is worked on.
Between patches they are, but for the lift itself: the tool is drawn back along its own axis.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robots import Kinematics, Robot, configuration_near

Floats = NDArray[np.float64]

LIFT = 0.02  # [m]
STEPS = 4  # of the lift: a straight line of the tool point to 0.01 mm or so
NEWTON = 8
CLOSE = 1e-6  # [m], and [1] of the axis


def lift(robot: Robot, q: Floats) -> Floats | None:
    """Configurations (k, n) that draw the tool back from where it touches, rad or m.

    The axis keeps its direction. The last is `LIFT` away; None where a limit is in the way.

    Args:
        robot: the arm.
        q: (n,) where the tool touches.
    """
    kinematics = Kinematics(robot)
    point, axis = kinematics.tool(q)
    rows, here = [], q
    for k in range(1, STEPS + 1):
        reached = configuration_near(
            kinematics, here, point - k * LIFT / STEPS * axis, axis, NEWTON, CLOSE
        )
        if reached is None:
            return None
        rows.append(reached)
        here = reached
    return np.array(rows)
