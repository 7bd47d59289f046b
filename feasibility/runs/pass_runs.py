"""Passes that no single motion runs: cut where they cannot be run, with the cause of each cut."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from feasibility.certification import replay
from feasibility.clock import Clock, OutOfTime
from feasibility.division import (
    Reconfiguration,
    clear_moves,
    collect_components,
    connect_pairs,
)
from feasibility.paths import CoveragePath, figures_of
from feasibility.problem import Problem
from feasibility.roadmap import (
    EDGES,
    NODES,
    Exploration,
    arrays_of,
    explore,
    route_walk,
    warm_up,
)
from feasibility.roadmap.joint_boxes import blockers_of
from feasibility.runs.fewest import Stations, Way, fewest_ways
from feasibility.runs.stopping import Stop, where_it_stops
from feasibility.task import Task
from robots import Robot
from surfaces.passes import PassPlaces
from surfaces.toolpaths import PoseCells


@dataclass(frozen=True, eq=False, slots=True)
class Cut:
    """Where the tool has to be lifted, and the arm to take another configuration."""

    pose: int
    """The last pose of the run that ends here."""
    next_pose: int
    """The first pose of the next run: the same one, or one further on."""
    stretch: int
    """Which stretch of a pass the run ends on; -1 on the way between two."""
    along: float
    """m, from the beginning of that stretch."""
    cause: str
    """Why no known configuration goes on: what stops it, and where."""
    move: Reconfiguration
    """From the last configuration of one run to the first of the next."""


@dataclass(frozen=True, eq=False, slots=True)
class PassRuns:
    """Passes in as few runs as the configurations known allow."""

    robot: Robot
    task: Task
    places: PassPlaces
    runs: tuple[CoveragePath, ...]
    """One certified motion each, in order."""
    cuts: tuple[Cut, ...]
    """Between one run and the next."""
    left_out: float
    """m, of passes that no run covers."""
    refusals: tuple[str, ...]
    """What the independent replay says against runs that were left out for it."""

    def stretches_of(self, run: CoveragePath) -> list[int]:
        """The stretches that a run works on, in order."""
        own = self.places.stretch[run.needed]
        return list(dict.fromkeys(own[own >= 0].tolist()))


def pass_runs(
    robot: Robot,
    cells: PoseCells,
    task: Task,
    places: PassPlaces,
    seed: int = 0,
    clock: Clock | None = None,
) -> PassRuns:
    """Run passes in the fewest motions that the configurations found allow.

    As little as can be is left out; then the motions are as few as can be, over the configurations
    that the search finds, and cut between passes rather than inside one.

    Args:
        robot: the arm.
        cells: the poses of all passes, of `surfaces.passes.pass_toolpath`.
        task: standoff, cone and so on.
        places: the same poses, with their stretches.
        seed: of the search.
        clock: its time limit counts.

    Raises:
        OutOfTime: the time ran out before the search began.
    """
    clock = Clock() if clock is None else clock
    warm_up()
    clock.start()
    with clock.enforced():
        arrays = arrays_of(robot, cells, task)
    blockers = blockers_of(robot, cells.surface, task)
    exploration = Exploration(robot, cells, arrays, seed, clock, blockers)
    try:
        explore(exploration)
        collect_components(exploration)
        everywhere = np.ones(len(cells), dtype=bool)
        for root in exploration.roots():
            connect_pairs(exploration, root, everywhere & exploration.covers(root))
    except OutOfTime:
        pass  # what was found until then counts
    exploration.clock = Clock()
    stations = _stations(exploration, places)
    found = _replayed(exploration, task, fewest_ways(stations))
    worked = np.zeros(len(stations.pieces), dtype=bool)
    for path in found.runs:
        own = np.flatnonzero(path.needed)
        worked[own[0] : own[-1]] = True
    return PassRuns(
        robot=robot,
        task=task,
        places=places,
        runs=tuple(found.runs),
        cuts=_cuts(exploration, task, places, found.runs),
        left_out=float(stations.pieces[~worked].sum()),
        refusals=found.refusals,
    )


class _Replayed(NamedTuple):
    """Ways as certified paths."""

    runs: list[CoveragePath]
    refusals: tuple[str, ...]


def _stations(exploration: Exploration, places: PassPlaces) -> Stations:
    """What a search found, as stations along the toolpath."""
    roadmap = exploration.roadmap
    over = np.array(roadmap.cell[: roadmap.counters[NODES]])
    count = int(roadmap.counters[EDGES])
    ends, rows = roadmap.ends[:count], roadmap.edge_rows[:count, 1]
    number = np.arange(1, count + 1)
    there = np.column_stack([ends, number, rows])
    back = np.column_stack([ends[:, ::-1], -number, rows])
    steps = np.concatenate([there, back]).astype(np.int64)
    ahead = over[steps[:, 1]] - over[steps[:, 0]]
    same = places.stretch[1:] == places.stretch[:-1]
    inside = same & (places.stretch[1:] >= 0)
    lengths = np.linalg.norm(np.diff(places.points, axis=0), axis=1)
    return Stations(over, steps[(ahead == 0) | (ahead == 1)], lengths * inside, inside)


def _replayed(exploration: Exploration, task: Task, ways: Sequence[Way]) -> _Replayed:
    """The ways that the independent replay accepts."""
    robot, cells = exploration.robot, exploration.cells
    runs, refusals = list[CoveragePath](), list[str]()
    for way in ways:
        walk = route_walk(exploration.roadmap, way.nodes[0], np.array(way.route, dtype=np.int64))
        needed = np.zeros(len(cells), dtype=bool)
        needed[walk.cell[walk.cell >= 0]] = True
        judged = replay(robot, cells, task, walk, needed)
        if not judged.accepted:
            refusals.append(judged.refusal)
            continue
        certificate = judged.certificate
        figures = figures_of(robot, cells, task, walk, certificate, needed)
        runs.append(CoveragePath(robot, cells, task, "given", needed, walk, certificate, figures))
    return _Replayed(runs, tuple(refusals))


def _cuts(
    exploration: Exploration, task: Task, places: PassPlaces, runs: Sequence[CoveragePath]
) -> tuple[Cut, ...]:
    """What lies between the runs."""
    robot, cells = exploration.robot, exploration.cells
    pairs = Problem.of(robot, cells, task).pairs
    moves = [
        Reconfiguration(robot.joint_names, robot.prismatic, a.walk.q[-1], b.walk.q[0])
        for a, b in pairwise(runs)
    ]
    clear = clear_moves(robot, cells, task, exploration.arrays.collisions, moves)
    found = []
    for before, after, move in zip(runs, runs[1:], clear, strict=False):
        pose, following = int(before.visits[-1]), int(after.visits[0])
        stop = where_it_stops(exploration, pose, move.start, pairs)
        found.append(
            Cut(
                pose=pose,
                next_pose=following,
                stretch=int(places.stretch[pose]),
                along=_along(places, pose),
                cause=_cause_words(places, stop),
                move=move,
            )
        )
    return tuple(found)


def _along(places: PassPlaces, pose: int) -> float:
    """m, from the beginning of the stretch that a pose belongs to."""
    first = int(np.flatnonzero(places.stretch == places.stretch[pose])[0])
    return float(np.linalg.norm(np.diff(places.points[first : pose + 1], axis=0), axis=1).sum())


def _cause_words(places: PassPlaces, stop: Stop) -> str:
    """What stops an arm that goes on, and where."""
    if not stop.cause:
        return "another configuration gets further"
    stretch = int(places.stretch[stop.pose])
    where = (
        "on the way to the next pass"
        if stretch < 0
        else (f"{1e3 * _along(places, stop.pose):.0f} mm along stretch {stretch + 1}")
    )
    return f"{stop.cause} {where}"
