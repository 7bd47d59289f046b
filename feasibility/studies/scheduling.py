"""Tasks on workers: every task comes back, also where workers die or their pool breaks."""

from __future__ import annotations

import json
import time
from collections import Counter, deque
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Future, wait
from dataclasses import dataclass, field
from typing import Any, Protocol

from coverable_errors import CoverableError, counted
from feasibility.clock import OutOfTime

AHEAD = 2  # tasks in flight for each worker: one at work, one waiting
LOOK = 0.1  # [s] between two queries of the futures
MOST_BREAKS = 10  # of the pool, one after the other, with nothing finished in between

BREAKS = (BrokenExecutor, CancelledError, EOFError, OSError, RuntimeError, ValueError)
"""What a pool that is breaking raises, at submitting or as the outcome of a future, besides
BrokenExecutor: its pipes may be closed already while it does not yet know that a worker died."""

Tables = dict[str, Any]
Work = Callable[[Tables], dict[str, Any]]


class WorkersError(CoverableError):
    """Workers that cannot be had, or were lost for good; what would do."""


class Workers(Protocol):
    """Where tasks run."""

    breaks: tuple[type[BaseException], ...]
    """What `submit` or a future raises when the pool is of no more use, and has to be renewed."""
    deaths: tuple[type[BaseException], ...]
    """What a future raises when a worker died with it."""
    patience: int
    """How many workers may die with a task alone in flight before it is given up."""

    @property
    def width(self) -> int:
        """How many tasks run at the same time."""

    @property
    def broken(self) -> bool:
        """Is the pool of no more use? Its futures then may never end."""

    def submit(self, work: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Run something; arguments and result are pickled on their way."""

    def renew(self) -> None:
        """Start a new pool after one broke, whose futures never finish."""

    def close(self) -> None:
        """End the workers, whatever they are doing."""


@dataclass(frozen=True, slots=True)
class Reply:
    """What came of one task."""

    index: int
    result: dict[str, Any] | None
    """None where it failed."""
    failure: str
    """Why it failed; empty otherwise."""
    seconds: float


def run_one(work: Work, tables: Tables) -> tuple[str | None, str, float]:
    """In a worker: do one task.

    Returns:
        Its result as JSON or None, why it failed, the seconds that it took.
    """
    began = time.perf_counter()
    result, failure = None, ""
    try:
        result = json.dumps(work(tables), allow_nan=False)
    except OutOfTime:  # of the whole run, which ends with it
        raise
    except Exception as error:  # noqa: BLE001 - one bad task must not end a study
        failure = one_line(error)
    return result, failure, time.perf_counter() - began


def one_line(error: BaseException) -> str:
    """An error with its kind."""
    return f"{type(error).__name__}: {' '.join(str(error).split())}"


def schedule(
    work: Work,
    tables: Sequence[Tables],
    workers: Workers,
    receive: Callable[[list[Reply]], None],
) -> None:
    """Have all tasks done.

    A task that was in flight when the pool broke is done again, with nothing else in flight: so a
    task that kills its worker is distinguished from those in flight beside it.

    Args:
        work: called with one of `tables`, in a worker; a function of a module.
        tables: of each task.
        workers: where they run.
        receive: called here with replies as they come, in any order, and with none several times
            a second; what it raises ends the work.

    Raises:
        WorkersError: the workers were lost for good.
    """
    _Schedule(work, tables, workers, receive).run()


@dataclass(slots=True)
class _Schedule:
    """Tasks in progress."""

    work: Work
    tables: Sequence[Tables]
    workers: Workers
    receive: Callable[[list[Reply]], None]
    waiting: deque[int] = field(init=False)
    suspects: deque[int] = field(default_factory=deque)
    """Were in flight when the pool broke."""
    deaths: Counter[int] = field(default_factory=Counter)
    """How often a worker died with this task alone in flight."""
    flying: dict[Future[Any], int] = field(default_factory=dict)
    alone: bool = False
    """Is what flies one suspect?"""
    breaks: int = 0
    """Since something was finished."""

    def __post_init__(self) -> None:
        """Nothing is submitted yet."""
        self.waiting = deque(range(len(self.tables)))

    def run(self) -> None:
        """Go on until everything is back."""
        while self.waiting or self.suspects or self.flying:
            try:
                self._submit()
            except self.workers.breaks as error:
                self._renew(error)
                continue
            done, _ = wait(self.flying, timeout=LOOK, return_when=FIRST_COMPLETED)
            broke = self._collect(done)
            if broke is not None or self.workers.broken:
                self._renew(broke)

    def _submit(self) -> None:
        """Submit as much as should be in flight; raises what a broken pool raises."""
        if not self.flying:
            self.alone = bool(self.suspects)
        source = self.suspects if self.alone else self.waiting
        most = 1 if self.alone else AHEAD * self.workers.width
        while source and len(self.flying) < most and self.alone == bool(self.suspects):
            future = self.workers.submit(run_one, self.work, self.tables[source[0]])
            self.flying[future] = source.popleft()

    def _renew(self, error: BaseException | None) -> None:
        """The pool broke: start a new one; what is not finished is done again."""
        self.breaks += 1
        if self.breaks > MOST_BREAKS:
            why = "" if error is None else f" ({one_line(error)})"
            raise WorkersError(
                f"the workers were lost {self.breaks} times in a row{why}; what was finished is "
                "kept, run again to continue"
            ) from error
        try:
            self.workers.renew()
        finally:
            self._collect(set(self.flying))

    def _collect(self, futures: set[Future[Any]]) -> BaseException | None:
        """Take in what has come back; returns what a broken pool raised."""
        replies: list[Reply] = []
        broke = None
        try:
            for future in futures:
                error = self._take(future, replies)
                broke = error or broke
        finally:
            self.breaks = 0 if replies else self.breaks
            self.receive(replies)
        return broke

    def _take(self, future: Future[Any], replies: list[Reply]) -> BaseException | None:
        """Add the reply of one task; without one, the task is done again."""
        index = self.flying.pop(future)
        broken, deaths = self.workers.breaks, self.workers.deaths
        try:
            # A future that is not done belongs to a pool that is gone: a TimeoutError is a loss.
            text, failure, seconds = future.result(timeout=0)
        except (*broken, *deaths) as error:
            if self.alone and isinstance(error, deaths):
                self.deaths[index] += 1
            times = self.deaths[index]
            if times == self.workers.patience:
                failure = f"its worker died, {counted(times, 'time')} with this task alone"
                replies.append(Reply(index, None, failure, 0.0))
            else:
                self.suspects.appendleft(index)
            return error if isinstance(error, broken) else None
        except Exception as error:  # what the tasks themselves raise comes as a reply
            if self.workers.broken:  # Dask stumbles over its own cancelled tasks
                self.suspects.appendleft(index)
                return error
            raise WorkersError(
                f"the workers cannot run the tasks ({one_line(error)}); what was finished is "
                "kept: see that they have the same coverable installed"
            ) from error
        result = None if text is None else json.loads(text)
        replies.append(Reply(index, result, failure, seconds))
        return None
