"""Dealing tasks out to workers in handfuls, and getting all of them back when workers die."""

from __future__ import annotations

import json
import time
from collections import Counter, deque
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from dataclasses import dataclass, field
from typing import Any

from feasibility.studies.workers import LOST, Workers, WorkersError

AHEAD = 2  # handfuls in flight for each worker: one at work, one waiting
HANDFUL_S = 0.2  # [s] that a handful should take: the rest of its way takes about a millisecond
LARGEST = 64  # tasks in one handful
LOOK = 0.1  # [s] between two looks at what has come back

Tables = dict[str, Any]
Work = Callable[[Tables], dict[str, Any]]


@dataclass(frozen=True, slots=True)
class Answer:
    """What came of one task."""

    index: int
    result: dict[str, Any] | None
    """None where it failed."""
    failure: str
    """Why it failed; empty otherwise."""
    seconds: float


def work_through(work: Work, tables: Sequence[Tables]) -> list[tuple[str | None, str, float]]:
    """In a worker: do some tasks one after the other.

    Returns:
        For each: its result as JSON or None, why it failed, the seconds that it took.
    """
    answers: list[tuple[str | None, str, float]] = []
    for table in tables:
        began = time.perf_counter()
        result, failure = None, ""
        try:
            result = json.dumps(work(table), allow_nan=False)
        except Exception as error:  # noqa: BLE001 - one bad task must not end a study
            failure = f"{type(error).__name__}: {' '.join(str(error).split())}"
        answers.append((result, failure, time.perf_counter() - began))
    return answers


def deal(
    work: Work,
    tables: Sequence[Tables],
    workers: Workers,
    receive: Callable[[list[Answer]], None],
) -> None:
    """Have all tasks done.

    A task that was in flight when a worker died is done again, with nothing else in flight: so the
    one that kills its worker is told from those that were merely there.

    Args:
        work: called with one of `tables`, in a worker; a function of a module.
        tables: what each task is told.
        workers: where to.
        receive: called here with answers as they come, in any order, and with none several times
            a second; what it raises ends the work.

    Raises:
        WorkersError: the workers were lost for good.
    """
    _Dealer(work, tables, workers, receive).run()


@dataclass(slots=True)
class _Dealer:
    """One deal in progress."""

    work: Work
    tables: Sequence[Tables]
    workers: Workers
    receive: Callable[[list[Answer]], None]
    waiting: deque[int] = field(init=False)
    suspects: deque[int] = field(default_factory=deque)
    """Were in flight when a worker died."""
    losses: Counter[int] = field(default_factory=Counter)
    """How often a task had a worker for itself and lost it."""
    flying: dict[Future[Any], list[int]] = field(default_factory=dict)
    alone: bool = False
    """Is what flies one suspect?"""
    pace: float = HANDFUL_S
    """[s] that a task takes, of late."""

    def __post_init__(self) -> None:
        """Nothing has been dealt out."""
        self.waiting = deque(range(len(self.tables)))

    def run(self) -> None:
        """Deal until everything is back."""
        while self.waiting or self.suspects or self.flying:
            whole = self._send()
            done = set[Future[Any]]()
            if self.flying:
                done, _ = wait(self.flying, timeout=LOOK, return_when=FIRST_COMPLETED)
            whole = self._collect(done) and whole
            if not whole:
                if self.workers.shared_fate:
                    self._collect(wait(self.flying).done)
                self.workers.renew()

    def _send(self) -> bool:
        """Deal out as much as should be in flight; False where the workers are broken."""
        if self.suspects:
            if self.flying:
                return True
            self.alone = True
            return self._fly(self.suspects, 1)
        self.alone = False
        width = self.workers.width
        while self.waiting and len(self.flying) < AHEAD * width:
            handful = min(int(HANDFUL_S / self.pace), LARGEST, len(self.waiting) // (2 * width))
            if not self._fly(self.waiting, max(handful, 1)):
                return False
        return True

    def _fly(self, source: deque[int], count: int) -> bool:
        """Send the first `count` tasks of a queue; False where nobody takes them."""
        indices = [source.popleft() for _ in range(count)]
        try:
            future = self.workers.submit(
                work_through, self.work, [self.tables[index] for index in indices]
            )
        except self.workers.losses:
            source.extendleft(reversed(indices))
            return False
        self.flying[future] = indices
        return True

    def _collect(self, done: set[Future[Any]]) -> bool:
        """Take in what has come back; False where workers were lost."""
        answers: list[Answer] = []
        whole = True
        for future in done:
            indices = self.flying.pop(future)
            try:
                results = future.result()
            except self.workers.losses as error:
                whole = False
                answers += self._lost(indices, error)
            except CancelledError as error:
                raise WorkersError(LOST) from error
            except Exception as error:  # what the tasks themselves raise comes as an answer
                said = " ".join(str(error).split())
                raise WorkersError(
                    f"the workers cannot run the tasks ({type(error).__name__}: {said}); what was "
                    "finished is kept: see that they have the same coverable installed"
                ) from error
            else:
                for index, (text, failure, seconds) in zip(indices, results, strict=True):
                    result = None if text is None else json.loads(text)
                    self.pace += 0.2 * (max(seconds, 1e-6) - self.pace)
                    answers.append(Answer(index, result, failure, seconds))
        self.receive(answers)
        return whole

    def _lost(self, indices: list[int], error: BaseException) -> list[Answer]:
        """Tasks whose worker died: try again, or give one up."""
        if not self.alone:
            self.suspects.extend(indices)
            return []
        (index,) = indices
        self.losses[index] += 1
        if self.losses[index] < self.workers.patience:
            self.suspects.appendleft(index)
            return []
        times = self.losses[index]
        failure = f"its worker died, {times} time{'s' if times > 1 else ''} with this task alone"
        return [Answer(index, None, failure, 0.0)]
