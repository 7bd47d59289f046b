"""Stations for one arm: the fewest placements whose motions together cover a surface."""

from __future__ import annotations

from dataclasses import dataclass

from feasibility.placement.placements import COUNT, Placements
from feasibility.placement.placer import Placer
from feasibility.placement.reach_bound import Reach
from feasibility.placement.refinement import BATCH, Judge
from feasibility.placement.region import Pose
from feasibility.placement.stations import Stations, stations_of
from feasibility.placement.study_tasks import trial_table
from feasibility.placement.trial import Trial
from feasibility.search import Progress, Search


@dataclass(frozen=True, eq=False, slots=True)
class StationPlan:
    """The fewest stations found in a region, and what a replay says of each."""

    stations: Stations
    trials: tuple[Trial, ...]
    """The placement of each station."""
    refusals: tuple[str, ...]
    """For each station why the replay refuses its motion; empty where it accepts it."""

    @property
    def certified(self) -> bool:
        """Is the motion of every station replayed and accepted?"""
        return not any(self.refusals)


def station_plan(
    placements: Placements,
    judge: Judge,
    search: Search | None = None,
    count: int = COUNT,
    progress: Progress | None = None,
) -> StationPlan:
    """The fewest placements that together cover the surface, each by one continuous motion.

    A search for one placement discards those that miss a part of the surface; here they are what
    is wanted. So more of them are searched, and all components go into one table.

    Args:
        placements: the search for one placement, which found none.
        judge: who tries placements.
        search: its settings; the seed is that of the replays, as of the judge.
        count: poses spread over the region and searched, besides those of `placements`.
        progress: called as progress(done, total, text); what it raises ends it.

    Returns:
        The plan. Optimal is meant among the motions found; more placements may need fewer.
    """
    search = Search() if search is None else search
    values = placements.region.samples(count, search.seed)[:count]
    reach = Reach.of(placements.robot, placements.cells, placements.task)
    values = values[reach.share(values) > 0.0]
    trials = [trial for trial in placements.trials if len(trial.covers)]
    for start in range(0, len(values), BATCH):
        if progress is not None:
            progress(start, len(values), "searching for stations")
        poses = [Pose.of_values(row) for row in values[start : start + BATCH]]
        trials += judge.tried(poses, early=False)
    stations = stations_of([trial_table(trial) for trial in trials], [True] * len(placements.cells))
    chosen = tuple(trials[station.row] for station in stations.stations)
    placer = Placer(placements.robot, placements.cells, placements.task, search)
    refusals = tuple(
        placer.replayed(trial, station.component)
        for trial, station in zip(chosen, stations.stations, strict=True)
    )
    return StationPlan(stations, chosen, refusals)
