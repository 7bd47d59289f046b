"""Where the tasks of a study run: in this process, or in processes of this machine.

Each of these has a pipe of its own, so that what dies with one of them is one task, which is done
again. They are started afresh (spawn): a forked one would share locks of Pinocchio and numba.
"""

import json
import multiprocessing
import os
import pickle
import signal
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any, Protocol

from coverable.errors import CoverableError, counted
from feasibility.clock import OutOfTime
from feasibility.notices import compiling_notice, notify
from feasibility.roadmap.warmup import warm_up

LOOK = 0.1  # [s] between two calls of `receive`
PATIENCE = 3  # workers that may die with a task before it is given up
STARTS = 3  # workers that may die before they are ready, one after the other
COMPILING, READY = b"!", b"."  # from a worker, ahead of its first reply

Tables = dict[str, Any]
Work = Callable[[Tables], Mapping[str, Any]]
Done = tuple[str | None, str, float]
"""Of one task: its result as JSON or None, why it failed, the seconds that it took."""


class WorkersError(CoverableError):
    """Workers that cannot be had, or were lost for good; what would do."""


@dataclass(frozen=True, slots=True)
class Reply:
    """What came of one task."""

    index: int
    result: dict[str, Any] | None
    """None where it failed."""
    failure: str
    """Why it failed; empty otherwise."""
    seconds: float

    @classmethod
    def of(cls, index: int, done: Done) -> "Reply":
        """The reply to a task that was done."""
        text, failure, seconds = done
        return cls(index, None if text is None else json.loads(text), failure, seconds)


Receive = Callable[[list[Reply]], None]


class Workers(Protocol):
    """Where tasks run."""

    @property
    def width(self) -> int:
        """How many tasks run at the same time."""

    def run(self, work: Work, tables: Sequence[Tables], receive: Receive) -> None:
        """Have all tasks done.

        Args:
            work: called with one of `tables`, in a worker; a function of a module.
            tables: of each task.
            receive: called here with replies as they come, in any order, and with none several
                times a second; what it raises ends the work.

        Raises:
            WorkersError: the workers were lost for good, or cannot be told of such work.
        """

    def close(self) -> None:
        """End the workers, whatever they are doing."""


def run_one(work: Work, tables: Tables) -> Done:
    """Do one task."""
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


def untold(error: BaseException | str) -> WorkersError:
    """The error about work that workers cannot do."""
    why = error if isinstance(error, str) else one_line(error)
    return WorkersError(
        f"the workers cannot run the tasks ({why}); what was finished is kept: see that they have "
        "the same coverable installed"
    )


class Here:
    """This process itself: one task after the other."""

    width = 1

    def __init__(self, warm: bool) -> None:
        """Nothing is done yet; see `open_workers`."""
        self._warm = warm

    def run(self, work: Work, tables: Sequence[Tables], receive: Receive) -> None:
        """See `Workers`."""
        if self._warm and tables:
            with compiling_notice():
                warm_up()
        for index, table in enumerate(tables):
            receive([Reply.of(index, run_one(work, table))])

    def close(self) -> None:
        """Nothing is open."""


class Processes:
    """Processes of this machine that have the kernels loaded; they end with this one."""

    def __init__(self, count: int, warm: bool) -> None:
        """None is started yet; see `open_workers`."""
        self.width, self._warm = count, warm
        self._context = multiprocessing.get_context("spawn")
        self._all = dict[Connection, BaseProcess]()
        self._new = list[Connection]()
        """Started, and not yet told to load the kernels."""
        self._loading, self._idle = set[Connection](), list[Connection]()
        self._busy = dict[Connection, int]()
        self._loaded = not warm
        self._lost = 0  # before they were ready, since anything was done
        self._waiting, self._deaths = deque[int](), Counter[int]()

    def run(self, work: Work, tables: Sequence[Tables], receive: Receive) -> None:
        """See `Workers`."""
        self._waiting, self._deaths = deque(range(len(tables))), Counter()
        try:
            while self._waiting or self._busy:
                self._occupy(work, tables)
                replies = list[Reply]()
                for pipe in wait(list(self._all), LOOK):
                    replies += self._heard(pipe)  # type: ignore[arg-type]
                receive(replies)
        finally:
            for pipe in list(self._busy):  # whatever ended the work: nobody asks for it any more
                self._end(pipe)

    def _occupy(self, work: Work, tables: Sequence[Tables]) -> None:
        """Have as many processes as are needed, and have them do something."""
        while len(self._all) < min(self.width, len(self._waiting) + len(self._busy)):
            self._new.append(self._start())
        # The first one to load may have to compile; the others find what it has compiled.
        while self._new and (self._loaded or not self._loading):
            self._loading.add(pipe := self._new.pop())
            self._send(pipe, self._warm)
        while self._waiting and self._idle:
            pipe, index = self._idle.pop(), self._waiting.popleft()
            self._busy[pipe] = index
            self._send(pipe, (work, tables[index]))

    def _start(self) -> Connection:
        """The pipe to a new process.

        It must never see a Ctrl-C, which a terminal sends to all: it takes over what is blocked.
        """
        ours, theirs = self._context.Pipe()
        process = self._context.Process(target=_serve, args=[theirs], daemon=True)
        resource_tracker.ensure_running()  # which would unblock it, in the first process's start
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            process.start()
            self._all[ours] = process
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        theirs.close()  # so that its end shows
        return ours

    def _send(self, pipe: Connection, what: Any) -> None:
        """Tell a process what to do; that it died meanwhile will show.

        Raises:
            WorkersError: it cannot be told of such work.
        """
        try:
            pipe.send(what)
        except OSError:
            pass
        except (AttributeError, TypeError, pickle.PicklingError) as error:
            raise untold(error) from error

    def _heard(self, pipe: Connection) -> list[Reply]:
        """The reply, if there is one, of a process that has sent something or died.

        Raises:
            WorkersError: too many died at their start, or it does not know such work.
        """
        try:
            said = pipe.recv()
        except (EOFError, OSError):
            return self._died(pipe)
        if said == COMPILING:
            notify()
        elif said == READY:
            self._loading.discard(pipe)
            self._idle.append(pipe)
            self._loaded, self._lost = True, 0
        elif isinstance(said, str):
            raise untold(said)
        else:
            self._idle.append(pipe)
            self._lost = 0
            return [Reply.of(self._busy.pop(pipe), said)]
        return []

    def _died(self, pipe: Connection) -> list[Reply]:
        """A process is gone: its task is done again, unless it has cost too many already."""
        starting, index = pipe in self._loading or pipe in self._new, self._busy.get(pipe)
        self._end(pipe)
        self._lost += starting
        if self._lost >= STARTS:
            raise WorkersError(
                f"the worker processes died while starting, {STARTS} times; what was finished is "
                "kept: see that there is enough memory, or use fewer workers"
            )
        if index is None:
            return []
        self._deaths[index] += 1
        if self._deaths[index] < PATIENCE:
            self._waiting.append(index)
            return []
        failure = f"its worker died, {counted(PATIENCE, 'time')}"
        return [Reply(index, None, failure, 0.0)]

    def _end(self, pipe: Connection) -> None:
        """End a process, if it has not ended, and forget it."""
        process = self._all.pop(pipe)
        process.kill()
        process.join()
        pipe.close()
        self._busy.pop(pipe, None)
        self._loading.discard(pipe)
        for some in (self._new, self._idle):
            if pipe in some:
                some.remove(pipe)

    def close(self) -> None:
        """End all processes."""
        for process in self._all.values():
            process.kill()
        for pipe in list(self._all):
            self._end(pipe)


def _serve(pipe: Connection) -> None:
    """In a new process: load the kernels when told to, then do one task after the other."""
    parent = multiprocessing.parent_process()

    def watch() -> None:
        if parent is not None:
            parent.join()  # however it dies
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
    with suppress(EOFError, OSError):
        if pipe.recv():
            with compiling_notice(say=lambda: pipe.send(COMPILING)):
                warm_up(True)
        pipe.send(READY)
        while True:
            try:
                work, tables = pipe.recv()
                done: Any = run_one(work, tables)
            except (EOFError, OSError):
                raise
            except Exception as error:  # noqa: BLE001 - work that is unknown here
                done = one_line(error)
            pipe.send(done)
