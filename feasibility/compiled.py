"""How the search kernels are compiled: one decorator, so that they all agree.

`numpy` errors: a division by zero gives inf or NaN, which no comparison in the search accepts,
where an exception would end it.

numba compiles a kernel once for each set of argument types, and a whole number or a truth value
that is written into a call is a type of its own: `correct(..., 6)` and `correct(..., 8)` are two
kernels. Constants that kernels hand to each other are therefore `np.int64(6)` or `np.bool_(True)`,
which are plain values; so that every kernel is compiled once.
"""

from __future__ import annotations

from typing import Any

from coverable_kernels import njit

# numba counts references to each array that a kernel reads out of a `NamedTuple`. A kernel that
# makes no arrays and returns none needs no counting, because its caller holds what it is given; one
# that makes some is refused by numba when it is compiled, and is to be `allocating`.
COUNTED: dict[str, Any] = {"_nrt": True}
UNCOUNTED: dict[str, Any] = {"_nrt": False}
kernel = njit(cache=True, error_model="numpy", **UNCOUNTED)
allocating = njit(cache=True, error_model="numpy", **COUNTED)


@kernel
def put(target, source):  # type: ignore[no-untyped-def]
    """Copy numbers into an array of the same length; numba's `target[:] = source` is far longer."""
    for j in range(target.shape[0]):
        target[j] = source[j]
