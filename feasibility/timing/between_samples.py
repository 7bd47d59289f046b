"""How far a curved motion is from the straight lines between its samples.

On a stretch with samples a and b at its ends let q'' be the second derivative by the share t of the
stretch. Both the motion and the straight line a + t (b - a) go through a and b, so they are at most
max |q''| / 8 apart, joint by joint. What of q'' points along b - a only changes how fast the line
is run: as long as that part is at most 2 |b - a|, the motion runs along it without going back,
and is off the line by the rest of q'' alone.
"""

import numpy as np

from coverable.arrays import Array

ROUNDING = 1e-12  # [rad] or [m]


def deviations(q: Array, seconds: Array) -> Array:
    """(m - 1, n) how far each joint may be from the straight lines between m samples.

    Args:
        q: (m, n) rad or m.
        seconds: (k, m - 1, n) values by the square of a stretch, between which q'' stays.
    """
    ahead = np.diff(q, axis=0)
    length = np.sqrt((ahead**2).sum(axis=1, keepdims=True))
    with np.errstate(invalid="ignore", divide="ignore"):
        along = np.where(length > 0.0, ahead / length, 0.0)
    share = (seconds * along).sum(axis=2, keepdims=True)
    onwards = np.abs(share).max(axis=0) <= 2.0 * length
    beside = np.where(onwards, seconds - share * along, seconds)
    return np.asarray(np.abs(beside).max(axis=0) / 8.0 + ROUNDING)
