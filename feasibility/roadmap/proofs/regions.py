"""Regions of the joint space: an interval for each joint.

The region of a tree's root has the limits (see `feasibility.cut_tree`), and for an opened joint one
turn from t, for all windings alike. A slide without ends is bounded by what it can reach:
were it further out than all targets, the tolerance and all other links, the tool would be too.

A statement that the tool is nowhere in a region is proved over one turn of each joint that has a
full turn or more there: the other windings place the tool alike. (The region itself, and the cuts
through it, keep their windings.)
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Mask
from feasibility.roadmap.motions.search_arrays import SearchArrays
from feasibility.roadmap.proofs.branching import BoxStack, PlaceParts, box_of

TURN = 2.0 * np.pi
WIDE = 1.5 * TURN  # [rad] range from which on windings cost more than they gain


class JointRegion(NamedTuple):
    """Configurations low <= q <= high."""

    low: Array
    """(n,) rad or m"""
    high: Array
    """(n,) rad or m"""
    revolute: Mask
    """(n,) joints that turn, rather than slide."""

    def sides(self, joint: int, value: float) -> tuple[JointRegion, JointRegion]:
        """What a cut q_j = value leaves on either side: q_j <= value, and q_j >= value."""
        high, low = self.high.copy(), self.low.copy()
        high[joint], low[joint] = min(high[joint], value), max(low[joint], value)
        return self._replace(high=high), self._replace(low=low)

    def on(self, joint: int, value: float) -> JointRegion:
        """The part of the region with q_j = value."""
        below, above = self.sides(joint, value)
        return above._replace(high=below.high)

    def inside(self, q: Array) -> Mask:
        """(k,) which configurations (k, n) lie in the region."""
        return np.asarray(((self.low <= q) & (q <= self.high)).all(axis=1))

    def holds(self, other: JointRegion) -> bool:
        """Does this region hold another?"""
        return bool((self.low <= other.low).all() and (self.high >= other.high).all())

    @property
    def empty(self) -> bool:
        """Is nothing left of an interval?"""
        return not bool((self.low <= self.high).all())

    def over_one_turn(self) -> JointRegion:
        """The region with no more than one turn of any joint: what the tool can do is the same."""
        wide = self.revolute & (self.high - self.low >= TURN)
        start = np.where(np.isfinite(self.low), self.low, -np.pi)
        low = np.where(wide, start, self.low)
        return self._replace(low=low, high=np.where(wide, start + TURN, self.high))

    @property
    def is_finite(self) -> bool:
        """Has every interval two ends?"""
        return bool(np.isfinite(self.low).all() and np.isfinite(self.high).all())

    def boxes(self, parameters: int) -> BoxStack:
        """A stack of one box, see `box_of`: the region, with one turn for several."""
        box = self.over_one_turn()
        return box_of(box.low, box.high, parameters)


def limits_of(arrays: SearchArrays, places: PlaceParts) -> JointRegion:
    """The region inside the limits; slides without ends are bounded where that is simple."""
    low, high = arrays.lower.copy(), arrays.upper.copy()
    slides = np.flatnonzero(arrays.chain.prismatic & ~(np.isfinite(low) & np.isfinite(high)))
    if len(slides) == 1:
        ends = np.maximum(abs(low), abs(high))[arrays.chain.prismatic]
        far = (
            np.linalg.norm(places.centre[0, :3])
            + np.linalg.norm(places.slopes[0, :, :3], axis=1).sum()
            + places.radius[0, 0]
            + arrays.tolerance
            + np.linalg.norm(arrays.chain.translations, axis=1).sum()
            + ends[np.isfinite(ends)].sum()
        ) * (1.0 + 1e-9)
        low[slides], high[slides] = np.maximum(low[slides], -far), np.minimum(high[slides], far)
    return JointRegion(low, high, ~arrays.chain.prismatic)


def wide_joints(arrays: SearchArrays) -> list[int]:
    """Joints that turn freely, or through much more than a turn."""
    wide = ~(arrays.upper - arrays.lower < WIDE) & ~arrays.chain.prismatic
    return [int(j) for j in np.flatnonzero(wide)]


def turn_from(region: JointRegion, joint: int, t: float) -> JointRegion:
    """The region with one turn of a joint, from t."""
    low, high = region.low.copy(), region.high.copy()
    low[joint], high[joint] = t, t + TURN
    return region._replace(low=low, high=high)


def folded(q: Array, opened: dict[int, float]) -> Array:
    """Configurations (k, n) with opened joints j inside their turn t_j .. t_j + 2 pi."""
    q = np.array(q)
    for joint, t in opened.items():
        q[:, joint] = t + np.mod(q[:, joint] - t, TURN)
    return q
