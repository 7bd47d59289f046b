"""Does the tool collide in every pose over a cell? Branch and bound over tilt and roll.

Over a cell the tool has three free numbers: two of the tilt w, a rotation vector across the
approach direction with |w| inside the cone, and the roll about that direction. The tool point is
within the tolerance of its target. A ball inside the tool, with its centre c from the tool point
and at a distance of a from the tool axis, is moved by a change of the pose by no more than

    |c| |dw| + a |d roll| + tolerance.

So a box of (w, roll) holds no pose that is clear if at its middle the signed distance of a centre
from a body at rest, less the ball's radius, is below the clearance by more than that. What the arm
does to bring the tool there, and whether it can, does not matter.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from coverable_arrays import Array, Mask
from feasibility.collisions import Bodies, Pair
from feasibility.roadmap.tool_alone.balls_inside import balls_inside
from feasibility.roadmap.tool_alone.distances import (
    Distance,
    ball_around,
    distance_from,
    distance_from_triangles,
)
from robots import Robot

MOST_BOXES = 4_000  # of one cell
ALL_BOXES = 20_000  # of all cells of one search
KEPT = 8  # problems whose balls are remembered: a search is often run again
SURE = 1e-6  # [m] deeper than needed
POSES = 12  # directions of tilt, and rolls, that a distance is measured in


class ToolBlocked(NamedTuple):
    """What keeps the tool from a cell in every pose."""

    pairs: tuple[tuple[str, str], ...]
    """In every pose one of them collides; the first is that of `distance`."""
    distance: float
    """m, of that pair in the best of some poses all over the cone; negative where they overlap."""
    boxes: int
    """How many were looked at."""


class _BallTest(NamedTuple):
    """Balls of the tool that have to stay clear of a body at rest."""

    pair: Pair
    distance: Distance
    centres: Array
    """(k, 3) m, from the tool point, in the frame of the last joint."""
    radii: Array
    """(k,) m."""
    ball: tuple[Array, float]
    """Around the body at rest: centre (3,) and radius, m."""

    def in_reach(self, point: Array, tolerance: float) -> bool:
        """May any ball come too near with the tool point within `tolerance` (m) of a point?"""
        centre, radius = self.ball
        reach = (np.linalg.norm(self.centres, axis=1) + self.radii).max(initial=-np.inf)
        needed = radius + float(reach) + self.pair.clearance + tolerance + SURE
        return bool(np.linalg.norm(centre - point) <= needed)


class _Measured(NamedTuple):
    """Of k boxes and all E balls of all pairs, m."""

    spare: Array
    """(k, E) distance beyond the clearance at the middle of a box, at most."""
    by_tilt: Array
    """(k, E) how far a ball is moved within a box by tilting."""
    by_roll: Array
    """(k, E) the same by rolling."""


_Still = tuple[Distance, tuple[Array, float]]


def _at_rest(geometry: object, placement: Array) -> _Still:
    """How far points are from a body at rest, and a ball around it."""
    return distance_from(geometry, placement), ball_around(geometry, placement)


@lru_cache(maxsize=KEPT)
def _tests_of(robot: Robot, bodies: Bodies) -> tuple[_BallTest, ...]:
    """Balls in what moves with the tool, against all that is at rest."""
    tool_frame = robot.model.frames[robot.tool_frame_id]
    carrier, tip = int(tool_frame.parentJoint), tool_frame.placement.translation
    moved, still = dict[str, list[Array]](), dict[str, list[_Still]]()
    for solid in bodies.solids:
        place = solid.placement
        if solid.joint == carrier:
            balls = balls_inside(solid.geometry)
            balls[:, :3] = balls[:, :3] @ place[:3, :3].T + place[:3, 3] - tip
            moved.setdefault(solid.owner, []).append(balls)
        elif solid.joint == 0:
            still.setdefault(solid.owner, []).append(_at_rest(solid.geometry, place))
    for thing in bodies.scene:
        still[thing.name] = [_at_rest(thing.geometry, thing.placement)]
    for soup in bodies.soups:
        if soup.owner not in still:
            sheet = distance_from_triangles(soup.triangles, soup.deviation)
            corners = soup.triangles.reshape(-1, 3)
            centre = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
            radius = float(np.linalg.norm(corners - centre, axis=1).max()) + soup.deviation
            still[soup.owner] = [(sheet, (centre, radius))]
    found: list[_BallTest] = []
    for pair in bodies.pairs:
        names = (pair.first, pair.second)
        tool, rest = names if pair.first in moved else names[::-1]
        if tool in moved and rest in still:
            balls = np.concatenate(moved[tool])
            found += [
                _BallTest(pair, d, balls[:, :3], balls[:, 3], ball) for d, ball in still[rest]
            ]
    return tuple(found)


class ToolAlone:
    """What the tool may hit by itself, of one problem.

    Pairs that are left out are not used, nor is anything that another joint moves.
    """

    def __init__(self, robot: Robot, bodies: Bodies, cone: float, tolerance: float) -> None:
        """Nothing is examined yet.

        Args:
            robot, bodies: the arm, everything that can collide, and the pairs to stay clear.
            cone: rad, largest angle between tool axis and approach direction.
            tolerance: m, of the tool point.
        """
        self._robot, self._bodies = robot, bodies
        tool = robot.model.frames[robot.tool_frame_id]
        self._axis: Array = tool.placement.rotation @ robot.approach_axis
        self._cone, self._tolerance = min(cone, np.pi), tolerance
        self._left = ALL_BOXES

    def blocking(self, point: Array, approach: Array) -> ToolBlocked | None:
        """What keeps the tool from a target in every pose; None where that is not proved.

        Args:
            point: (3,) m, the target of the tool point.
            approach: (3,) unit vector, the approach direction there.
        """
        boxes = np.array([[0.0, 0.0, self._cone, 0.0, np.pi]])  # w_1, w_2, half, roll, half
        frame = _Frame(self._axis, approach)
        tests = self._near(boxes, point, frame)
        if not tests:
            return None
        owners = np.repeat(np.arange(len(tests)), [len(test.radii) for test in tests])
        used, looked = set[int](), 0
        while len(boxes):
            looked += len(boxes)
            self._left -= len(boxes)
            if looked > MOST_BOXES or self._left < 0:
                return None
            found = self._measured(boxes, tests, point, frame)
            rows = np.arange(len(boxes))
            inside = np.hypot(boxes[:, 0], boxes[:, 1]) <= self._cone
            if (inside & (found.spare.min(axis=1) + self._tolerance >= 0.0)).any():
                return None  # this pose is clear, in smaller boxes too
            deep = np.maximum(-found.spare - self._tolerance - SURE, 0.0)
            moved = found.by_tilt + found.by_roll
            # The ball that rules a box out, or will: it decides how the box is cut.
            times = np.where(deep > 0.0, moved / np.maximum(deep, SURE), np.inf)
            best = times.argmin(axis=1)
            left = moved[rows, best] >= deep[rows, best]
            used |= set(owners[best[~left]].tolist())
            tilts = (found.by_tilt >= found.by_roll)[rows, best]
            boxes = _parts(boxes[left], tilts[left], self._cone)
        some = self._measured(_all_over(self._cone), tests, point, frame).spare
        best = int(some.min(axis=1).argmax())
        first = int(owners[some[best].argmin()])
        pairs = [tests[k].pair for k in (first, *sorted(used))]
        named = dict.fromkeys((pair.first, pair.second) for pair in pairs)
        return ToolBlocked(tuple(named), float(some[best].min()) + pairs[0].clearance, looked)

    def _near(self, root: Array, point: Array, frame: _Frame) -> list[_BallTest]:
        """The balls that may collide in some pose of the first box.

        None of them where the pose at its middle is not seen to collide.
        """
        known = _tests_of(self._robot, self._bodies)
        tests = [test for test in known if test.in_reach(point, self._tolerance)]
        if not tests:
            return []
        found = self._measured(root, tests, point, frame)
        if found.spare.min() + self._tolerance >= 0.0:
            return []
        close = (found.spare - found.by_tilt - found.by_roll)[0] < 0.0
        parts = np.split(close, np.cumsum([len(test.radii) for test in tests])[:-1])
        return [
            test._replace(centres=test.centres[some], radii=test.radii[some])
            for test, some in zip(tests, parts, strict=True)
            if some.any()
        ]

    def _measured(
        self, boxes: Array, tests: Iterable[_BallTest], point: Array, frame: _Frame
    ) -> _Measured:
        """Distances at the middles of boxes (k, 5), and how far balls are moved within them."""
        turns = frame.rotations(boxes)
        spare, reach, lateral = [], [], []
        for test in tests:
            places = point + np.einsum("kij,bj->kbi", turns, test.centres)
            spare.append(test.distance(places) - test.radii - test.pair.clearance)
            reach.append(np.linalg.norm(test.centres, axis=1))
            across = test.centres - np.outer(test.centres @ self._axis, self._axis)
            lateral.append(np.linalg.norm(across, axis=1))
        return _Measured(
            np.concatenate(spare, axis=1),
            np.outer(np.sqrt(2.0) * boxes[:, 2], np.concatenate(reach)),
            np.outer(boxes[:, 4], np.concatenate(lateral)),
        )


class _Frame:
    """Rotations of the last joint's frame over a target, by tilt and roll."""

    def __init__(self, axis: Array, approach: Array) -> None:
        """From the tool axis in the joint's frame to the approach direction."""
        start, end = (np.column_stack([one, *_across(one)]) for one in (axis, approach))
        self._approach, self._plane, self._onto = approach, end[:, 1:].T, end @ start.T

    def rotations(self, boxes: Array) -> Array:
        """(k, 3, 3) at the middles of boxes."""
        if not boxes[:, [0, 1, 3]].any():
            return np.repeat(self._onto[None], len(boxes), axis=0)
        from scipy.spatial.transform import Rotation

        tilts = Rotation.from_rotvec(boxes[:, :2] @ self._plane)
        rolls = Rotation.from_rotvec(boxes[:, 3:4] * self._approach)
        return np.asarray((tilts * rolls).as_matrix() @ self._onto)


def _across(direction: Array) -> tuple[Array, Array]:
    """Two unit vectors across a direction and each other, right-handed."""
    first = np.cross(direction, np.eye(3)[int(np.argmin(np.abs(direction)))])
    first /= np.linalg.norm(first)
    return first, np.cross(direction, first)


def _all_over(cone: float) -> Array:
    """(k, 5) poses all over the cone, as boxes of no size."""
    turns = 2.0 * np.pi * np.arange(POSES) / POSES
    ring = cone * np.column_stack([np.cos(turns), np.sin(turns)])
    both = np.concatenate([np.zeros((1, 2)), 0.5 * ring, ring])
    poses = np.zeros((len(both) * POSES, 5))
    poses[:, :2], poses[:, 3] = np.repeat(both, POSES, axis=0), np.tile(turns, len(both))
    return poses


def _parts(boxes: Array, tilts: Mask, cone: float) -> Array:
    """Boxes cut into four along the tilt where `tilts`, else into halves along the roll.

    Parts wholly outside the cone are left out.
    """
    found = []
    for signs in ((-0.5, -0.5), (-0.5, 0.5), (0.5, -0.5), (0.5, 0.5)):
        part = boxes[tilts]
        part[:, :2] += np.array(signs) * part[:, 2:3]
        part[:, 2] *= 0.5
        found.append(part)
    for sign in (-0.5, 0.5):
        part = boxes[~tilts]
        part[:, 3] += sign * part[:, 4]
        part[:, 4] *= 0.5
        found.append(part)
    cut = np.concatenate(found)
    nearest = np.maximum(np.abs(cut[:, :2]) - cut[:, 2:3], 0.0)
    return np.asarray(cut[np.hypot(nearest[:, 0], nearest[:, 1]) <= cone])
