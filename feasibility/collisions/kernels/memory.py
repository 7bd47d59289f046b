"""The memory of the compiled clearance of an arm: what search kernels are given, and Python asks.

How a segment is certified: `segments.py`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array
from feasibility.collisions.kernels import tables as T
from feasibility.collisions.kernels.function import with_address
from feasibility.collisions.kernels.kernel_calls import MEASURE, call
from feasibility.collisions.kernels.packing import packed
from feasibility.collisions.kernels.tables import views
from feasibility.collisions.problem_bodies import Bodies
from robots.robot import Robot


def collision_buffer(bodies: Bodies, robot: Robot) -> Array:
    """The memory of the compiled clearance of an arm's bodies.

    It holds an address of this process: never send it to another one; make it there anew.

    Args:
        bodies: what can collide, and the pairs that are checked.
        robot: the arm whose joints carry them.

    Raises:
        RobotError: the arm is no serial chain.
    """
    memory = packed(bodies, robot).copy()
    views(memory).state[0, T.BLAMED] = -1.0
    return with_address(memory)


def configuration_bounds(buffer: Array, q: ArrayLike) -> Array:
    """(P,) m, lower bounds of the distances of all pairs at q; inf for a pair without shapes.

    They are sharp to about 1e-6 of the distance. Where two bodies overlap a bound is negative, by
    at least the depth. What may stand out from a surface's triangles is taken off.
    """
    t = views(buffer)
    t.asked[0] = q
    slot = int(call(buffer, MEASURE)) if len(t.items) else 0
    pairs = t.items[:, T.PAIR].astype(int)
    result = np.full(int(pairs.max(initial=-1)) + 1, np.inf)
    np.minimum.at(result, pairs, t.items[:, T.BOUND + slot])
    return result
