"""The certified clearance, for the search kernels and for Python.

`collision_buffer` makes the memory that the others work on; for one thread of one process. How a
segment is certified: `segments.py`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from coverable_kernels import entry
from feasibility.collisions import Bodies
from feasibility.collisions.kernels import tables as T
from feasibility.collisions.kernels.calls import MEASURE, PUSH, SEGMENT, call, with_address
from feasibility.collisions.kernels.packing import packed
from feasibility.collisions.kernels.tables import Array, row, views
from robots import Robot


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


@entry
def segment_clear(buffer, q0, q1):  # type: ignore[no-untyped-def]
    """Is every pair further apart than its clearance all along a straight joint segment?

    Bounds are kept for both ends of the last segment: ask for the next one from either, bit by bit,
    and they are used again. Which pair was to blame: `blamed`.

    Args:
        buffer: see `collision_buffer`; not empty.
        q0, q1: (n,) rad or m, the ends; twice the same for a single configuration.

    Returns:
        m, positive where that is certain, end points included: at q1 no pair is nearer to its
        clearance than this. 0 or less where it is not, as for NaN.
    """
    at = row(buffer, T.ASKED, np.int64(0))
    n = q0.shape[0]
    for j in range(n):
        buffer[at + j] = q0[j]
        buffer[at + n + j] = q1[j]
    return call(buffer, SEGMENT)


@entry
def clearance_gradient(buffer, q, step, size):  # type: ignore[no-untyped-def]
    """Add a push of at most `size` away from what is within `INFLUENCE` of its clearance.

    Args:
        buffer: see `collision_buffer`; not empty.
        q: (n,) rad or m.
        step: (n,) what the push is added to.
        size: the largest Euclidean length of the push.

    Returns:
        0 where nothing is near; 1 where the nearest pair is at its clearance; more below it.
    """
    at = row(buffer, T.ASKED, np.int64(0))
    n = q.shape[0]
    for j in range(n):
        buffer[at + j] = q[j]
    buffer[T.STATE + T.SIZE] = size
    share = call(buffer, PUSH)
    for j in range(n):
        step[j] += buffer[at + 2 * n + j]
    return share


@entry
def blamed(buffer):  # type: ignore[no-untyped-def]
    """Which of `Bodies.pairs` the last segment that was not certified failed at; -1 before."""
    return np.int64(buffer[T.STATE + T.BLAMED])


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
