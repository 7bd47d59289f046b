"""Check the numbers that a surface is built from, and report all their faults together."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, TypedDict

import numpy as np
from numpy.typing import NDArray

from surfaces.surface import TURN_TOLERANCE, Side, SurfaceError, rotation_from_rpy

LARGEST_RATIO = 1e6  # of two lengths of one surface
ORIGIN = (0.0, 0.0, 0.0)


class Pose(TypedDict):
    """What every surface is built from besides its own shape."""

    side: Side
    position: NDArray[np.float64]
    """(3,) m."""
    rotation: NDArray[np.float64]
    """(3, 3)"""


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

    def pose(self, side: Any, position: Any, rpy_deg: Any) -> Pose:
        """Side, position (metres) and fixed-axis roll, pitch, yaw (degrees), under these names."""
        return {
            "side": self.side(side),
            "position": self.vector("position", position, "metres"),
            "rotation": self.rotation("rpy_deg", rpy_deg),
        }

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


Shape = tuple[int | None, ...]

LARGEST_COORDINATE = 1e6  # [m]


def real(value: Any) -> float:
    """The value as a float, or NaN if it is not a real number."""
    if isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool):
        try:
            return float(value)
        except OverflowError:
            return math.inf
    return math.nan


def table(
    name: str, value: Any, shape: Shape, expected: str, cap: int, faults: list[str]
) -> NDArray[np.float64] | None:
    """A rectangular array of finite numbers, or None after a fault.

    Args:
        name: of the argument, for messages.
        value: an array, or sequences in sequences.
        shape: the lengths wanted along each axis, None where any will do.
        expected: what the value should be, for messages.
        cap: largest number of entries.
        faults: what is wrong is added here.
    """
    try:
        found = _shape(name, value, len(shape), cap)
        if any(want not in (None, have) for want, have in zip(shape, found, strict=True)):
            raise ValueError(f"{name} must be {expected}, got the shape {_times(found)}")
        array = np.array(_leaves(value, len(shape)), dtype=float).reshape(found)
    except ValueError as error:
        text = str(error)
        faults.append(text if text.startswith(name) else f"{name}{text}")
        return None
    bad = np.argwhere(~np.isfinite(array))
    if len(bad):
        place = tuple(int(index) for index in bad[0])
        more = f"; {len(bad)} such entries in all" if len(bad) > 1 else ""
        faults.append(
            f"{name}{_indices(place)} must be a finite number, got {_at(value, place)!r}{more}"
        )
        return None
    return array


def metres(
    name: str, value: Any, shape: Shape, expected: str, cap: int, faults: list[str]
) -> NDArray[np.float64] | None:
    """A table of coordinates (m), none of them so large that its cube would be lost."""
    found = table(name, value, shape, expected, cap, faults)
    if found is not None and found.size and np.abs(found).max() > LARGEST_COORDINATE:
        faults.append(
            f"{name} must lie within {LARGEST_COORDINATE:g} metres of the origin, "
            f"got {np.abs(found).max():g}; give it in metres"
        )
        return None
    return found


def _shape(name: str, value: Any, depth: int, cap: int) -> tuple[int, ...]:
    """Lengths along each axis; raises where rows differ, or there is too much or too little."""
    if isinstance(value, np.ndarray):
        if value.ndim != depth or value.dtype.kind not in "fiu":
            raise ValueError(
                f"{name} must have {depth} axes of numbers, "
                f"got an array of shape {value.shape} and type {value.dtype}"
            )
        _capped(name, value.shape, cap)
        return value.shape
    if not isinstance(value, Sequence) or isinstance(value, (str, bytes)):
        raise ValueError(f"{name} must be a list, got {type(value).__name__}")
    lengths: tuple[int, ...] = (len(value),)
    _capped(name, lengths, cap)
    if depth == 1 or not value:
        return lengths + (0,) * (depth - 1)
    inner = [_shape(f"{name}[{k}]", row, depth - 1, cap) for k, row in enumerate(value)]
    for k, row in enumerate(inner):
        if row != inner[0]:
            raise ValueError(
                f"{name} must have rows of one length, got {_times(inner[0])} numbers in "
                f"{name}[0] and {_times(row)} in {name}[{k}]"
            )
    lengths += inner[0]
    _capped(name, lengths, cap)
    return lengths


def _capped(name: str, lengths: tuple[int, ...], cap: int) -> None:
    if math.prod(lengths) > cap:
        raise ValueError(
            f"{name} must hold at most {cap:,} numbers, got {_times(lengths)}; use a coarser one"
        )


def _leaves(value: Any, depth: int) -> NDArray[np.float64] | list[float]:
    """The numbers in one row; NaN for what is no number."""
    if isinstance(value, np.ndarray):
        return value.reshape(-1)
    if depth == 1:
        return [real(item) for item in value]
    return [number for row in value for number in _leaves(row, depth - 1)]


def _at(value: Any, place: tuple[int, ...]) -> Any:
    for index in place:
        value = value[index]
    return value.item() if isinstance(value, np.generic) else value


def _indices(place: tuple[int, ...]) -> str:
    return "".join(f"[{index}]" for index in place)


def _times(lengths: tuple[int, ...]) -> str:
    return " x ".join(map(str, lengths))
