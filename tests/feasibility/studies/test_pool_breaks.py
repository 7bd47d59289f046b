"""However a pool of workers breaks, it is one event: a new one is started, and nothing is lost.

A stand-in takes the place of the pool of processes, and of Dask's: it does its tasks here and now,
and breaks at the n-th task, in each way in which a real one was seen to break or may break.
"""

from __future__ import annotations

from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from concurrent.futures.process import BrokenProcessPool

import pytest
import study_works

from feasibility.studies import StudyTask, open_workers, run_tasks
from feasibility.studies.scheduling import WorkersError

COUNT = 12
BREAKS = [
    BrokenProcessPool("a child process terminated abruptly"),
    BrokenExecutor("broken"),
    CancelledError(),
    OSError("handle is closed"),
    ValueError("I/O operation on closed file"),
    RuntimeError("cannot schedule new futures after shutdown"),
    RuntimeError("cannot schedule new futures after interpreter shutdown"),
    EOFError(),
    BrokenPipeError(32, "Broken pipe"),
    ConnectionResetError(104, "Connection reset by peer"),
    ConnectionRefusedError(111, "Connection refused"),
    TimeoutError("timed out"),
]


class StandIn(Executor):
    """A pool that breaks: does everything at once, in this process."""

    made: list[StandIn]
    where = "submit"
    error: BaseException = BrokenExecutor()
    breaks_at: tuple[int, ...] = ()
    """Tasks, counted over all pools, at which a pool breaks."""
    submitted = 0

    def __init__(self, *arguments, **settings):
        self._broken = False
        self.made.append(self)

    def submit(self, work, /, *arguments, **settings):
        if self._broken and self.where in ("submit", "shutdown"):
            raise self.error
        kind = type(self)
        kind.submitted += 1
        future = Future()
        if kind.submitted in self.breaks_at:
            self._broken = True
            if self.where == "submit":
                raise self.error
        if not self._broken:
            future.set_result(work(*arguments))
        elif self.where == "result":
            future.set_exception(self.error)
        return future  # or one that never ends

    def shutdown(self, wait=True, *, cancel_futures=False):
        if self._broken and self.where == "shutdown":
            raise self.error


class StandInClient:
    """A Dask client whose executor is the stand-in; its cluster outlives it."""

    def __init__(self, address, **settings):
        self.pool = pools[0]()

    def wait_for_workers(self, count, timeout):
        pass

    def nthreads(self):
        return {"tcp://127.0.0.1:1": 1, "tcp://127.0.0.1:2": 1}

    def get_executor(self, **settings):
        return self.pool

    @property
    def status(self):
        return "closed" if self.pool._broken else "running"

    def close(self):
        pass


pools: list[type[StandIn]] = []


@pytest.fixture(params=["processes", "dask"])
def there(request, monkeypatch):
    """Settings of `open_workers`, and the class that stands in for the pool there."""

    own = type("Own", (StandIn,), {"made": []})
    pools[:] = [own]
    if request.param == "dask":
        monkeypatch.setattr(pytest.importorskip("distributed"), "Client", StandInClient)
        # Stand-ins start no threads, beside which the garbage of others would have to be gone.
        monkeypatch.setattr("feasibility.studies.dask_workers.gc.collect", int)
        return {"address": "tcp://127.0.0.1:8786", "warm": False}, own
    monkeypatch.setattr("concurrent.futures.ProcessPoolExecutor", own)
    return {"count": 2, "warm": False}, own


def numbers(**more):
    return [StudyTask({"number": k, **more}, {}, study_works.double) for k in range(COUNT)]


@pytest.mark.parametrize("where", ["submit", "result", "shutdown"])
@pytest.mark.parametrize("error", BREAKS, ids=repr)
def test_a_break_of_any_kind_starts_a_new_pool_and_loses_nothing(there, where, error) -> None:
    settings, pool = there
    pool.where, pool.error, pool.breaks_at = where, error, (1, 7, 12)
    with open_workers(**settings) as workers:
        rows = run_tasks(numbers(), workers)
    assert [(row.status, row.result["double"]) for row in rows] == [
        ("done", 2 * k) for k in range(COUNT)
    ]
    assert [made._broken for made in pool.made] == [True, True, True, False]


def test_a_future_that_never_ends_once_its_pool_is_broken(there) -> None:
    """Python 3.11 forgets tasks that are submitted at the moment when a worker dies."""
    settings, pool = there
    pool.where, pool.breaks_at = "never", (2, 9)
    with open_workers(**settings) as workers:
        rows = run_tasks(numbers(), workers)
    assert [row.result["double"] for row in rows] == [2 * k for k in range(COUNT)]
    assert [made._broken for made in pool.made] == [True, True, False]


def test_pools_that_break_at_every_task_end_the_study(there) -> None:
    settings, pool = there
    pool.breaks_at, pool.error = tuple(range(1, 10_000)), OSError("handle is closed")
    with (
        pytest.raises(WorkersError, match=r"what was finished is kept"),
        open_workers(**settings) as workers,
    ):
        run_tasks(numbers(), workers)
    assert len(pool.made) < 50
