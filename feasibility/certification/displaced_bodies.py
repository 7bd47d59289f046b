"""Do bodies stay clear while the part stands elsewhere, and the arm follows it?

Each joint is within e_j of the motion that was accepted, which the judge of collisions allows for
as deviations. The part, and what is at rest beside it, may be displaced, or stay: a point of it is
shifted by D + Theta * its distance from the pivot at most; and so is, as seen from it, the nearest
point of the arm. Clearances of pairs with it are raised by that much.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from coverable_arrays import Array
from feasibility.certification.collisions import collision_replay
from feasibility.certification.lever_bounds import stretched_length
from feasibility.collisions import Bodies, HalfSpace
from feasibility.collisions.words import SURFACE
from robots import Robot

SHARES = (1.0, 0.7, 0.5, 0.35, 0.25, 0.12, 0.06)  # [1] of a margin, that bodies may allow


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
    """The largest of `SHARES` of a margin with which bodies stay clear along a motion.

    Args:
        robot: the arm.
        bodies: all of the problem.
        q: (m, n) the motion, m >= 2, rad or m.
        pivot: (3,) m, about which the part turns.
        most: m and rad, the margin without bodies.
        moved: (m - 1, n) rad or m, e_j of each segment, with a share of it.
    """
    pair, row = None, 0
    for share in SHARES:
        raised = _raised(robot, bodies, pivot, share * most[0], share * most[1])
        found = collision_replay(robot, raised, q, moved(share))
        if found.accepted:
            return ClearShare(share, pair, row)
        pair, row = found.faults[0].pair, max(found.faults[0].row, 0)
    return ClearShare(0.0, pair, row)


def _raised(robot: Robot, bodies: Bodies, pivot: Array, shift: float, turn: float) -> Bodies:
    """The bodies, with clearances that allow for the part, and what is at rest beside it."""
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
    more = {name: max(shift, turn * min(far[name], arm)) for name in rest}
    raised = [
        replace(one, clearance=one.clearance + more.get(one.first, 0.0) + more.get(one.second, 0.0))
        for one in bodies.pairs
    ]
    return replace(bodies, pairs=tuple(raised))


def _furthest(points: Array) -> float:
    """m, the largest length of vectors (..., 3)."""
    return float(np.linalg.norm(points, axis=-1).max(initial=0.0))
