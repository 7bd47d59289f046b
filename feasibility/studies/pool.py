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
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any, NamedTuple, Protocol

from coverable.errors import CoverableError, counted
from feasibility.clock import OutOfTime
from feasibility.notices import compiling_notice

LOOK = 0.1  # [s] between two calls of `receive`
PATIENCE = 3  # workers that may die with a task before it is given up
STARTS = 3  # workers that may die before they are ready, one after the other
READY = b"."  # from a worker, ahead of its first reply

Tables = dict[str, Any]
Work = Callable[[Tables], Mapping[str, Any]]


class WorkersError(CoverableError):
    """Workers that cannot be had, or were lost for good; what would do."""


class Reply(NamedTuple):
    """What came of one task."""

    result: dict[str, Any] | None
    """JSON values; None where it failed."""
    failure: str
    """Why it failed; empty otherwise."""
    seconds: float


Receive = Callable[[dict[int, Reply]], None]


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
            receive: called here with replies by the index of their tasks, as they come, and with
                none several times a second; what it raises ends the work.

        Raises:
            WorkersError: the workers were lost for good, or cannot be told of such work.
        """

    def close(self) -> None:
        """End the workers, whatever they are doing."""


def run_one(work: Work, tables: Tables) -> Reply:
    """Do one task."""
    began = time.perf_counter()
    result, failure = None, ""
    try:
        result = json.loads(json.dumps(work(tables), allow_nan=False))
    except OutOfTime:  # of the whole run, which ends with it
        raise
    except Exception as error:  # noqa: BLE001 - one bad task must not end a study
        failure = one_line(error)
    return Reply(result, failure, time.perf_counter() - began)


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


def warm_up(rarely_used: bool = False) -> None:
    """Load the kernels of the search: imported here, as workers that need none start at once."""
    from feasibility.roadmap import warmup

    warmup.warm_up(rarely_used)


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
            receive({index: run_one(work, table)})

    def close(self) -> None:
        """Nothing is open."""


class Processes:
    """Processes of this machine that have the kernels loaded; they end with this one."""

    def __init__(self, count: int, warm: bool) -> None:
        """None is started yet; see `open_workers`."""
        self.width, self._warm = count, warm
        self._context = multiprocessing.get_context("spawn")
        self._all, self._busy = dict[Connection, BaseProcess](), dict[Connection, int]()
        self._ready = set[Connection]()
        """Those that have loaded what they need."""
        self._lost = 0  # before they were ready, since anything was done
        self._waiting, self._deaths = deque[int](), Counter[int]()

    def run(self, work: Work, tables: Sequence[Tables], receive: Receive) -> None:
        """See `Workers`."""
        self._waiting, self._deaths = deque(range(len(tables))), Counter()
        try:
            self._start()
            if self._warm and tables:  # compiled here, if need be: the others find that
                with compiling_notice():
                    warm_up(True)
            while self._waiting or self._busy:
                self._start()
                for pipe in list(self._all.keys() - self._busy.keys())[: len(self._waiting)]:
                    self._busy[pipe] = self._waiting.popleft()
                    try:
                        pipe.send((work, tables[self._busy[pipe]]))
                    except OSError:
                        pass  # it died, which will show
                    except (AttributeError, TypeError, pickle.PicklingError) as error:
                        raise untold(error) from error
                replies = dict[int, Reply]()
                for heard in wait(list(self._all), LOOK):
                    replies |= self._heard(heard)  # pyrefly: ignore[bad-argument-type]
                receive(replies)
        finally:
            for pipe in list(self._busy):  # whatever ended the work: nobody asks for it any more
                self._end(pipe)

    def _start(self) -> None:
        """Have as many processes as are needed.

        They must never see a Ctrl-C, which a terminal sends to all: they take over what is blocked.
        """
        while len(self._all) < min(self.width, len(self._waiting) + len(self._busy)):
            ours, theirs = self._context.Pipe()
            process = self._context.Process(target=_serve, args=[theirs, self._warm], daemon=True)
            resource_tracker.ensure_running()  # which would unblock it, in the first one's start
            before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
            try:
                process.start()
                self._all[ours] = process
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, before)
            theirs.close()  # so that its end shows

    def _heard(self, pipe: Connection) -> dict[int, Reply]:
        """The reply, if there is one, of a process that has sent something or died.

        Raises:
            WorkersError: too many died at their start, or it does not know such work.
        """
        try:
            said = pipe.recv()
        except (EOFError, OSError):
            return self._died(pipe)
        self._lost = 0
        if said == READY:
            self._ready.add(pipe)
            return {}
        if isinstance(said, str):
            raise untold(said)
        return {self._busy.pop(pipe): said}

    def _died(self, pipe: Connection) -> dict[int, Reply]:
        """A process is gone: its task is done again, unless it has cost too many already."""
        starting, index = pipe not in self._ready, self._busy.get(pipe)
        self._end(pipe)
        self._lost += starting
        if self._lost >= STARTS:
            raise WorkersError(
                f"the worker processes died while starting, {STARTS} times; what was finished is "
                "kept: see that there is enough memory, or use fewer workers"
            )
        if index is None:
            return {}
        self._deaths[index] += not starting
        if self._deaths[index] < PATIENCE:
            self._waiting.append(index)
            return {}
        return {index: Reply(None, f"its worker died, {counted(PATIENCE, 'time')}", 0.0)}

    def _end(self, pipe: Connection) -> None:
        """End a process, if it has not ended, and forget it."""
        process = self._all.pop(pipe)
        process.kill()
        process.join()
        pipe.close()
        self._busy.pop(pipe, None)
        self._ready.discard(pipe)

    def close(self) -> None:
        """End all processes."""
        for process in self._all.values():
            process.kill()
        for pipe in list(self._all):
            self._end(pipe)


def _serve(pipe: Connection, warm: bool) -> None:
    """In a new process: do one task after the other, with the kernels loaded before the first."""
    parent = multiprocessing.parent_process()

    def watch() -> None:
        if parent is not None:
            parent.join()  # however it dies
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
    done: Any = None
    with suppress(EOFError, OSError):
        while True:
            try:
                work, tables = pipe.recv()
                if done is None:
                    if warm:
                        warm_up(True)
                    pipe.send(READY)
                done = run_one(work, tables)
            except (EOFError, OSError):
                raise
            except Exception as error:  # noqa: BLE001 - work that is unknown here
                done = one_line(error)
            pipe.send(done)
