"""Arrays in type hints, and values whose arrays nobody changes.

Shapes and units are given where they are used.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]


def unit_along(direction: ArrayLike) -> Array:
    """The unit vector (3,) along three finite numbers that are not all zero, of any size."""
    vector = np.array(direction, dtype=float)
    vector /= np.abs(vector).max()  # first, so that squares neither vanish nor overflow
    return np.asarray(vector / np.linalg.norm(vector))


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Protected:
    """A value whose arrays nobody changes, and which pickles as a call of its constructor."""

    def __post_init__(self) -> None:
        """Copy and write-protect the arrays; those in tuples are protected in place."""
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, np.ndarray):
                value = np.array(value)
                object.__setattr__(self, field.name, value)
            for array in value if isinstance(value, tuple) else (value,):
                if isinstance(array, np.ndarray):
                    array.flags.writeable = False

    def __reduce__(self) -> tuple[object, ...]:
        """What is derived is derived again, and arrays are protected again."""
        return (type(self), tuple(getattr(self, item.name) for item in fields(self) if item.init))
