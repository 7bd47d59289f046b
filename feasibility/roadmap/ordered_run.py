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

from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Mask
from feasibility.problem import Problem
from feasibility.roadmap.connecting import explore_self_motions
from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.graph import Roadmap
from feasibility.roadmap.walk import route_walk
from feasibility.search_result import SearchResult
from feasibility.verdict import Cause, CauseKind, Walk
from robots.kinematics import Kinematics
from robots.robot import Robot

IN_PLACE = 0.1  # [1] share of the tolerance within which a tool point stays over a pose
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

    def added_to(
        self, found: SearchResult, problem: Problem, exploration: Exploration
    ) -> SearchResult:
        """What was found of a toolpath, all of whose poses one component covers, with the run."""
        total, walk = len(problem.cells), self.walk
        counts = {**found.counts, "fk": int(exploration.work.counts[0])}
        if walk is None:
            return replace(
                found, counts=counts, covered=self.covered(total), unfinished="",
                exhausted=self.failed_words(total), make_causes=lambda: self.causes(total),
            )  # fmt: skip
        near = IN_PLACE * problem.task.effective_tolerance
        counts["in_place"] = changes_in_place(problem.robot, exploration.arrays.points, walk, near)
        return replace(
            found, counts=counts, start=0, motion=walk, replay=partial(problem.replayed, walk),
            accepted=f"One motion of {{waypoints}} waypoints runs the {total} poses in order, "
            f"without going back; {counts['in_place']} times it changes the posture in place. "
            f"Pinocchio's replay holds it {problem.within}, between waypoints too.",
        )  # fmt: skip


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
        walk = route_walk(exploration.roadmap, best.start, best.route)
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
    return layers_of(exploration.roadmap, exploration.begun)


def layers_of(roadmap: Roadmap, begin: int | None = None) -> Layers:
    """The best run from the first pose to the last one that any run reaches.

    Args:
        roadmap: the roadmap.
        begin: the node that it has to begin at; any over the first pose by default.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import dijkstra

    cell, steps = roadmap.cell, steps_ahead(roadmap)
    starts = roadmap.over[0] if begin is None else [begin]
    if not starts:
        return Layers(frozenset(), -1, -1, ())
    ends = np.array(list(steps), dtype=np.int64).reshape(-1, 2).T
    costs = [cost for cost, _ in steps.values()]
    graph = coo_array((costs, (ends[0], ends[1])), shape=(len(cell), len(cell))).tocsr()
    cost, before, _ = dijkstra(graph, indices=starts, return_predecessors=True, min_only=True)
    ahead = np.flatnonzero(np.isfinite(cost)).tolist()
    end = min(ahead, key=lambda node: (-cell[node], cost[node]))
    route, here = list[int](), end
    while before[here] >= 0:
        there, here = here, int(before[here])
        route.append(steps[here, there][1])
    return Layers(
        ahead=frozenset(ahead), furthest=cell[end], start=here, route=tuple(reversed(route))
    )


def steps_ahead(roadmap: Roadmap) -> dict[tuple[int, int], tuple[float, int]]:
    """From one node to another, by the cheapest edge: what it costs, and the signed edge + 1."""
    found: dict[tuple[int, int], tuple[float, int]] = {}
    cell = roadmap.cell
    for edge, (x, y, motion) in enumerate(roadmap.edges):
        cost = len(motion) + (CHANGE_COST if cell[x] == cell[y] else 0.0)
        for step, signed in (((x, y), edge + 1), ((y, x), -edge - 1)):
            if cell[step[1]] - cell[step[0]] in (0, 1):
                found[step] = min(found.get(step, (np.inf, 0)), (cost, signed))
    return found


def _try_more(exploration: Exploration, best: Layers) -> None:
    """One round: new configurations over the last poses that a run reaches, followed ahead."""
    exploration.tick("looking for a run in order")
    known = len(exploration.roadmap.cell)
    exploration.add_seeds(0, exploration.guesses(SEEDS))
    for cell in sorted({max(best.furthest - back, 0) for back in BACK}):
        explore_self_motions(exploration, cell)
    ahead = _layers(exploration).ahead
    for node in range(known, len(exploration.roadmap.cell)):
        if node in ahead:
            exploration.tick("looking for a run in order")
            _follow(exploration, node, len(exploration.cells))


def _follow(exploration: Exploration, node: int, poses: int) -> None:
    """Lead a node ahead from pose to pose, as far as it goes or until it joins what is known."""
    roadmap, grower = exploration.roadmap, exploration.grower
    while roadmap.cell[node] < poses - 1:
        cell = roadmap.cell[node] + 1
        motion = grower.track(exploration.curve(cell - 1, cell), (0.0, 1.0), roadmap.q[node])
        if motion is None:
            return
        q = motion[-1]
        near = sorted(roadmap.over[cell], key=lambda x: float(np.abs(roadmap.q[x] - q).sum()))
        new = grower.add_node(cell, q, roadmap.root_of(node))
        roadmap.add_edge(node, new, motion)
        roadmap.queue.clear()  # it need not be spread: it is followed here
        for other in near[:JOINED]:
            motion, reached = grower.connect(cell, q, roadmap.q[other])
            if reached:
                roadmap.add_edge(new, other, motion)
        node = new
