"""The memory of the compiled clearance of an arm, and the function that works on it.

The memory is what search kernels are given, and what Python asks; the function is a C function,
loaded or compiled where bodies are checked. How a segment is certified: `segments.py`.

Which way to go from what is near: with n the direction from the nearest point of the first body to
that of the second, p, the distance of a pair changes by d distance / dq_j = n . (z_j x (p - o_j))
for a joint j that turns between them, n . z_j for one that slides. Joints ahead move both alike.
"""

from functools import cache
from typing import Any

import numpy as np
from numba import types
from numba.core import event
from numpy.typing import ArrayLike

from coverable.arrays import Array
from coverable.kernels import callback, kernel
from feasibility.collisions.kernels import tables as T
from feasibility.collisions.kernels.clearance import MEASURE, PUSH, call
from feasibility.collisions.kernels.distances import of_item
from feasibility.collisions.kernels.link_frames import pose_of
from feasibility.collisions.kernels.packing import packed
from feasibility.collisions.kernels.segments import cheap_bound, segment_holds_clear, slot_of_start
from feasibility.collisions.kernels.tables import ADDRESS, row, rows_of, views
from feasibility.collisions.kernels.witness import NORMAL, ON_SECOND, witness
from feasibility.collisions.problem_bodies import Bodies
from feasibility.notices import COLLISIONS, compiling_notice
from robots.robot import Robot

MOST = 2.0  # times as much as a pair at its clearance may weigh


@kernel
def add_rates(m, item, slot, share):
    """Add d distance / dq of an item, times its share, to the push."""
    witness(m, item, slot)
    out, n, p = row(m, T.ASKED, np.int64(2)), NORMAL, ON_SECOND
    for j in range(np.int64(m[item + T.INNER]), np.int64(m[item + T.OUTER])):
        axis = pose_of(m, slot, j + 1)
        x, y, z = m[axis + 2], m[axis + 5], m[axis + 8]
        if not m[row(m, T.JOINTS, j) + T.SLIDES] > 0.0:
            u, v, w = m[p] - m[axis + 9], m[p + 1] - m[axis + 10], m[p + 2] - m[axis + 11]
            x, y, z = y * w - z * v, z * u - x * w, x * v - y * u
        m[out + j] += share * (m[n] * x + m[n + 1] * y + m[n + 2] * z)


@kernel
def push(m):
    """Set row 2 of `asked` to a push of at most SIZE away from what is nearer than WISH.

    Returns how much nearer than that the nearest pair is, as a share; 0 where none is.
    """
    q, out, n = row(m, T.ASKED, np.int64(0)), row(m, T.ASKED, np.int64(2)), rows_of(m, T.JOINTS)
    finite = True
    for j in range(n):
        m[out + j] = 0.0
        finite &= abs(m[q + j]) < np.inf
    if not finite:
        return 0.0
    here, strongest = slot_of_start(m), 0.0
    for k in range(rows_of(m, T.ITEMS)):
        item = row(m, T.ITEMS, k)
        wish = m[item + T.WISH]
        bound, enough = item + T.BOUND + here, m[item + T.CLEARANCE] + wish
        if m[bound] < enough:
            cheap_bound(m, item, here)
        if m[bound] >= enough:
            continue
        m[T.FOUND] = np.inf
        m[bound] = max(m[bound], of_item(m, item, here, here, -np.inf, enough, -np.inf))
        found = m[T.FOUND]  # of what was met, where the bound is of boxes that were not opened
        if found < enough:
            share = min((enough - found) / wish, MOST)
            strongest = max(strongest, share)
            add_rates(m, item, here, share)
    length = 0.0
    for j in range(n):
        length += m[out + j] ** 2
    if length > 0.0:
        factor = min(strongest, 1.0) * m[T.STATE + T.SIZE] / np.sqrt(length)
        for j in range(n):
            m[out + j] *= factor
    return strongest


@kernel
def measure(m):
    """Bound every item at the configuration in `asked`, in the slot that is returned."""
    here = slot_of_start(m)
    for k in range(rows_of(m, T.ITEMS)):
        item = row(m, T.ITEMS, k)
        m[item + T.BOUND + here] = of_item(m, item, here, here, np.inf, np.inf, -np.inf)
    return np.float64(here)


@kernel
def _run(memory: Array, what: int) -> float:
    """The C function: the memory is a plain pointer in there."""
    if what == PUSH:
        result: float = push(memory)
    elif what == MEASURE:
        result = measure(memory)
    else:
        result = segment_holds_clear(memory)
    return result


@cache
def _compiled() -> Any:
    """The C function, compiled or loaded; it lives as long as the process."""
    signature = types.float64(types.CPointer(types.float64), types.int64)
    whole = _WholeCompilation()
    with compiling_notice(notice=COLLISIONS), event.install_listener("numba:compile", whole):
        function = callback(signature)(_run)
    whole.end()
    return function


class _WholeCompilation(event.Listener):
    """Makes one compilation, for whoever listens, of the C function and all kernels inside.

    numba tells of the kernels alone, and the function takes as long again. There is none where it
    is loaded.
    """

    def __init__(self) -> None:
        """It has not begun."""
        self.begun = False

    def on_start(self, about: Any) -> None:
        """The first kernel begins to be compiled."""
        if not self.begun:
            self.begun = True
            event.start_event("numba:compile")

    def on_end(self, about: Any) -> None:
        """A kernel has been compiled."""

    def end(self) -> None:
        """The function is there."""
        if self.begun:
            event.end_event("numba:compile")


def with_address(memory: Array) -> Array:
    """The same array, which now can be called in this process."""
    memory.view(np.int64)[ADDRESS] = _compiled().address
    return memory


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
