"""The memory of the compiled clearance of an arm, and the function that works on it.

The memory is what search kernels are given, and what Python asks; the function is a C function,
loaded or compiled where bodies are checked. How a segment is certified: `segments.py`.
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
from feasibility.collisions.kernels.packing import packed
from feasibility.collisions.kernels.push import push
from feasibility.collisions.kernels.segments import segment_holds_clear, slot_of_start
from feasibility.collisions.kernels.tables import ADDRESS, row, rows_of, views
from feasibility.collisions.problem_bodies import Bodies
from feasibility.notices import COLLISIONS, compiling_notice
from robots.robot import Robot


@kernel
def measure(m):  # type: ignore[no-untyped-def]
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
