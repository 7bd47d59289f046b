"""Placements tried as the tasks of a study: by many workers, and kept, so that a run can go on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from functools import lru_cache
from typing import Any

import numpy as np

from coverable_files import stamps
from feasibility.cases import TABLES, Case, toml_document
from feasibility.placement.evaluator import LocalEvaluator, Margins, Stage, Trial
from feasibility.placement.region import Pose
from feasibility.search import Progress
from feasibility.studies import (
    Store,
    StudyTask,
    Workers,
    bits_of,
    cells_of,
    files_of,
    run_tasks,
    trial_fault,
)
from feasibility.verdict import Answer, Evidence

KEPT = 4  # surfaces that one worker keeps
AHEAD = 4  # placements for each worker in one batch

Tables = dict[str, Any]


class StudyEvaluator:
    """Tries placements of a case's surface as tasks of a study; see `Evaluator`."""

    def __init__(
        self,
        case: Case,
        workers: Workers,
        store: Store | None = None,
        progress: Progress | None = None,
    ) -> None:
        """Placements of this case's surface.

        Args:
            case: the robot, the surface, the task and the search.
            workers: where they are tried.
            store: where what was tried is kept and found again.
            progress: called as progress(done, total, text) several times a second, with the
                tasks of the present batch; what it raises ends the run.
        """
        self.tables, self.workers, self.store = case.to_tables(), workers, store
        self.progress = progress
        self.batch = AHEAD * workers.width

    def try_all(self, poses: Sequence[Pose], early: bool) -> list[Trial]:
        """See `Evaluator`."""
        return self._all(poses, {"early": early})

    def check_all(self, poses: Sequence[Pose], causes: bool) -> list[Trial]:
        """See `Evaluator`."""
        return self._all(poses, {"causes": causes})

    def _all(self, poses: Sequence[Pose], how: Tables) -> list[Trial]:
        """One task for each pose."""
        tasks = [
            StudyTask(
                {**self.tables, "placement": {"pose": pose.values.tolist(), **how}},
                {"position": pose.position, "rpy_deg": pose.rpy_deg},
                try_placement,
                trial_fault,
            )
            for pose in poses
        ]  # fmt: skip
        rows = run_tasks(tasks, self.workers, self.store, self.progress)
        return [
            trial_from(row.result)
            if row.status == "done"
            else Trial(pose, Stage.FAILED, 0.0, message=str(row.result["message"]))
            for pose, row in zip(poses, rows, strict=True)
        ]


def try_placement(tables: Tables) -> Tables:
    """Try one placement; what a worker does.

    Args:
        tables: a case, as `Case.to_tables` gives it, and `placement`: `pose`, six numbers, and
            either `early`, see `LocalEvaluator.try_at`, or `causes`, see
            `LocalEvaluator.check_at`.

    Returns:
        See `trial_table`.
    """
    text = toml_document({title: tables[title] for title in TABLES if title in tables})
    local = _evaluator(text, *map(stamps, files_of(tables)))
    request = tables["placement"]
    pose = Pose.of_values(request["pose"])
    if "early" in request:
        return trial_table(local.try_at(pose, request["early"]))
    return trial_table(local.check_at(pose, request["causes"]))


@lru_cache(maxsize=KEPT)
def _evaluator(text: str, *changed: tuple[object, ...]) -> LocalEvaluator:
    """The evaluator of a case, made once, and again where a file has changed."""
    return LocalEvaluator(*Case.from_toml(text).build())


def trial_table(trial: Trial) -> Tables:
    """A trial as JSON values; `trial_from` reads it back."""
    margins = trial.margins
    return {
        "position": list(trial.pose.position),
        "rpy_deg": list(trial.pose.rpy_deg),
        "stage": str(trial.stage),
        **{name: getattr(trial, name) for name in ("in_reach", "probed", "share", "margin")},
        "margins": None if margins is None else asdict(margins),
        "cells": trial.covers.shape[1],
        "components": [bits_of(cover) for cover in trial.covers],
        "verdict": None if trial.answer is None else str(trial.answer),
        "evidence": None if trial.evidence is None else str(trial.evidence),
        "message": trial.message,
        "causes": dict(trial.causes),
        "early": trial.early,
        "fk": trial.fk,
    }


def trial_from(table: Any) -> Trial:
    """The trial that `trial_table` wrote."""
    margins = table["margins"]
    n = int(table["cells"])
    covers = [cells_of(bits, n) for bits in table["components"]]
    return Trial(
        pose=Pose.of_values([*table["position"], *table["rpy_deg"]]),
        stage=Stage(table["stage"]),
        **{name: float(table[name]) for name in ("in_reach", "probed", "share")},
        margins=None if margins is None else Margins(**margins),
        covers=np.array(covers, dtype=bool).reshape(len(covers), n),
        answer=None if table["verdict"] is None else Answer(table["verdict"]),
        evidence=None if table["evidence"] is None else Evidence(table["evidence"]),
        message=str(table["message"]),
        causes=dict(table["causes"]),
        early=bool(table["early"]),
        fk=int(table["fk"]),
    )
