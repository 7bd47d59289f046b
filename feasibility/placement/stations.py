"""Stations: the fewest placements of an arm that together cover a surface.

A station is one arm with the surface at one placement, doing one continuous motion. What such a
motion covers is one component of that placement's search. So stations are a set cover of the cells
by components, solved to the proven optimum (see `feasibility.division`). Among the fewest, the
stations with larger components are not preferred: how many is what costs.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from coverable.arrays import Ints, Mask, Protected
from feasibility.clock import Clock
from feasibility.demands.every_demand import OF_EACH, unjudged
from feasibility.division.one_motion import motion_over
from feasibility.division.set_covering import set_cover
from feasibility.placement.placements import COUNT, Placements
from feasibility.placement.reach_bound import Reach
from feasibility.placement.region import Pose, moved_cells
from feasibility.placement.trials import Evaluator, Trial, search_all, search_with
from feasibility.search_settings import Progress, Search

TIME_LIMIT = 60.0  # [s] for the optimum; tables of thousands of rows take far less


@dataclass(frozen=True, eq=False, slots=True)
class Station(Protected):
    """One arm at one placement, doing one continuous motion."""

    placement: int
    """Index of the placement."""
    component: int
    """Index of its component."""
    covers: Mask
    """(N,) cells that its motion can cover."""
    cells: Ints
    """(k,) cells given to it: each cell to one station, to the one that covers most."""


@dataclass(frozen=True, eq=False, slots=True)
class Stations(Protected):
    """The fewest stations found."""

    stations: tuple[Station, ...]
    """The one given most cells first."""
    left_out: Ints
    """(k,) cells that no component covers."""
    bound: int
    """No fewer stations cover what these cover."""

    def __len__(self) -> int:
        """Number of stations."""
        return len(self.stations)

    @property
    def optimal(self) -> bool:
        """Is it proved that no fewer will do, given the components found?"""
        return len(self.stations) <= self.bound


@dataclass(frozen=True, eq=False, slots=True)
class StationPlan:
    """The fewest stations found in a region, and the outcome of their replays."""

    stations: Stations
    trials: tuple[Trial, ...]
    """The placement of each station."""
    refusals: tuple[str, ...]
    """For each station why its motion is refused; empty where it holds what the case demands."""
    not_judged: tuple[str, ...] = ()
    """What the case demands of all motions together, such as a coverage."""

    @property
    def certified(self) -> bool:
        """Is the motion of every station replayed and accepted?"""
        return not any(self.refusals)


def station_plan(
    placements: Placements,
    evaluator: Evaluator,
    search: Search | None = None,
    count: int = COUNT,
    progress: Progress | None = None,
    clock: Clock | None = None,
) -> StationPlan:
    """The fewest placements that together cover the surface, each by one continuous motion.

    A search for one placement discards those that miss a part of the surface; here they are what
    is wanted. So more of them are searched, and all components go into one table.

    Args:
        placements: the search for one placement, which found none.
        evaluator: tries placements.
        search: its settings; the seed is that of the replays, as of the evaluator.
        count: poses spread over the region and searched, besides those of `placements`.
        progress: called as progress(done, total, text); what it raises ends it.
        clock: of the command that this is a part of.

    Returns:
        The plan. Optimal is meant among the motions found; more placements may need fewer.
    """
    search = Search() if search is None else search
    values = placements.region.samples(count, search.seed)[:count]
    reach = Reach.of(placements.robot, placements.cells, placements.task)
    poses = [Pose.of_values(row) for row in values[reach.share(values) > 0.0]]
    trials = [trial for trial in placements.trials if len(trial.covers)]
    trials += search_all(evaluator, poses, progress, "searching for stations")
    limit = TIME_LIMIT if clock is None else min(TIME_LIMIT, max(clock.left, 0.0))
    stations = fewest_stations([trial.covers for trial in trials], len(placements.cells), limit)
    chosen = tuple(trials[station.placement] for station in stations.stations)
    refusals = tuple(
        motion_over(
            placements.robot,
            moved_cells(placements.cells, trial.pose),
            placements.task,
            search_with(trial.effort, search, len(placements.cells)),
            station.covers,
        ).refusal
        for trial, station in zip(chosen, stations.stations, strict=True)
    )
    left = unjudged(placements.robot, placements.task, OF_EACH)
    return StationPlan(stations, chosen, refusals, left)


def fewest_stations(covers: Sequence[Mask], n: int, time_limit: float = TIME_LIMIT) -> Stations:
    """The fewest motions that together cover what all motions found cover.

    Args:
        covers: for each placement (K, n) the cells that its K components cover; placements without
            components count as covering nothing.
        n: number of cells of the surface.
        time_limit: s, for the proof of the optimum.

    Example:
        >>> covers = np.array([[1, 1, 0, 0], [0, 0, 1, 0]]), np.array([[0, 1, 1, 1]])
        >>> found = fewest_stations([table.astype(bool) for table in covers], 4)
        >>> [(s.placement, s.cells.tolist()) for s in found.stations], found.optimal
        ([(1, [1, 2, 3]), (0, [0])], True)
    """
    motions = [(k, component) for k, table in enumerate(covers) for component in range(len(table))]
    table = np.vstack([np.zeros((0, n), dtype=bool), *(table for table in covers if len(table))])
    can = table.any(axis=0)
    found = set_cover(table[:, can], time_limit)
    rows = sorted(found.rows, key=lambda row: (-int(table[row].sum()), row))
    # Each cell to the first of them that covers it.
    owner = np.where(can, np.argmax(table[rows], axis=0) if rows else 0, -1)
    stations = [
        Station(*motions[row], covers=table[row], cells=np.flatnonzero(owner == k))
        for k, row in enumerate(rows)
    ]
    stations.sort(key=lambda station: (-len(station.cells), station.placement, station.component))
    return Stations(tuple(stations), np.flatnonzero(~can), found.bound)
