"""Does the arm collide wherever its tool is at a target? Branch and bound over boxes of joints.

Boxes are contracted to what may have the tool there (`at_target`), and dropped where two bodies
collide all over them (`ball_tests`); what is left is halved. Where no box is left, no configuration
has the tool at the target without a collision.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from coverable_arrays import Array
from feasibility.collisions import Bodies
from feasibility.roadmap.branch_and_bound import toward_middle
from feasibility.roadmap.joint_boxes.at_target import Direction, Target, at_target
from feasibility.roadmap.joint_boxes.ball_tests import BallTests
from feasibility.roadmap.joint_boxes.frames import Boxes, frames_at
from feasibility.task import Task
from robots import Robot

BATCH = 1024  # boxes at a time
MOST_BOXES = 30_000  # of one target
ALL_BOXES = 40_000  # of all targets of one search
MUCH = 0.7  # a box of which a joint keeps less is looked at again before it is halved
NEAR = 8.0  # [1] ratio of moves to depth below which a box is halved for the sake of the collision
TYPICAL = 0.2  # [1] of the reach: a length that makes radians comparable to metres
DEEP = 0.05  # [1] of that length, from which on it is
THINNEST = 1e-6  # [rad], [m]


class ArmBlocked(NamedTuple):
    """What keeps the arm from a target."""

    pairs: tuple[tuple[str, str], ...]
    """Wherever the tool is at the target, one of them collides."""
    boxes: int
    """How many were looked at."""


@dataclass(eq=False)
class JointBoxes:
    """Proofs that some pair of bodies collides wherever the tool is at a target."""

    robot: Robot
    bodies: Bodies
    """Everything that can collide, and the pairs that have to stay clear."""
    task: Task
    """Its tolerance, cone and roll are used."""
    left: int = ALL_BOXES
    """Boxes that may still be looked at, for all targets."""

    @cached_property
    def tests(self) -> BallTests:
        """What may collide; balls are placed when they are first needed."""
        return BallTests(self.robot, self.bodies)

    def target(self, point: Array, approach: Array, reference: Array | None = None) -> Target:
        """Where the tool has to be over a cell.

        Args:
            point: (3,) m, the target of the tool point.
            approach: (3,) unit vector, the approach direction there.
            reference: (3,) unit vector, the reference direction, where roll is limited.
        """
        task, chain = self.task, self.robot.chain
        directions = [Direction(chain.approach, approach, task.cone_chord)]
        if task.roll is not None and reference is not None:
            middle = toward_middle(approach, reference, task.roll.middle)
            directions.append(Direction(chain.reference, middle, _roll_chord(task)))
        return Target(point, chain.translations[-1], task.effective_tolerance, tuple(directions))

    def any_clear(self, q: Array) -> bool:
        """Does one of some configurations (k, n) pass all tests? Then no proof can be had there."""
        return bool((self.tests.spare(frames_at(self.robot.chain, q)) >= 0.0).any())

    def blocking(
        self,
        target: Target,
        low: Array,
        high: Array,
        tick: Callable[[], object] = lambda: None,
        most: int = MOST_BOXES,
    ) -> ArmBlocked | None:
        """What keeps the arm from a target everywhere in a box; None where that is not proved.

        Args:
            target: where the tool has to be.
            low, high: (n,) rad or m, finite.
            tick: called between batches; may raise.
            most: boxes that may be looked at.
        """
        chain, scale = self.robot.chain, TYPICAL * self.robot.reach
        waiting, used, looked = [Boxes(low[None], high[None])], set[int](), 0
        while sum(len(boxes.low) for boxes in waiting):
            boxes = _next(waiting)
            looked += len(boxes.low)
            self.left -= len(boxes.low)
            if looked > most or self.left < 0:
                return None
            tick()
            frames = frames_at(chain, boxes.centre)
            kept, left, effect, held = at_target(chain, frames, boxes, target, scale)
            width = np.maximum(boxes.high - boxes.low, THINNEST)
            much = kept & (((left.high - left.low) / width).min(axis=1) < MUCH)
            waiting.append(left.some(much))
            (rest,) = np.nonzero(kept & ~much)
            found = self.tests.deepest(frames.some(rest), boxes.half[rest], target)
            open_ = found.ratio >= 1.0
            if (held[rest] & np.isinf(found.ratio)).any():
                return None  # this configuration is clear, in smaller boxes too
            used |= set(found.pair[~open_].tolist())
            # (Around shallow overlaps there would be no end of ever smaller boxes.)
            near = (found.ratio < NEAR) & (found.effect.sum(axis=1) > found.ratio * DEEP * scale)
            by = np.where(near[:, None], found.effect, effect[rest])[open_]
            rest = rest[open_]
            if len(rest) and (boxes.half[rest].max(axis=1) < THINNEST).any():
                return None
            waiting.append(_halves(left.some(rest), by))
        names = dict.fromkeys((self.tests.pairs[k].first, self.tests.pairs[k].second) for k in used)
        return ArmBlocked(tuple(names), looked)


def _roll_chord(task: Task) -> float:
    """How far the reference axis can be from the middle of its range, as a chord.

    A tilt of at most alpha and a roll of at most rho to either side turn it by Theta at most,
    cos(Theta / 2) = cos(alpha / 2) cos(rho / 2).
    """
    if task.roll is None:
        return 2.0
    tilt = 1.0 - 0.25 * min(task.cone_chord, 2.0) ** 2
    cosine = np.cos(0.5 * min(task.roll.half, np.pi))
    return float(2.0 * np.sqrt(max(1.0 - tilt * cosine * cosine, 0.0)))


def _next(waiting: list[Boxes]) -> Boxes:
    """Take about a batch of boxes, the newest first, so that few wait."""
    low, high = (np.concatenate([boxes[k] for boxes in waiting]) for k in (0, 1))
    waiting[:] = [Boxes(low[:-BATCH], high[:-BATCH])] if len(low) > BATCH else []
    return Boxes(low[-BATCH:], high[-BATCH:])


def _halves(boxes: Boxes, effect: Array) -> Boxes:
    """Every box in two, across the joint of the largest effect (m, n)."""
    rows = np.arange(len(effect))
    along = (effect * (boxes.high > boxes.low)).argmax(axis=1) if len(effect) else rows
    middle = boxes.centre[rows, along]
    low, high = boxes.low.copy(), boxes.high.copy()
    high[rows, along] = middle
    low[rows, along] = middle
    return Boxes(np.concatenate([boxes.low, low]), np.concatenate([high, boxes.high]))
