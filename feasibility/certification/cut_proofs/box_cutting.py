"""Regions of the joint space that cuts leave, and boxes cut into smaller ones: nothing is lost.

A box is cut along what can move the tool furthest from, or along, the surface: a joint is halved,
or the part of the surface gives way to its children. The finest parts are halved along x.

*Joints of a turn and more.* Turns of 2 pi leave the tool where it is. So where the question is
whether a region holds any configuration with the tool on the surface, a joint whose interval holds
a whole turn may take any one turn of it. That makes joints without limits finite.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coverable.arrays import Array, Mask
from feasibility.certification.cut_proofs.linear_models import Boxes, Models, Parts

KEPT = 0.7  # share of a box's width, in its shortest joint, over which contraction is no progress
FEW = 100  # boxes: so few are cut several times at once, as none of them will be proved empty yet
TIMES = 3


def smaller(boxes: Boxes, models: Models, parts: Parts, length: float) -> Boxes:
    """What contraction left of open boxes: as it is where it did much, otherwise cut.

    Their models are contracted; differences of axes are multiplied by `length` (m).
    """
    centre = boxes.centre
    low = np.maximum(centre + models.low, boxes.low)
    high = np.minimum(centre + models.high, boxes.high)
    width = np.maximum(boxes.high - boxes.low, 1e-300)
    share = np.where(boxes.high > boxes.low, (high - low) / width, 1.0)
    much = share.min(axis=1) < KEPT
    now = Boxes(low, high, boxes.part, boxes.claim)
    rest, reach = now.of(~much), models.reach[~much]
    for _ in range(TIMES if len(boxes) < FEW else 1):
        rest, reach = cut(rest, reach, parts, length)
    return Boxes.join(now.of(much), rest)


def cut(boxes: Boxes, reach: Array, parts: Parts, length: float) -> tuple[Boxes, Array]:
    """Every box in two, or in the one of these that it lies in; and the reach of these.

    The reach (m, n + 2) m is how much each variable can move the tool or the target, about.
    Differences of normals are multiplied by `length` (m).
    """
    n = reach.shape[1] - 2
    over_surface = reach[:, n:].sum(axis=1) + parts.radius[boxes.part] @ [1.0, length]
    finest = parts.children[boxes.part, 0] < 0
    surface_first = over_surface > reach[:, :n].max(axis=1)
    surface_first &= ~finest | (reach[:, n:] > 0.0).any(axis=1)
    along = np.where(
        surface_first, n + np.argmax(reach[:, n:], axis=1), np.argmax(reach[:, :n], axis=1)
    )
    to_children = surface_first & ~finest  # the others are halved
    (halved,), (split,) = np.nonzero(~to_children), np.nonzero(to_children)
    rows = np.concatenate([halved, halved, split, split])
    side = np.repeat([0, 1, 0, 1], [len(halved)] * 2 + [len(split)] * 2)
    made, reach, child = boxes.of(rows), reach[rows], to_children[rows]
    low, high, k = made.low, made.high, np.arange(2 * len(halved))
    at = k, along[rows[k]]
    middle = 0.5 * (low[at] + high[at])
    low[at] = np.where(side[k] == 1, middle, low[at])
    high[at] = np.where(side[k] == 0, middle, high[at])
    reach[at] *= 0.5
    axis = np.where(child, parts.axis[made.part], 2)
    for a in (0, 1):
        own = axis == a
        shift = np.array([1.0, -1.0])[side[own]]
        for ends in (low, high):
            ends[own, n + a] = 2.0 * ends[own, n + a] + shift
        reach[own, n + a] *= 0.5
    low[axis < 0, n:], high[axis < 0, n:] = -1.0, 1.0
    reach[axis < 0, n:] *= 0.7
    low[:, n:], high[:, n:] = np.maximum(low[:, n:], -1.0), np.minimum(high[:, n:], 1.0)
    made.part[child] = parts.children[made.part, side][child]
    kept = np.asarray(~(child & (low > high).any(axis=1)))
    return made.of(kept), reach[kept]


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
