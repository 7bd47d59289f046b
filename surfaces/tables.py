"""Arrays out of what a user hands over: shape and size are looked at before anything is copied."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

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
