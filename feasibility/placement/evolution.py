"""A search for placements in progress: differential evolution over the poses of a region."""

from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np

from coverable.arrays import Array
from feasibility.clock import Clock, OutOfTime
from feasibility.placement.reach_bound import Reach
from feasibility.placement.region import Pose, Region
from feasibility.placement.trials import Effort, Evaluator, Trial
from feasibility.search_settings import Progress

SMALLEST = 5  # poses that evolution needs
STRIDES = (0.4, 0.9)  # [1] of the difference of two poses, by which a third one is moved
APART = 0.05  # [1] of the region's widths: placements nearer to each other are alike
FULLY = 3  # placements that are checked with all effort where none was found feasible
TIME_OUT = "the time limit ran out"
INTERRUPTED = "it was interrupted"


@dataclass
class Evolution:
    """A search for placements in progress."""

    evaluator: Evaluator
    reach: Reach
    region: Region
    clock: Clock
    progress: Progress | None
    trials: dict[Pose, Trial] = field(default_factory=dict)
    drawn: int = 0
    bound: int = 0
    """Placements that the reach bound discarded."""
    expected: int = 0
    """Placements that are drawn in all, if it goes on to its end."""
    nearest: tuple[float, Pose | None] = (np.inf, None)
    """Of those that the bound discarded the one that is least out of reach, and by how much."""
    stopped: str = ""
    """Why it did not go on to its end, if so."""

    @property
    def ranked(self) -> list[Trial]:
        """The best first."""
        return sorted(self.trials.values(), key=lambda trial: trial.rank, reverse=True)

    def run(self, count: int, rounds: int, seed: int) -> None:
        """Differential evolution over what varies of the region; then a closer look at the best."""
        from scipy.optimize import differential_evolution

        low, high = self.region.low, self.region.high
        free, self.expected = high > low, (rounds + 1) * count

        def costs(rows: Array) -> Array:
            values = np.tile(low, (count, 1))
            values[:, free] = rows.T
            return self.costs(self.region.rounded(values))

        try:
            differential_evolution(
                costs, list(zip(low[free], high[free], strict=True)), vectorized=True,
                init=self.region.samples(count, seed)[:, free], maxiter=rounds,
                mutation=STRIDES, seed=np.random.default_rng(seed), tol=0.0, polish=False,
                updating="deferred", callback=lambda *_: bool(self.stopped),
            )  # fmt: skip
        except RuntimeError as error:  # for SciPy errors of an evaluator are those of a map
            raise error.__cause__ or error from None
        self.look_closer()

    def costs(self, values: Array) -> Array:
        """(k,) of poses (k, 6): what is less is better."""
        if self.stopped:
            return np.full(len(values), np.inf)
        self.drawn += len(values)
        far = self.reach.distances(values).max(axis=1) / (self.reach.reach + self.reach.tolerance)
        outside, inside = np.flatnonzero(far > 1.0), np.flatnonzero(far <= 1.0)
        for k in outside[np.argsort(far[outside])][:1]:
            self.nearest = min(self.nearest, (float(far[k]), Pose.of_values(values[k])))
        self.bound += len(outside)
        costs = np.where(far > 1.0, 1.0 + far, 2.0)
        poses = [Pose.of_values(values[k]) for k in inside]
        self.look(poses, "quickly")
        for k, pose in zip(inside, poses, strict=True):
            if (trial := self.trials.get(pose)) is not None:
                costs[k] = -trial.margin if trial.feasible else 1.01 - trial.share
        return costs

    def look(self, poses: Sequence[Pose], effort: Effort) -> None:
        """Try some poses, as long as there is time."""
        asked = [p for p in dict.fromkeys(poses) if effort == "fully" or p not in self.trials]
        self._report()
        with suppress(OutOfTime):
            if not (self.stopped or self.clock.out_of_time):
                with self.clock.enforced():
                    for trial in self.evaluator(asked, effort):
                        self.trials[trial.pose] = trial
                        self._report()
                        if self.clock.out_of_time:
                            raise OutOfTime
                    return
        self.stopped = self.stopped or TIME_OUT

    def look_closer(self) -> None:
        """Where nothing is feasible, check the best, or what is least out of reach, thoroughly."""
        ranked = self.ranked
        if self.stopped or any(trial.feasible for trial in ranked):
            return
        best = [trial.pose for trial in distinct(ranked, self.region, FULLY)]
        last = self.nearest[1]
        self.look(best or ([] if last is None else [last]), "fully")

    def _report(self) -> None:
        """Say how far it is, and what the best so far is."""
        if self.progress is None:
            return
        text = "trying placements"
        if self.trials:
            best = max(self.trials.values(), key=lambda trial: trial.rank)
            margin, share = f"all, margin {1e3 * best.margin:.3g} mm", f"{100.0 * best.share:.1f} %"
            text += f"; best covers {margin if best.feasible else share}"
        self.progress(self.bound + len(self.trials), max(self.expected, self.drawn), text)


def distinct(trials: Iterable[Trial], region: Region, most: int) -> list[Trial]:
    """Those that are not nearly like one before them, up to so many."""
    widths, chosen = np.maximum(region.high - region.low, 1e-12), list[Trial]()
    for trial in trials:
        off = [np.abs((trial.pose.values - one.pose.values) / widths).max() for one in chosen]
        if len(chosen) < most and min(off, default=1.0) >= APART and not trial.failed:
            chosen.append(trial)
    return chosen
