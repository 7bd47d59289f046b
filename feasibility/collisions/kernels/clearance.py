"""The certified clearance, as search kernels ask for it: by an address that they find in memory.

numba compiles a kernel for the types of what it gets. Were the clearance called by name, every
search kernel would hold it, and be compiled with it where nothing is asked of collisions; were its
address a constant, no kernel could be kept on disk. So kernels know an array of numbers: empty
where collisions are not checked, else the memory of `tables.py`, whose first number is the address
of a C function `f(memory, what)`, see `memory.py`. The address is written when the array is made,
and holds in that process alone: an array must never be sent to another one, nor used by two threads
at a time.
"""

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from coverable.kernels import entry
from feasibility.collisions.kernels import tables as T
from feasibility.collisions.kernels.tables import row

SEGMENT, PUSH, MEASURE = np.int64(0), np.int64(1), np.int64(2)


@intrinsic
def _call(typing: Any, memory: Any, what: Any) -> Any:
    """Call the function whose address an array begins with, with that array and a whole number."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        array = context.make_array(signature.args[0])(context, builder, values[0])
        whole = ir.IntType(64)
        start = builder.ptrtoint(array.data, whole)
        address = builder.load(builder.bitcast(array.data, whole.as_pointer()))
        kind = ir.FunctionType(ir.DoubleType(), [whole, whole])
        return builder.call(builder.inttoptr(address, kind.as_pointer()), [start, values[1]])

    return types.float64(memory, types.int64), generate


@entry
def call(memory, what):
    """Run the clearance on a memory, which must not be empty."""
    return _call(memory, what)


@entry
def segment_clear(buffer, q0, q1):
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
def clearance_gradient(buffer, q, step, size):
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
def blamed(buffer):
    """Which of `Bodies.pairs` the last segment that was not certified failed at; -1 before."""
    return np.int64(buffer[T.STATE + T.BLAMED])
