"""The certified clearance, as search kernels ask for it; `memory.py` makes what it works on."""

from __future__ import annotations

import numpy as np

from coverable.kernels import entry
from feasibility.collisions.kernels import tables as T
from feasibility.collisions.kernels.kernel_calls import PUSH, SEGMENT, call
from feasibility.collisions.kernels.tables import row


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
