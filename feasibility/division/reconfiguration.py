"""From one patch to the next: in which order, from which end, and how far the joints move.

A patch can be painted by several walks, each from either end, and a walk may be done a full turn
of a joint further on where the limits allow it. The order and the ends are chosen so that the
largest move of a joint is the least there is (a bottleneck travelling salesman, by dynamic
programming over subsets of patches; Held and Karp 1962). What comes within 2 per cent of that is
taken for as good, and of it the least sum over all joints.

The moves are straight lines in joint space, away from the surface. They stay inside the limits,
because limits are convex; nothing else is said of them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from feasibility.verdict import Walk
from robots import Robot

Floats = NDArray[np.float64]
TURN = 2.0 * np.pi
MOST_EXACT = 12  # patches up to which the best order is found; beyond, the nearest comes next
AS_GOOD = 1.02  # how much larger than the least the largest move may be
SLACK = 1e-9  # [rad] rounding in sums of turns
LEAST_TOLD = 0.05  # [deg], [0.1 mm]: smaller moves are not named


@dataclass(frozen=True, eq=False, slots=True)
class Reconfiguration:
    """The move from the end of one patch's walk to the start of the next one's."""

    joint_names: tuple[str, ...]
    prismatic: NDArray[np.bool_]
    """(n,) which joints slide."""
    start: Floats
    """(n,) rad or m."""
    end: Floats
    """(n,) rad or m."""

    @property
    def moves(self) -> Floats:
        """(n,) how far each joint moves, rad or m, with its sign."""
        return self.end - self.start

    def described(self, most: int | None = None) -> str:
        """The joints that move, the furthest first: 'shoulder_pan_joint by -352.1 deg, ...'.

        Args:
            most: how many are named, if not all; the others are counted.
        """
        shown = np.where(self.prismatic, 1e4 * self.moves, np.degrees(self.moves))
        parts = []
        for j in np.argsort(-np.abs(shown), kind="stable").tolist():
            if abs(shown[j]) >= LEAST_TOLD:
                value, unit = (0.1 * shown[j], "mm") if self.prismatic[j] else (shown[j], "deg")
                parts.append(f"{self.joint_names[j]} by {value:+.1f} {unit}")
        if most is not None and len(parts) > most + 1:
            parts[most:] = [f"{len(parts) - most} more"]
        return ", ".join(parts) or "no joint"


@dataclass(frozen=True, eq=False, slots=True)
class Itinerary:
    """Walks in the order in which they are done, and the moves between them."""

    order: tuple[int, ...]
    """Which patch comes when."""
    walks: tuple[Walk, ...]
    """One for each patch, in that order."""
    moves: tuple[Reconfiguration, ...]
    """From each walk to the next; one fewer than there are walks."""


def itinerary(robot: Robot, choices: Sequence[Sequence[Walk]]) -> Itinerary:
    """Choose for each patch one of its walks and its direction, and the order of patches.

    Args:
        robot: the arm.
        choices: for each patch the walks that paint it, one at least.
    """
    options = [
        (p, Walk(walk.q[::way], walk.cell[::way]))
        for p, walks in enumerate(choices)
        for walk in walks
        for way in (1, -1)
    ]
    group = np.array([p for p, _ in options], dtype=np.int64)
    costs = _costs(robot, [walk for _, walk in options], _joint_scale(robot))
    if len(choices) <= MOST_EXACT:
        path = _least_path(costs.largest, group, np.maximum)
        most = max((costs.largest[a, b] for a, b in pairwise(path)), default=0.0)
        allowed = costs.largest <= AS_GOOD * most + SLACK
        path = _least_path(np.where(allowed, costs.total, np.inf), group, np.add)
    else:
        path = _nearest_path(costs.largest, group)
    walks = _unwound(robot, [options[k][1] for k in path])
    moves = tuple(
        Reconfiguration(robot.joint_names, robot.prismatic, a.q[-1], b.q[0])
        for a, b in pairwise(walks)
    )
    return Itinerary(tuple(int(group[k]) for k in path), tuple(walks), moves)


def _joint_scale(robot: Robot) -> Floats:
    """(n,) what turns joint moves into radians: a slide counts as the turn that sweeps it."""
    reach = robot.reach if np.isfinite(robot.reach) and robot.reach > 0.0 else 1.0
    return np.where(robot.prismatic, 1.0 / reach, 1.0)


def _turns(robot: Robot, walk: Walk) -> tuple[Floats, Floats]:
    """(n,) fewest and most full turns that each joint of a walk can be moved on by."""
    with np.errstate(invalid="ignore"):
        low = np.ceil((robot.lower - walk.q.min(axis=0)) / TURN)
        high = np.floor((robot.upper - walk.q.max(axis=0)) / TURN)
    fixed = robot.prismatic
    # Rounding must not rule out the walk as it is.
    return np.where(fixed, 0.0, np.minimum(low, 0.0)), np.where(fixed, 0.0, np.maximum(high, 0.0))


class _Costs(NamedTuple):
    """(S, S) figures of the move from the end of each walk to the start of each other."""

    largest: Floats
    """The largest move of a joint, rad."""
    total: Floats
    """The sum over all joints, rad."""


def _costs(robot: Robot, walks: Sequence[Walk], scale: Floats) -> _Costs:
    """Moves between walks, each walk moved on by the full turns that suit the two best."""
    starts = np.array([walk.q[0] for walk in walks])
    ends = np.array([walk.q[-1] for walk in walks])
    low, high = (np.array(side) for side in zip(*(_turns(robot, w) for w in walks), strict=True))
    gap = starts[None] - ends[:, None]
    turns = np.clip(np.round(-gap / TURN), low[None] - high[:, None], high[None] - low[:, None])
    moves = np.abs(gap + TURN * turns) * scale
    return _Costs(np.max(moves, axis=2, initial=0.0), moves.sum(axis=2))


def _least_path(
    cost: Floats, group: NDArray[np.int64], combine: Callable[[Floats, Floats], Floats]
) -> list[int]:
    """One option of each group, in the order that has the least combined cost."""
    count = int(group.max()) + 1
    size = len(group)
    best = np.full((1 << count, size), np.inf)
    came = np.full((1 << count, size), -1, dtype=np.int64)
    best[1 << group, np.arange(size)] = 0.0
    for done in range(1, 1 << count):
        for p in range(count):
            rest = done & ~(1 << p)
            if rest == done or rest == 0:
                continue
            own = np.flatnonzero(group == p)
            total = combine(best[rest][:, None], cost[:, own])
            came[done, own] = np.argmin(total, axis=0)
            best[done, own] = total[came[done, own], np.arange(len(own))]
    done = (1 << count) - 1
    k = int(np.argmin(best[done]))
    path = [k]
    while came[done, k] >= 0:
        done, k = done & ~(1 << int(group[k])), int(came[done, k])
        path.append(k)
    return path[::-1]


def _nearest_path(cost: Floats, group: NDArray[np.int64]) -> list[int]:
    """From the first option always to the nearest one of a group that is not done."""
    path = [0]
    left = group != group[0]
    while left.any():
        path.append(int(np.argmin(np.where(left, cost[path[-1]], np.inf))))
        left &= group != group[path[-1]]
    return path


def _unwound(robot: Robot, walks: Sequence[Walk]) -> list[Walk]:
    """The same walks, joints moved on by full turns so that each move is the least there is.

    Joints are independent of each other, and so are their turns.
    """
    most = len(walks)
    low, high = (np.array(side) for side in zip(*(_turns(robot, w) for w in walks), strict=True))
    turns = np.zeros((len(walks), robot.n))
    for j in range(robot.n):
        # A joint without limits never has to go further than this.
        ks = [
            np.arange(max(low[i, j], -most), min(high[i, j], most) + 1) for i in range(len(walks))
        ]
        total = [(0.0, abs(float(k)) * SLACK) for k in ks[0]]
        came: list[list[int]] = []
        for i in range(1, len(walks)):
            gap = walks[i].q[0, j] - walks[i - 1].q[-1, j]
            move = np.abs(gap + TURN * (ks[i][None] - ks[i - 1][:, None]))
            ranked = [
                min(
                    (max(t[0], m), t[1] + m, a)
                    for a, (t, m) in enumerate(zip(total, column, strict=True))
                )
                for column in move.T.tolist()
            ]
            came.append([a for _, _, a in ranked])
            total = [(worst, path) for worst, path, _ in ranked]
        k = min(range(len(total)), key=lambda k: total[k])
        for i in range(len(walks) - 1, -1, -1):
            turns[i, j] = ks[i][k]
            k = came[i - 1][k] if i else k
    # Rounding must not carry a joint over its limit.
    return [
        Walk(np.clip(w.q + TURN * t, robot.lower, robot.upper) if t.any() else w.q, w.cell)
        for w, t in zip(walks, turns, strict=True)
    ]
