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

from collections.abc import Callable, Sequence
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


class Collides(NamedTuple):
    """What became of the claim that something collides wherever the tool covers a cell."""

    confirmed: bool
    boxes: int
    """How many boxes, of tilt and roll or of joint values, were looked at."""
    pairs: tuple[tuple[str, str], ...] = ()
    """Where it is confirmed: one of them collides; the first is that of `distance`."""
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
) -> Collides:
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
        return Collides(False, 0)
    tool, looked, used = _Tool(robot, point, approach, tolerance), 0, set[int]()
    cone = min(cone, np.pi)
    # Sheets have thousands of points, and tool and objects few.
    order = sorted(range(len(pairs)), key=lambda i: not pairs[i].moving)
    waiting = np.array([[0.0, 0.0, cone, 0.0, np.pi]])  # tilts u, v +- half; roll +- wide
    while len(waiting):
        boxes, waiting = waiting[-BATCH:], waiting[:-BATCH]
        looked += len(boxes)
        if looked > most:
            return Collides(False, looked)
        tick()
        found = tool.measured(boxes, pairs, order)
        if ((found.over <= 0.0) & (np.hypot(boxes[:, 0], boxes[:, 1]) <= cone)).any():
            return Collides(False, looked)  # nor would a smaller box be ruled out
        open_ = found.ratio >= 1.0
        used |= set(found.best[~open_].tolist())
        order.sort(key=lambda i: i not in used)
        waiting = np.concatenate([waiting, _parts(boxes[open_], found.by_tilt[open_], cone)])
    over, nearest = _at_best(tool, cone, pairs)
    blamed = [pairs[nearest].pair, *(pairs[i].pair for i in sorted(used))]
    named = dict.fromkeys((pair.first, pair.second) for pair in blamed)
    return Collides(True, looked, tuple(named), blamed[0].clearance - over - tolerance)


def _at_best(tool: _Tool, cone: float, pairs: list[ToolPair]) -> tuple[float, int]:
    """By how much (m) bodies are too near in the best of some poses all over the cone, and which.

    With one pair alone it is no more: only poses that could be the best are measured with all.
    """
    poses, least, nearest, known = _all_over(cone), np.inf, 0, set[int]()
    at_least = np.full(len(poses), -np.inf)
    while at_least.min() < least:
        k = int(at_least.argmin())
        found = tool.measured(poses[k : k + 1], pairs, range(len(pairs)), whole=True)
        over, i = float(found.over[0]), int(found.nearest[0])
        if over < least:
            least, nearest = over, i
        if i not in known:
            known.add(i)
            at_least = np.maximum(at_least, tool.measured(poses, pairs, [i], whole=True).over)
        at_least[k] = np.inf
    return least, nearest


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

    def measured(
        self, boxes: Array, pairs: list[ToolPair], order: Sequence[int], whole: bool = False
    ) -> _Measured:
        """What is known of boxes (k, 5), a few at a time where pairs have many points.

        Pairs are taken in this order; boxes that one rules out are not asked about the others,
        unless `whole`.
        """
        some = max(1, MOST_POINTS // max(len(pair.points) for pair in pairs))
        parts = [
            self._measured(boxes[first : first + some], pairs, order, whole)
            for first in range(0, len(boxes), some)
        ]
        return _Measured(*map(np.concatenate, zip(*parts, strict=True)))

    def _measured(
        self, boxes: Array, pairs: list[ToolPair], order: Sequence[int], whole: bool
    ) -> _Measured:
        """`measured` of all at once."""
        rotations = np.array([self._rotation(*box[[0, 1, 3]]) for box in boxes])
        places, count = self._point - rotations @ self._tip, len(boxes)
        over, ratio = np.full(count, -np.inf), np.full(count, np.inf)
        by_tilt, best, nearest = (np.zeros(count, kind) for kind in (bool, int, int))
        for i in order:
            rows = np.flatnonzero((ratio >= 1.0) | whole)
            if not len(rows):
                break
            inside, own = pairs[i].overlaps(rotations[rows], places[rows])
            away = own - self._tip
            size = np.einsum("...i,...i->...", away, away)
            beside = np.sqrt(np.maximum(size - (away @ self._axis) ** 2, 0.0))
            tilting = np.sqrt(2.0 * size) * boxes[rows, 2:3]
            rolling = beside * boxes[rows, 4:]
            spare = inside - self._tolerance
            times = np.divide(tilting + rolling, spare, out=np.full(spare.shape, np.inf),
                              where=spare > 0.0)  # fmt: skip
            at = np.arange(len(rows)), times.argmin(axis=1)
            # Where nothing is too near, any point tells how to cut.
            better = (times[at] < ratio[rows]) | (i == order[0])
            more = spare.max(axis=1) > over[rows]
            over[rows[more]], nearest[rows[more]] = spare.max(axis=1)[more], i
            ratio[rows[better]], best[rows[better]] = times[at][better], i
            by_tilt[rows[better]] = np.broadcast_to(tilting > rolling, spare.shape)[at][better]
        return _Measured(over, ratio, by_tilt, best, nearest)

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
