"""How a bound is asked: it holds at every sample, and some sample uses most of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

TINY = 1e-12


def holds(bound: ArrayLike, truth: ArrayLike, used: float = 0.97, tiny: float = TINY) -> None:
    """Assert that no sample is above its bound, and that a smaller bound would be wrong.

    Args:
        bound: what is stated; what is not finite states nothing.
        truth: what is found at samples, of a shape that fits.
        used: the least share of its bound that some sample has to use; 0 asks only that it holds.
        tiny: room for rounding, in the unit of both.
    """
    __tracebackhide__ = True
    bound, truth = np.broadcast_arrays(np.asarray(bound, float), np.asarray(truth, float))
    beyond = truth - bound * (1.0 + 1e-12) - tiny
    assert not (beyond > 0.0).any(), f"{np.nanmax(beyond):.3g} above the bound"
    if used:
        known = np.isfinite(bound) & (bound > tiny)
        most = float(np.max(truth[known] / bound[known], initial=0.0))
        assert most >= used, f"only {most:.3g} of the bound is used anywhere"
