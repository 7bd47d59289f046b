"""A search for placements in progress: which poses are tried, and in which order."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from typing import Protocol

import numpy as np

from coverable_arrays import Array
from coverable_errors import counted
from feasibility.clock import Clock, OutOfTime
from feasibility.placement.evaluator import Stage, Trial
from feasibility.placement.reach_bound import Reach
from feasibility.placement.region import Pose, Region
from feasibility.search import Progress

DRAWS = 16  # as many times more are drawn where the bound leaves few
FEW = 32  # poses within reach that refinement should start from
FALLBACK = 4  # placements that are searched although bound or probe speak against them
ELITES = 4  # placements that are refined
WIDTHS = (0.5, 0.35, 0.25, 0.17, 0.12, 0.08)  # [1] of the region, around the best
TIME_OUT = "the time limit ran out"
INTERRUPTED = "it was interrupted"
CYCLES = 3  # times through the widths, as long as nothing is feasible
APART = 0.05  # [1] of the region's widths: placements nearer to each other are alike


class Evaluator(Protocol):
    """Tries placements, here or elsewhere; results come in the order of the poses."""

    batch: int
    """Poses that it should be given at once, so that it is busy, and the answer not late."""

    def try_all(self, poses: Sequence[Pose], early: bool) -> list[Trial]:
        """See `LocalEvaluator.try_at`."""

    def check_all(self, poses: Sequence[Pose], causes: bool) -> list[Trial]:
        """See `LocalEvaluator.check_at`."""


def search_all(
    evaluator: Evaluator, values: Array, progress: Progress | None, text: str
) -> list[Trial]:
    """Search the placements (k, 6), a batch at a time; none is discarded early."""
    trials: list[Trial] = []
    for start in range(0, len(values), evaluator.batch):
        if progress is not None:
            progress(start, len(values), text)
        poses = [Pose.of_values(row) for row in values[start : start + evaluator.batch]]
        trials += evaluator.try_all(poses, early=False)
    return trials


@dataclass(slots=True)
class Refinement:
    """A search for placements in progress."""

    evaluator: Evaluator
    reach: Reach
    region: Region
    seed: int
    early: bool
    clock: Clock
    progress: Progress | None
    trials: list[Trial] = field(default_factory=list)
    drawn: int = 0
    bound: int = 0
    """Placements that the reach bound discarded."""
    best: Trial | None = None
    """The first in rank of those tried."""
    checks: dict[Pose, Trial] = field(default_factory=dict)
    sure: dict[Pose, Trial] = field(default_factory=dict)
    """What `check` says of those that were the best for a while, in case the search is stopped."""
    stopped: str = ""
    """Why the search did not go on to its end, if so."""
    expected: int = 0
    """Placements that are tried in all, if a search goes on to its end; an estimate."""
    streams: int = 0
    """Random sequences used so far, so that each is another one."""

    def searched(self, count: int, around: int, keep: int, interruptible: bool) -> list[Trial]:
        """Search and check; the best that are feasible, see `place`."""
        try:
            self.run(count, around)
            self.verify(keep)
        except KeyboardInterrupt:
            if not interruptible:
                raise
            self.stopped = INTERRUPTED
        return self.found(keep)

    def run(self, count: int, around: int) -> None:
        """Spread `count` poses over the region, then try `around` around each of the best."""
        self.expected = len(WIDTHS) * ELITES * around
        self.sweep(count)
        self.refine(around)

    def sweep(self, count: int) -> None:
        """Spread poses over the region, and try those that the bound leaves."""
        values = self.region.samples(count, self._stream())[:count]
        self.drawn = len(values)
        if not self.early:
            self._try(values, early=False)
            return
        inside = values[self.reach.within(values).all(axis=1)]
        if len(inside) < min(FEW, count):
            more = self.region.samples(DRAWS * count, self._stream())[1:]
            self.drawn += len(more)
            fits = self.reach.within(more).all(axis=1)
            inside = np.vstack([inside, more[fits][: min(FEW, count) - len(inside)]])
            values = np.vstack([values, more])
        self.bound = self.drawn - len(inside)
        self._try(inside, early=True)
        if not any(trial.stage is Stage.SEARCH for trial in self.trials):
            self._fall_back(values)

    def _fall_back(self, values: Array) -> None:
        """Search where the least speaks against it, for the best share that can be had."""
        self.trials.sort(key=lambda trial: trial.rank, reverse=True)
        rows = [trial.pose.values for trial in self.trials[:FALLBACK]]
        self.trials = self.trials[FALLBACK:]
        if not rows:
            rows = list(values[np.argsort(-self.reach.share(values), kind="stable")[:FALLBACK]])
        self._try(np.array(rows), early=False)

    def refine(self, around: int) -> None:
        """Try poses around the best, nearer and nearer."""
        for _ in range(CYCLES if around else 0):
            for done, width in enumerate(WIDTHS):
                rows = [
                    self.region.near(trial.pose.values, width, around, self._stream())[:around]
                    for trial in self._elites(ELITES)
                ]
                if self.stopped or not rows:
                    return
                values = np.vstack(rows)
                self.drawn += len(values)
                if self.early:
                    fits = self.reach.within(values).all(axis=1)
                    self.bound += int((~fits).sum())
                    values = values[fits]
                left = (len(WIDTHS) - done) * ELITES * around
                self.expected = len(self.trials) + left
                self._try(values, self.early)
            if any(trial.complete for trial in self.trials):
                return
            # The short search may have missed what the full one finds.
            self._check([trial.pose for trial in self._elites(1)])
            if any(trial.feasible for trial in self.checks.values()):
                return

    def verify(self, keep: int) -> None:
        """Check the best placements, until so many are feasible."""
        likely = self._elites(3 * keep, lambda trial: trial.complete)
        while (
            likely
            and not self.stopped
            and sum(trial.feasible for trial in self.checks.values()) < keep
        ):
            some, likely = likely[:keep], likely[keep:]
            self._check([trial.pose for trial in some])
        known = [*self.checks.values(), *self.sure.values()]
        if not self.stopped and not any(trial.feasible for trial in known):
            self._check([trial.pose for trial in self._elites(1)], causes=True)

    def found(self, keep: int) -> list[Trial]:
        """The best placements that `check` calls feasible, of those it was asked about."""
        if self.stopped or not any(trial.feasible for trial in self.checks.values()):
            self._keep(list(self.sure.values()))
        found = [trial for trial in self.checks.values() if trial.feasible]
        return sorted(found, key=lambda trial: -trial.margin)[:keep]

    def _elites(
        self, most: int, wanted: Callable[[Trial], bool] = lambda trial: True
    ) -> list[Trial]:
        """The best placements that are not alike, of those searched."""
        widths = np.maximum(self.region.high - self.region.low, 1e-12)
        chosen: list[Trial] = []
        pool = [t for t in self.trials if t.stage in (Stage.SEARCH, Stage.CHECK) and wanted(t)]
        for trial in sorted(pool, key=lambda trial: trial.rank, reverse=True):
            apart = [
                np.abs((trial.pose.values - other.pose.values) / widths).max() for other in chosen
            ]
            if min(apart, default=1.0) >= APART:
                chosen.append(trial)
                if len(chosen) == most:
                    break
        return chosen

    def _try(self, values: Array, early: bool) -> None:
        """Look into poses (k, 6), a batch at a time."""
        if not self.trials:
            self.expected += len(values)
        for start in range(0, len(values), self.evaluator.batch):
            self._report("trying placements")
            rows = values[start : start + self.evaluator.batch]
            poses = [Pose.of_values(row) for row in rows]
            tried = self._in_time(partial(self.evaluator.try_all, poses, early))
            self.trials += tried
            known = tried if self.best is None else [self.best, *tried]
            self.best = max(known, key=lambda trial: trial.rank, default=None)
            if self.stopped:
                return
            self._make_sure()

    def _make_sure(self) -> None:
        """Check the best so far, where one motion covers it all: its answer, if stopped here."""
        best = self.best
        if best is None or not best.complete or best.pose in self.sure or best.pose in self.checks:
            return
        for trial in self._in_time(partial(self.evaluator.check_all, [best.pose], False)):
            self.sure[trial.pose] = trial

    def _check(self, poses: list[Pose], causes: bool = False) -> None:
        """Run `check` on poses; its trials replace the earlier ones."""
        poses = [pose for pose in poses if causes or pose not in self.checks]
        if not causes:
            self._keep([self.sure[pose] for pose in poses if pose in self.sure])
            poses = [pose for pose in poses if pose not in self.sure]
        self._report(f"checking the best {counted(len(poses), 'placement')}")
        self._keep(self._in_time(partial(self.evaluator.check_all, poses, causes)))

    def _keep(self, checked: Sequence[Trial]) -> None:
        """Let what was checked replace what was tried."""
        for trial in checked:
            self.checks[trial.pose] = trial
            self.trials = [t for t in self.trials if t.pose != trial.pose] + [trial]

    def _report(self, doing: str) -> None:
        """Say how far it is, and what the best so far is."""
        if self.progress is None:
            return
        text, best = doing, self.best
        if best is not None:
            margin = f"all, margin {best.margin:.2f}"
            text += f"; best covers {margin if best.complete else f'{100.0 * best.share:.1f} %'}"
        self.progress(len(self.trials), max(self.expected, len(self.trials)), text)

    def _in_time(self, tried: Callable[[], list[Trial]]) -> list[Trial]:
        """Some trials; none where the time has run out, before them or meanwhile."""
        with suppress(OutOfTime):
            if not (self.stopped or self.clock.out_of_time):
                with self.clock.enforced():
                    return tried()
        self.stopped = TIME_OUT
        return []

    def _stream(self) -> int:
        """A seed that was not used before."""
        self.streams += 1
        return int(np.random.SeedSequence([self.seed, self.streams]).generate_state(1)[0])
