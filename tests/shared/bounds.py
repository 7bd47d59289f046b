"""Bounds against what is really there, never below it and nearly met; judges that are starved."""

import numpy as np
from numpy.typing import ArrayLike

TINY = 1e-12


def holds(bound: ArrayLike, truth: ArrayLike, used: float = 0.97, tiny: float = TINY) -> None:
    """Is the bound at least the truth everywhere, and is `used` of it needed somewhere?

    Args:
        bound: what is claimed; inf where nothing is, which counts as no use of it.
        truth: what samples show, of a shape that fits to it.
        used: the least share of a bound that some truth has to be; 0 where none comes near.
        tiny: room for rounding, in the unit of both.
    """
    __tracebackhide__ = True
    bound, truth = np.broadcast_arrays(np.asarray(bound, float), np.asarray(truth, float))
    assert bound.size > 0
    assert not np.isnan(bound).any()
    assert np.isfinite(truth).all()
    over = truth - (bound * (1.0 + 1e-12) + tiny)
    worst = np.unravel_index(np.argmax(over), over.shape)
    assert over[worst] <= 0.0, f"{truth[worst]:.6g} exceeds {bound[worst]:.6g} at {worst}"
    some = np.isfinite(bound) & (bound > tiny)
    share = (truth[some] / bound[some]).max(initial=0.0)
    assert share >= used, f"no more than {share:.4f} of the bound is ever used"


# One quantity made absurdly large, for judges that have to refuse then.

LARGE = 1e3  # m, rad, [1]


class Starved:
    """A value one of whose methods has its answer changed."""

    def __init__(self, value, name, change):
        self._value, self._name, self._change = value, name, change

    def __getattr__(self, name):
        own = getattr(self._value, name)
        return (lambda *args: self._change(own(*args))) if name == self._name else own


def grown(values, column=slice(None)):
    """A copy, absurdly large in one of the last axis' columns, or all over."""
    found = np.array(values, dtype=float)
    found[..., column] = LARGE
    return found
