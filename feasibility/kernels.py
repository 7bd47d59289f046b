"""How the search kernels are compiled: one decorator, so that they all agree.

`numpy` errors: a division by zero gives inf or NaN, which no comparison in the search accepts,
where an exception would end it.
"""

from __future__ import annotations

from numba import njit

kernel = njit(cache=True, error_model="numpy")
