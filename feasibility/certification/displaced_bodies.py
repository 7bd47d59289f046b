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

Shares = tuple[Array, tuple[str, str] | None]
"""(m - 1,) shares along each segment, and the two bodies that allow least; None where all is."""


def displaced_share(
    robot: Robot,
    task: Task,
    pivot: Array,
    pairings: Sequence[Pairing],
    most: tuple[float, float],
    moved: Callable[[float, float], Array],
) -> Shares:
    """The share of a margin with which bodies stay clear along a motion.

    Args:
        robot, task: the case.
        pivot: (3,) m, about which the part turns.
        pairings: all couples of bodies along the motion, as they were judged.
        most: m and rad, the margin without bodies.
        moved: (m - 1, n) rad or m, e_j of each segment with the part so far off.
    """
    scene = () if task.collision is None else task.collision.scene
    nearer = Nearer(robot, pairings, {SURFACE, *(one.name for one in scene)}, pivot)
    along, some, pair = np.zeros(len(pairings[0].low)), 1.0, None
    most_calls = SHARE_OF_CALLS * sum(one.calls for one in pairings)
    spare, tried = spare_of(pairings), set[tuple[int, int]]()
    for calls in (0.0, most_calls):
        part = some * most[0], some * most[1]
        shares, least = clear_share(pairings, spare, nearer.by(moved(*part), *part), calls, tried)
        along, pair = np.maximum(along, some * shares), least or pair
        some = min(max(LESS, WIDER * float(along.min())), 1.0)
        if least is None or (some == 1.0 and most_calls < FEW):
            break
    return along, pair


def spare_of(pairings: Sequence[Pairing]) -> Array:
    """(c, m - 1) m, what is certified of couples beyond what they need."""
    needed = np.array([one.needed for one in pairings])
    return np.array([one.low for one in pairings]) - needed[:, None]


def clear_share(
    pairings: Sequence[Pairing], spare: Array, nearer: Array, calls: float,
    tried: set[tuple[int, int]],
) -> Shares:  # fmt: skip
    """The share of `nearer` (c, m - 1) m that c couples may come nearer by, as far as known.

    Of those that allow least planes find out more, where not `tried` before, or so many calls of
    coal, at least `FEW`. That raises what they `spare`, see `spare_of`.
    """
    more = np.maximum(nearer, LEAST)

    def shares_of(k: int | slice) -> Array:  # 0 where that is NaN
        return np.minimum(np.fmax(spare[k] / more[k], 0.0), 1.0)

    shares, least, pair = shares_of(slice(None)), 1.0, None
    for k in np.argsort(shares.min(axis=1)).tolist():
        if shares[k].min() >= least:
            break
        one, wanted = pairings[k], pairings[k].needed + least * more[k]
        at = k, int(shares[k].argmin())
        if calls < FEW and at not in tried:
            tried.add(at)
            one.part_at(at[1], wanted)
        elif calls >= FEW:
            calls += one.calls
            one.look_closer(wanted, MOST_CALLS * (calls - one.calls))
            calls -= one.calls
        spare[k] = spare_of([one])[0]
        shares[k] = shares_of(k)
        if shares[k].min() < least:
            least, pair = float(shares[k].min()), one.names
    return shares.min(axis=0), pair


class Nearer:
    """How much nearer couples of bodies may come along a motion."""

    def __init__(
        self, robot: Robot, pairings: Sequence[Pairing], beside: set[str], pivot: Array
    ) -> None:
        """See where all couples of bodies are along it.

        Of `beside`, by names, what is at rest is displaced with the part, about `pivot` (3,) m.
        """
        motion, self.slides = pairings[0].motion, robot.prismatic[:, None, None]
        bodies = dict[Body, int]()
        couples = [bodies.setdefault(x, len(bodies)) for one in pairings for x in (one.a, one.b)]
        self.couples = np.array(couples).reshape(-1, 2).T
        tool = robot.model.frames[robot.tool_frame_id].placement.translation
        centres = np.array([*(body.centre for body in bodies), tool])
        self.joints = np.array([*(body.joint for body in bodies), robot.n])
        balls = np.array([*(min(body.ball, HUGE) + body.deviation for body in bodies), 0.0])
        """(B,) m, about the centres of all bodies, and of the tool point."""
        middles = motion.middles(self.joints, centres)
        levers = (motion.levers(middles) + balls).transpose(0, 2, 1)
        most = np.where(self.slides, 1.0, np.maximum(levers[..., :-1], levers[..., 1:]))
        way = self._seen(most * motion.steps.T[:, None])
        ahead = (np.arange(robot.n)[:, None] < self.joints)[..., None]
        behind = np.where(ahead, way[1:], way[:-1])
        mean = 0.5 * (levers[..., :-1] + levers[..., 1:] + behind)
        self.levers = np.where(self.slides, 1.0, mean)
        """(n, B, m - 1) m, the largest along each segment, of points of each body."""
        rests = [one.a.joint == 0 and not beside.isdisjoint(one.names) for one in pairings]
        over = [rest and SURFACE in one.names for rest, one in zip(rests, pairings, strict=True)]
        self.goes, self.over = np.array([rests, over])[..., None]

        def apart(points: Array, ways: Array) -> Array:  # (c, m - 1) m, the second ones, at most
            away = np.linalg.norm(middles - points, axis=2)
            return (0.5 * (away[:-1] + away[1:] + ways.T) + balls).T[self.couples[1]]

        self.far, self.reach = apart(pivot, way[0]), apart(middles[:, -1:], way[self.joints, -1])
        """From the pivot, and from the tool point."""
        self.size = (np.linalg.norm(centres - pivot, axis=1) + balls)[self.couples[0], None]
        """(c, 1) m, of what is at rest from there."""

    def _seen(self, each: Array) -> Array:
        """(n + 1, B, m - 1) sums over the joints between each body's and every one.

        Of values (n, B, m - 1) of all joints.
        """
        sums = np.concatenate([np.zeros_like(each[:1]), np.cumsum(each, axis=0)])
        return np.abs(sums - sums[self.joints, np.arange(len(self.joints))])

    def by(self, moved: Array, shift: float, turn: float) -> Array:
        """(c, m - 1) m, how much nearer they come at most, the part displaced by so many m and rad.

        `moved` (m - 1, n) rad or m is e_j of each segment.
        """
        moved = moved.T[:, None]
        off, (a, b) = self._seen(self.levers * moved), self.couples  # as seen from every joint
        found = reduce(np.minimum, (one[a] + one[b] for one in off))  # faster than all at once
        # The part, and what is beside it.
        found += self.goes * np.maximum(shift, turn * np.minimum(self.size, self.far + off[0, b]))
        if not self.over.any():
            return np.asarray(found)
        # The part, as seen from the tool point.
        turned, on = np.zeros((len(moved) + 1, moved.shape[2])), self.joints[b]
        np.where(self.slides, 0.0, moved)[:, 0].cumsum(axis=0, out=turned[1:])
        followed = off[on, -1] + (turn + turned[on]) * self.reach
        return np.asarray(np.where(self.over, np.minimum(found, followed), found))
