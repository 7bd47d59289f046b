"""The tool drawn back along a straight line, its axis held; and lifted from where it touches.

Where the standoff is 0, the pairs of tool and surface are not checked while a patch is worked on.
Between patches they are, but for the lift itself: the tool is drawn back along its own axis.
"""

from __future__ import annotations

import numpy as np

from coverable_arrays import Array
from robots import Kinematics, Robot, configuration_near

LIFT = 0.02  # [m]
STEPS = 4  # of the lift: a straight line of the tool point to 0.01 mm or so
NEWTON = 8
CLOSE = 1e-6  # [m], and [1] of the axis


def tool_moved(robot: Robot, q: Array, move: Array, count: int, newton: int, close: float) -> Array:
    """Configurations (k, n) rad or m, q (n,) the first, with the tool point ever further on a line.

    The line is `move` (3,) m, in `count` equal steps; the axis keeps its direction. Fewer rows
    follow q where the arm cannot go on. Each takes at most `newton` steps of Newton's method, and
    is off by less than `close`, m and 1 of the axis.
    """
    kinematics = Kinematics(robot)
    point, axis = kinematics.tool(q)
    rows = [q]
    for k in range(1, count + 1):
        there = point + k / count * move
        reached = configuration_near(kinematics, rows[-1], there, axis, newton, close)
        if reached is None:
            break
        rows.append(reached)
    return np.array(rows)


def lift(robot: Robot, q: Array) -> Array | None:
    """Configurations (k, n) rad or m that draw the tool back from where it touches at q (n,).

    The last is `LIFT` away; None where a limit prevents it.
    """
    back = -LIFT * Kinematics(robot).tool(q)[1]
    rows = tool_moved(robot, q, back, STEPS, NEWTON, CLOSE)
    return rows[1:] if len(rows) > STEPS else None
