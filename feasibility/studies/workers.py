"""Where the tasks of a study run: this process, processes of this machine, or a Dask cluster.

All of them are a `concurrent.futures.Executor` with what is needed around it: how wide it is, how
the loss of a worker shows, and how it is made ready again. Whatever a pool raises when it
breaks is one event: the tasks that are not finished are done again, in a new pool.
"""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from multiprocessing.synchronize import Lock
from typing import Any

from feasibility.clock import OutOfTime
from feasibility.notices import compiling_notice, notify
from feasibility.roadmap import warm_up, warm_up_in_turn
from feasibility.studies.scheduling import BREAKS, Workers, WorkersError

ATTEMPTS = 3  # to start worker processes anew

MOST = 1_000  # processes
CONNECT = 10.0  # [s] for a Dask scheduler to answer


@contextmanager
def open_workers(
    count: int | None = None,
    address: str | None = None,
    *,
    warm: bool = True,
    connect: float = CONNECT,
) -> Iterator[Workers]:
    """Workers for `run_tasks`, until the block ends, and with it their work.

    Args:
        count: processes on this machine; None for one on each processor, 0 for none: then tasks
            run in this process.
        address: of a Dask scheduler, such as "tcp://127.0.0.1:8786", instead of processes.
        warm: load the kernels of the search before the first task. Where they have to be compiled,
            one process does it while the others wait, and a line on stderr says so.
        connect: s for a Dask scheduler to answer.

    Raises:
        WorkersError: there is no such scheduler, both are given, or the count is not in 0 .. 1,000.

    Example:
        >>> with open_workers(0) as workers:
        ...     workers.submit(max, 3, 5).result()
        5
    """
    if address is not None and count is not None:
        raise WorkersError("give a number of worker processes or the address of Dask, not both")
    if count is not None and not 0 <= count <= MOST:
        raise WorkersError(f"the number of workers must be in 0 .. {MOST:,}, got {count}")
    workers: Workers
    if address is not None:
        from feasibility.studies.dask_workers import DaskWorkers

        workers = DaskWorkers(address, warm, connect)
    elif count == 0:
        workers = Here(warm)
    else:
        workers = Processes(processors() if count is None else count, warm)
    try:
        yield workers
    finally:
        workers.close()


def processors() -> int:
    """How many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class Here:
    """This process itself: one task after the other."""

    breaks: tuple[type[BaseException], ...] = ()
    deaths: tuple[type[BaseException], ...] = ()
    patience = 1
    width = 1
    broken = False

    def __init__(self, warm: bool) -> None:
        """Nothing is done yet; see `open_workers`."""
        self._warm = warm

    def submit(self, work: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Run it now."""
        if self._warm:
            with compiling_notice():
                warm_up()
            self._warm = False
        future: Future[Any] = Future()
        try:
            future.set_result(work(*arguments))
        except OutOfTime:
            raise
        except Exception as error:  # noqa: BLE001 - it is the future's, as in every executor
            future.set_exception(error)
        return future

    def renew(self) -> None:
        """Nothing can break."""

    def close(self) -> None:
        """Nothing is open."""


class Processes:
    """Processes of this machine that have the kernels loaded.

    They are started afresh (spawn): a forked one would share locks of Pinocchio and numba. A pipe
    tells them of this process's death: however it dies, its end closes and they end too.
    """

    breaks: tuple[type[BaseException], ...] = BREAKS
    deaths: tuple[type[BaseException], ...] = BREAKS
    patience = 3

    def __init__(self, count: int, warm: bool) -> None:
        """Start `count` processes, as they are needed; see `open_workers`."""
        self.width, self._warm = count, warm
        self._start()

    def _start(self) -> None:
        """Make the pool."""
        from concurrent.futures import ProcessPoolExecutor
        from multiprocessing import get_context

        context = get_context("spawn")
        self._death_read, self._death_write = context.Pipe(duplex=False)
        heard, self._notices = context.Pipe(duplex=False)
        self._listener = threading.Thread(target=_pass_on, args=[heard], daemon=True)
        self._listener.start()
        lock = context.Lock() if self._warm else None
        self._pool: Executor = ProcessPoolExecutor(
            self.width,
            mp_context=context,
            initializer=_begin,
            initargs=(self._death_read, self._notices, lock),
        )

    @property
    def broken(self) -> bool:
        """Has a process died? Python 3.11 forgets tasks that are submitted at that moment."""
        return bool(getattr(self._pool, "_broken", False))

    def submit(self, work: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Run it in one of the processes."""
        # A process that is started here must never see a Ctrl-C, which a terminal sends to all:
        # it takes over what is blocked.
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            return self._pool.submit(work, *arguments)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)

    def renew(self) -> None:
        """Start new processes, and wait for one of them.

        Raises:
            WorkersError: they die before they do anything.
        """
        for _ in range(ATTEMPTS):
            self.close()
            with suppress(*self.breaks):
                self._start()
                self.submit(os.getpid).result()
                return
        raise WorkersError(
            f"the worker processes died while starting, {ATTEMPTS} times; what was finished is "
            "kept: see that there is enough memory, or use fewer workers"
        )

    def close(self) -> None:
        """End the processes.

        They end themselves, as when this process dies. Asked by the pool they might not: one that
        is killed while it waits for a task takes the lock of the others' queue with it.
        """
        self._death_write.close()
        with suppress(*self.breaks):
            self._pool.shutdown(wait=True, cancel_futures=True)
        self._death_read.close()
        self._notices.close()
        self._listener.join()


def _pass_on(heard: Connection) -> None:
    """Say that a worker compiles, when it sends word; until nobody is left who could."""
    with heard:
        try:
            heard.recv_bytes()
        except (EOFError, OSError):
            return
    notify()


def _begin(parent: Connection, notices: Connection, lock: Lock | None) -> None:
    """In a new worker: watch the parent; load the kernels, one worker first, if there is a lock."""

    def watch() -> None:
        parent.poll(None)  # nothing is ever sent: it returns when the other end is closed
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
    if lock is not None:
        warm_up_in_turn(lock, lambda: notices.send_bytes(b"!"))
    notices.close()
