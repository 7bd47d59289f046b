"""Placements of one surface tried, one at a time.

Moving the surface moves targets and curves rigidly, and their derivative bounds stay. So a
placement is the same problem with its arrays rotated and shifted, and the cells need not be cut
again. Only `feasibility.check`, which decides in the end, gets cells that have really been moved.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from coverable_arrays import Mask
from feasibility.checking import check
from feasibility.placement.quick_search import (
    MOST_COVERS,
    covers_of,
    least_margins,
    probe,
    search_quickly,
    spread_cells,
)
from feasibility.placement.reach_bound import Reach
from feasibility.placement.region import Pose, moved_cells
from feasibility.roadmap import (
    Exploration,
    SearchArrays,
    arrays_of,
    collisions_of,
    covering_walk,
    exploration_of,
    explore,
)
from feasibility.search import Search
from feasibility.speed import TOO_SLOW, replay_at_rates
from feasibility.studies import cause_counts, component_covers
from feasibility.task import Task
from feasibility.verdict import Answer, Evidence
from robots import Robot
from surfaces import Cells


class Stage(StrEnum):
    """How far the evaluation of a placement went."""

    BOUND = "bound"
    """A target is proved out of reach: no search was run."""
    PROBE = "probe"
    """Newton's method failed at one of the probed cells: no search was run."""
    SEARCH = "search"
    """A short search was run."""
    CHECK = "check"
    """The full search was run, and its motion replayed."""
    FAILED = "failed"
    """No evaluator finished it; the message says why."""


@dataclass(frozen=True, slots=True)
class Margins:
    """What the motion over a placement leaves, as shares 0..1; see `placement.quick_search`."""

    limits: float
    cone: float
    reach: float

    @property
    def least(self) -> float:
        """By which placements are compared."""
        return min(self.limits, self.cone, self.reach)


@dataclass(frozen=True, eq=False, slots=True)
class Trial:
    """What is known of one placement."""

    pose: Pose
    stage: Stage
    in_reach: float
    """Share of the area that the reach bound leaves open."""
    probed: float = 0.0
    """Share of the probed cells over which Newton's method found a configuration."""
    share: float = 0.0
    """Share of the area that the best single motion found covers; 0 without a search."""
    margins: Margins | None = None
    """None unless that motion covers every cell."""
    covers: Mask = field(default_factory=lambda: np.zeros((0, 0), dtype=bool))
    """(K, N) cells of the largest components found, none inside another, the best first."""
    answer: Answer | None = None
    """The answer of `feasibility.check`; None where it was not run."""
    evidence: Evidence | None = None
    message: str = ""
    """The message of `feasibility.check`."""
    causes: Mapping[str, int] = field(default_factory=dict)
    """Missed cells by cause, the most frequent first; only where requested."""
    early: bool = False
    """Whether probes came before its search, and could end it."""
    fk: int = 0
    """Evaluations of the arm."""

    @property
    def feasible(self) -> bool:
        """Has `feasibility.check` found and replayed a covering motion?"""
        return self.answer is Answer.FEASIBLE

    @property
    def margin(self) -> float:
        """The measure; 0 where not every cell is covered."""
        return 0.0 if self.margins is None else self.margins.least

    @property
    def complete(self) -> bool:
        """Does one motion found cover every cell?"""
        return bool(len(self.covers) and self.covers[0].all())

    @property
    def rank(self) -> tuple[float, ...]:
        """Larger is better: covered share, then margin, then what was seen before a search."""
        return (round(self.share, 9), self.margin, self.probed, self.in_reach)


class LocalEvaluator:
    """Tries placements of one surface for one arm and task."""

    batch = 1

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
            references=np.ascontiguousarray(here.references @ turn.T),
            frames=np.ascontiguousarray(here.frames @ turn.T),
            targets=targets,
            collisions=collisions_of(self.robot, surface.moved(turn, shift), self.task),
        )

    def try_at(self, pose: Pose, early: bool = True) -> Trial:
        """Evaluate one placement.

        Args:
            pose: where the surface's frame stands.
            early: whether bounds and probes may end it before a search.
        """
        if early and not self.reach.within(pose.values[None]).all():
            return Trial(pose, Stage.BOUND, self._in_reach(pose))
        exploration, probed = self._searched(pose, early)
        if probed < 1.0:
            fk = int(exploration.work.counts[0])
            return Trial(pose, Stage.PROBE, self._in_reach(pose), probed, fk=fk)
        return self._trial_of(exploration, pose, early)

    def try_all(self, poses: Sequence[Pose], early: bool) -> list[Trial]:
        """See `Evaluator`."""
        return [self.try_at(pose, early) for pose in poses]

    def check_all(self, poses: Sequence[Pose], causes: bool) -> list[Trial]:
        """See `Evaluator`."""
        return [self.check_at(pose, causes) for pose in poses]

    def _in_reach(self, pose: Pose) -> float:
        """Share of the area that the reach bound leaves open."""
        return float(self.reach.share(pose.values[None])[0])

    def _searched(self, pose: Pose, early: bool) -> tuple[Exploration, float]:
        """Probe and search; returns the share of probed cells that were reached, too."""
        exploration = Exploration(self.robot, self.cells, self.problem_at(pose), self.search.seed)
        if early:
            distances = self.reach.distances(pose.values[None])[0]
            ends = [int(distances.argmax()), int(distances.argmin())]
            some = np.array(list(dict.fromkeys([*ends, *self.probes])), dtype=np.int64)
            hits = probe(exploration, some)
            if not hits.all():
                return exploration, float(hits.mean())
        search_quickly(exploration, early)
        return exploration, 1.0

    def replayed(self, trial: Trial, component: int) -> str:
        """Replay the motion behind one of a trial's `covers`, which is found again for that.

        Returns:
            Empty where the independent replay accepts one continuous motion over these cells;
            otherwise why it does not.
        """
        cells = moved_cells(self.cells, trial.pose)
        if trial.stage is Stage.CHECK:
            exploration = self._explored(cells)
        else:
            exploration, _ = self._searched(trial.pose, trial.early)
        cover = trial.covers[component]
        for root in exploration.roots():
            if (exploration.covers(root) >= cover).all():
                walk, needed = covering_walk(exploration.roadmap, root), exploration.covers(root)
                return replay_at_rates(self.robot, cells, self.task, walk, needed)[1]
        return "the search did not find this motion again"

    def check_at(self, pose: Pose, causes: bool = False) -> Trial:
        """Run `feasibility.check` on one placement.

        Args:
            pose: where the surface's frame stands.
            causes: whether to determine the causes of missed cells.
        """
        cells = moved_cells(self.cells, pose)
        verdict = check(self.robot, cells, self.task, self.search)
        tried = self.try_at(pose, early=False) if verdict.feasible else None
        if tried is not None and not tried.complete:
            # The search of `check` again, for the margins that its motion leaves.
            tried = self._trial_of(self._explored(cells), pose, early=False)
        slow = TOO_SLOW in verdict.statistics  # all of it is covered: the message says the cause
        return Trial(
            pose=pose,
            stage=Stage.CHECK,
            in_reach=self._in_reach(pose),
            probed=1.0 if verdict.feasible else 0.0,
            share=self._share_of(verdict.covered),
            margins=None if tried is None else tried.margins,
            covers=component_covers(verdict)[:MOST_COVERS],
            answer=verdict.answer,
            evidence=verdict.evidence,
            message=verdict.message,
            causes=cause_counts(verdict).cells if causes and not slow else {},
            fk=int(verdict.statistics["fk"]) + (0 if tried is None else tried.fk),
        )

    def _explored(self, cells: Cells) -> Exploration:
        """The search of `check` for cells at their place."""
        exploration = exploration_of(self.robot, cells, self.task, self.search.seed)
        explore(exploration)
        return exploration

    def _share_of(self, cover: Mask) -> float:
        """Share of the area that some cells (N,) have."""
        areas = self.cells.areas
        return 1.0 if cover.all() else float(areas[cover].sum() / areas.sum())

    def _trial_of(self, exploration: Exploration, pose: Pose, early: bool) -> Trial:
        """What a search found."""
        covers = covers_of(exploration)
        margins = None
        if exploration.complete:
            limits, cone = least_margins(exploration).tolist()
            margins = Margins(limits, cone, max(0.0, min(1.0, self.reach.slack(pose.values))))
        return Trial(
            pose=pose,
            stage=Stage.SEARCH,
            in_reach=self._in_reach(pose),
            probed=1.0,
            share=self._share_of(covers[0]) if len(covers) else 0.0,
            margins=margins,
            covers=covers,
            early=early,
            fk=int(exploration.work.counts[0]),
        )
