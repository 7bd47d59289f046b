"""Which way to go from what is near.

With n the direction from the nearest point of the first body to that of the second, p, the distance
of a pair changes by d distance / dq_j = n . (z_j x (p - o_j)) for a joint j that turns between
them, n . z_j for one that slides. Joints ahead of the first body move both alike.
"""

import numpy as np

from coverable.kernels import kernel
from feasibility.collisions.kernels import tables as T
from feasibility.collisions.kernels.distances import of_item
from feasibility.collisions.kernels.link_frames import pose_of
from feasibility.collisions.kernels.segments import cheap_bound, slot_of_start
from feasibility.collisions.kernels.tables import row, rows_of
from feasibility.collisions.kernels.witness import NORMAL, ON_SECOND, witness

MOST = 2.0  # times as much as a pair at its clearance may weigh


@kernel
def add_rates(m, item, slot, share):  # type: ignore[no-untyped-def]
    """Add d distance / dq of an item, times its share, to the push."""
    witness(m, item, slot)
    out, n, p = row(m, T.ASKED, np.int64(2)), NORMAL, ON_SECOND
    for j in range(np.int64(m[item + T.INNER]), np.int64(m[item + T.OUTER])):
        axis = pose_of(m, slot, j + 1)
        x, y, z = m[axis + 2], m[axis + 5], m[axis + 8]
        if not m[row(m, T.JOINTS, j) + T.SLIDES] > 0.0:
            u, v, w = m[p] - m[axis + 9], m[p + 1] - m[axis + 10], m[p + 2] - m[axis + 11]
            x, y, z = y * w - z * v, z * u - x * w, x * v - y * u
        m[out + j] += share * (m[n] * x + m[n + 1] * y + m[n + 2] * z)


@kernel
def push(m):  # type: ignore[no-untyped-def]
    """Set row 2 of `asked` to a push of at most SIZE away from what is nearer than WISH.

    Returns how much nearer than that the nearest pair is, as a share; 0 where none is.
    """
    q, out, n = row(m, T.ASKED, np.int64(0)), row(m, T.ASKED, np.int64(2)), rows_of(m, T.JOINTS)
    finite = True
    for j in range(n):
        m[out + j] = 0.0
        finite &= abs(m[q + j]) < np.inf
    if not finite:
        return 0.0
    here, strongest = slot_of_start(m), 0.0
    for k in range(rows_of(m, T.ITEMS)):
        item = row(m, T.ITEMS, k)
        wish = m[item + T.WISH]
        bound, enough = item + T.BOUND + here, m[item + T.CLEARANCE] + wish
        if m[bound] < enough:
            cheap_bound(m, item, here)
        if m[bound] >= enough:
            continue
        m[T.FOUND] = np.inf
        m[bound] = max(m[bound], of_item(m, item, here, here, -np.inf, enough, -np.inf))
        found = m[T.FOUND]  # of what was met, where the bound is of boxes that were not opened
        if found < enough:
            share = min((enough - found) / wish, MOST)
            strongest = max(strongest, share)
            add_rates(m, item, here, share)
    length = 0.0
    for j in range(n):
        length += m[out + j] ** 2
    if length > 0.0:
        factor = min(strongest, 1.0) * m[T.STATE + T.SIZE] / np.sqrt(length)
        for j in range(n):
            m[out + j] *= factor
    return strongest
