"""What motions hold together at a speed, or at a distance from singularities; the verdict there.

A motion that is too slow somewhere joins nothing: components fall apart into what the others join.
The best motion over most cells is one through such a component, the largest speed the one up to
which a component has all cells.

A verdict has a motion that covers everything; the question is whether one does so at the speed.
Where the known one is too slow, motions that hold the speed are put together anew, from all that
are known and more that are made. What is found is replayed like any motion. That nothing is found
proves nothing: the answer is undecided then.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from coverable.arrays import Mask
from coverable.errors import at_least, counted
from feasibility.certification.rate_replay import RateReplay, replay_rates
from feasibility.clock import Clock, OutOfTime
from feasibility.demands.every_demand import required_words
from feasibility.demands.motion_rates import Edge, RatedGraph, grow, rated_graph, replay_at_rates
from feasibility.paths.motion_graph import MotionGraph
from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.graph import Roadmap
from feasibility.roadmap.ordered_run import layers_of
from feasibility.roadmap.walk import covering_walk, route_walk
from feasibility.task import Task
from feasibility.verdict import (
    Answer,
    Cause,
    CauseKind,
    Certificate,
    Evidence,
    Verdict,
    Walk,
    deferred,
)
from surfaces.adjacency import components

FEW = 5  # cells that are named


def best_motion(rated: RatedGraph, edges: Sequence[Edge]) -> tuple[Mask, Callable[[], Walk]]:
    """The cells (N,) that a motion made of some can visit at most, and what makes that motion.

    It begins at the arm's start, where it has one; cells that have an order are visited in it.
    """
    cells, begin = len(rated.cells), rated.begin
    roadmap = roadmap_of(rated.graph, range(len(rated.graph.cell)), edges, cells)
    if rated.cells.in_order:
        run = layers_of(roadmap, begin)
        over = np.arange(cells) <= run.furthest
        return over, lambda: route_walk(roadmap, run.start, run.route)
    root = roadmap.largest if begin is None else roadmap.root_of(begin)
    return roadmap.cover[root], lambda: covering_walk(roadmap, root, begin)


def roadmap_of(
    graph: MotionGraph, nodes: Iterable[int], edges: Sequence[Edge], cells: int
) -> Roadmap:
    """A roadmap of some nodes, numbered in this order, and motions between them.

    Each connected part is a component, and no node is queued.
    """
    number = {node: k for k, node in enumerate(nodes)}
    ends = np.array([(number[x], number[y]) for x, y in edges], dtype=np.int64).reshape(-1, 2)
    part = components(ends, len(number)).tolist()
    roadmap = Roadmap(cells)
    for _ in range(max(part, default=-1) + 1):
        roadmap.add_component()
    for node, root in zip(number, part, strict=True):
        q = graph.q[node]
        roadmap.add_node(graph.cell[node], q, np.zeros_like(q), root)
    for x, y in edges:
        roadmap.add_edge(number[x], number[y], graph.motion(x, y)[1:])
    roadmap.largest = int(np.argmax([*roadmap.size, 0]))
    roadmap.queue.clear()
    return roadmap


def keep_fast_motions(exploration: Exploration, task: Task) -> dict[int, Cause]:
    """Leave only motions in a search that hold what a task requires, and only cells that they join.

    A cell to which no such motion leads is in no component any more: that the arm can hold still
    over it is not enough. A single cell is kept where there is nothing else.

    Returns:
        Cells that lose their last component, and why.
    """
    reached, cells, roadmap = exploration.reached, len(exploration.cells), exploration.roadmap
    graph = MotionGraph.of(exploration.arrays, exploration.work, exploration.cells)
    for edge, (x, y, _) in enumerate(roadmap.edges):
        motion = roadmap.motion(edge)
        ends = graph.node(roadmap.cell[x], motion[0]), graph.node(roadmap.cell[y], motion[-1])
        graph.join(*ends, motion)
    rated, cell = RatedGraph(exploration.robot, exploration.cells, task, graph), graph.cell
    with suppress(OutOfTime):
        grow(rated, exploration.clock)
    pairs, over = np.array(rated.enough, dtype=np.int64).reshape(-1, 2), np.array(cell)
    if cells > 1:  # without parts over one cell alone
        part = components(pairs, len(cell))[pairs[:, 0]]
        pairs = pairs[np.isin(part, part[over[pairs[:, 0]] != over[pairs[:, 1]]])]
    edges = [(x, y) for x, y in pairs.tolist()]
    exploration.roadmap = roadmap_of(graph, np.unique(pairs).tolist(), edges, cells)
    lost = np.flatnonzero(reached & ~exploration.reached).tolist()
    best = rated.fastest_to_cells((x, y) for x, y in rated.rated if cell[x] != cell[y])
    kind, none = CauseKind.DISCONNECTED, "no motion leads to it"
    return {c: Cause(c, kind, False, rated.fault(best[c]) if c in best else none) for c in lost}


@dataclass(frozen=True, eq=False, slots=True)
class RateFigures:
    """What the motions of a feasible verdict allow."""

    witness: RateReplay
    """Of the covering motion itself."""
    largest: float
    """m/s, the largest speed that a motion over all cells is known to hold."""


def rate_figures(
    verdict: Verdict, clock: Clock | None = None, more: bool = True
) -> RateFigures | None:
    """Look for the largest speed, as long as there is time; None where the verdict has no motion.

    Where the joints have no velocity limits, it is inf. Motions beyond those of the verdict are
    tried where `more` is wanted, as `check` does at a speed.
    """
    if verdict.witness is None or not len(verdict.cells):
        return None
    free = replace(verdict.task, speed=None, min_manipulability=None)
    replayed = replay_rates(verdict.robot, verdict.cells, free, verdict.witness, closely=True)
    if not np.isfinite(replayed.speed):
        return RateFigures(replayed, replayed.speed)
    rated = rated_graph(replace(verdict, task=free))
    with suppress(OutOfTime):
        if more:
            grow(rated, Clock() if clock is None else clock)
    return RateFigures(replayed, max(replayed.speed, largest_speed(rated)))


def largest_speed(rated: RatedGraph) -> float:
    """m/s, the largest speed that a motion over all cells allows; 0 where there is no motion."""
    sigma = rated.task.min_manipulability or -np.inf
    speeds = np.unique([r.speed for r in rated.rated.values() if r.sigma >= sigma]).tolist()
    possible = bisect_left(
        speeds, True, key=lambda v: not best_motion(rated, rated.holding(v))[0].all()
    )
    return float(speeds[possible - 1]) if possible else 0.0


def at_rates(verdict: Verdict, clock: Clock) -> Verdict:
    """The verdict at the speed, or the same where it is not feasible or no speed is required."""
    task, walk = verdict.task, verdict.witness
    if not task.requires_rates or not verdict.feasible or walk is None or not len(verdict.cells):
        return verdict
    replayed = replay_rates(verdict.robot, verdict.cells, task, walk)
    if replayed.accepted:
        return _accepted(verdict, walk, verdict.certificate, "")
    rated, late = rated_graph(verdict), ""
    covered, made = best_motion(rated, rated.enough)
    try:
        if not covered.all():
            with clock.enforced():
                grow(rated, clock)
            covered, made = best_motion(rated, rated.enough)
    except OutOfTime:
        late = " The time limit ran out before all that might be faster was tried."
    if covered.all():
        other = made()
        every = np.ones(len(verdict.cells), dtype=bool)
        certificate, refusal = replay_at_rates(verdict.robot, verdict.cells, task, other, every)
        if not refusal:
            note = " It is not the first motion that was found."
            return _accepted(verdict, other, certificate, note)
    return _not_found(verdict, rated, replayed, covered, late)


def _accepted(verdict: Verdict, walk: Walk, certificate: Certificate | None, note: str) -> Verdict:
    """The verdict with a motion that is fast enough, and what the judge measured of it."""
    task = verdict.task
    replayed = replay_rates(verdict.robot, verdict.cells, task, walk, closely=True)
    places = [stop.cell for stop in replayed.stops if stop.why == "in place"]
    corners = len(replayed.stops) - len(places)
    words = ""
    if task.speed is not None:
        waits = f"{counted(len(places), 'wait')} in place"
        if places:
            unique = list(dict.fromkeys(places))
            waits += f" at cell{'s' if len(unique) > 1 else ''} {verdict.cells.named(unique, FEW)}"
            waits += f", {replayed.waiting:.2g} s together,"
        stops = f", but for {waits} and {counted(corners, 'corner')}"
        words = (
            f" The tool can have {task.speed:g} m/s all along it inside the joints' velocities"
            f"{stops if replayed.stops else ''}."
        )
    if task.min_manipulability is not None:
        words += f" Its smallest singular value is at least {at_least(replayed.sigma, 3)}."
    fast = task.speed is not None
    kept = certificate and replace(
        certificate,
        max_speed=replayed.speed if fast and np.isfinite(replayed.speed) else None,
        min_singular_value=None if task.min_manipulability is None else replayed.sigma,
        stops_in_place=len(places) if fast else None,
        corners=corners if fast else None,
    )
    message = verdict.message
    if note and verdict.certificate is not None:
        old, new = f"{verdict.certificate.waypoints} waypoints", f"{len(walk.q)} waypoints"
        message = message.replace(old, new, 1)
    start = int(walk.cell[0])
    return replace(
        verdict, witness=walk, certificate=kept, message=message + words + note,
        start=start if start >= 0 else verdict.start,
    )  # fmt: skip


def _not_found(
    verdict: Verdict, rated: RatedGraph, replayed: RateReplay, reached: Mask, late: str
) -> Verdict:
    """Undecided: what is wrong with the motion that is known, and how much is possible."""
    task, total = verdict.task, len(verdict.cells)
    best = largest_speed(rated)
    message = (
        f"One continuous motion covers every cell, but none was found that does so "
        f"{required_words(task)}: on the one that is known {replayed.refusal}. "
        f"The best of those known covers {int(reached.sum())} of {total} cells."
    )
    if task.speed is not None and best > 0.0:
        message += f" All of them can be covered at {best:.3g} m/s."
    return replace(
        verdict, answer=Answer.UNDECIDED, evidence=Evidence.BUDGET, message=message + late,
        covered=reached, witness=None, certificate=None,
        causes=deferred(lambda: _causes(rated, reached)),
    )  # fmt: skip


def _causes(rated: RatedGraph, reached: Mask) -> tuple[Cause, ...]:
    """Why cells are missed: what the best motion to each that is not fast enough would need."""
    enough = set(rated.enough)
    best = rated.fastest_to_cells(edge for edge in rated.rated if edge not in enough)
    kind, found = CauseKind.DISCONNECTED, list[Cause]()
    for cell in np.flatnonzero(~reached).tolist():
        detail = "the motions to it are as required, but not connected to the best one"
        if cell in best:
            detail = rated.fault(best[cell], f" at cell {list(rated.cells.unravel(cell))}")
        found.append(Cause(cell, kind, False, detail))
    return tuple(found)
