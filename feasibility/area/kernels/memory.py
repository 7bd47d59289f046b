"""Working memory of the test of one tile."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Tile(NamedTuple):
    """One tile, and what is found out about it."""

    corners: NDArray[np.float64]
    """(4, 2, 3) target points (m) and approach directions that it is mixed from."""
    radii: NDArray[np.float64]
    """(2,) m and 1, by which it may be off these."""
    gain: NDArray[np.float64]
    """(n, 3) G."""
    rate: NDArray[np.float64]
    """(n,) d, the lengths of its rows."""
    weights: NDArray[np.float64]
    """(n,) W."""
    rows: NDArray[np.float64]
    """(6, n) the Jacobians that G inverts,"""
    wanted: NDArray[np.float64]
    """(6, 3) and what they are to become."""
    square: NDArray[np.float64]
    """(6, 6)"""
    right: NDArray[np.float64]
    """(6,)"""
    turn: NDArray[np.float64]
    """(3, 3) A G."""
    here: NDArray[np.float64]
    """(n,) where the arm is."""


def tile_memory(n: int) -> Tile:
    """Working memory for an arm of n joints."""
    wanted = np.zeros((6, 3))
    wanted[:3] = np.eye(3)
    return Tile(
        corners=np.zeros((4, 2, 3)),
        radii=np.zeros(2),
        gain=np.zeros((n, 3)),
        rate=np.zeros(n),
        weights=np.zeros(n),
        rows=np.zeros((6, n)),
        wanted=wanted,
        square=np.zeros((6, 6)),
        right=np.zeros(6),
        turn=np.zeros((3, 3)),
        here=np.zeros(n),
    )
