"""Regions of the joint space that cuts leave: a box of joints, and intervals of weighted sums.

*Joints of a turn and more.* Turns of 2 pi leave the tool where it is. So where the question is
whether a region holds any configuration with the tool on the surface, a joint that no w weighs and
whose interval holds a whole turn may take any one turn of it. That makes joints without limits
finite.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from coverable_arrays import Array, Mask
from feasibility.certification.cut_proofs.linear_models import GUARD, Models

TURN = 2.0 * np.pi
ON_CUT = 1e-9  # [rad], [m] by which w . q may pass the value that it should have


@dataclass(frozen=True, eq=False, slots=True)
class JointRegion:
    """Joints inside a box, and weighted sums of joints inside intervals."""

    low: Array
    """(n,) rad or m; -inf where there is no limit."""
    high: Array
    """(n,)"""
    weights: Array
    """(k, n) w"""
    least: Array
    """(k,) w . q is at least this"""
    most: Array
    """(k,) and at most this."""

    @staticmethod
    def box(low: Array, high: Array) -> JointRegion:
        """A region without weighted sums."""
        return JointRegion(low, high, np.zeros((0, len(low))), np.zeros(0), np.zeros(0))

    def within(self, weights: Array, least: float, most: float) -> JointRegion:
        """The part of it in which weights . q lies in least .. most."""
        (weighted,) = np.nonzero(weights)
        if len(weighted) == 1:
            j = weighted[0]
            low, high = self.low.copy(), self.high.copy()
            first, last = sorted((least / weights[j], most / weights[j]))
            low[j], high[j] = max(low[j], first), min(high[j], last)
            return JointRegion(low, high, self.weights, self.least, self.most)
        return JointRegion(
            self.low,
            self.high,
            np.vstack([self.weights, weights]),
            np.append(self.least, least),
            np.append(self.most, most),
        )

    @property
    def empty(self) -> bool:
        """Does it hold no configuration, plainly?"""
        return bool((self.low > self.high).any() or (self.least > self.most).any())

    def folded(self, prismatic: Mask) -> JointRegion:
        """One turn of each joint whose interval holds one and that no sum weighs."""
        turns = ~prismatic & ~(self.weights != 0.0).any(axis=0) & (self.high - self.low > TURN)
        low = np.where(turns, np.where(np.isfinite(self.low), self.low, -np.pi), self.low)
        high = np.where(turns, low + TURN, self.high)
        return JointRegion(low, high, self.weights, self.least, self.most)

    def sums_hold(self, q: Array) -> Mask:
        """(m,) whose weighted sums of configurations (m, n) are in it, within `ON_CUT`."""
        sums = q @ self.weights.T
        inside = (sums >= self.least - ON_CUT) & (sums <= self.most + ON_CUT)
        return np.asarray(inside.all(axis=1))

    def with_sums(self, models: Models, centre: Array) -> Models:
        """Models at `centre` (m, n) with one more coordinate for each w: w . q minus its middle."""
        if not len(self.weights):
            return models
        least, most = self.ranges()
        value = centre @ self.weights.T - 0.5 * (least + most)
        slopes = np.zeros((*models.columns.shape[:2], len(self.weights)))
        slopes[:, : self.weights.shape[1]] = self.weights.T
        half = np.broadcast_to(0.5 * (most - least) + GUARD, value.shape)
        return replace(
            models,
            residual=np.concatenate([models.residual, value], axis=1),
            columns=np.concatenate([models.columns, slopes], axis=2),
            radius=np.concatenate([models.radius, half], axis=1),
        )

    def ranges(self) -> tuple[Array, Array]:
        """(k,) the least and the largest that w . q can be, all bounds considered; finite."""
        first, second = self.weights * self.low, self.weights * self.high
        return (
            np.maximum(np.minimum(first, second).sum(axis=1), self.least),
            np.minimum(np.maximum(first, second).sum(axis=1), self.most),
        )
