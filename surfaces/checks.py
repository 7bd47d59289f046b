"""Check the numbers that a surface is built from, and report all their faults together."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfaces.surface import TURN_TOLERANCE, Side, SurfaceError, rotation_from_rpy
from surfaces.tables import real

LARGEST_RATIO = 1e6  # of two lengths of one surface


class Checks:
    """Reads arguments one by one, collects what is wrong, and raises once at the end."""

    def __init__(self, kind: str) -> None:
        """Start checking a surface of the given kind."""
        self.kind = kind
        self.faults: list[str] = []

    def positive(self, name: str, value: Any) -> float:
        """A finite length > 0 (m)."""
        number = real(value)
        if not (math.isfinite(number) and number > 0.0):
            self.faults.append(f"{name} must be a finite number > 0 (metres), got {value!r}")
            return 1.0
        return number

    def ratio(self, name: str, value: float, remedy: str) -> None:
        """A ratio of lengths that leaves room for squares and cubes in floating point."""
        if not 1.0 / LARGEST_RATIO <= value <= LARGEST_RATIO:
            self.faults.append(
                f"{name} must lie in {1.0 / LARGEST_RATIO:g} .. {LARGEST_RATIO:g}, "
                f"got {value:g}; {remedy}"
            )

    def interval(self, name: str, value: Any) -> tuple[float, float]:
        """A pair (low, high) of finite metres, low < high."""
        return self._pair(name, value, "metres", (0.0, 1.0))

    def angles(self, name: str, value: Any) -> tuple[float, float]:
        """A pair of degrees, low < high, at most a full turn apart; returned in radians."""
        low, high = self._pair(name, value, "degrees", (0.0, 90.0))
        if math.radians(high - low) > math.tau + TURN_TOLERANCE:
            self.faults.append(
                f"{name} must span at most a full turn of 360 degrees, got {value!r}, "
                f"which spans {high - low:g}"
            )
        return math.radians(low), math.radians(high)

    def polar(self, name: str, value: Any) -> tuple[float, float]:
        """A pair of degrees in 0..180, low < high; returned in radians."""
        low, high = self._pair(name, value, "degrees", (0.0, 90.0))
        if low < 0.0 or high > 180.0:
            self.faults.append(
                f"{name} must lie in 0 .. 180 (degrees from the +z axis of the sphere), "
                f"got {value!r}"
            )
        return math.radians(low), math.radians(high)

    def side(self, value: Any) -> Side:
        """'inside' or 'outside'."""
        if isinstance(value, str) and value == "inside":
            return "inside"
        if not (isinstance(value, str) and value == "outside"):
            self.faults.append(f"side must be 'inside' or 'outside', got {value!r}")
        return "outside"

    def vector(self, name: str, value: Any, unit: str) -> NDArray[np.float64]:
        """Three finite numbers."""
        numbers = _numbers(value)
        if len(numbers) != 3 or not all(map(math.isfinite, numbers)):
            self.faults.append(f"{name} must be three finite numbers ({unit}), got {value!r}")
            return np.zeros(3)
        return np.array(numbers)

    def rotation(self, name: str, value: Any) -> NDArray[np.float64]:
        """The rotation of fixed-axis roll, pitch, yaw in degrees."""
        return rotation_from_rpy(*np.radians(self.vector(name, value, "degrees")))

    def done(self) -> None:
        """Raise if anything was wrong.

        Raises:
            SurfaceError: with every fault found.
        """
        if self.faults:
            raise SurfaceError(f"{self.kind}: " + "; ".join(self.faults))

    def _pair(
        self, name: str, value: Any, unit: str, stand_in: tuple[float, float]
    ) -> tuple[float, float]:
        """Two finite numbers, the first below the second; `stand_in` after a fault."""
        numbers = _numbers(value)
        if len(numbers) != 2 or not all(map(math.isfinite, numbers)):
            self.faults.append(
                f"{name} must be a pair (low, high) of finite numbers ({unit}), got {value!r}"
            )
            return stand_in
        low, high = numbers
        if not low < high:
            self.faults.append(
                f"{name} must be a pair (low, high) with low < high ({unit}), got {value!r}"
            )
            return stand_in
        return low, high


def _numbers(value: Any) -> list[float]:
    """The values of a sequence as floats; an empty list if it is not a sequence of numbers."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if not isinstance(value, Sequence) or isinstance(value, (str, bytes)):
        return []
    return [real(item) for item in value]
