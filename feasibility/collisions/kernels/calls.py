"""How a search kernel calls the compiled clearance: by an address that it finds in memory.

numba compiles a kernel for the types of what it gets. Were the clearance called by name, every
search kernel would hold it, and be compiled with it where nothing is asked of collisions; were its
address a constant, no kernel could be kept on disk. So kernels know an array of numbers: empty
where collisions are not checked, else the memory of `tables.py`, whose first number is the address
of a C function `f(memory, what)`. The address is written when the array is made, and holds in that
process alone: an array must never be sent to another one, nor used by two threads at a time.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import event
from numba.extending import intrinsic

from coverable_arrays import Array
from coverable_kernels import callback, entry, kernel
from feasibility.collisions.kernels.measuring import measure
from feasibility.collisions.kernels.push import push
from feasibility.collisions.kernels.segments import segment_holds_clear
from feasibility.collisions.kernels.tables import ADDRESS
from feasibility.notices import COLLISIONS, compiling_notice

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


@entry
def call(memory, what):  # type: ignore[no-untyped-def]
    """Run the clearance on a memory, which must not be empty."""
    return _call(memory, what)  # type: ignore[call-arg]
