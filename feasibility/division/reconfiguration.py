"""From one patch to the next: in which order, from which end, and how far the joints move.

A patch can be painted by several walks, each from either end, and full turns of a joint further on
where the limits allow it. The largest move of a joint is to be the least there is (a bottleneck
travelling salesman, by trying all orders of a few patches). What comes within 2 per cent of that
counts as equally good, and of it the least sum over all joints.

The moves are straight lines in joint space, which stay inside the limits. Where collisions are
checked, `between_patches` leads a move around obstacles.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise, permutations

import numpy as np

from coverable.arrays import Array, Ints, Mask, Protected
from feasibility.certification.collisions.collision_replay import CollisionReplay
from feasibility.division.free_motion import in_radians
from feasibility.paths.metrics import turns_inside
from feasibility.paths.order import improved
from feasibility.verdict import Walk
from robots.robot import Robot

TURN = 2.0 * np.pi
MOST_EXACT = 7  # patches up to which all orders are tried; beyond, one is improved by 2-opt
AS_GOOD = 1.02  # how much larger than the least the largest move may be
SLACK = 1e-9  # [rad] rounding in sums of turns
LEAST_NAMED = 0.05  # [deg], [0.1 mm]: smaller moves are not named


@dataclass(frozen=True, eq=False, slots=True)
class Reconfiguration(Protected):
    """The move from the end of one patch's walk to the start of the next one's."""

    joint_names: tuple[str, ...]
    prismatic: Mask
    """(n,) which joints slide."""
    start: Array
    """(n,) rad or m."""
    end: Array
    """(n,) rad or m."""
    via: Array = field(default_factory=lambda: np.zeros((0, 0)))
    """(k, n) rad or m, configurations in between; none where the move is one straight line."""
    replayed: CollisionReplay | None = None
    """What the judge of collisions says of the move; None where collisions are not checked."""

    @property
    def waypoints(self) -> Array:
        """(k + 2, n) rad or m, from start to end; straight lines lead from one to the next."""
        return np.vstack([self.start, *self.via, self.end])

    @property
    def refusal(self) -> str:
        """Why the move must not be made; empty where nothing is known against it."""
        if self.replayed is None or self.replayed.accepted:
            return ""
        worst, *others = self.replayed.faults
        more = f", and {len(others)} more" if others else ""
        return f"no path around was found, and straight on {worst.text}{more}"

    @property
    def moves(self) -> Array:
        """(n,) how far each joint moves, rad or m, with its sign."""
        return self.end - self.start

    def described(self, most: int | None = None) -> str:
        """The joints that move, the furthest first: 'shoulder_pan_joint by -352.1 deg, ...'.

        No more are named than `most`, if that is given; the others are counted.
        """
        shown = np.where(self.prismatic, 1e4 * self.moves, np.degrees(self.moves))
        parts = []
        for j in np.argsort(-np.abs(shown), kind="stable").tolist():
            if abs(shown[j]) >= LEAST_NAMED:
                value, unit = (0.1 * shown[j], "mm") if self.prismatic[j] else (shown[j], "deg")
                parts.append(f"{self.joint_names[j]} by {value:+.1f} {unit}")
        if most is not None and len(parts) > most + 1:
            parts[most:] = [f"{len(parts) - most} more"]
        return ", ".join(parts) or "no joint"


def itinerary(robot: Robot, choices: Sequence[Sequence[Walk]]) -> tuple[list[int], list[Walk]]:
    """The order of patches, and one walk of each in that order, chosen with its direction."""
    options = [
        (p, Walk(walk.q[::direction], walk.cell[::direction]))
        for p, walks in enumerate(choices)
        for walk in walks
        for direction in (1, -1)
    ]
    group = np.array([p for p, _ in options], dtype=np.int64)
    # How far joints move from the end of each walk to the start of each other, each moved on by the
    # full turns that suit the two best.
    starts, ends = (np.array([walk.q[row] for _, walk in options]) for row in (0, -1))
    low, high = _turns(robot, [walk for _, walk in options])
    gap = starts[None] - ends[:, None]
    turns = np.clip(np.round(-gap / TURN), low[None] - high[:, None], high[None] - low[:, None])
    moves = np.abs(gap + TURN * turns) * in_radians(robot)
    largest, total = moves.max(axis=2, initial=0.0), moves.sum(axis=2)
    own = [np.flatnonzero(group == p) for p in range(len(choices))]
    patches = range(len(own))
    if len(own) <= MOST_EXACT:  # of two opposite orders one will do: walks can be reversed
        orders = [list(order) for order in permutations(patches) if order[0] >= order[-1]]
    else:
        apart = np.array([[largest[np.ix_(a, b)].min() for b in own] for a in own])
        orders = [improved(apart, np.array(patches)).tolist()]
    layers = [[own[p] for p in order] for order in orders]
    path = _least_path(largest, total, layers, AS_GOOD)
    return group[path].tolist(), _unwound(robot, [options[k][1] for k in path])


def straight_moves(robot: Robot, walks: Sequence[Walk]) -> list[Reconfiguration]:
    """From the end of each walk to the start of the next one."""
    return [
        Reconfiguration(robot.joint_names, robot.prismatic, a.q[-1], b.q[0])
        for a, b in pairwise(walks)
    ]


def _turns(robot: Robot, walks: Sequence[Walk]) -> tuple[Array, Array]:
    """(S, n) fewest and most full turns that each joint of each walk can be moved on by."""
    fewest, most = zip(*(turns_inside(robot, walk.q) for walk in walks), strict=True)
    return np.array(fewest), np.array(most)


def _least_path(
    largest: Array, total: Array, orders: Sequence[Sequence[Ints]], as_good: float
) -> list[int]:
    """One option of each layer: the least sum, of those whose largest move is about the least.

    From each option to each other there are the largest move and what is summed (S, S); the orders
    are of layers of options, and `as_good` times the least is about the least.
    """
    most = min(_through(largest, layers, np.maximum)[0] for layers in orders)
    allowed = np.where(largest <= as_good * most + SLACK, total, np.inf)
    return min(_through(allowed, layers, np.add) for layers in orders)[1]


def _through(
    cost: Array, layers: Sequence[Ints], combine: Callable[[Array, Array], Array]
) -> tuple[float, list[int]]:
    """The least combined cost of a path with one option of each layer in turn, and that path."""
    best, came = np.zeros(len(layers[0])), []
    for before, after in pairwise(layers):
        total = combine(best[:, None], cost[np.ix_(before, after)])
        came.append(np.argmin(total, axis=0))
        best = total.min(axis=0)
    path = [int(np.argmin(best))]
    for choice in reversed(came):
        path.append(int(choice[path[-1]]))
    return float(best.min()), [
        int(layer[k]) for layer, k in zip(layers, reversed(path), strict=True)
    ]


def _unwound(robot: Robot, walks: Sequence[Walk]) -> list[Walk]:
    """The same walks, joints moved on by full turns so that each move is the least there is.

    Joints are independent of each other, and so are their turns.
    """
    count = len(walks)
    low, high = _turns(robot, walks)
    # A joint without limits never has to go further than this.
    low, high = np.maximum(low, -count), np.minimum(high, count)
    starts, ends = np.array([w.q[0] for w in walks]), np.array([w.q[-1] for w in walks])
    turns = np.zeros((count, robot.n))
    for j in range(robot.n):
        options = [
            (i, k)
            for i in range(count)
            for k in sorted(range(int(low[i, j]), int(high[i, j]) + 1), key=abs)
        ]
        walk, turn = np.array(options).T
        move = np.abs(
            (starts[walk, j] + TURN * turn)[None] - (ends[walk, j] + TURN * turn)[:, None]
        )
        fewest = move + SLACK * np.abs(turn)[:, None]  # of equal moves those with the fewest turns
        layers = [np.flatnonzero(walk == i) for i in range(count)]
        turns[:, j] = turn[_least_path(move, fewest, [layers], 1.0)]
    # Rounding must not move a joint past its limit.
    return [
        Walk(np.clip(w.q + TURN * t, robot.lower, robot.upper) if t.any() else w.q, w.cell)
        for w, t in zip(walks, turns, strict=True)
    ]
