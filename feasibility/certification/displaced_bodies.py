"""Do bodies stay clear while the part stands elsewhere, and the arm follows it?

Each joint j is within e_j of the motion that was accepted. Two bodies, on the joints a and b behind
it, come nearer by no more than both are moved as seen from any joint k from a to b: what joints up
to k move the first, those behind k the second. The part, and what is at rest beside it, may be
displaced, or stay: that moves two points towards each other by D, or Theta times the distance from
the pivot of either, at most.

The tool point stands over the same place of the part. So a body on joint k is also moved against
the part by no more than the tool point as seen from k, and its distance from that times what it
turns: Theta, and e_j of the joints up to k that turn.

All of these are convex in (D, Theta): a share of a margin takes no more than that share of them. So
where two bodies are at least d apart along a segment, c is needed, and they may come nearer by x, a
share (d - c) / x of it does no harm. d is what the judge of collisions has certified of the motion;
only pairs that do not allow all of it are looked at again.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array
from feasibility.certification.collisions.judged_shapes import Body
from feasibility.certification.collisions.pairing import Pairing
from feasibility.collisions.words import SURFACE
from feasibility.task import Task
from robots.robot import Robot
from surfaces.cells import Cells

SHARES = (0.4, 1.0)  # [1] of a margin that bodies are asked about: less takes less of them
FEW, SHARE_OF_CALLS = 20, 0.08  # coal calls, or as many for each that the judge needed, ...
MOST_CALLS = 0.6  # [1] ... of which a couple gets this share of what is left
HUGE = 1e6  # [m] the radius of a half space
LEAST = 1e-12  # [m] so that nothing is divided by 0


class ClearShare(NamedTuple):
    """How much of a margin bodies allow."""

    share: float
    pair: tuple[str, str] | None
    """What allows no more; None where all is allowed."""
    row: int
    """Where that is."""


def displaced_share(
    robot: Robot,
    cells: Cells,
    task: Task,
    pairings: tuple[Pairing, ...],
    most: tuple[float, float],
    moved: Callable[[float, float], Array],
) -> ClearShare:
    """A share of a margin with which bodies stay clear along a motion, and why not with more.

    Args:
        robot, cells, task: the case.
        pairings: all couples of bodies along the motion, as they were judged.
        most: m and rad, the margin without bodies.
        moved: (m - 1, n) rad or m, e_j of each segment with the part so far off.
    """
    scene = () if task.collision is None else task.collision.scene
    beside = {SURFACE, *(one.name for one in scene)}
    nearer = Nearer(robot, pairings, beside, cells.centres.mean(axis=0))
    found, asked = ClearShare(0.0, None, 0), sum(one.calls for one in pairings)
    last = asked + max(FEW, SHARE_OF_CALLS * asked)
    for some in SHARES:
        part = some * most[0], some * most[1]
        calls = last - sum(one.calls for one in pairings)
        clear = clear_share(pairings, nearer.by(moved(*part), *part), calls)
        found = clear._replace(share=max(found.share, some * clear.share))
        if clear.pair is not None:
            break
    return found


def clear_share(pairings: Sequence[Pairing], nearer: Array, calls: float) -> ClearShare:
    """The share of `nearer` (c, m - 1) m that couples may come nearer by, as far as known.

    So many calls of coal find out more, of what allows least.
    """
    found, more = ClearShare(1.0, None, 0), np.maximum(nearer, LEAST)
    shares, rows = _shares(pairings, more)
    for k in np.argsort(shares).tolist():
        one, share, row = pairings[k], float(shares[k]), int(rows[k])
        if share < found.share:
            calls += one.calls
            one.look_closer(row, more[k], found.share, MOST_CALLS * calls)
            calls -= one.calls
            (share,), (row,) = (each.tolist() for each in _shares([one], more[[k]]))
        if share < found.share:
            found = ClearShare(share, one.names, row)
    return found


def _shares(pairings: Sequence[Pairing], more: Array) -> tuple[Array, Array]:
    """(c,) the share of `more` that couples allow, and the segments that allow no more."""
    over = np.stack([one.low - one.needed for one in pairings])
    shares = np.where(over >= more, 1.0, over / more)
    shares = np.where(np.isnan(shares), 0.0, shares.clip(0.0, 1.0))
    rows = shares.argmin(axis=1)
    return shares[np.arange(len(rows)), rows], rows


class Nearer:
    """How much nearer couples of bodies may come along a motion."""

    def __init__(
        self, robot: Robot, pairings: tuple[Pairing, ...], beside: set[str], pivot: Array
    ) -> None:
        """See where they are along it.

        Args:
            robot: the arm.
            pairings: all couples along the motion.
            beside: names of what is displaced with the part, if it is at rest.
            pivot: (3,) m, about which the part turns.
        """
        self.motion, self.slides = pairings[0].motion, robot.prismatic
        bodies = list(dict.fromkeys(body for one in pairings for body in (one.a, one.b)))
        tool = robot.model.frames[robot.tool_frame_id].placement.translation
        self.joints = np.array([body.joint for body in bodies] + [robot.n])
        self.balls = np.array([min(body.ball, HUGE) for body in bodies] + [0.0])
        """(B,) m, about the centres of all bodies, and of the tool point."""
        centres = np.vstack([*(body.centre for body in bodies), tool])
        self.middles = self.motion.middles(self.joints, centres)
        self.levers = self.motion.levers(self.middles)
        index = {body: k for k, body in enumerate(bodies)}
        self.first = np.array([index[one.a] for one in pairings])
        self.second = np.array([index[one.b] for one in pairings])
        goes = [bool(beside & set(one.names)) and one.a.joint == 0 for one in pairings]
        self.goes = np.array(goes)
        self.over = np.array([SURFACE in one.names and goes[k] for k, one in enumerate(pairings)])
        self.far = np.array([_furthest(one.a, pivot) for one in pairings])
        self.reach = np.array(
            [_furthest(one.b, tool) if one.b.joint == robot.n else np.inf for one in pairings]
        )
        self.pivot = pivot

    def by(self, moved: Array, shift: float, turn: float) -> Array:
        """(c, m - 1) m, how much nearer they come at most.

        Args:
            moved: (m - 1, n) rad or m, e_j of each segment.
            shift, turn: m and rad, how far the part is displaced.
        """
        a, b = self.joints[self.first], self.joints[self.second]
        (behind, far), (before, _) = self._seen(moved, False), self._seen(moved, True)
        found = np.full((len(moved), len(a)), np.inf)
        for k in range(int(b.max()) + 1):
            both = before[k][:, self.first] + behind[k][:, self.second]
            np.minimum(found, both, out=found, where=(a <= k) & (k <= b))
        # The part, and what is beside it.
        away = self._apart(self.pivot, far[0], self.second) + behind[0][:, self.second]
        found += self.goes * np.maximum(shift, turn * np.minimum(self.far, away))
        # The part, as seen from the tool point.
        tool, turned = len(self.joints) - 1, np.where(self.slides, 0.0, moved)
        turned = turn + np.column_stack([0.0 * turned[:, :1], np.cumsum(turned, axis=1)])
        away = self._apart(self.middles[:, [tool]], far[b, :, tool].T, self.second)
        away = behind[b, :, tool].T + turned[:, b] * np.minimum(away, self.reach)
        np.minimum(found, away, out=found, where=self.over)
        return found.T

    def _seen(self, moved: Array, before: bool) -> tuple[Array, Array]:
        """(n + 1, m - 1, B) m, how far points of bodies are moved as seen from every joint.

        By the e_j, and along each segment. Bodies are on that joint or behind it, or before it. As
        joints deviate one by one, that furthest from a body first, levers are those of the motion.
        """
        n, steps = moved.shape[1], self.motion.steps
        off, way = np.zeros((2, n + 1, len(moved), len(self.joints)))
        last = np.zeros((2, *off.shape[1:]))
        for j in range(n) if before else reversed(range(n)):
            some = self.joints <= j if before else self.joints > j
            levers = self.levers[j] + self.balls
            mean = 0.5 * (levers[:-1] + levers[1:] + last[1])
            lever = some * (1.0 if self.slides[j] else mean)
            last += lever * np.stack([moved[:, j, None], steps[:, j, None]])
            off[j + before], way[j + before] = last
        return off, way

    def _apart(self, points: Array, moved: Array, which: Array) -> Array:
        """(m - 1, c) m, the largest distance of bodies from points that move by so much."""
        apart = np.linalg.norm(self.middles[:, which] - points, axis=2)
        moved = moved if moved.shape[1] == len(which) else moved[:, which]
        return 0.5 * (apart[:-1] + apart[1:] + moved) + self.balls[which]


def _furthest(body: Body, pivot: Array) -> float:
    """m, of any of a body's points from the pivot."""
    if body.half_space:
        return np.inf
    away = np.linalg.norm(body.corners - pivot, axis=1).max()
    return float(away + body.radius + body.circle + body.deviation)
