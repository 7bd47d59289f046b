"""Values that are arrays of equally many rows: some of the rows, or those of several values."""

from __future__ import annotations

from dataclasses import fields
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from coverable.arrays import Mask

Chosen = Mask | NDArray[np.intp] | slice


class Rows:
    """Base of dataclasses whose fields are arrays, or values of rows themselves.

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
        return type(self)(*(_some(value, rows) for value in self._values()))

    @classmethod
    def join(cls, *parts: Self) -> Self:
        """The rows of values one behind another; at least one value."""
        return cls(*map(_joined, *(part._values() for part in parts)))

    def _values(self) -> list[Any]:
        """What is in the fields."""
        return [getattr(self, one.name) for one in fields(self)]  # type: ignore[arg-type]


def _some(value: Any, rows: Chosen) -> Any:
    """Some rows of an array, or of a value of rows."""
    return value[rows] if isinstance(value, np.ndarray) else value.of(rows)


def _joined(*values: Any) -> Any:
    """Arrays, or values of rows, one behind another."""
    first = values[0]
    return np.concatenate(values) if isinstance(first, np.ndarray) else type(first).join(*values)
