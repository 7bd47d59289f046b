"""How the search kernels are compiled: one decorator, so that they all agree.

`numpy` errors: a division by zero gives inf or NaN, which no comparison in the search accepts,
where an exception would end it.

numba compiles a kernel once for each set of argument types, and a whole number or a truth value
that is written into a call is a type of its own: `correct(..., 6)` and `correct(..., 8)` are two
kernels. Constants that kernels hand to each other are therefore `np.int64(6)` or `np.bool_(True)`,
which are plain values; so that every kernel is compiled once.
"""

from __future__ import annotations

from coverable_kernels import njit

kernel = njit(cache=True, error_model="numpy")
# Written into its caller, of the same file: each array in a `NamedTuple` costs at every call.
inlined = njit(cache=True, error_model="numpy", inline="always")


@kernel
def put(target, source):  # type: ignore[no-untyped-def]
    """Copy numbers into an array of the same length; numba's `target[:] = source` is far longer."""
    for j in range(target.shape[0]):
        target[j] = source[j]
