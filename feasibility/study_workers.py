"""Where the tasks of a study run: this process, processes of this machine, or a Dask cluster.

All of them are a `concurrent.futures.Executor` with what is needed around it: how wide it is, how
the loss of a worker shows, and how it is made ready again.
"""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from contextlib import contextmanager
from multiprocessing.connection import Connection
from typing import Any, Protocol

ATTEMPTS = 3  # to start worker processes anew
CONNECT = 10.0  # [s] for a Dask scheduler to answer
ASK = 2.0  # [s] between two questions about how many workers there are
LOST = "the connection to the workers was lost; what was finished is kept, run again to continue"
GATHER = 60.0  # [s] for its first worker to be there


class WorkersError(ValueError):
    """Workers that cannot be had, or were lost for good; what would do."""


class Workers(Protocol):
    """Where tasks run."""

    losses: tuple[type[BaseException], ...]
    """What a future raises when a worker died on it."""
    patience: int
    """How often a task may lose the worker that it has for itself before it is given up."""
    shared_fate: bool
    """Does the death of one worker end all that is in flight?"""

    @property
    def width(self) -> int:
        """How many tasks run at the same time."""

    def submit(self, work: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Run something; arguments and result are pickled on their way."""

    def renew(self) -> None:
        """Make ready again after a loss."""

    def close(self, at_once: bool) -> None:
        """End the workers: after what they are doing, or at once."""


@contextmanager
def open_workers(
    count: int | None = None, address: str | None = None, *, warm: bool = True
) -> Iterator[Workers]:
    """Workers for `feasibility.study.run_tasks`, until the block ends.

    Args:
        count: processes on this machine; None for one on each processor, 0 for none: then tasks
            run in this process.
        address: of a Dask scheduler, such as "tcp://127.0.0.1:8786", instead of processes.
        warm: load the kernels of the search into each process before its first task.

    Raises:
        WorkersError: there is no such scheduler, or both are given.
        ValueError: the count is negative.

    Example:
        >>> with open_workers(0) as workers:
        ...     workers.submit(max, 3, 5).result()
        5
    """
    if address is not None and count is not None:
        raise WorkersError("give a number of worker processes or the address of Dask, not both")
    if count is not None and count < 0:
        raise WorkersError(f"the number of workers must be >= 0, got {count}")
    workers: Workers
    if address is not None:
        workers = DaskWorkers(address)
    else:
        workers = (
            Here() if count == 0 else Processes(processors() if count is None else count, warm)
        )
    try:
        yield workers
    except BaseException:
        workers.close(at_once=True)
        raise
    workers.close(at_once=False)


def processors() -> int:
    """How many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class Here:
    """This process itself: one task after the other."""

    losses: tuple[type[BaseException], ...] = ()
    patience = 1
    shared_fate = False
    width = 1

    def submit(self, work: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Run it now."""
        future: Future[Any] = Future()
        try:
            future.set_result(work(*arguments))
        except Exception as error:  # noqa: BLE001 - it is the future's, as in every executor
            future.set_exception(error)
        return future

    def renew(self) -> None:
        """Nothing can be lost."""

    def close(self, at_once: bool) -> None:
        """Nothing is open."""


class Processes:
    """Processes of this machine that have the kernels loaded.

    They are started afresh (spawn): a forked one would share locks of Pinocchio and numba. A pipe
    is their leash: when this process dies, however it dies, its end closes and they end too.
    """

    losses: tuple[type[BaseException], ...] = (BrokenExecutor,)
    patience = 3
    shared_fate = True

    def __init__(self, count: int, warm: bool) -> None:
        """Start `count` processes, as they are needed; see `open_workers`."""
        self.width, self._warm = count, warm
        self._start()

    def _start(self) -> None:
        """Make the pool."""
        from concurrent.futures import ProcessPoolExecutor
        from multiprocessing import get_context

        context = get_context("spawn")
        self._end, self._leash = context.Pipe(duplex=False)
        self._pool: Executor = ProcessPoolExecutor(
            self.width, mp_context=context, initializer=_begin, initargs=(self._end, self._warm)
        )

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
            self.close(at_once=True)
            self._start()
            try:
                self.submit(os.getpid).result()
                return
            except BrokenExecutor:
                continue
        raise WorkersError(
            f"the worker processes died while starting, {ATTEMPTS} times; what was finished is "
            "kept: see that there is enough memory, or use fewer workers"
        )

    def close(self, at_once: bool) -> None:
        """End the processes."""
        if at_once:
            self._leash.close()
        self._pool.shutdown(wait=True, cancel_futures=True)
        self._leash.close()
        self._end.close()


def _begin(leash: Connection, warm: bool) -> None:
    """In a new worker: watch the leash, load the kernels."""

    def watch() -> None:
        leash.poll(None)  # nothing is ever sent: it returns when the other end is closed
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
    if warm:
        from feasibility.warmup import warm_up

        warm_up()


class DaskWorkers:
    """The workers of a Dask cluster. Each needs coverable installed; one thread each is best."""

    patience = 1  # Dask has tried several workers before it gives a task up
    shared_fate = False

    def __init__(self, address: str) -> None:
        """Connect.

        Raises:
            WorkersError: Dask is not installed, or nothing useful answers there.
        """
        try:
            from distributed import Client, KilledWorker
        except ImportError as error:
            raise WorkersError(
                "--dask needs the library distributed: pip install 'coverable[dask]'"
            ) from error
        self.losses: tuple[type[BaseException], ...] = (KilledWorker,)
        try:
            self._client = Client(address, timeout=CONNECT, set_as_default=False)
        except (OSError, ValueError, TypeError) as error:  # a timeout is an OSError
            raise WorkersError(
                f"no Dask scheduler answers at {address!r} ({error}); expected an address such as "
                "tcp://127.0.0.1:8786"
            ) from error
        try:
            self._client.wait_for_workers(1, timeout=GATHER)
        except TimeoutError as error:
            self._client.close()
            raise WorkersError(
                f"the Dask scheduler at {address!r} has no workers; start some with `dask worker`"
            ) from error
        self._width, self._asked = 1, -ASK
        # Not pure: a task that is submitted again is run again.
        self._pool: Executor = self._client.get_executor(pure=False)

    @property
    def width(self) -> int:
        """Threads of all workers, as of late; at least 1, for while they are replaced.

        Raises:
            WorkersError: the scheduler is gone.
        """
        now = time.monotonic()
        if now > self._asked + ASK:
            try:
                self._width = max(sum(self._client.nthreads().values()), 1)
            except OSError as error:
                raise WorkersError(LOST) from error
            self._asked = now
        return self._width

    def submit(self, work: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Run it on the cluster."""
        return self._pool.submit(work, *arguments)

    def renew(self) -> None:
        """Dask replaces its workers by itself."""

    def close(self, at_once: bool) -> None:
        """Leave the cluster; it goes on without us."""
        try:
            self._pool.shutdown(wait=not at_once)
        except (CancelledError, OSError):  # nobody is there to be told
            pass
        finally:
            self._client.close()
