"""How near two bodies come along a motion by coal's distances: found, where bounds are certified.

The truth lies between the two, as no distance that is met is less than the least there is.
"""

from __future__ import annotations

import math

import numpy as np

from feasibility.certification.collisions.pairing import Pairing
from feasibility.certification.collisions.parting import lows
from feasibility.certification.collisions.pieces import Below, coal_distance

PARTS = 32  # of a motion
FINEST = 1.0 / 16.0  # [1] share of a segment, within which no other place is looked for


def least_measured(pairing: Pairing) -> float:
    """The least distance (m) of two bodies, exact ones, that is met on a motion.

    Looked for at the row with the lowest bound in each of several parts of the motion, and from the
    best of them in ever shorter steps to both sides. Of a motion that deviates from straight lines
    only rows are looked at.
    """
    motion, last = pairing.motion, len(pairing.motion.q) - 1
    parts = np.array_split(pairing.hints, min(PARTS, last))
    begin = np.cumsum([0, *map(len, parts)])[:-1]
    times = [float(k + np.argmin(part)) for k, part in zip(begin, parts, strict=True)]
    least, time = min((_distance(pairing, time), time) for time in times)
    step = 2.0 ** math.ceil(math.log2(last / len(parts)))
    finest = 1.0 if motion.deviations.any() else FINEST
    while step >= finest:
        for other in (time - step, time + step):
            found = _distance(pairing, other) if 0.0 <= other <= last else math.inf
            if found < least:
                least, time = found, other
        step *= 0.5
    return least


def _distance(pairing: Pairing, time: float) -> float:
    """m, at a time in rows."""
    a, b, row = pairing.a, pairing.b, min(int(time), len(pairing.motion.q) - 2)
    pose = pairing.motion.pose(*pairing.joints, row, time - row)
    if isinstance(a, Below):
        n = a.thin[None]
        return float(lows(b, pose, n)[0] - a.support(n)[0])
    return coal_distance(a.truth, b.truth, pose.rotations[0], pose.points[0])[0]
