"""Do bodies stay clear while the part stands elsewhere, and the arm follows it?

Each joint is within e_j of the motion that was accepted, which moves bodies by as much at most as
`ArmMotion` says of deviations. The part, and what is at rest beside it, may be displaced, or stay:
a point of it is shifted by D + Theta * its distance from the pivot at most; and so is, as seen from
it, the nearest point of the arm. What moves with the tool keeps to the surface: its tool point
stands over the same place, and it has turned by the sum of e_j of the joints that turn, and Theta,
at most; so its furthest point from there sets how much nearer it comes.

All of these are convex in (D, Theta): a share of a margin takes no more than that share of them. So
where two bodies are at least d apart along a segment, c is needed, and they may come nearer by x, a
share (d - c) / x of it does no harm. Only pairs that do not allow all of it are looked at closely.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Mask
from feasibility.certification.collisions.collision_replay import couples_of
from feasibility.certification.collisions.motion import ArmMotion
from feasibility.certification.collisions.pairing import ENOUGH, Pairing
from feasibility.certification.lever_bounds import stretched_length
from feasibility.collisions.problem_bodies import Bodies
from feasibility.collisions.shapes import HalfSpace
from feasibility.collisions.words import SURFACE
from robots.robot import Robot

FEW = (50, 0)  # calls for a pair, and for each row, after which what is known by then has to do
LEAST = 1e-12  # [m] so that nothing is divided by 0


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
    deviations: Array,
    raised: Array,
    still: Mask,
    apart: float,
) -> ClearShare:
    """The share of deviations and raised clearances with which bodies stay clear, as far as known.

    Args:
        robot: the arm.
        bodies: all of the problem.
        q: (m, n) rows of a motion that was accepted, m >= 2, rad or m.
        deviations: (m - 1, n) rad or m, how far each joint may be from it along each segment.
        raised: (p, m - 1) m, by which each of `bodies.pairs` may come nearer besides.
        still: (p,) pairs that deviations do not bring nearer.
        apart: m, certified of all pairs along the motion.
    """
    couples, found = couples_of(bodies), ClearShare(1.0, None, 0)
    clearances = np.array([one.clearance for one in bodies.pairs])
    taken = np.repeat(clearances[:, None], len(deviations), axis=1)
    deviating = couples.nearer(ArmMotion(robot, q, deviations))
    looked = list[tuple[float, int, Pairing, Array]]()
    for number, one, moved in zip(
        couples.numbers.tolist(), couples.along(ArmMotion(robot, q), taken), deviating, strict=True
    ):
        most = raised[number] + (0.0 if still[number] else moved)
        one.needed, one.low = 0.0, np.maximum(one.low, max(apart - clearances[number], 0.0))
        if not (one.low >= most).all():
            row = int(np.argmin(one.low - most))
            met = float(one.measured(np.array([row], dtype=float))[0]) - clearances[number]
            looked.append((met / max(float(most[row]), LEAST), number, one, most))
    for met, number, one, most in sorted(looked, key=lambda each: each[0]):
        if not (one.low >= found.share * most).all():  # what is met limits what is looked for
            one.certify(min(met, found.share / ENOUGH) * float(most.max()), FEW)
            shares = np.where(one.low >= most, 1.0, one.low / np.maximum(most, LEAST))
            shares = np.nan_to_num(shares, nan=0.0)
            if shares.min() < found.share:
                pair, row = bodies.pairs[number], int(np.argmin(shares))
                found = ClearShare(float(shares[row]), (pair.first, pair.second), row)
    return found


def displaced_share(
    robot: Robot,
    bodies: Bodies,
    q: Array,
    pivot: Array,
    most: tuple[float, float],
    moved: Array,
    apart: float,
) -> ClearShare:
    """A share of a margin with which bodies stay clear along a motion, and why not with more.

    Args:
        robot: the arm.
        bodies: all of the problem.
        q: (m, n) the motion, m >= 2, rad or m.
        pivot: (3,) m, about which the part turns.
        most: m and rad, the margin without bodies.
        moved: (m - 1, n) rad or m, e_j of each segment.
        apart: m, certified of all pairs along the motion.
    """
    with_tool, beside = _with_tool(robot, bodies), _beside(robot, bodies, pivot, *most)
    turned = most[1] + moved[:, ~robot.prismatic].sum(axis=1)
    still = np.array([one.second == SURFACE and one.first in with_tool for one in bodies.pairs])
    raised = [
        turned * with_tool[one.first]
        if keeps
        else np.full(len(moved), beside.get(one.first, 0.0) + beside.get(one.second, 0.0))
        for one, keeps in zip(bodies.pairs, still, strict=True)
    ]
    return clear_share(robot, bodies, q, moved, np.stack(raised), still, apart)


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


def _beside(
    robot: Robot, bodies: Bodies, pivot: Array, shift: float, turn: float
) -> dict[str, float]:
    """m, how far the part, and what is at rest beside it, is displaced as seen from the arm."""
    far, arm = dict[str, float](), 0.0
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
    return {name: max(shift, turn * min(far[name], arm)) for name in rest}


def _furthest(points: Array) -> float:
    """m, the largest length of vectors (..., 3)."""
    return float(np.linalg.norm(points, axis=-1).max(initial=0.0))
