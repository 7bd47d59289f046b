"""Values with one quantity made absurdly large, for judges that have to refuse then."""

from __future__ import annotations

import numpy as np

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
