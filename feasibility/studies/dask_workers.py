"""Tasks of a study on a Dask cluster, as any other workers."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable
from concurrent.futures import Executor, Future, wait
from contextlib import suppress
from typing import Any

from feasibility.notices import slow_notice
from feasibility.roadmap import warm_up
from feasibility.studies.scheduling import BREAKS, WorkersError

FIRST_WORKER = 60.0  # [s] for its first worker to be there
ASK = 2.0  # [s] between two looks at how many workers there are


class DaskWorkers:
    """The workers of a Dask cluster. Each needs coverable installed; one thread each is best."""

    patience = 1  # Dask has tried several workers before it gives a task up
    breaks: tuple[type[BaseException], ...] = BREAKS

    def __init__(self, address: str, warm: bool, connect: float) -> None:
        """Connect; see `open_workers`.

        Raises:
            WorkersError: Dask is not installed, or nothing useful answers there.
        """
        try:
            from distributed import KilledWorker
        except ImportError as error:
            raise WorkersError(
                "--dask needs the library distributed: pip install 'coverable[dask]'"
            ) from error
        self.deaths: tuple[type[BaseException], ...] = (KilledWorker,)
        self._address, self._warm, self._patience = address, warm, connect
        self._connect()

    def _connect(self) -> None:
        """Find the scheduler, and wait for its first worker."""
        from distributed import Client

        address = self._address
        # A client that could not connect lives on in its own traceback. Where the garbage collector
        # closes it while another starts a thread, both wait for one lock for ever; so it goes now.
        gc.collect()
        try:
            self._client = Client(address, timeout=self._patience, set_as_default=False)
        except (OSError, ValueError, TypeError) as error:  # a timeout is an OSError
            raise WorkersError(
                f"no Dask scheduler answers at {address!r} ({error}); expected an address such as "
                "tcp://127.0.0.1:8786"
            ) from error
        try:
            self._client.wait_for_workers(1, timeout=FIRST_WORKER)
        except TimeoutError as error:
            self._client.close()
            raise WorkersError(
                f"the Dask scheduler at {address!r} has no workers; start some with `dask worker`"
            ) from error
        self._width, self._queried = 1, -ASK
        # Not pure: a task that is submitted again is run again.
        self._pool: Executor = self._client.get_executor(pure=False)

    @property
    def width(self) -> int:
        """Threads of all workers, as of late; at least 1, for while they are replaced."""
        now = time.monotonic()
        if now > self._queried + ASK:
            self._width = max(sum(self._client.nthreads().values()), 1)
            self._queried = now
        return self._width

    @property
    def broken(self) -> bool:
        """Is the connection closed?"""
        return self._client.status in ("closing", "closed")

    def submit(self, work: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Run it on the cluster."""
        if self._warm:
            self._load()
            self._warm = False
        return self._pool.submit(work, *arguments)

    def _load(self) -> None:
        """Have one worker of each machine load the kernels, so that the others need not compile."""
        from distributed.comm import get_address_host

        machines = {get_address_host(name): name for name in self._client.nthreads()}
        with slow_notice():
            # Another one will do, should the one that is named die meanwhile.
            pools = [
                self._client.get_executor(pure=False, workers=[name], allow_other_workers=True)
                for name in machines.values()
            ]
            wait([pool.submit(warm_up, True) for pool in pools])

    def renew(self) -> None:
        """Connect again; Dask replaces workers by itself.

        Raises:
            WorkersError: the scheduler is gone.
        """
        self.close()
        try:
            self._connect()
        except WorkersError as error:
            raise WorkersError(
                "the connection to the workers was lost; what was finished is kept, run again to "
                "continue"
            ) from error

    def close(self) -> None:
        """Leave the cluster; it goes on without us."""
        with suppress(*self.breaks):  # perhaps nobody is there any more
            self._pool.shutdown(wait=False)
        with suppress(*self.breaks):
            self._client.close()
