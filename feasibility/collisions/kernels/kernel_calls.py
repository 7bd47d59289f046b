"""How a search kernel calls the compiled clearance: by an address that it finds in memory.

numba compiles a kernel for the types of what it gets. Were the clearance called by name, every
search kernel would hold it, and be compiled with it where nothing is asked of collisions; were its
address a constant, no kernel could be kept on disk. So kernels know an array of numbers: empty
where collisions are not checked, else the memory of `tables.py`, whose first number is the address
of a C function `f(memory, what)`, see `function.py`. The address is written when the array is made,
and holds in that process alone: an array must never be sent to another one, nor used by two threads
at a time.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from coverable.kernels import entry

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
def call(memory, what):  # type: ignore[no-untyped-def]
    """Run the clearance on a memory, which must not be empty."""
    return _call(memory, what)  # type: ignore[call-arg]
