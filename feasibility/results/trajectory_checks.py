"""What the readers of trajectories share: caps, and lists of names and numbers, checked."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

MOST_SAMPLES = 1_000_000
MOST_JOINTS = 64
MOST_SHOWN = 5  # faults in one message


def names(value: object, where: str, faults: list[str]) -> tuple[str, ...]:
    """Joint names out of a list."""
    if (
        isinstance(value, list)
        and 1 <= len(value) <= MOST_JOINTS
        and all(isinstance(name, str) for name in value)
    ):
        return tuple(value)
    faults.append(f"{where} must be a list of 1 to {MOST_JOINTS} names")
    return ()


def numbers(
    value: object, shape: tuple[int, ...], where: str, faults: list[str]
) -> NDArray[np.float64]:
    """Numbers out of nested lists; whether they are finite, `Trajectory` says."""
    what = f"{where} must hold {' x '.join(map(str, shape))} numbers"
    rows = value if len(shape) == 2 else [value]
    fits = (
        isinstance(rows, list)
        and (len(shape) == 1 or len(rows) == shape[0])
        and all(isinstance(row, list) and len(row) == shape[-1] for row in rows)
        and all(type(item) in (int, float) for row in rows for item in row)
    )
    if fits:
        try:
            return np.array(rows, dtype=float).reshape(shape)
        except (OverflowError, ValueError):  # a whole number beyond what a float holds
            pass
    faults.append(what)
    return np.full(shape, math.nan)


def raise_all(faults: list[str]) -> None:
    """Raise all faults together, if there are any.

    Raises:
        ValueError: there are.
    """
    if faults:
        more = f"; and {len(faults) - MOST_SHOWN} more" if len(faults) > MOST_SHOWN else ""
        raise ValueError("; ".join(faults[:MOST_SHOWN]) + more)
