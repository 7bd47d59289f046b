"""One placement of a surface tried: `check` with the surface there, in full or with less effort."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from coverable.arrays import Mask
from feasibility.cases.case import Case
from feasibility.checking import check
from feasibility.placement.region import Pose, moved_cells
from feasibility.search_settings import Progress, Search
from feasibility.studies.pool import Workers
from feasibility.studies.run import StudyTask, run_tasks
from feasibility.studies.store import Store
from feasibility.studies.stored import cells_of
from feasibility.studies.study_outcome import outcome_of
from feasibility.task import Task
from feasibility.verdict import Answer, Evidence
from robots.robot import Robot
from surfaces.cells import Cells

Effort = Literal["quickly", "widely", "fully"]
"""Few evaluations, and no more than the answer needs; some, for as many cells as they reach, as
shares of the area need them; or all that the search may have, and causes of missed cells."""
FEW, EACH = 2_000, 40  # evaluations of a quick look, in all and for each cell
WIDE = 3  # times as many for a wide one: all but a few shares of notebook 05's map are those of all
AHEAD = 4  # placements for each worker in one batch


@dataclass(frozen=True, eq=False, slots=True)
class Trial:
    """What `check` says of one placement, with all its effort or with less."""

    pose: Pose
    result: Mapping[str, Any]
    """See `studies.outcome_of`; the message alone of one that could not be tried."""
    effort: Effort = "quickly"
    """A feasible one is as good with little."""

    @property
    def failed(self) -> bool:
        """Did no worker come to an end with it? The message says why."""
        return "share" not in self.result

    @property
    def answer(self) -> Answer:
        """Of `check`."""
        return Answer(self.result.get("verdict", "undecided"))

    @property
    def evidence(self) -> Evidence:
        """What it rests on; of a quick look that is undecided, its small budget."""
        return Evidence(self.result.get("evidence", "budget"))

    @property
    def feasible(self) -> bool:
        """Is there a motion that the replay accepted?"""
        return self.answer is Answer.FEASIBLE

    @property
    def message(self) -> str:
        """Of `check`."""
        return str(self.result["message"])

    @property
    def share(self) -> float:
        """Share of the area, 0..1, that the best single motion found covers."""
        return float(self.result.get("share", 0.0))

    @property
    def margin(self) -> float:
        """m, how far the surface may be shifted from there, by which feasible ones are compared."""
        left = self.result.get("margins") or {}
        return float(left.get("placement_m") or 0.0) if self.feasible else 0.0

    @property
    def covers(self) -> Mask:
        """(K, N) cells of the components found, none inside another, the best first."""
        n, parts = int(self.result.get("cells", 0)), self.result.get("components", ())
        return np.array([cells_of(bits, n) for bits in parts], dtype=bool).reshape(len(parts), n)

    @property
    def rank(self) -> tuple[float, ...]:
        """Larger is better."""
        fully = float(self.effort == "fully")
        return float(self.feasible), round(self.share, 9), self.margin, fully


Evaluator = Callable[[Sequence[Pose], Effort], Iterator[Trial]]
"""Tries poses; the trials come in their order, as they are finished."""


def search_with(effort: Effort, search: Search, cells: int) -> Search:
    """The settings of a trial: those given, or with few evaluations."""
    if effort == "fully":
        return search
    quick = effort == "quickly"
    few = (1 if quick else WIDE) * (FEW + EACH * cells)
    most = few if search.evaluations is None else min(few, search.evaluations)
    return replace(search, evaluations=most, early=quick)


def evaluator_here(robot: Robot, cells: Cells, task: Task, search: Search) -> Evaluator:
    """Tries placements of a surface in this process."""

    def tried(poses: Sequence[Pose], effort: Effort) -> Iterator[Trial]:
        chosen = search_with(effort, search, len(cells))
        for pose in poses:
            verdict = check(robot, moved_cells(cells, pose), task, chosen)
            yield Trial(pose, outcome_of(verdict, causes=effort == "fully"), effort)

    return tried


def evaluator_of_study(
    case: Case,
    cells: int,
    workers: Workers,
    store: Store | None = None,
    progress: Progress | None = None,
) -> Evaluator:
    """Tries placements of a case's surface, of so many cells, as tasks of a study.

    By many workers, and kept in a store, if there is one. The progress is that of the tasks of the
    present batch, several times a second; what it raises ends the run.
    """
    batch = AHEAD * workers.width

    def tried(poses: Sequence[Pose], effort: Effort) -> Iterator[Trial]:
        tables = replace(case, search=search_with(effort, case.search, cells)).to_tables()
        for start in range(0, len(poses), batch):
            some = poses[start : start + batch]
            tasks = [_task(tables, pose, effort == "fully") for pose in some]
            rows = run_tasks(tasks, workers, store, progress)
            for pose, row in zip(some, rows, strict=True):
                yield Trial(pose, row.result, effort)

    return tried


def _task(tables: Mapping[str, Any], pose: Pose, causes: bool) -> StudyTask:
    """A case with the surface at a pose."""
    where = {"position": list(pose.position), "rpy_deg": list(pose.rpy_deg)}
    surface = {**tables["surface"], **where}
    return StudyTask({**tables, "surface": surface, "wanted": {"causes": causes}}, where)


def search_all(
    evaluator: Evaluator, poses: Sequence[Pose], progress: Progress | None, text: str
) -> list[Trial]:
    """A wide look at each of some poses."""
    trials = list[Trial]()
    for trial in evaluator(poses, "widely"):
        trials.append(trial)
        if progress is not None:
            progress(len(trials), len(poses), text)
    return trials
