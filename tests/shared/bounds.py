"""One question to every bound: does it hold at all samples, and would a smaller one be wrong?"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

ROUNDING, TINY = 1e-12, 1e-12  # relative and absolute


def holds(bound: ArrayLike, truth: ArrayLike, used: float = 0.97) -> None:
    """Fail unless bound >= truth everywhere, and somewhere a share `used` of it is needed."""
    __tracebackhide__ = True
    bound, truth = np.broadcast_arrays(np.asarray(bound, float), np.asarray(truth, float))
    assert truth.size, "nothing was asked"
    wrong = ~(truth <= bound * (1.0 + ROUNDING) + TINY)
    assert not wrong.any(), f"{truth[wrong][0]!r} is more than its bound, {bound[wrong][0]!r}"
    share = np.divide(truth, bound, out=np.zeros(truth.shape), where=(bound > 0.0) & (truth > TINY))
    most = float(share.max())
    assert most >= used, f"of no bound more than {most:.3f} is used, {used} should be"
