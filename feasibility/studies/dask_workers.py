"""Tasks of a study on a Dask cluster, as any other workers."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import CancelledError, Executor, Future, wait
from typing import Any

from feasibility.notices import slow_notice
from feasibility.roadmap import warm_up
from feasibility.studies.workers import LOST, WorkersError

CONNECT = 10.0  # [s] for a Dask scheduler to answer
GATHER = 60.0  # [s] for its first worker to be there
ASK = 2.0  # [s] between two questions about how many workers there are


class DaskWorkers:
    """The workers of a Dask cluster. Each needs coverable installed; one thread each is best."""

    patience = 1  # Dask has tried several workers before it gives a task up
    shared_fate = False

    def __init__(self, address: str, warm: bool) -> None:
        """Connect; see `open_workers`.

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
        self._warm, self._width, self._asked = warm, 1, -ASK
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
        if self._warm:
            self._load()
            self._warm = False
        return self._pool.submit(work, *arguments)

    def _load(self) -> None:
        """Have one worker of each machine load the kernels, so that the others need not compile.

        Raises:
            WorkersError: the scheduler is gone.
        """
        from distributed.comm import get_address_host

        try:
            machines = {get_address_host(name): name for name in self._client.nthreads()}
        except OSError as error:
            raise WorkersError(LOST) from error
        with slow_notice():
            # Another one will do, should the one that is named die meanwhile.
            ways = [
                self._client.get_executor(pure=False, workers=[name], allow_other_workers=True)
                for name in machines.values()
            ]
            wait([way.submit(warm_up) for way in ways])

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
