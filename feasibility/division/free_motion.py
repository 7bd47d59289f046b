"""A joint motion clear of collisions, away from the surface: RRT-connect, then shortened.

Two trees of straight lines grow from both ends: one towards a random place, the other towards where
the first has got (Kuffner and LaValle, "RRT-Connect", ICRA 2000). Every line is certified by the
compiled clearance of the search. The effort is a count of lines, the same on every machine.
"""

from itertools import pairwise

import numpy as np

from coverable.arrays import Array
from feasibility.collisions.kernels.clearance import clearance_gradient, segment_clear
from robots.robot import Robot

MOST_LINES = 40_000  # that are tried for one motion
SHORTEST = 1e-3  # [rad], no line is halved below this
LONGEST = 1.0  # [rad] towards a random place at once
PUSHES, PUSH = 12, 0.1  # from what an end is near, and the length [rad] of one
NEAR = 0.9  # how near what pushes may be: 1 at its clearance, 0 where it pushes no more
SHORTCUTS = 300  # pairs of random places between which a straight line is tried
TURN = 2.0 * np.pi


def in_radians(robot: Robot) -> Array:
    """(n,) rad by which a joint's move counts, by rad or m: a slide as the turn that sweeps it."""
    return np.where(robot.prismatic, 1.0 / robot.length_unit, 1.0)


class FreeSpace:
    """Straight lines that are certified clear, at most so many of them."""

    def __init__(self, robot: Robot, buffer: Array, most: int = MOST_LINES) -> None:
        """Nothing is certified yet; `buffer` is of `collision_buffer`."""
        self.buffer, self.left = buffer, most
        self.scale = in_radians(robot)
        self.lower, self.upper = robot.lower, robot.upper

    def length(self, start: Array, end: Array) -> float:
        """rad, the largest move of a joint."""
        return float(np.max(np.abs(end - start) * self.scale, initial=0.0))

    def reached(self, start: Array, end: Array) -> Array:
        """(n,) how far the straight line is certified; `end` itself where all of it is."""
        self.left -= 1
        if self.left < 0:
            return start
        if segment_clear(self.buffer, start, end) > 0.0:
            return end
        if self.length(start, end) < SHORTEST:
            return start
        middle = 0.5 * (start + end)
        here = self.reached(start, middle)
        return here if here is not middle else self.reached(middle, end)

    def clear(self, start: Array, end: Array) -> bool:
        """Is all of a straight line certified?"""
        return self.reached(start, end) is end


class _Tree:
    """Configurations, each reached by a straight line from the one before it."""

    def __init__(self, space: FreeSpace, root: Array) -> None:
        """A tree of the path from one configuration to a place that is further from all bodies.

        Lines from where the arm all but touches something are hardly ever certified.
        """
        self.space = space
        self.q = np.stack(_away(space, root))
        self.before = list(range(-1, len(self.q) - 1))

    def towards(self, aim: Array, most: float = np.inf) -> tuple[int, bool]:
        """Grow from the nearest configuration to another, by no more than so many rad.

        Returns:
            Where it got, -1 for nowhere; and whether that is `aim`.
        """
        away = np.linalg.norm((self.q - aim) * self.space.scale, axis=1)
        near = int(np.argmin(away))
        start = self.q[near]
        length = self.space.length(start, aim)
        end = aim if length <= most else start + most / length * (aim - start)
        got = self.space.reached(start, end)
        if self.space.length(start, got) < SHORTEST and got is not aim:
            return -1, False
        self.q = np.vstack([self.q, got])
        self.before.append(near)
        return len(self.before) - 1, got is aim

    def path(self, node: int) -> list[Array]:
        """The configurations from the root to a node."""
        found = []
        while node >= 0:
            found.append(self.q[node])
            node = self.before[node]
        return found[::-1]


def _away(space: FreeSpace, q: Array) -> list[Array]:
    """Configurations from q on, one after the other away from what is near."""
    rows = [q]
    for _ in range(PUSHES):
        push = np.zeros_like(q)
        if clearance_gradient(space.buffer, rows[-1], push, PUSH) <= NEAR:
            break
        got = space.reached(rows[-1], np.clip(rows[-1] + push, space.lower, space.upper))
        if not space.length(rows[-1], got) > 0.0:
            break
        rows.append(got)
    return rows


def free_motion(space: FreeSpace, start: Array, end: Array, seed: int) -> Array | None:
    """(m, n) a motion between two configurations, inside the limits, all certified clear.

    It is the straight line where that is clear; None where none was found. The seed is that of
    random places.
    """
    if space.clear(start, end):
        return np.stack([start, end])
    rng = np.random.default_rng(seed)
    # A joint without limits stays within a turn.
    low = np.maximum(space.lower, np.minimum(start, end) - TURN)
    high = np.minimum(space.upper, np.maximum(start, end) + TURN)
    trees = [_Tree(space, start), _Tree(space, end)]
    forwards = True
    while space.left > 0:
        one, other = trees if forwards else trees[::-1]
        node, _ = one.towards(rng.uniform(low, high), LONGEST)
        forwards = not forwards
        if node < 0:
            continue
        joint, joined = other.towards(one.q[node])
        if joined:
            nodes = (node, joint) if one is trees[0] else (joint, node)
            first, last = trees[0].path(nodes[0]), trees[1].path(nodes[1])
            return _shortened(space, np.array(first + last[-2::-1]), rng)
    return None


def _shortened(space: FreeSpace, rows: Array, rng: np.random.Generator) -> Array:
    """The same motion, straight between random places of it where that is clear.

    All joints are tried, and one of them alone in turn: what one has to go around, others need not.
    """
    space.left = MOST_LINES
    for number in range(SHORTCUTS):
        lengths = [space.length(a, b) for a, b in pairwise(rows)]
        at = np.concatenate([[0.0], np.cumsum(lengths)])
        first, last = np.sort(rng.uniform(0.0, at[-1], 2))
        i, j = (int(np.searchsorted(at, place, side="right")) for place in (first, last))
        if i == j or len(rows) == 2:
            continue
        a, b = (
            np.array([np.interp(place, at, column) for column in rows.T]) for place in (first, last)
        )
        between = rows[i:j].copy() if number % 2 else rows[:0]
        if number % 2:
            joint, share = rng.integers(rows.shape[1]), (at[i:j] - first) / (last - first)
            between[:, joint] = a[joint] + share * (b[joint] - a[joint])
        new = np.vstack([a, between, b])
        if all(space.clear(*ends) for ends in pairwise([rows[i - 1], *new, rows[j]])):
            rows = np.vstack([rows[:i], new, rows[j:]])
    return _without_needless(space, rows)


def _without_needless(space: FreeSpace, rows: Array) -> Array:
    """The same motion without rows that a straight line from the one before can pass over."""
    kept = [0]
    while kept[-1] < len(rows) - 1:
        here = kept[-1]
        onward = range(len(rows) - 1, here + 1, -1)
        kept.append(next((k for k in onward if space.clear(rows[here], rows[k])), here + 1))
    return rows[kept]
