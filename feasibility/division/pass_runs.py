"""Passes that no single motion runs: cut where they cannot be run, with the cause of each cut.

A roadmap has nodes over the poses of the passes; a certified motion leads from a node to another
over the same pose or the next one. The tool may be lifted at any pose and set down at another node
over it, which is an interruption, and between two poses it may stay lifted, which leaves the piece
between them undone. The best runs are a shortest path by (undone length, runs, cuts inside a pass,
changes of posture in place, waypoints), in that order.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import networkx as nx
import numpy as np

from coverable.arrays import Array, Mask
from feasibility.clock import Clock, OutOfTime
from feasibility.demands.fast_motions import keep_fast_motions
from feasibility.demands.motion_rates import replay_at_rates
from feasibility.division.between_patches import clear_moves
from feasibility.division.left_out import Gap, PassSearch, along_stretch, gaps_of, where_it_stops
from feasibility.division.plans import collect_components, connect_pairs
from feasibility.division.reconfiguration import Reconfiguration, straight_moves
from feasibility.paths.coverage import CoveragePath
from feasibility.paths.metrics import unwound
from feasibility.problem import Problem
from feasibility.roadmap.graph import Roadmap
from feasibility.roadmap.ordered_run import steps_ahead
from feasibility.roadmap.rounds import explore
from feasibility.roadmap.search import exploration_of
from feasibility.roadmap.walk import route_walk
from feasibility.roadmap.warmup import warm_up
from feasibility.task import Task
from robots.robot import Robot
from surfaces.passes.toolpath import PassPlaces
from surfaces.toolpaths.pose_cells import PoseCells

RESOLUTION = 1e-12  # [m] lengths are counted in this, so that equal sums are equal
# What one step costs, as digits of one number; all motions together have less than 64 bits.
CUT, RUN, UNDONE = 1 << 64, 1 << 96, 1 << 128


Run = tuple[int, list[int]]
"""A node, and the route from it: numbers of edges + 1, negative where one is run backwards."""


def fewest_runs(roadmap: Roadmap, pieces: Array, inside: Mask) -> list[Run]:
    """The runs that leave least undone, the fewest of them, cut between passes where they can be.

    Args:
        roadmap: over N poses.
        pieces: (N - 1,) m, of the passes between poses; 0 where the tool need not work.
        inside: (N - 1,) whether both poses belong to one stretch of a pass.
    """
    steps, last = _steps(roadmap, pieces, inside), len(pieces)
    before, cost = nx.dijkstra_predecessor_and_distance(steps, -1)
    ends = [k for k in cost if k == -1 - last or (k >= 0 and roadmap.cell[k] == last)]
    path = [min(ends, key=lambda k: cost[k])]
    while before[path[-1]]:
        path.append(before[path[-1]][0])
    runs = list[Run]()
    for here, there in pairwise(reversed(path)):
        if number := steps[here][there]["number"]:
            runs[-1][1].append(number)
        elif there >= 0:  # the tool is set down here
            runs.append((there, []))
    return [(start, route) for start, route in runs if route]


def _steps(roadmap: Roadmap, pieces: Array, inside: Mask) -> nx.DiGraph:
    """The steps from each state: a node, or -1 - i for the tool lifted over pose i.

    Each has a `weight`, and the signed `number` of the motion, or 0 for none.
    """
    steps, within = nx.DiGraph(), [*inside.tolist(), False]
    steps.add_node(-1)
    for (x, y), (cost, number) in steps_ahead(roadmap).items():
        steps.add_edge(x, y, number=number, weight=int(cost))
    for node, pose in enumerate(roadmap.cell):
        steps.add_edge(node, -1 - pose, number=0, weight=CUT * within[pose])
        steps.add_edge(-1 - pose, node, number=0, weight=RUN)
    for pose, undone in enumerate(np.round(pieces / RESOLUTION).tolist()):
        steps.add_edge(-1 - pose, -2 - pose, number=0, weight=UNDONE * int(undone))
    return steps


@dataclass(frozen=True, eq=False, slots=True)
class Interruption:
    """Where the tool has to be lifted, and the arm to take another configuration."""

    pose: int
    """The last pose of the run that ends here."""
    next_pose: int
    """The first pose of the next run: the same one, or one further on."""
    stretch: int
    """Which stretch of a pass the run ends on; -1 between two."""
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
    cuts: tuple[Interruption, ...]
    """Between one run and the next."""
    gaps: tuple[Gap, ...]
    """What no run works on, and why."""
    refusals: tuple[str, ...]
    """Why the independent replay refuses runs that were left out for it."""

    @property
    def left_out(self) -> float:
        """m, of passes that no run covers."""
        return sum(gap.length for gap in self.gaps)

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
    that the search finds, and cut between passes rather than inside one. At a speed, or a distance
    from singularities, only motions count that hold it.

    Args:
        robot, cells, task, seed, clock: as for `check`; cells are the poses of `pass_toolpath`.
        places: the same poses, with their stretches.

    Raises:
        OutOfTime: the time ran out before the search began.
    """
    clock = Clock() if clock is None else clock
    warm_up()
    clock.start()
    exploration = exploration_of(robot, cells, task, seed, clock)
    try:
        explore(exploration)
        collect_components(exploration)
        for root in exploration.roots():
            connect_pairs(exploration, root, exploration.covers(root))
    except OutOfTime:
        pass  # what was found until then counts
    slow = keep_fast_motions(exploration, task) if task.requires_rates else {}
    same = places.stretch[1:] == places.stretch[:-1]
    inside = same & (places.stretch[1:] >= 0)
    pieces = inside * np.linalg.norm(np.diff(places.points, axis=0), axis=1)
    found = fewest_runs(exploration.roadmap, pieces, inside)
    runs, refusals = list[CoveragePath](), list[str]()
    worked = np.zeros(len(pieces), dtype=bool)
    for run in found:
        walk = unwound(robot, task, route_walk(exploration.roadmap, *run))
        needed = np.zeros(len(cells), dtype=bool)
        needed[walk.cell[walk.cell >= 0]] = True
        certificate, refusal = replay_at_rates(robot, cells, task, walk, needed)
        if refusal:
            refusals.append(refusal)
            continue
        runs.append(CoveragePath.of(robot, cells, task, "given", walk, needed, certificate))
        worked[walk.cell[0] : walk.cell[-1]] = True
    exploration.clock = Clock()
    search = PassSearch(exploration, task, places, Problem.of(robot, cells, task).pairs, slow)
    return PassRuns(
        robot=robot,
        task=task,
        places=places,
        runs=tuple(runs),
        cuts=_cuts(search, runs),
        gaps=gaps_of(search, pieces, worked),
        refusals=tuple(refusals),
    )


def _cuts(search: PassSearch, runs: Sequence[CoveragePath]) -> tuple[Interruption, ...]:
    """What lies between the runs."""
    robot, cells = search.exploration.robot, search.exploration.cells
    straight = straight_moves(robot, [run.walk for run in runs])
    moves, found = clear_moves(robot, cells, search.task, straight), list[Interruption]()
    for (before, after), move in zip(pairwise(runs), moves, strict=True):
        pose = int(before.visits[-1])
        found.append(
            Interruption(
                pose=pose,
                next_pose=int(after.visits[0]),
                stretch=int(search.places.stretch[pose]),
                along=along_stretch(search.places, pose),
                cause=where_it_stops(search, pose, move.start)
                or "another configuration gets further",
                move=move,
            )
        )
    return tuple(found)
