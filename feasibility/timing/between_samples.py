"""How far a bent motion is from the straight lines between its samples.

On a stretch with samples a and b at its ends let q'' be the second derivative by the share t of the
stretch. Both the motion and the straight line a + t (b - a) go through a and b, so they are at most
max |q''| / 8 apart, joint by joint. What of q'' points along b - a only changes how fast the line
is run: as long as that part is at most 2 |b - a|, the motion runs along it without turning back,
and is off the line by the rest of q'' alone.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from feasibility.timing.sampled_trajectory import Kind, Trajectory, coefficients, derivative

Array = NDArray[np.float64]

ROUNDING = 1e-12  # [rad] or [m]


def strays(q: Array, bends: Array) -> Array:
    """(m - 1, n) how far each joint may be from the straight lines between m samples.

    Args:
        q: (m, n) rad or m.
        bends: (k, m - 1, n) values by the square of a stretch, between which q'' stays.
    """
    ahead = np.diff(q, axis=0)
    way = np.sqrt((ahead**2).sum(axis=1, keepdims=True))
    with np.errstate(invalid="ignore", divide="ignore"):
        along = np.where(way > 0.0, ahead / way, 0.0)
    share = (bends * along).sum(axis=2, keepdims=True)
    onwards = np.abs(share).max(axis=0) <= 2.0 * way
    beside = np.where(onwards, bends - share * along, bends)
    return np.asarray(np.abs(beside).max(axis=0) / 8.0 + ROUNDING)


def strays_between(run: Trajectory, kind: Kind, q: Array) -> Array:
    """`strays` of what a controller makes of a trajectory, looked at at some places.

    Args:
        run: k samples.
        kind: what is put through them.
        q: ((k - 1) * places + 1, n) the motion at so many places of each polynomial.
    """
    places = (len(q) - 1) // (len(run) - 1)
    points = coefficients(run, kind)
    bends = derivative(run, derivative(run, points))
    stretch = np.diff(run.time)[:, None] / places
    return strays(q, np.repeat(bends * stretch**2, places, axis=1))
