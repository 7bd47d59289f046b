"""Tasks of a study on a Dask cluster. Each worker needs coverable; one thread each is best."""

import gc
from collections import deque
from collections.abc import Sequence
from concurrent.futures import CancelledError
from contextlib import suppress

from distributed import Client, Future, KilledWorker, wait

from feasibility.studies.pool import (
    LOOK,
    Receive,
    Reply,
    Tables,
    Work,
    WorkersError,
    run_one,
    untold,
)

AHEAD = 2  # tasks in flight for each thread: one at work, one waiting
FIRST_WORKER = 60.0  # [s] for the first worker to be there


class DaskWorkers:
    """The workers of a Dask cluster; Dask itself does again what dies with one of them."""

    def __init__(self, address: str, connect: float) -> None:
        """Connect, and wait for the first worker; see `open_workers`.

        Raises:
            WorkersError: nothing useful answers there.
        """
        # A client that could not connect lives on in its own traceback. Where the garbage collector
        # closes it while another starts a thread, both wait for one lock for ever; so it goes now.
        gc.collect()
        try:
            self._client = Client(address, timeout=connect, set_as_default=False)
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

    @property
    def width(self) -> int:
        """Threads of all workers now; at least 1, for while they are replaced."""
        return max(sum(self._client.nthreads().values()), 1)

    def run(self, work: Work, tables: Sequence[Tables], receive: Receive) -> None:
        """See `Workers`."""
        waiting, flying = deque(range(len(tables))), dict[Future, int]()
        try:
            while waiting or flying:
                receive(self._step(work, tables, waiting, flying))
        finally:
            with suppress(OSError, RuntimeError):  # perhaps nobody is there any more
                self._client.cancel(list(flying))

    def _step(
        self, work: Work, tables: Sequence[Tables], waiting: deque[int], flying: dict[Future, int]
    ) -> dict[int, Reply]:
        """Keep enough tasks in flight, and wait a moment for replies.

        Raises:
            WorkersError: the scheduler is gone, or workers do not know such work.
        """
        try:
            most = AHEAD * self.width if waiting else 0
            while waiting and len(flying) < most:
                # Not pure: a task that is submitted again is run again.
                sent = self._client.submit(run_one, work, tables[waiting[0]], pure=False)
                flying[sent] = waiting.popleft()
            with suppress(TimeoutError), self._client.as_current():
                wait(list(flying), timeout=LOOK, return_when="FIRST_COMPLETED")
            done = [future for future in flying if future.done()]
            return {flying.pop(future): self._reply(future) for future in done}
        except (OSError, RuntimeError, CancelledError) as error:
            raise WorkersError(
                "the connection to the workers was lost; what was finished is kept, run again to "
                "continue"
            ) from error

    def _reply(self, future: Future) -> Reply:
        """The reply to a task that has come to an end."""
        try:
            return Reply(*future.result())
        except KilledWorker:
            return Reply(None, "its worker died, several times", 0.0)
        except (OSError, CancelledError):
            raise
        except Exception as error:  # what the tasks themselves raise comes as a reply
            raise untold(error) from error

    def close(self) -> None:
        """Leave the cluster; it goes on without us."""
        with suppress(OSError, RuntimeError):
            self._client.close()
