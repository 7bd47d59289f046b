"""Which way to go from what is near.

With n the direction from the nearest point of the first body to that of the second, p, the distance
of a pair changes by d distance / dq_j = n . (z_j x (p - o_j)) for a joint j that turns between
them, n . z_j for one that slides. Joints ahead of the first body move both alike.
"""

from __future__ import annotations

import numpy as np

from feasibility.collisions.kernels.distances import of_item
from feasibility.collisions.kernels.segments import cheap_bound, slot_of_start
from feasibility.collisions.kernels.tables import (
    BOUNDS,
    CLEARANCE,
    INNER,
    OUTER,
    SIZE,
    SLIDES,
    WISH,
)
from feasibility.collisions.kernels.witness import witness
from feasibility.compiled import kernel


@kernel
def push(t):  # type: ignore[no-untyped-def]
    """Set row 2 of `asked` to a push of at most SIZE away from what is nearer than WISH.

    Returns how much nearer than that the nearest pair is, as a share; 0 where none is.
    """
    n = t.joints.shape[0]
    for j in range(n):
        t.asked[2, j] = 0.0
        if not abs(t.asked[0, j]) < np.inf:
            return 0.0
    here, wish, strongest = slot_of_start(t), t.state[0, WISH], 0.0
    for item in range(t.items.shape[0]):
        enough = t.items[item, CLEARANCE] + wish
        if t.bounds[here, item] >= enough:
            continue
        cheap_bound(t, item, here)
        if t.bounds[here, item] >= enough:
            continue
        t.state[0, BOUNDS] += 1.0
        bound = of_item(t, item, here, here, enough, enough, -np.inf)
        t.bounds[here, item] = max(t.bounds[here, item], bound)
        if bound >= enough:
            continue
        share = min((enough - bound) / wish, 2.0)
        strongest = max(strongest, share)
        witness(t, item, here)
        found = t.found[0]
        n_x, n_y, n_z, x, y, z = found[1], found[2], found[3], found[7], found[8], found[9]
        root = here * (n + 1)
        for j in range(np.int64(t.items[item, INNER]), np.int64(t.items[item, OUTER])):
            axis = t.poses[root + j + 1]
            zx, zy, zz = axis[2], axis[5], axis[8]
            if t.joints[j, SLIDES] > 0.0:
                rate = n_x * zx + n_y * zy + n_z * zz
            else:
                px, py, pz = x - axis[9], y - axis[10], z - axis[11]
                rate = n_x * (zy * pz - zz * py) + n_y * (zz * px - zx * pz)
                rate += n_z * (zx * py - zy * px)
            t.asked[2, j] += share * rate
    length = 0.0
    for j in range(n):
        length += t.asked[2, j] ** 2
    if length > 0.0:
        factor = min(strongest, 1.0) * t.state[0, SIZE] / np.sqrt(length)
        for j in range(n):
            t.asked[2, j] *= factor
    return strongest
