"""Answers for a page: a quick look while something is dragged, the certified verdict afterwards.

A quick look colours the cells and calls nothing feasible: it is a short search without replay,
proofs and causes. The certified answer is that of `check`, in its words.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from coverable.errors import CoverableError
from feasibility.cases.case import Case, Setup
from feasibility.checking import check
from feasibility.clock import Clock, OutOfTime
from feasibility.collisions.asked_bodies import said_of
from feasibility.live import picture
from feasibility.live.controls import Controls
from feasibility.live.jobs import Answer, Job, Superseded
from feasibility.live.quick_search import quick_search
from feasibility.live.workbench import Workbench
from feasibility.problem import Problem
from feasibility.reports import verdict as report

STEPS = 60  # looks at the clock, between which a search does 8,000 evaluations at most
STEPS_WITH_BODIES = 24  # the same where distances of bodies make an evaluation dearer
JSON_HINT = " (--json lists all)"  # of the command, which a page has not
BUG = "this is a bug in coverable: {}: {}; the page goes on working"


class Watch(Clock):
    """A clock that also ends a search after some steps, or when nobody waits for it any more."""

    def __init__(self, job: Job, limit: float | None = None, steps: float = np.inf) -> None:
        """A clock that does not run yet.

        Args:
            job: what the search is for.
            limit: seconds, see `Clock`.
            steps: looks at the clock after which the search ends.
        """
        super().__init__(limit)
        self._job, self._left = job, steps

    def report(self, done: int, total: int | None, text: str) -> None:
        """Keep it for the page that waits."""
        cells = f"{done} of {total} cells" if total else f"{done} cells"
        self._job.said = f"{cells} so far; {text}"

    def tick(self, done: int, total: int | None, text: str, spent: int = 0) -> None:
        """Report, and stop where nobody waits or enough has been tried.

        Raises:
            OutOfTime: the steps are used up, or the deadline has passed.
            Superseded: the job has been dropped.
        """
        if self._job.dropped:
            raise Superseded
        self._left -= 1
        if self._left < 0:
            raise OutOfTime
        super().tick(done, total, text, spent)

    @contextmanager
    def enforced(self) -> Iterator[None]:
        """Nothing: the alarms that this is done with in commands belong to the main thread."""
        yield


class Answers:
    """Answers the questions of all pages of one case."""

    def __init__(self, controls: Controls, bench: Workbench) -> None:
        """Answer for a case.

        Args:
            controls: what can be changed in it.
            bench: builds the changed cases.
        """
        self.controls, self.bench = controls, bench

    def __call__(self, job: Job) -> Answer:
        """The answer as the page has it; bad values and faults of ours are answers, too.

        Raises:
            Superseded: nobody waits for it any more.
        """
        try:
            case = self.controls.changed(job.values)
            setup = self.bench.build(case, roughly=not job.final)
            began = time.perf_counter()
            found = certified(case, setup, job) if job.final else quick_look(setup, job)
            return {**found, "seconds": time.perf_counter() - began}
        except CoverableError as error:
            return {"kind": "error", "head": str(error)}
        except (Superseded, KeyboardInterrupt):
            raise
        except Exception as error:  # noqa: BLE001 - the page goes on working
            return {"kind": "error", "head": BUG.format(type(error).__name__, error)}


def quick_look(setup: Setup, job: Job) -> Answer:
    """How much of the surface a short search reaches; neither certified nor complete."""
    robot, cells, task, search = setup
    watch = Watch(job, steps=STEPS if task.collision is None else STEPS_WITH_BODIES)
    covered, q = quick_search(Problem.of(robot, cells, task), search, watch)
    number, total = int(covered.sum()), len(cells)
    what = "cells" if not cells.in_order else "poses, in any order,"
    paint = picture.quick_paint(covered)
    return {
        "kind": "quick",
        "head": f"quick look: one motion reaches {number:,} of {total:,} {what}".rstrip(",")
        + ("" if number == total else " so far"),
        "covered": number,
        "cells": total,
        "rows": [],
        "groups": [],
        "note": said_of(robot, task.collision),
        "paint": paint._asdict(),
        "commands": picture.packed(picture.posed(robot, q, task.collision is not None)),
        "parts": {"paths": [], "entries": [], "seconds": 0.0},
    }


def certified(case: Case, setup: Setup, job: Job) -> Answer:
    """What `coverable check` says of the case, with the cells in the colours of their causes."""
    watch = Watch(job, limit=setup.search.time_limit)
    verdict = check(*setup, clock=watch)
    paint, parts = picture.certified_paint(verdict), picture.certified_parts(verdict)
    return {
        "kind": str(verdict.answer),
        "head": report.as_text(verdict, case).splitlines()[0],
        "covered": verdict.n_covered,
        "cells": len(verdict.cells),
        "evidence": str(verdict.evidence),
        "rows": [[name, text] for name, text in report.rows_of(verdict) if text],
        "groups": [
            line.removesuffix(JSON_HINT)
            for line in report.causes_listed(verdict.causes, verdict.cells)
        ],
        "note": said_of(verdict.robot, verdict.task.collision),
        "paint": paint._asdict(),
        "commands": picture.packed(parts.commands),
        "parts": {"paths": parts.paths, "entries": parts.entries, "seconds": parts.seconds},
    }
