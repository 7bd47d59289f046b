"""Does the tool collide in every pose that covers a cell? What must confirm such a proof.

No code is shared with the search, which places balls in the tool and measures how deep they are.
Here shapes as they are meet shapes that are eroded, and whether they do is coal's word, yes or no:
its depths are not asked, as they are not the least ones. A box of tilts (a rotation vector w across
the approach direction, inside the cone) and rolls moves no point of a body by more than

    m = (furthest point from the tool point) |dw| + (furthest from the tool axis) |d roll|
        + tolerance

from where it is at the middle of the box. So all of the box collides if there one body meets what
an erosion by m leaves of the other (`erosion`), or comes nearer to it than the clearance less m.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from coverable_arrays import Array
from feasibility.certification.tool_alone.couples import Couple, couples_of
from feasibility.collisions import Bodies
from robots import Robot

MOST_BOXES = 100_000
TICK = 500  # boxes between two calls of `tick`


class PoseCheck(NamedTuple):
    """What became of the claim."""

    confirmed: bool
    boxes: int
    """How many boxes of tilt and roll were looked at."""


class _Box(NamedTuple):
    """Tilts (u, v) +- half and rolls +- wide, rad."""

    u: float
    v: float
    half: float
    roll: float
    wide: float


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
    frame = robot.model.frames[robot.tool_frame_id].placement
    axis = frame.rotation @ robot.approach_axis
    couples = [one for one in couples_of(robot, bodies, axis) if one.near(point)]
    if not couples:
        return PoseCheck(False, 0)
    onto = pin.Quaternion.FromTwoVectors(axis, approach).toRotationMatrix()
    plane = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), approach).toRotationMatrix()
    reach, lateral = np.mean([(one.reach, one.lateral) for one in couples], axis=0)
    cone, looked = min(cone, np.pi), 0
    waiting = [_Box(0.0, 0.0, cone, 0.0, np.pi)]
    while waiting:
        box = waiting.pop()
        if np.hypot(max(abs(box.u) - box.half, 0.0), max(abs(box.v) - box.half, 0.0)) > cone:
            continue
        looked += 1
        if looked > most:
            return PoseCheck(False, most)
        if looked % TICK == 0:
            tick()
        tilt = pin.exp3(plane @ np.array([box.u, box.v, 0.0]))
        rotation = tilt @ pin.exp3(box.roll * approach) @ onto
        pose = pin.SE3(rotation, point - rotation @ frame.translation)
        if _blocked(couples, pose, np.sqrt(2.0) * box.half, box.wide, tolerance):
            continue
        inside = np.hypot(box.u, box.v) <= cone
        if inside and not _blocked(couples, pose, 0.0, 0.0, tolerance):
            return PoseCheck(False, looked)  # nor would a smaller box be
        waiting += _parts(box, float(reach), float(lateral))
    return PoseCheck(True, looked)


def _blocked(
    couples: list[Couple], pose: pin.SE3, tilt: float, roll: float, tolerance: float
) -> bool:
    """Does one of the couples collide at a pose and at all that are so far from it?

    The one that does comes to the front: the next box is often alike.
    """
    for k, one in enumerate(couples):
        if one.collides(pose, one.reach * tilt + one.lateral * roll + tolerance):
            couples.insert(0, couples.pop(k))
            return True
    return False


def _parts(box: _Box, reach: float, lateral: float) -> list[_Box]:
    """A box cut along what moves more."""
    if np.sqrt(2.0) * box.half * reach < box.wide * lateral:
        half = 0.5 * box.wide
        return [box._replace(roll=box.roll + way * half, wide=half) for way in (-1.0, 1.0)]
    half = 0.5 * box.half
    return [
        box._replace(u=box.u + i * half, v=box.v + k * half, half=half)
        for i in (-1.0, 1.0)
        for k in (-1.0, 1.0)
    ]
