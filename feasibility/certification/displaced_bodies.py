"""Do bodies stay clear while the part stands elsewhere, and the arm follows it?

Each joint j is within e_j of the motion that was accepted. Two bodies, on the joints a and b behind
it, come nearer by no more than both are moved as seen from any joint k from a to b: what joints up
to k move the first, those behind k the second. Joints deviate one by one, that furthest from a body
first, so that levers are those of the motion. The part, and what is at rest beside it, may be
displaced, or stay: that moves two points towards each other by D, or Theta times the distance from
the pivot of either, at most.

The tool point stands over the same place of the part. So a body on joint k is also moved against
the part by no more than the tool point as seen from k, and its distance from that times what it
turns: Theta, and e_j of the joints up to k that turn.

All of these are convex in (D, Theta): a share of a margin takes no more than that share of them. So
where two bodies are at least d apart along a segment, c is needed, and they may come nearer by x, a
share (d - c) / x of it does no harm. d is what the judge of collisions has certified of the motion;
only of pairs that do not allow all of it planes are tried, and coal is asked again.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import reduce
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array
from feasibility.certification.collisions.judged_shapes import Body
from feasibility.certification.collisions.pairing import Pairing
from feasibility.collisions.words import SURFACE
from feasibility.task import Task
from robots.robot import Robot

LESS, WIDER = 0.2, 1.5  # [1] of a margin, asked about next: so much, or times what is known
SHARE_OF_CALLS = 0.08  # coal calls for each that the judge needed, ...
FEW, MOST_CALLS = 20, 0.8  # ... no less, of which a couple gets this share of what is left
HUGE = 1e6  # [m] the radius of a half space
LEAST = 1e-12  # [m] so that nothing is divided by 0


class ClearShare(NamedTuple):
    """How much of a margin bodies allow."""

    along: Array
    """(m - 1,) share that they allow along each segment."""
    pair: tuple[str, str] | None
    """What allows no more than the least of these; None where all is allowed."""


def displaced_share(
    robot: Robot,
    task: Task,
    pivot: Array,
    pairings: tuple[Pairing, ...],
    most: tuple[float, float],
    moved: Callable[[float, float], Array],
) -> ClearShare:
    """A share of a margin with which bodies stay clear along a motion, and why not with more.

    Args:
        robot, task: the case.
        pivot: (3,) m, about which the part turns.
        pairings: all couples of bodies along the motion, as they were judged.
        most: m and rad, the margin without bodies.
        moved: (m - 1, n) rad or m, e_j of each segment with the part so far off.
    """
    scene = () if task.collision is None else task.collision.scene
    beside = {SURFACE, *(one.name for one in scene)}
    nearer = Nearer(robot, pairings, beside, pivot)
    along, some, pair = np.zeros(len(pairings[0].low)), 1.0, None
    calls = SHARE_OF_CALLS * sum(one.calls for one in pairings)
    for allowed in (0.0, calls):
        part = some * most[0], some * most[1]
        clear = clear_share(pairings, nearer.by(moved(*part), *part), allowed)
        along, pair = np.maximum(along, some * clear.along), clear.pair or pair
        some = min(max(LESS, WIDER * float(along.min())), 1.0)
        if clear.pair is None or (some == 1.0 and calls < FEW):
            break
    return ClearShare(along, pair)


def clear_share(pairings: Sequence[Pairing], nearer: Array, calls: float) -> ClearShare:
    """The share of `nearer` (c, m - 1) m that couples may come nearer by, as far as known.

    Of those that allow least planes find out more, or so many calls of coal.
    """
    more = np.maximum(nearer, LEAST)
    shares, pair = _shares(pairings, more), None
    known, least = shares.min(axis=1), 1.0
    for k in np.argsort(known).tolist():
        if known[k] >= least:
            break
        one, row = pairings[k], int(shares[k].argmin())
        if calls == 0.0:
            one.part_at(row, one.needed + least * more[k])
        elif calls >= FEW:
            calls += one.calls
            one.look_closer(row, least * more[k], MOST_CALLS * (calls - one.calls))
            calls -= one.calls
        shares[k] = _shares([one], more[k])
        if shares[k].min() < least:
            least, pair = float(shares[k].min()), one.names
    return ClearShare(shares.min(axis=0), pair)


def _shares(pairings: Sequence[Pairing], more: Array) -> Array:
    """(c, m - 1) the share of `more` that couples allow along each segment; 0 where that is NaN."""
    needed = np.array([one.needed for one in pairings])[:, None]
    over = np.array([one.low for one in pairings]) - needed
    return np.asarray(np.minimum(np.fmax(over / more, 0.0), 1.0))


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
        motion, self.slides = pairings[0].motion, robot.prismatic
        bodies = list(dict.fromkeys(body for one in pairings for body in (one.a, one.b)))
        index = {body: k for k, body in enumerate(bodies)}
        self.first = np.array([index[one.a] for one in pairings])
        self.second = np.array([index[one.b] for one in pairings])
        tool = robot.model.frames[robot.tool_frame_id].placement.translation
        centres = np.array([*(body.centre for body in bodies), tool])
        self.joints = np.array([*(body.joint for body in bodies), robot.n])
        balls = np.array([*(min(body.ball, HUGE) + body.deviation for body in bodies), 0.0])
        """(B,) m, about the centres of all bodies, and of the tool point."""
        middles, slides = motion.middles(self.joints, centres), self.slides[:, None, None]
        levers = motion.levers(middles) + balls
        most = np.where(slides, 1.0, np.maximum(levers[:, :-1], levers[:, 1:]))
        way = self._sums(most * motion.steps.T[:, :, None])
        between = np.where(np.arange(robot.n)[:, None, None] < self.joints, way[1:], way[:-1])
        self.levers = np.where(slides, 1.0, 0.5 * (levers[:, :-1] + levers[:, 1:] + between))
        """(n, m - 1, B) m, the largest along each segment, of points of each body."""
        rests = [one.a.joint == 0 and not beside.isdisjoint(one.names) for one in pairings]
        self.goes, self.over = np.array(rests), np.array([SURFACE in one.names for one in pairings])
        self.over &= self.goes
        self.far = self._apart(middles, pivot, way[0], balls)
        """(m - 1, c) m, of the second ones from the pivot, at most."""
        self.size = (np.linalg.norm(centres - pivot, axis=1) + balls)[self.first]
        """(c,) m, of what is at rest from there."""
        self.reach = self._apart(middles, middles[:, [-1]], way[self.joints, :, -1].T, balls)
        """(m - 1, c) m, of the second ones from the tool point, at most."""
        ends = {body: _furthest(body, tool) for body in bodies if body.joint == robot.n}
        np.minimum(self.reach, [ends.get(one.b, np.inf) for one in pairings], out=self.reach)

    def _sums(self, each: Array) -> Array:
        """(n + 1, m - 1, B) sums over the joints from every one up to each body's, or back.

        Of values (n, m - 1, B) of all joints.
        """
        sums = np.zeros((len(each) + 1, *each.shape[1:]))
        each.cumsum(axis=0, out=sums[1:])
        return np.abs(sums - sums[self.joints, :, np.arange(len(self.joints))].T)

    def _apart(self, middles: Array, points: Array, way: Array, balls: Array) -> Array:
        """(m - 1, c) m, how far the second ones are at most from points that go such ways."""
        away = np.linalg.norm(middles - points, axis=2)
        return np.asarray(0.5 * (away[:-1] + away[1:] + way) + balls)[:, self.second]

    def by(self, moved: Array, shift: float, turn: float) -> Array:
        """(c, m - 1) m, how much nearer they come at most.

        Args:
            moved: (m - 1, n) rad or m, e_j of each segment.
            shift, turn: m and rad, how far the part is displaced.
        """
        off = self._sums(self.levers * moved.T[:, :, None])  # as seen from every joint
        found = reduce(np.minimum, (one[:, self.first] + one[:, self.second] for one in off))
        # The part, and what is beside it.
        away = np.minimum(self.size, self.far + off[0][:, self.second])
        found += self.goes * np.maximum(shift, turn * away)
        # The part, as seen from the tool point.
        turned = np.zeros((len(moved), len(self.slides) + 1))
        np.where(self.slides, 0.0, moved).cumsum(axis=1, out=turned[:, 1:])
        b = self.joints[self.second]
        away = off[b, :, -1].T + (turn + turned[:, b]) * self.reach
        np.minimum(found, away, out=found, where=self.over)
        return np.asarray(found.T)


def _furthest(body: Body, point: Array) -> float:
    """m, of any of a body's points from another one."""
    away = body.corners - point
    most = np.sqrt(np.einsum("ki,ki->k", away, away).max())
    return float(most + body.radius + body.circle + body.deviation)
