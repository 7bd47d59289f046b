"""Placements of one surface tried, one at a time.

Moving the surface moves targets and curves rigidly, and their derivative bounds stay. So a
placement is the same problem with its arrays rotated and shifted, and the cells need not be cut
again. Only `feasibility.check`, which decides in the end, gets cells that have really been moved.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from feasibility.division import undominated
from feasibility.placement.margins import least_margins
from feasibility.placement.quick_search import (
    MOST_COVERS,
    covers_of,
    probe,
    search_quickly,
    spread_cells,
)
from feasibility.placement.reach_bound import Reach
from feasibility.placement.region import Array, Pose, moved_cells
from feasibility.placement.trial import Margins, Stage, Trial
from feasibility.roadmap import Exploration, SearchArrays, arrays_of
from feasibility.search import Search
from feasibility.studies import cause_counts
from feasibility.task import Task
from robots import Robot
from surfaces import Cells


class LocalEvaluator:
    """Tries placements of one surface for one arm and task."""

    def __init__(self, robot: Robot, cells: Cells, task: Task, search: Search) -> None:
        """Compute what all placements share."""
        self.robot, self.cells, self.task, self.search = robot, cells, task, search
        self.problem = arrays_of(robot, cells, task)
        self.reach = Reach.of(robot, cells, task)
        self.probes = spread_cells(cells)

    def problem_at(self, pose: Pose) -> SearchArrays:
        """The problem with the surface's frame at a pose."""
        here, surface = self.problem, self.cells.surface
        turn = pose.rotation @ surface.rotation.T
        shift = np.array(pose.position) - turn @ surface.position
        targets = np.concatenate(
            [here.targets[..., :3] @ turn.T, here.targets[..., 3:] @ turn.T], axis=2
        )
        targets[:, 0, :3] += shift
        # As `arrays_of` has them: for other arrays all kernels would be compiled once more.
        targets.flags.writeable = False
        return here._replace(
            points=np.ascontiguousarray(here.points @ turn.T + shift),
            approaches=np.ascontiguousarray(here.approaches @ turn.T),
            targets=targets,
        )

    def try_at(self, pose: Pose, early: bool = True) -> Trial:
        """Look into one placement.

        Args:
            pose: where the surface's frame stands.
            early: whether bounds and probes may end it before a search.
        """
        distances = self.reach.distances(pose.values[None])[0]
        in_reach = float(self.reach.share(pose.values[None])[0])
        if early and distances.max() > self.reach.reach + self.reach.tolerance:
            return Trial(pose, Stage.BOUND, in_reach)
        exploration = Exploration(self.robot, self.cells, self.problem_at(pose), self.search.seed)
        probed = self._searched(exploration, distances, early)
        if probed < 1.0:
            fk = int(exploration.work.counts[0])
            return Trial(pose, Stage.PROBE, in_reach, probed, fk=fk)
        return replace(self.trial_of(exploration, pose, in_reach, probed), early=early)

    def try_all(self, poses: Sequence[Pose], early: bool) -> list[Trial]:
        """See `Evaluator`."""
        return [self.try_at(pose, early) for pose in poses]

    def check_all(self, poses: Sequence[Pose], causes: bool) -> list[Trial]:
        """See `Evaluator`."""
        return [self.check_at(pose, causes) for pose in poses]

    def _searched(self, exploration: Exploration, distances: Array, early: bool) -> float:
        """Probe and search; returns the share of probed cells that were reached."""
        if early:
            ends = [int(distances.argmax()), int(distances.argmin())]
            some = np.array(list(dict.fromkeys([*ends, *self.probes])), dtype=np.int64)
            hits = probe(exploration, some)
            if not hits.all():
                return float(hits.mean())
        search_quickly(exploration, early)
        return 1.0

    def replayed(self, trial: Trial, component: int) -> str:
        """Replay the motion behind one of a trial's `covers`, which is found again for that.

        Returns:
            Empty where the independent replay accepts one continuous motion over these cells;
            otherwise why it does not.
        """
        from feasibility.certification import replay
        from feasibility.roadmap import covering_walk, explore

        cells = moved_cells(self.cells, trial.pose)
        if trial.stage is Stage.CHECK:
            problem = arrays_of(self.robot, cells, self.task)
            exploration = Exploration(self.robot, cells, problem, self.search.seed)
            explore(exploration)
        else:
            problem = self.problem_at(trial.pose)
            exploration = Exploration(self.robot, self.cells, problem, self.search.seed)
            distances = self.reach.distances(trial.pose.values[None])[0]
            self._searched(exploration, distances, trial.early)
        cover = trial.covers[component]
        for root in exploration.roots():
            if (exploration.covers(root) >= cover).all():
                walk = covering_walk(exploration.roadmap, root)
                replayed = replay(self.robot, cells, self.task, walk, exploration.covers(root))
                return "" if replayed.accepted else replayed.refusal
        return "the search did not find this motion again"

    def check_at(self, pose: Pose, causes: bool = False) -> Trial:
        """Ask `feasibility.check` about one placement.

        Args:
            pose: where the surface's frame stands.
            causes: whether to look for the causes of missed cells.
        """
        from feasibility.checking import check

        cells = moved_cells(self.cells, pose)
        verdict = check(self.robot, cells, self.task, self.search)
        tried = self.try_at(pose, early=False) if verdict.feasible else None
        if tried is not None and not tried.complete:
            tried = self._explored(cells, pose)
        covers = np.zeros((len(verdict.components), len(cells)), dtype=bool)
        for row, component in zip(covers, verdict.components, strict=True):
            row[component] = True
        covers = covers[undominated(covers)][:MOST_COVERS]
        return Trial(
            pose=pose,
            stage=Stage.CHECK,
            in_reach=float(self.reach.share(pose.values[None])[0]),
            probed=1.0 if verdict.feasible else 0.0,
            share=self.share_of(verdict.covered),
            margins=None if tried is None else tried.margins,
            covers=covers,
            answer=verdict.answer,
            evidence=verdict.evidence,
            message=verdict.message,
            causes=cause_counts(verdict).cells if causes else {},
            fk=int(verdict.statistics["fk"]) + (0 if tried is None else tried.fk),
        )

    def _explored(self, cells: Cells, pose: Pose) -> Trial:
        """The search of `check` again, for the margins that its motion leaves."""
        from feasibility.roadmap import explore

        problem = arrays_of(self.robot, cells, self.task)
        exploration = Exploration(self.robot, cells, problem, self.search.seed)
        explore(exploration)
        return self.trial_of(exploration, pose, 1.0, 1.0)

    def share_of(self, cover: NDArray[np.bool_]) -> float:
        """Share of the area that some cells (N,) have."""
        areas = self.cells.areas
        return 1.0 if cover.all() else float(areas[cover].sum() / areas.sum())

    def trial_of(
        self, exploration: Exploration, pose: Pose, in_reach: float, probed: float
    ) -> Trial:
        """What a search found."""
        covers = covers_of(exploration)
        margins = self._margins(exploration, pose) if exploration.complete else None
        return Trial(
            pose=pose,
            stage=Stage.SEARCH,
            in_reach=in_reach,
            probed=probed,
            share=self.share_of(covers[0]) if len(covers) else 0.0,
            margins=margins,
            covers=covers,
            fk=int(exploration.work.counts[0]),
        )

    def _margins(self, exploration: Exploration, pose: Pose) -> Margins:
        """What the component that covers every cell leaves."""
        limits, cone = least_margins(exploration).tolist()
        return Margins(limits, cone, max(0.0, min(1.0, self.reach.slack(pose.values))))
