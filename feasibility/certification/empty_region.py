"""Is there no configuration in a region with the tool on the surface? Branch and bound over boxes.

The region is a box of joints and intervals of weighted sums w . q. Boxes that the linear models do
not prove empty are contracted and halved, along a joint or, with the part of the surface cut into
its children, over the surface. Nothing is lost by that: what is dropped is proved empty. A few of
the boxes that are left give starts for a search for a configuration that refutes the claim."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from feasibility.certification.box_exclusion import (
    contract,
    directions_for,
    nearest,
    separated,
)
from feasibility.certification.linear_models import Allowed, Arm, Array, Boxes, Models, Parts
from feasibility.certification.region import Region

BATCH = 2048  # boxes at a time
FIRST_TRY = 100  # boxes after which a refutation is first tried
RARER = 4  # times as many boxes until the next try
STARTS = 16  # of a search for a configuration that refutes the claim
KEPT = 0.7  # share of a box's width, in its shortest joint, over which contraction is no progress


@dataclass(frozen=True, eq=False, slots=True)
class Outcome:
    """What became of the claim that a region is empty."""

    boxes: int
    """How many boxes were looked at."""
    left: bool
    """Were boxes left when the budget ran out?"""
    point: Array | None = None
    """(n,) a configuration of the region with the tool on the surface, if one was found."""

    @property
    def empty(self) -> bool:
        """Is the region proved empty?"""
        return not self.left and self.point is None


Refuter = Callable[[Array, Region], Array | None]
"""Looks for a configuration of the region near starts (m, n)."""


class Emptiness:
    """Proves regions empty of configurations with the tool on given parts of the surface."""

    def __init__(self, arm: Arm, allowed: Allowed, tick: Callable[[], object]) -> None:
        """Work for one arm; `tick` is called between batches, and may raise."""
        self.arm = arm
        self.allowed = allowed
        self.tick = tick

    def test(self, region: Region, parts: Parts, refute: Refuter, most: int) -> Outcome:
        """Prove a region empty, refute that, or give up after `most` boxes."""
        region = region.folded(self.arm.prismatic)
        if region.empty:
            return Outcome(0, left=False)
        n = self.arm.n
        ends = np.array([[-1.0, -1.0], [1.0, 1.0]])
        low, high = np.append(region.low, ends[0])[None], np.append(region.high, ends[1])[None]
        waiting = [Boxes(low, high, np.zeros(1, dtype=np.int64))]
        done, next_try = 0, FIRST_TRY
        while waiting:
            if done >= most:
                return Outcome(done, left=True)
            self.tick()
            boxes = _next(waiting)
            done += len(boxes)
            open_boxes, models, place = self.examine(boxes, parts, region)
            if not len(open_boxes):
                continue
            if done >= next_try:
                next_try *= RARER
                starts = (open_boxes.centre + place)[:, :n]
                point = refute(starts[:: len(starts) // STARTS + 1], region)
                if point is not None:
                    return Outcome(done, left=True, point=point)
            waiting.append(smaller(open_boxes, models, parts, self.allowed.length))
        return Outcome(done, left=False)

    def examine(self, boxes: Boxes, parts: Parts, region: Region) -> tuple[Boxes, Models, Array]:
        """The boxes that are not proved empty, their models, and where these come nearest."""
        models = region.with_sums(
            self.arm.models(boxes, parts, self.allowed), boxes.centre[:, : self.arm.n]
        )
        normals = parts.centre[boxes.part, 3:]
        low, high = contract(models, directions_for(models, normals))
        kept = np.asarray(~(low > high).any(axis=1))
        models, boxes, low, high = models[kept], boxes[kept], low[kept], high[kept]
        models = replace(models, low=low, high=high)
        place, missed = nearest(models)
        kept = ~separated(models, missed)
        return boxes[kept], models[kept], place[kept]


def _next(waiting: list[Boxes]) -> Boxes:
    """Take about a batch of boxes, the newest first, so that few wait."""
    taken, size = [], 0
    while waiting and size < BATCH:
        boxes = waiting.pop()
        room = BATCH - size
        if len(boxes) > room:
            waiting.append(boxes[: len(boxes) - room])
            boxes = boxes[len(boxes) - room :]
        taken.append(boxes)
        size += len(boxes)
    return Boxes.joined(taken)


def smaller(boxes: Boxes, models: Models, parts: Parts, length: float) -> Boxes:
    """What is left of open boxes: as it is where contraction did much, otherwise in halves."""
    n = boxes.low.shape[1] - 2
    centre = boxes.centre
    low = np.maximum(centre + models.low, boxes.low)
    high = np.minimum(centre + models.high, boxes.high)
    width = np.maximum(boxes.high - boxes.low, 1e-300)
    share = np.where(boxes.high > boxes.low, (high - low) / width, 1.0)
    much = share.min(axis=1) < KEPT
    now = Boxes(low, high, boxes.part)
    rest, share = now[~much], share[~much]
    made = [now[much]]
    reach = models.reach[~much]
    over_surface = reach[:, n:].sum(axis=1) + parts.radius[rest.part] @ [1.0, length]
    finest = parts.children[rest.part, 0] < 0
    surface_first = over_surface > reach[:, :n].max(axis=1)
    surface_first &= ~finest | (reach[:, n:] > 0.0).any(axis=1)
    by_joint = ~surface_first
    made += _halves(rest[by_joint], np.argmax(reach[by_joint, :n], axis=1))
    at_end = surface_first & finest
    made += _halves(rest[at_end], n + np.argmax(reach[at_end, n:], axis=1))
    made += _children(rest[surface_first & ~finest], parts, n)
    return Boxes.joined(made)


def _halves(boxes: Boxes, along: NDArray[np.int64]) -> list[Boxes]:
    """Boxes (m) cut at the middle of one variable each (m,)."""
    rows = np.arange(len(boxes))
    middle = 0.5 * (boxes.low[rows, along] + boxes.high[rows, along])
    low, high = boxes.low.copy(), boxes.high.copy()
    high[rows, along] = middle
    low[rows, along] = middle
    return [Boxes(boxes.low, high, boxes.part), Boxes(low, boxes.high, boxes.part)]


def _children(boxes: Boxes, parts: Parts, n: int) -> list[Boxes]:
    """The same joints over the two children of each box's part."""
    made = []
    for side in (0, 1):
        low, high = boxes.low.copy(), boxes.high.copy()
        axis = parts.axis[boxes.part]
        for a in (0, 1):
            halved = axis == a
            for ends in (low, high):
                ends[halved, n + a] = 2.0 * ends[halved, n + a] + (1.0 if side == 0 else -1.0)
        low[axis < 0, n:], high[axis < 0, n:] = -1.0, 1.0
        low[:, n:], high[:, n:] = np.maximum(low[:, n:], -1.0), np.minimum(high[:, n:], 1.0)
        child = Boxes(low, high, parts.children[boxes.part, side])
        made.append(child[np.asarray(~(low > high).any(axis=1))])
    return made
