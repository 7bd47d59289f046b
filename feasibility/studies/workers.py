"""Workers opened: this process, processes of this machine, or a Dask cluster."""

import os
from collections.abc import Generator
from contextlib import contextmanager

from feasibility.interrupts import at_leave
from feasibility.studies.pool import Here, Processes, Workers, WorkersError

MOST = 1_000  # processes
CONNECT = 10.0  # [s] for a Dask scheduler to answer


@contextmanager
def open_workers(
    count: int | None = None,
    address: str | None = None,
    *,
    warm: bool = True,
    connect: float = CONNECT,
) -> Generator[Workers]:
    """Workers for `run_tasks`, until the block ends, and with it their work.

    Args:
        count: processes on this machine; None for one on each processor, 0 for none: then tasks
            run in this process.
        address: of a Dask scheduler, such as "tcp://127.0.0.1:8786", instead of processes.
        warm: load the kernels of the search in every process before its first task. Where they have
            to be compiled, this process does it before, and a line on stderr says so.
        connect: s for a Dask scheduler to answer.

    Raises:
        WorkersError: there is no such scheduler, both are given, or the count is not in 0 .. 1,000.

    Example:
        >>> with open_workers(0, warm=False) as workers:
        ...     workers.run(dict, [{"a": 1}], lambda replies: print(replies[0].result))
        {'a': 1}
    """
    if address is not None and count is not None:
        raise WorkersError("give a number of worker processes or the address of Dask, not both")
    if count is not None and not 0 <= count <= MOST:
        raise WorkersError(f"the number of workers must be in 0 .. {MOST:,}, got {count}")
    workers: Workers
    if address is not None:
        try:
            from feasibility.studies.dask_workers import DaskWorkers
        except ImportError as error:
            raise WorkersError(
                "--dask needs the library distributed: pip install 'coverable[dask]'"
            ) from error
        workers = DaskWorkers(address, connect)
    elif count == 0:
        workers = Here(warm)
    else:
        here = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
        workers = Processes((here or 1) if count is None else count, warm)
    try:
        with at_leave(workers.close):
            yield workers
    finally:
        workers.close()
