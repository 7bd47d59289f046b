"""Working memory of the test of one tile."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coverable_arrays import Array


class Tile(NamedTuple):
    """One tile, and what is found out about it."""

    corners: Array
    """(4, 2, 3) target points (m) and approach directions that it is mixed from."""
    radii: Array
    """(2,) m and 1, by which it may be off these."""
    gain: Array
    """(n, 3) G."""
    rate: Array
    """(n,) d, the lengths of its rows."""
    weights: Array
    """(n,) W."""
    rows: Array
    """(6, n) the Jacobians that G inverts,"""
    wanted: Array
    """(6, 3) and what they are to become."""
    square: Array
    """(6, 6)"""
    right: Array
    """(6,)"""
    turn: Array
    """(3, 3) A G."""
    here: Array
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
