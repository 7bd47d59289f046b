"""Stations: the fewest placements of an arm that together cover a surface.

A station is one arm with the surface at one placement, doing one continuous motion. What such a
motion covers is one component of that placement's search. So stations share the cells out among
components as the patches of a division do, to the proven optimum (`division.plans`).
"""

from dataclasses import dataclass

import numpy as np

from coverable.arrays import Ints, Protected
from feasibility.clock import Clock
from feasibility.demands.every_demand import OF_EACH, unjudged
from feasibility.division.plans import fewest_patches, motion_over
from feasibility.placement.placements import COUNT, Placements
from feasibility.placement.reach_bound import Reach
from feasibility.placement.region import Pose, moved_cells
from feasibility.placement.trials import Evaluator, Trial, search_all, search_with
from feasibility.search_settings import Progress, Search

TIME_LIMIT = 60.0  # [s] for the optimum; tables of thousands of rows take far less


@dataclass(frozen=True, eq=False, slots=True)
class StationPlan(Protected):
    """The fewest stations found in a region, and the outcome of their replays."""

    trials: tuple[Trial, ...]
    """The placement of each station, the one given most cells first."""
    station: Ints
    """(N,) the station that each cell is given to; -1 for cells that no component covers."""
    bound: int
    """No fewer stations cover what these cover."""
    refusals: tuple[str, ...]
    """For each station why its motion is refused; empty where it holds what the case demands."""
    not_judged: tuple[str, ...] = ()
    """What the case demands of all motions together, such as a coverage."""

    @property
    def optimal(self) -> bool:
        """Is it proved that no fewer will do, given the components found? More may need fewer."""
        return len(self.trials) <= self.bound

    @property
    def certified(self) -> bool:
        """Is the motion of every station replayed and accepted?"""
        return not any(self.refusals)

    def cells(self, station: int) -> Ints:
        """(k,) the cells given to a station; to none where that is -1."""
        return np.flatnonzero(self.station == station)


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
        evaluator, search, progress, clock: as for `place`; the seed is that of the replays, too.
        count: poses spread over the region and searched, besides those of `placements`.
    """
    search, cells = Search() if search is None else search, placements.cells
    values = placements.region.samples(count, search.seed)
    reach = Reach.of(placements.robot, cells, placements.task)
    poses = [Pose.of_values(row) for row in values[reach.share(values) > 0.0]]
    trials = [trial for trial in placements.trials if len(trial.covers)]
    trials += search_all(evaluator, poses, progress, "searching for stations")
    limit = TIME_LIMIT if clock is None else min(TIME_LIMIT, max(clock.left, 0.0))
    found = [(trial, cover) for trial in trials for cover in trial.covers]
    table = np.array([cover for _, cover in found], dtype=bool).reshape(-1, len(cells))
    partition = fewest_patches(table, cells.pairs, limit)
    chosen = [found[row] for row in partition.rows]
    refusals = tuple(
        motion_over(
            placements.robot,
            moved_cells(cells, trial.pose),
            placements.task,
            search_with(trial.effort, search, len(cells)),
            cover,
        )[1]
        for trial, cover in chosen
    )
    left = unjudged(placements.robot, placements.task, OF_EACH)
    at = tuple(trial for trial, _ in chosen)
    return StationPlan(at, partition.patch, partition.bound, refusals, left)
