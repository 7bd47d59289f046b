"""Studies on a Dask cluster of this machine: the same table, though a worker is killed."""

import os
import signal
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec
from multiprocessing import get_context

import pytest
import study_works
from jobs import run_coverable
from samples import sampled, spread

from coverable import Store, open_workers, run_tasks
from feasibility.studies.pool import WorkersError
from feasibility.studies.run import StudyTask

QUIET = pytest.mark.filterwarnings("ignore")  # what Dask says of its own threads and ports
pytestmark = [QUIET, pytest.mark.skipif(not find_spec("distributed"), reason="needs Dask")]


@contextmanager
def cluster(folder, workers):
    """A scheduler and workers of one thread each, in processes that have all loaded."""
    from distributed import Client

    file = folder / "scheduler.json"
    common = "--scheduler-file", file, "--no-dashboard"

    def run(command, *arguments):
        for stream in (1, 2):
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream)
        command(list(map(str, arguments)))

    def start(command, *arguments):
        command = import_module(f"distributed.cli.dask_{command}").main
        process = get_context("fork").Process(target=run, args=(command, *arguments))
        process.start()
        return process

    made = [start("scheduler", *common, "--host", "127.0.0.1", "--port", 0)]
    own = "--nthreads", 1, "--no-nanny", "--host", "127.0.0.1", "--local-directory", folder
    made += [start("worker", *common, *own) for _ in range(workers)]
    try:
        with Client(scheduler_file=str(file), set_as_default=False) as client:
            client.wait_for_workers(workers, timeout=60)
            address = client.scheduler.address
        yield address, made
    finally:
        for process in made:
            process.kill()
            process.join()


@sampled("count", spread([60, 2000], 1))
def test_a_worker_killed_while_it_works_and_then_the_scheduler(count, tmp_path) -> None:
    """Each task has one row; verdicts are those of this process; what was finished is kept."""
    study = tmp_path / "plates.toml"
    study.write_text(study_works.STUDY, encoding="utf-8")
    with cluster(tmp_path, 2) as (address, made):
        failing = [StudyTask({"number": k}, {}, study_works.fail_odd) for k in range(4)]
        tasks = [StudyTask({"number": k}, {}, study_works.double_slowly) for k in range(count)]
        killed = []

        def kill(done, total, text) -> None:
            if done > count // 4 and not killed:
                killed.append(made[1].pid)
                os.kill(made[1].pid, signal.SIGKILL)

        with Store(tmp_path / "a.study") as store, open_workers(address=address) as there:
            assert there.width == 2
            assert [row.status for row in run_tasks(failing, there)] == ["done", "failed"] * 2
            rows = run_tasks(tasks, there, store, kill)
            assert len(store) == count
            assert there.width == len(killed) == 1
        assert [row.result["double"] for row in rows] == list(range(0, 2 * count, 2))
        for stem, how in (("dask", ("--dask", address)), ("0", ("--workers", 0))):
            files = "--out", tmp_path / f"{stem}.study", "--csv", tmp_path / f"{stem}.csv"
            assert run_coverable("study", study, *files, *how).status == 0

        def lose(done, total, text) -> None:
            if done > 5:
                made[0].kill()

        tasks = [StudyTask({"number": k}, {"k": k}, study_works.double_slowly) for k in range(400)]
        with Store(":memory:") as store, open_workers(address=address, warm=False) as there:
            with pytest.raises(WorkersError, match="what was finished is kept"):
                run_tasks(tasks, there, store, lose)
            assert 5 < len(store) < 400
    assert (tmp_path / "dask.csv").read_bytes() == (tmp_path / "0.csv").read_bytes()
    assert len((tmp_path / "0.csv").read_text(encoding="utf-8").splitlines()) == 13


def test_a_scheduler_that_was_never_there() -> None:
    """One clear message."""
    for address in ("nonsense://x", "", "127.0.0.1:1"):
        with (
            pytest.raises(WorkersError, match="Dask scheduler"),
            open_workers(address=address, connect=0.3),
        ):
            pass
