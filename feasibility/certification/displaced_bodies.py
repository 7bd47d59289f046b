"""Do bodies stay clear while the part stands elsewhere, and the arm follows it?

Each joint is within e_j of the motion that was accepted, which the judge of collisions allows for
as deviations. The part, and what is at rest beside it, may be displaced, or stay: a point of it is
shifted by D + Theta * its distance from the pivot at most; and so is, as seen from it, the nearest
point of the arm. Clearances of pairs with it are raised by that much. What moves with the tool
keeps to the surface: its tool point stands over the same place, and it has turned by the sum of e_j
of the joints that turn, and Theta, at most; so its furthest point from there sets how much.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array
from feasibility.certification.collisions.collision_replay import CollisionFault, collision_replay
from feasibility.certification.lever_bounds import stretched_length
from feasibility.collisions.bodies import Bodies
from feasibility.collisions.shapes import HalfSpace
from feasibility.collisions.words import SURFACE
from robots.robot import Robot

SHARES = (0.12, 0.35, 1.0)  # [1] of a margin that are tried: less takes less time
FURTHER = 1.6  # [1] times the last that is allowed is tried, too


class ClearShare(NamedTuple):
    """How much of a margin bodies allow."""

    share: float
    pair: tuple[str, str] | None
    """What allows no more; None where all is allowed."""
    row: int
    """Where that is."""


def clear_share(
    robot: Robot,
    bodies: Bodies,
    q: Array,
    pivot: Array,
    most: tuple[float, float],
    moved: Callable[[float], Array],
) -> ClearShare:
    """A share of a margin with which bodies stay clear along a motion, and why not with more.

    Args:
        robot: the arm.
        bodies: all of the problem.
        q: (m, n) the motion, m >= 2, rad or m.
        pivot: (3,) m, about which the part turns.
        most: m and rad, the margin without bodies.
        moved: (m - 1, n) rad or m, e_j of each segment, with a share of it.
    """

    def faults_at(share: float) -> tuple[CollisionFault, ...]:
        off, (shift, turn) = moved(share), (share * most[0], share * most[1])
        turned = turn + float(off[:, ~robot.prismatic].sum(axis=1).max(initial=0.0))
        return (
            collision_replay(robot, _beside(robot, bodies, pivot, shift, turn), q, off).faults
            or collision_replay(robot, _at_tool(robot, bodies, turned), q).faults
        )

    allowed = 0.0
    for share in SHARES:
        faults = faults_at(share)
        if faults:
            if allowed and not faults_at(FURTHER * allowed):
                allowed *= FURTHER
            return ClearShare(allowed, faults[0].pair, max(faults[0].row, 0))
        allowed = share
    return ClearShare(allowed, None, 0)


def _with_tool(robot: Robot, bodies: Bodies) -> dict[str, float]:
    """m, the furthest point from the tool point, of the owners of bodies that move with it."""
    tool = robot.model.frames[robot.tool_frame_id].placement.translation
    far, others = dict[str, float](), set[str]()
    for body in bodies.polytopes:
        if body.joint == robot.n:
            reach = _furthest(body.vertices - tool) + body.radius
            far[body.owner] = max(far.get(body.owner, 0.0), reach)
        else:
            others.add(body.owner)
    return {name: reach for name, reach in far.items() if name not in others}


def _at_tool(robot: Robot, bodies: Bodies, turned: float) -> Bodies:
    """The pairs of surface and what moves with the tool, with clearances that allow for a turn."""
    far = _with_tool(robot, bodies)
    pairs = [
        replace(one, clearance=one.clearance + turned * far[one.first])
        for one in bodies.pairs
        if one.second == SURFACE and one.first in far
    ]
    return replace(bodies, pairs=tuple(pairs))


def _beside(robot: Robot, bodies: Bodies, pivot: Array, shift: float, turn: float) -> Bodies:
    """The other pairs, with clearances that allow for the part, and what is at rest beside it."""
    far, arm, with_tool = dict[str, float](), 0.0, _with_tool(robot, bodies)
    for soup in bodies.soups:
        far[soup.owner] = _furthest(soup.triangles - pivot) + soup.deviation
    for body in bodies.polytopes:
        if body.joint:
            arm = max(arm, _furthest(body.vertices) + body.radius)
        else:
            reach = _furthest(body.vertices - pivot) + body.radius
            far[body.owner] = max(far.get(body.owner, 0.0), reach)
    far |= {one.name: np.inf for one in bodies.scene if isinstance(one.geometry, HalfSpace)}
    arm += _furthest(pivot) + stretched_length(robot, -1)  # the furthest point of any pose
    rest = {SURFACE, *(one.name for one in bodies.scene)} & far.keys()
    more = {name: max(shift, turn * min(far[name], arm)) for name in rest}
    raised = [
        replace(one, clearance=one.clearance + more.get(one.first, 0.0) + more.get(one.second, 0.0))
        for one in bodies.pairs
        if not (one.second == SURFACE and one.first in with_tool)
    ]
    return replace(bodies, pairs=tuple(raised))


def _furthest(points: Array) -> float:
    """m, the largest length of vectors (..., 3)."""
    return float(np.linalg.norm(points, axis=-1).max(initial=0.0))
