"""How large a share of what bodies may move besides an accepted motion leaves them clear?

What joints deviate by moves a body by as much at most as `ArmMotion` says, which is convex in the
deviations: with a share of them it moves by no more than that share. So where two bodies are at
least d apart along a segment, c is needed, and they may come nearer by x, a share (d - c) / x of it
does no harm. Only pairs that this would not allow all are looked at closely.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Mask
from feasibility.certification.collisions.collision_replay import couples_of
from feasibility.certification.collisions.motion import ArmMotion
from feasibility.certification.collisions.pairing import ENOUGH, Pairing
from feasibility.collisions.bodies import Bodies
from robots.robot import Robot

FEW = (50, 1)  # calls for a pair, and for each row, after which what is known by then has to do
LEAST = 1e-12  # [m] so that nothing is divided by 0


class ClearShare(NamedTuple):
    """How much of a margin bodies allow."""

    share: float
    pair: tuple[str, str] | None
    """What allows no more; None where all is allowed."""
    row: int
    """Where that is."""


def clear_share(
    robot: Robot,
    bodies: Bodies,
    q: Array,
    deviations: Array,
    raised: Array,
    still: Mask,
    apart: float,
) -> ClearShare:
    """The share of deviations and raised clearances with which bodies stay clear, as far as known.

    Args:
        robot: the arm.
        bodies: all of the problem.
        q: (m, n) rows of a motion that was accepted, m >= 2, rad or m.
        deviations: (m - 1, n) rad or m, how far each joint may be from it along each segment.
        raised: (p, m - 1) m, by which each of `bodies.pairs` may come nearer besides.
        still: (p,) pairs that deviations do not bring nearer.
        apart: m, certified of all pairs along the motion.
    """
    couples, found = couples_of(bodies), ClearShare(1.0, None, 0)
    clearances = np.array([one.clearance for one in bodies.pairs])
    taken = np.repeat(clearances[:, None], len(deviations), axis=1)
    deviating = couples.nearer(ArmMotion(robot, q, deviations))
    looked = list[tuple[float, int, Pairing, Array]]()
    for number, one, moved in zip(
        couples.numbers.tolist(), couples.along(ArmMotion(robot, q), taken), deviating, strict=True
    ):
        most = raised[number] + (0.0 if still[number] else moved)
        one.needed, one.low = 0.0, np.maximum(one.low, max(apart - clearances[number], 0.0))
        if (one.low < most).any():
            row = int(np.argmin(one.low - most))
            met = float(one.measured(np.array([row], dtype=float))[0]) - clearances[number]
            looked.append((met / max(float(most[row]), LEAST), number, one, most))
    for met, number, one, most in sorted(looked, key=lambda each: each[0]):
        if (one.low < found.share * most).any():  # the least that is met limits what is looked for
            one.certify(min(met, found.share / ENOUGH) * float(most.max()), FEW)
            shares = np.where(one.low < most, one.low / np.maximum(most, LEAST), 1.0)
            if shares.min() < found.share:
                pair, row = bodies.pairs[number], int(np.argmin(shares))
                found = ClearShare(float(shares[row]), (pair.first, pair.second), row)
    return found
