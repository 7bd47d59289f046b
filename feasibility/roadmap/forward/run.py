"""A run of a toolpath: from the first pose to the last in one motion, and never back.

The complete search joins configurations whichever way the tool goes between poses. Where one
component covers all poses there may still be no run in order: the motion may have to go back to
where it can change its posture.

Nodes over one pose are a layer. A motion of the roadmap leads from a layer to the next, or stays in
one; so a run in order is a path through the layers. The one with the fewest changes of posture in
place is taken, and among those one with the fewest waypoints. Where there is none, more is tried
from the furthest pose that a run reaches: other configurations over it and over the poses before
it, by self-motions of what a run reaches there, each followed ahead as far as it goes.
"""

from __future__ import annotations

import heapq
from typing import NamedTuple

import numpy as np

from coverable_arrays import Array, Mask
from feasibility.roadmap.expansion import CONNECT_STEPS
from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.graph import (
    EDGES,
    HEAD,
    NODES,
    TAIL,
    WAYPOINTS,
    Roadmap,
    add_edge,
    add_node,
    nodes_over,
    root_of,
    unite,
)
from feasibility.roadmap.motions import MOST_STEPS, connect, look_at, track
from feasibility.roadmap.walk import route_walk
from feasibility.verdict import Cause, CauseKind, Walk
from robots import Kinematics, Robot

CHANGE_COST = 1e6  # [waypoints] that a change of posture in place counts as
IDLE_ROUNDS = 8  # rounds without gain after which no run is found
MOST_ROUNDS = 60
BACK = (0, 1, 2, 4, 8, 16, 32, 64)  # poses before the furthest over which is looked in a round
SEEDS = 8  # guesses over the first pose, each round
JOINED = 2  # nodes over each pose that a motion ahead tries to join


class OrderedRun(NamedTuple):
    """What was found of a run in order."""

    walk: Walk | None
    """From the first pose to the last; None where no run gets there."""
    furthest: int
    """The last pose that a run reaches."""
    rounds: int
    """How often more was tried."""

    def covered(self, poses: int) -> Mask:
        """(poses,) those that the run passes."""
        return np.arange(poses) <= self.furthest

    def failed_words(self, poses: int) -> str:
        """What was tried in vain."""
        return (
            f"One motion reaches all {poses} poses, but none was found that runs them in order, "
            f"without going back: the best run ends over pose {self.furthest}, where the arm can "
            f"neither go on nor change its posture in place ({self.rounds} rounds of other "
            "configurations were tried)."
        )

    def causes(self, poses: int) -> tuple[Cause, ...]:
        """Why the poses behind the furthest are missed."""
        detail = (
            f"reached only by going back: runs in order end over pose {self.furthest}, where the "
            "arm cannot change its posture in place"
        )
        missed = range(self.furthest + 1, poses)
        return tuple(Cause(pose, CauseKind.DISCONNECTED, False, detail) for pose in missed)


class Layers(NamedTuple):
    """How far a run from the first pose gets."""

    ahead: frozenset[int]
    """Nodes that a run reaches."""
    furthest: int
    """The last pose that a run reaches; -1 where there is none over the first."""
    start: int
    """The node at which the best run to that pose begins, -1 where there is none."""
    route: tuple[int, ...]
    """Its edges, + 1, negative where one is run backwards."""


def run_in_order(exploration: Exploration) -> OrderedRun:
    """The run that gets furthest; more is tried where it does not reach the last pose.

    Raises:
        OutOfTime: the deadline passed.
    """
    last = len(exploration.cells) - 1
    best, rounds, idle = _layers(exploration), 0, 0
    while best.furthest < last and idle < IDLE_ROUNDS and rounds < MOST_ROUNDS:
        rounds += 1
        _try_more(exploration, best)
        found = _layers(exploration)
        idle = 0 if found.furthest > best.furthest else idle + 1
        best = found
    walk = None
    if best.furthest == last:
        walk = route_walk(exploration.roadmap, best.start, np.array(best.route, dtype=np.int64))
    return OrderedRun(walk, best.furthest, rounds)


def changes_in_place(robot: Robot, targets: Array, walk: Walk, near: float) -> int:
    """How often a motion, marked at the poses, changes its posture over a pose.

    Args:
        robot, walk: the arm and its motion.
        targets: (N, 3) m, of the poses.
        near: m, how near to a target the tool point is over it.
    """
    marks = np.flatnonzero(walk.cell >= 0)
    points, _ = Kinematics(robot).tools(walk.q)
    section = np.searchsorted(marks, np.arange(len(walk.q)))
    ahead = walk.cell[marks[np.minimum(section, len(marks) - 1)]]
    over = np.linalg.norm(points - targets[ahead], axis=1) <= near
    apart = np.linalg.norm(np.diff(targets, axis=0, prepend=np.nan), axis=1)
    turns = apart <= 2.0 * near  # it turns on the spot from the pose before: that is no change
    still = over[1:] & over[:-1] & (ahead[1:] == ahead[:-1]) & ~turns[ahead[1:]]
    return len(np.unique(ahead[1:][still]))


def _layers(exploration: Exploration) -> Layers:
    """How far runs get, from the arm's start where it has one."""
    begun = exploration.begun
    return layers_of(exploration.roadmap, None if begun is None else int(begun[0]))


def layers_of(roadmap: Roadmap, begin: int | None = None) -> Layers:
    """The best run from the first pose to the last one that any run reaches.

    Args:
        roadmap: the roadmap.
        begin: the node that it has to begin at; any over the first pose by default.
    """
    cell = roadmap.cell[: roadmap.counters[NODES]].tolist()
    steps = _steps(roadmap, cell)
    starts = [x for x, over in enumerate(cell) if over == 0] if begin is None else [begin]
    cost, came = _cheapest(starts, steps)
    if not cost:
        return Layers(frozenset(), -1, -1, ())
    end = min(cost, key=lambda x: (-cell[x], cost[x]))
    route, here = list[int](), end
    while here in came:
        edge, here = came[here]
        route.append(edge)
    return Layers(
        ahead=frozenset(cost),
        furthest=cell[end],
        start=here,
        route=tuple(reversed(route)),
    )


def _steps(roadmap: Roadmap, cell: list[int]) -> list[list[tuple[int, int, float]]]:
    """From each node those it leads to: the signed edge + 1, the node, and what it costs."""
    found: list[list[tuple[int, int, float]]] = [[] for _ in cell]
    count = roadmap.counters[EDGES]
    rows = roadmap.edge_rows[:count, 1].tolist()
    for edge, (x, y) in enumerate(roadmap.ends[:count].tolist()):
        cost = rows[edge] + (CHANGE_COST if cell[x] == cell[y] else 0.0)
        if cell[y] - cell[x] in (0, 1):
            found[x].append((edge + 1, y, cost))
        if cell[x] - cell[y] in (0, 1):
            found[y].append((-edge - 1, x, cost))
    return found


def _cheapest(
    starts: list[int], steps: list[list[tuple[int, int, float]]]
) -> tuple[dict[int, float], dict[int, tuple[int, int]]]:
    """Of all nodes that are reached the least cost, and the last step there."""
    cost = dict.fromkeys(starts, 0.0)
    came: dict[int, tuple[int, int]] = {}
    queue = [(0.0, x) for x in starts]
    done = np.zeros(len(steps), dtype=bool)
    while queue:
        spent, x = heapq.heappop(queue)
        if done[x]:
            continue
        done[x] = True
        for edge, y, more in steps[x]:
            if spent + more < cost.get(y, np.inf):
                cost[y] = spent + more
                came[y] = edge, x
                heapq.heappush(queue, (spent + more, y))
    return cost, came


def _try_more(exploration: Exploration, best: Layers) -> None:
    """One round: new configurations over the last poses that a run reaches, followed ahead."""
    exploration.tick("looking for a run in order")
    known = int(exploration.roadmap.counters[NODES])
    exploration.add_seeds(0, exploration.guesses(SEEDS))
    for cell in sorted({max(best.furthest - back, 0) for back in BACK}):
        exploration.explore_self_motions(cell)
    ahead = _layers(exploration).ahead
    for node in range(known, int(exploration.roadmap.counters[NODES])):
        if node in ahead:
            exploration.tick("looking for a run in order")
            _follow(exploration, node, len(exploration.cells))


def _follow(exploration: Exploration, node: int, poses: int) -> None:
    """Lead a node ahead from pose to pose, as far as it goes or until it joins what is known."""
    while exploration.roadmap.cell[node] < poses - 1:
        cell = int(exploration.roadmap.cell[node]) + 1
        q = exploration.roadmap.q[node].copy()
        roadmap, curve = exploration.reserve(MOST_STEPS + 1), exploration.curve(cell - 1, cell)
        rows = track(
            exploration.arrays, exploration.work, curve, 0.0, 1.0, q, q, False,
            roadmap.waypoints, roadmap.counters[WAYPOINTS],
        )  # fmt: skip
        if rows < 0:
            return
        over = nodes_over(roadmap, cell)
        component = int(root_of(roadmap, roadmap.component[node]))
        new = int(add_node(exploration.arrays, exploration.work, roadmap, cell, q, component))
        add_edge(roadmap, node, new, rows)
        # It need not be spread: it is followed here.
        roadmap.counters[HEAD] = roadmap.counters[TAIL] = 0
        _join(exploration, new, over)
        node = new


def _join(exploration: Exploration, new: int, over: list[int]) -> None:
    """Join a new node with the nearest known ones over its pose, where a self-motion does."""
    q = exploration.roadmap.q[new].copy()
    over = sorted(over, key=lambda x: float(np.abs(exploration.roadmap.q[x] - q).sum()))
    for other in over[:JOINED]:
        roadmap = exploration.reserve(int(CONNECT_STEPS) + 1)
        arrays, cell = exploration.arrays, roadmap.cell[new]
        here = q.copy()
        look_at(arrays, exploration.work, cell)
        rows, reached = connect(
            arrays, exploration.work, here, roadmap.q[other], roadmap.waypoints,
            roadmap.counters[WAYPOINTS], CONNECT_STEPS,
        )  # fmt: skip
        if reached:
            add_edge(roadmap, new, other, rows)
            unite(roadmap, roadmap.component[new], roadmap.component[other])
