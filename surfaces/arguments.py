"""Check the numbers that a surface is built from, and report all their faults together."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, TypedDict

import numpy as np

import coverable.errors
from coverable.arrays import Array
from coverable.errors import MISSING, Fault, real, shown
from surfaces.surface import TURN_TOLERANCE, Side, SurfaceError, rotation_from_rpy

SIDES: tuple[Side, ...] = ("inside", "outside")
LARGEST_RATIO = 1e6  # of two lengths of one surface
ORIGIN = (0.0, 0.0, 0.0)


class PoseArguments(TypedDict):
    """What every surface is built from besides its own shape."""

    side: Side
    position: Array
    """(3,) m."""
    rotation: Array
    """(3, 3)"""


class Checks(coverable.errors.Checks):
    """Reads the arguments of a surface one by one; `done` raises a `SurfaceError`."""

    def __init__(self, kind: str) -> None:
        """Start checking a surface of the given kind."""
        super().__init__(kind, SurfaceError)

    def ratio(self, name: str, other: str, value: float, remedy: str) -> None:
        """A ratio of lengths that leaves room for squares and cubes in floating point."""
        if not 1.0 / LARGEST_RATIO <= value <= LARGEST_RATIO:
            expected = f"must be within a factor of {LARGEST_RATIO:g} of {other}"
            self.keep(Fault(name, f"got the ratio {value:g}; {remedy}", expected=expected))

    def angles(self, name: str, value: Any) -> tuple[float, float]:
        """A pair of degrees, low < high, at most a full turn apart; returned in radians."""
        low, high = self.interval(name, value, "degrees", (0.0, 90.0))
        if math.radians(high - low) > math.tau + TURN_TOLERANCE:
            spans = f"got {shown(value)}, which spans {high - low:g}"
            expected = "must span at most a full turn of 360 degrees"
            self.keep(Fault(name, spans, expected=expected))
        return math.radians(low), math.radians(high)

    def polar(self, name: str, value: Any) -> tuple[float, float]:
        """A pair of degrees in 0..180, low < high; returned in radians."""
        low, high = self.interval(name, value, "degrees", (0.0, 90.0))
        if low < 0.0 or high > 180.0:
            self.wrong(name, value, "must lie in 0 .. 180 (degrees from the +z axis)")
        return math.radians(low), math.radians(high)

    def vector(self, name: str, value: Any, unit: str) -> Array:
        """Three finite numbers."""
        found = self.numbers(name, value, 3, f"must be three finite numbers ({unit})")
        return np.zeros(3) if found is None else np.array(found)

    def rotation(self, name: str, value: Any) -> Array:
        """The rotation of fixed-axis roll, pitch, yaw in degrees."""
        return rotation_from_rpy(*np.radians(self.vector(name, value, "degrees")))

    def pose(self, side: Any, position: Any, rpy_deg: Any) -> PoseArguments:
        """Side, position (metres) and fixed-axis roll, pitch, yaw (degrees), under these names."""
        return {
            "side": self.choice("side", side, SIDES),
            "position": self.vector("position", position, "metres"),
            "rotation": self.rotation("rpy_deg", rpy_deg),
        }


def check_pose(side: Any = "inside", position: Any = ORIGIN, rpy_deg: Any = ORIGIN) -> None:
    """Refuse arguments that make no pose, before there is a surface.

    Raises:
        SurfaceError: with everything that is wrong.
    """
    checks = Checks("pose")
    checks.pose(side, position, rpy_deg)
    checks.done()


Shape = tuple[int | None, ...]

LARGEST_COORDINATE = 1e6  # [m]


def table(
    name: str, value: Any, shape: Shape, expected: str, cap: int, faults: list[Fault]
) -> Array | None:
    """A rectangular array of finite numbers, or None after a fault.

    Args:
        name: of the argument, for messages.
        value: an array, or sequences in sequences.
        shape: the lengths wanted along each axis, None where any will do.
        expected: what the value should be, for messages.
        cap: largest number of entries.
        faults: what is wrong is added here.
    """
    if value is MISSING:
        faults.append(Fault(name, "is missing", expected=f"it must be {expected}"))
        return None
    try:
        found = _shape(name, value, len(shape), cap)
    except SurfaceError as error:
        faults += error.faults
        return None
    if any(want not in (None, have) for want, have in zip(shape, found, strict=True)):
        faults.append(Fault(name, f"got the shape {_times(found)}", expected=f"must be {expected}"))
        return None
    array = np.array(_leaves(value, len(shape)), dtype=float).reshape(found)
    bad = np.argwhere(~np.isfinite(array))
    if len(bad):
        place = tuple(int(index) for index in bad[0])
        more = f"; {len(bad)} such entries in all" if len(bad) > 1 else ""
        got = f"got {shown(_at(value, place))}{more}"
        where = name + "".join(f"[{index}]" for index in place)
        faults.append(Fault(where, got, expected="must be a finite number"))
        return None
    return array


def metres(
    name: str, value: Any, shape: Shape, expected: str, cap: int, faults: list[Fault]
) -> Array | None:
    """A table of coordinates (m), none of them so large that its cube would be lost."""
    found = table(name, value, shape, expected, cap, faults)
    if found is not None and found.size and np.abs(found).max() > LARGEST_COORDINATE:
        expected = f"must lie within {LARGEST_COORDINATE:g} metres of the origin"
        got = f"got {np.abs(found).max():g}; give it in metres"
        faults.append(Fault(name, got, expected=expected))
        return None
    return found


def _shape(name: str, value: Any, depth: int, cap: int) -> tuple[int, ...]:
    """Lengths along each axis; raises where rows differ, or there is too much or too little."""
    if isinstance(value, np.ndarray):
        if value.ndim != depth or value.dtype.kind not in "fiu":
            got = f"got an array of shape {value.shape} and type {value.dtype}"
            raise SurfaceError(Fault(name, got, expected=f"must have {depth} axes of numbers"))
        _capped(name, value.shape, cap)
        return value.shape
    if not isinstance(value, Sequence) or isinstance(value, (str, bytes)):
        got = f"got {type(value).__name__}"
        raise SurfaceError(Fault(name, got, expected="must be a list"))
    lengths: tuple[int, ...] = (len(value),)
    _capped(name, lengths, cap)
    if depth == 1 or not value:
        return lengths + (0,) * (depth - 1)
    inner = [_shape(f"{name}[{k}]", row, depth - 1, cap) for k, row in enumerate(value)]
    for k, row in enumerate(inner):
        if row != inner[0]:
            got = f"got {_times(inner[0])} numbers in row 0 and {_times(row)} in row {k}"
            raise SurfaceError(Fault(name, got, expected="must have rows of one length"))
    lengths += inner[0]
    _capped(name, lengths, cap)
    return lengths


def _capped(name: str, lengths: tuple[int, ...], cap: int) -> None:
    if math.prod(lengths) > cap:
        got = f"got {_times(lengths)}; use a coarser one"
        raise SurfaceError(Fault(name, got, expected=f"must hold at most {cap:,} numbers"))


def _leaves(value: Any, depth: int) -> Array | list[float]:
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


def _times(lengths: tuple[int, ...]) -> str:
    return " x ".join(map(str, lengths))
