"""The compiled clearance as a C function, loaded or compiled where bodies are checked."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numba import types
from numba.core import event

from coverable.arrays import Array
from coverable.kernels import callback, kernel
from feasibility.collisions.kernels.kernel_calls import MEASURE, PUSH
from feasibility.collisions.kernels.measuring import measure
from feasibility.collisions.kernels.push import push
from feasibility.collisions.kernels.segments import segment_holds_clear
from feasibility.collisions.kernels.tables import ADDRESS
from feasibility.notices import COLLISIONS, compiling_notice


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
