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
from numba import carray, cfunc, types
from numba.extending import intrinsic

from feasibility.collisions.kernels.measuring import measure
from feasibility.collisions.kernels.push import push
from feasibility.collisions.kernels.segments import segment_holds_clear
from feasibility.collisions.kernels.tables import ADDRESS, HEADER, Array, Tables
from feasibility.compiled import kernel

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


@intrinsic
def _pointer(typing: Any, address: Any) -> Any:
    """A pointer to numbers at an address."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return builder.inttoptr(values[0], ir.DoubleType().as_pointer())

    return types.CPointer(types.float64)(types.int64), generate


@kernel
def _table(memory, number):  # type: ignore[no-untyped-def]
    """The view of one table, its memory owned by nobody in here."""
    head = carray(_pointer(memory), HEADER)  # type: ignore[call-arg]
    start = np.int64(head[1 + 3 * number])
    shape = (np.int64(head[2 + 3 * number]), np.int64(head[3 + 3 * number]))
    return carray(_pointer(memory + 8 * start), shape)


def _run(memory: int, what: int) -> float:
    """Compiled: the C function."""
    t = Tables(
        _table(memory, 0), _table(memory, 1), _table(memory, 2), _table(memory, 3),
        _table(memory, 4), _table(memory, 5), _table(memory, 6), _table(memory, 7),
        _table(memory, 8), _table(memory, 9), _table(memory, 10), _table(memory, 11),
        _table(memory, 12), _table(memory, 13), _table(memory, 14), _table(memory, 15),
        _table(memory, 16), _table(memory, 17), _table(memory, 18),
    )  # fmt: skip
    if what == PUSH:
        return push(t)
    if what == MEASURE:
        return measure(t)
    return segment_holds_clear(t)


@cache
def _compiled() -> Any:
    """The C function, compiled or loaded; it lives as long as the process."""
    return cfunc("float64(int64, int64)", cache=True, error_model="numpy")(_run)


def with_address(memory: Array) -> Array:
    """The same array, which now can be called in this process."""
    memory.view(np.int64)[ADDRESS] = _compiled().address
    return memory


@kernel
def call(memory, what):  # type: ignore[no-untyped-def]
    """Run the clearance on a memory, which must not be empty."""
    return _call(memory, what)  # type: ignore[call-arg]
