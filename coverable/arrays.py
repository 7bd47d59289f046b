"""Arrays in type hints, values whose arrays nobody changes, and such that have a row each.

Shapes and units are given where they are used.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]
Chosen = Ints | Mask | NDArray[np.intp] | slice
"""Some of the rows of arrays."""


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


class Rows:
    """Base of dataclasses whose fields are arrays of equally many rows, or such values themselves.

    What is neither is of all rows alike.

    Example:
        >>> from dataclasses import dataclass
        >>> @dataclass(frozen=True, eq=False, slots=True)
        ... class Points(Rows):
        ...     x: Array
        >>> points = Points(np.array([1.0, 2.0, 3.0]))
        >>> Points.join(points.of(points.x > 2.0), points).x.tolist()
        [3.0, 1.0, 2.0, 3.0]
    """

    __slots__ = ()

    def of(self, rows: Chosen) -> Self:
        """Some of the rows of every field."""
        return type(self)(*(_some(value, rows) for value in self.values()))

    @classmethod
    def join(cls, *parts: Self) -> Self:
        """The rows of values one behind another; at least one value."""
        return cls(*map(_joined, *(part.values() for part in parts)))

    def put(self, rows: Chosen, others: Self) -> None:
        """Replace some of the rows, of values whose fields are arrays."""
        for mine, other in zip(self.values(), others.values(), strict=True):
            mine[rows] = other

    def values(self) -> list[Any]:
        """What is in the fields."""
        return [getattr(self, one.name) for one in fields(self)]  # pyrefly: ignore[bad-argument-type]


def _some(value: Any, rows: Chosen) -> Any:
    """Some rows of an array, or of a value of rows."""
    if isinstance(value, np.ndarray):
        return value[rows]
    return value.of(rows) if isinstance(value, Rows) else value


def _joined(*values: Any) -> Any:
    """Arrays, or values of rows, one behind another."""
    first = values[0]
    if isinstance(first, np.ndarray):
        return np.concatenate(values)
    return first.join(*values) if isinstance(first, Rows) else first
