"""Regions of the joint space that cuts leave: boxes of joints.

*Joints of a turn and more.* Turns of 2 pi leave the tool where it is. So where the question is
whether a region holds any configuration with the tool on the surface, a joint whose interval holds
a whole turn may take any one turn of it. That makes joints without limits finite.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coverable.arrays import Array, Mask

TURN = 2.0 * np.pi


@dataclass(frozen=True, eq=False, slots=True)
class JointRegion:
    """Joints inside a box."""

    low: Array
    """(n,) rad or m; -inf where there is no limit."""
    high: Array
    """(n,)"""

    def within(self, joint: int, least: float, most: float) -> JointRegion:
        """The part of it in which a joint lies in least .. most."""
        low, high = self.low.copy(), self.high.copy()
        low[joint], high[joint] = max(low[joint], least), min(high[joint], most)
        return JointRegion(low, high)

    @property
    def empty(self) -> bool:
        """Does it hold no configuration?"""
        return bool((self.low > self.high).any())

    def folded(self, prismatic: Mask) -> JointRegion:
        """One turn of each joint whose interval holds one."""
        turns = ~prismatic & (self.high - self.low > TURN)
        low = np.where(turns, np.where(np.isfinite(self.low), self.low, -np.pi), self.low)
        return JointRegion(low, np.where(turns, low + TURN, self.high))
