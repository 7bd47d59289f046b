"""A bound has to hold at every sample, and some sample has to use most of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

TINY = 1e-12


def holds(bound: ArrayLike, truth: ArrayLike, used: float = 0.97) -> None:
    """No truth is above its bound, and the largest share of a bound that one uses is `used`.

    A bound that is smaller by 1 - used would be wrong, so nobody can make it smaller unnoticed.
    """
    __tracebackhide__ = True
    most, found = np.broadcast_arrays(np.asarray(bound, float), np.asarray(truth, float))
    assert found.size, "nothing was sampled"
    assert not np.isnan(most).any(), "a bound is no number"
    beyond = found - (most * (1.0 + 1e-12) + TINY)
    at = np.unravel_index(int(np.argmax(beyond)), beyond.shape)
    assert (beyond <= 0.0).all(), f"{found[at]:.12g} is above its bound of {most[at]:.12g}"
    share = float(np.max(np.where(most > TINY, found / np.maximum(most, TINY), 0.0)))
    assert share >= used, f"no sample uses more than {share:.3f} of its bound"
