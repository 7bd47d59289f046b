"""Does the tool collide in every pose that covers a cell? Boxes of tilt and roll.

Over a cell the tool has three free numbers: two of the tilt w, a rotation vector across the
approach direction with |w| inside the cone, and the roll about that direction. The tool point is
within the tolerance of its target. Within a box of (w, roll) no point of the tool, nor one at rest
as it is seen from the tool, moves from where it is at the middle by more than

    m = (its distance from the tool point) |dw| + (from the tool axis) |d roll| + tolerance.

So bodies are too near all over the box if there a point that is r deep in one of them is s deep in
another (`depths`), and r + s and the clearance together are more than m. What the arm does to bring
the tool there, and whether it can, does not matter.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from coverable.arrays import Array, Mask
from feasibility.certification.collisions.tool_pairs import ToolPair, tool_pairs
from feasibility.collisions.problem_bodies import Bodies
from robots.robot import Robot

MOST_BOXES = 100_000
BATCH = 512  # boxes at a time
MOST_POINTS = 20_000  # of bodies at once, each compared with all planes of another: 0.1 GB
POSES = 12  # directions of tilt, and rolls, among which the best is told


class PoseCheck(NamedTuple):
    """What became of the claim."""

    confirmed: bool
    boxes: int
    """How many boxes of tilt and roll were looked at."""
    pairs: tuple[tuple[str, str], ...] = ()
    """Where it is confirmed: in every pose one of them collides; the first is that of `distance`.
    """
    distance: float = np.nan
    """m, of that pair in the best of some poses all over the cone; negative where they overlap."""


class _Measured(NamedTuple):
    """Of k boxes, the point that is nearest to showing that all of a box collides."""

    over: Array
    """(k,) m, by how much bodies are too near at the middle, for certain and at most."""
    ratio: Array
    """(k,) how far the best point moves in the box by how far it may; below 1 the box is ruled out,
    inf where nothing is too near."""
    by_tilt: Mask
    """(k,) does tilting move that point more than rolling?"""
    best: Array
    """(k,) the pair that the point belongs to."""
    nearest: Array
    """(k,) the pair that `over` belongs to."""


def never_clear(
    robot: Robot,
    bodies: Bodies,
    cone: float,
    tolerance: float,
    point: Array,
    approach: Array,
    tick: Callable[[], object] = lambda: None,
    most: int = MOST_BOXES,
) -> PoseCheck:
    """Is it confirmed that the tool collides in every pose over a target?

    Args:
        robot: the arm, of which only what moves with the tool counts.
        bodies: its bodies, and the pairs that are checked.
        cone: rad, largest angle between tool axis and approach direction.
        tolerance: m, of the tool point.
        point: (3,) m, the target of the tool point.
        approach: (3,) unit vector, the approach direction there.
        tick: called now and then; what it raises ends the work.
        most: how many boxes may be looked at.
    """
    pairs = tool_pairs(robot, bodies, point)
    if not pairs:
        return PoseCheck(False, 0)
    tool, looked, used = _Tool(robot, point, approach, tolerance), 0, set[int]()
    cone = min(cone, np.pi)
    waiting = np.array([[0.0, 0.0, cone, 0.0, np.pi]])  # tilts u, v +- half; roll +- wide
    while len(waiting):
        boxes, waiting = waiting[-BATCH:], waiting[:-BATCH]
        looked += len(boxes)
        if looked > most:
            return PoseCheck(False, looked)
        tick()
        found = tool.measured(boxes, pairs)
        if ((found.over <= 0.0) & (np.hypot(boxes[:, 0], boxes[:, 1]) <= cone)).any():
            return PoseCheck(False, looked)  # nor would a smaller box be ruled out
        open_ = found.ratio >= 1.0
        used |= set(found.best[~open_].tolist())
        waiting = np.concatenate([waiting, _parts(boxes[open_], found.by_tilt[open_], cone)])
    some = tool.measured(_all_over(cone), pairs)
    k = int(some.over.argmin())
    first = pairs[int(some.nearest[k])].pair
    blamed = [first, *(pairs[i].pair for i in sorted(used))]
    distance = first.clearance - float(some.over[k]) - tolerance
    named = dict.fromkeys((pair.first, pair.second) for pair in blamed)
    return PoseCheck(True, looked, tuple(named), distance)


class _Tool:
    """The tool over one target."""

    def __init__(self, robot: Robot, point: Array, approach: Array, tolerance: float) -> None:
        """See `never_clear`."""
        frame = robot.model.frames[robot.tool_frame_id].placement
        self._tip, self._axis = frame.translation, frame.rotation @ robot.approach_axis
        self._point, self._approach, self._tolerance = point, approach, tolerance
        up = np.array([0.0, 0.0, 1.0])
        self._onto = pin.Quaternion.FromTwoVectors(self._axis, approach).toRotationMatrix()
        self._plane = pin.Quaternion.FromTwoVectors(up, approach).toRotationMatrix()[:, :2]

    def measured(self, boxes: Array, pairs: list[ToolPair]) -> _Measured:
        """What is known of boxes (k, 5), a few at a time where pairs have many points."""
        some = max(1, MOST_POINTS // max(len(pair.points) for pair in pairs))
        parts = [
            self._measured(boxes[first : first + some], pairs)
            for first in range(0, len(boxes), some)
        ]
        return _Measured(*map(np.concatenate, zip(*parts, strict=True)))

    def _measured(self, boxes: Array, pairs: list[ToolPair]) -> _Measured:
        """`measured` of all at once."""
        rotations = np.array([self._rotation(*box[[0, 1, 3]]) for box in boxes])
        rows, over, ratio, by_tilt = np.arange(len(boxes)), [], [], []
        for pair in pairs:
            inside, own = pair.overlaps(rotations, self._point - rotations @ self._tip)
            away = own - self._tip
            size = np.einsum("...i,...i->...", away, away)
            beside = np.sqrt(np.maximum(size - (away @ self._axis) ** 2, 0.0))
            tilting = np.sqrt(2.0 * size) * boxes[:, 2:3]
            rolling = beside * boxes[:, 4:]
            spare = inside - self._tolerance
            times = np.divide(tilting + rolling, spare, out=np.full(spare.shape, np.inf),
                              where=spare > 0.0)  # fmt: skip
            best = times.argmin(axis=1)
            over.append(spare.max(axis=1))
            ratio.append(times[rows, best])
            by_tilt.append(np.broadcast_to(tilting > rolling, spare.shape)[rows, best])
        best, nearest = np.argmin(ratio, axis=0), np.argmax(over, axis=0)
        return _Measured(
            np.max(over, axis=0), np.min(ratio, axis=0), np.array(by_tilt)[best, rows], best,
            nearest,
        )  # fmt: skip

    def _rotation(self, u: float, v: float, roll: float) -> Array:
        """(3, 3) of the last joint, tilted and rolled about the approach direction."""
        tilt = pin.exp3(self._plane @ np.array([u, v]))
        return np.asarray(tilt @ pin.exp3(roll * self._approach) @ self._onto)


def _all_over(cone: float) -> Array:
    """(k, 5) poses all over the cone, as boxes of no size."""
    turns = 2.0 * np.pi * np.arange(POSES) / POSES
    ring = cone * np.column_stack([np.cos(turns), np.sin(turns)])
    both = np.concatenate([np.zeros((1, 2)), 0.5 * ring, ring])
    poses = np.zeros((len(both) * POSES, 5))
    poses[:, :2], poses[:, 3] = np.repeat(both, POSES, axis=0), np.tile(turns, len(both))
    return poses


def _parts(boxes: Array, by_tilt: Mask, cone: float) -> Array:
    """Boxes cut into four along the tilt where `by_tilt`, else into halves along the roll.

    Parts wholly outside the cone are left out.
    """
    found = []
    for signs in ((-0.5, -0.5), (-0.5, 0.5), (0.5, -0.5), (0.5, 0.5)):
        part = boxes[by_tilt]
        part[:, :2] += np.array(signs) * part[:, 2:3]
        part[:, 2] *= 0.5
        found.append(part)
    for sign in (-0.5, 0.5):
        part = boxes[~by_tilt]
        part[:, 3] += sign * part[:, 4]
        part[:, 4] *= 0.5
        found.append(part)
    cut = np.concatenate(found)
    nearest = np.maximum(np.abs(cut[:, :2]) - cut[:, 2:3], 0.0)
    return np.asarray(cut[np.hypot(nearest[:, 0], nearest[:, 1]) <= cone])
