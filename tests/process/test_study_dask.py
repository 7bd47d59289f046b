"""Studies on a Dask cluster of this machine: the same table, though a worker is killed."""

from __future__ import annotations

import os
import signal

import pytest
import study_works
from jobs import coverable

from feasibility.studies import Store, StudyTask, open_workers, run_tasks
from feasibility.studies.scheduling import WorkersError

distributed = pytest.importorskip("distributed")

pytestmark = pytest.mark.filterwarnings("ignore")  # what Dask says of its own threads and ports


def cluster(workers):
    """A cluster of workers of one thread each, heard on this machine alone."""
    return distributed.LocalCluster(
        n_workers=workers, threads_per_worker=1, host="127.0.0.1", dashboard_address=None
    )


def test_a_worker_killed_under_the_command(tmp_path) -> None:
    """Real verdicts, and the table that is written is that of this process alone, byte by byte."""
    study = tmp_path / "plates.toml"
    study.write_text(study_works.STUDY, encoding="utf-8")
    killed = []

    def kill(done, total, text) -> None:
        if done > 10 and not killed:
            killed.append(next(iter(made.workers.values())).pid)
            os.kill(killed[0], signal.SIGKILL)

    with cluster(2) as made:
        failing = [StudyTask({"number": k}, {}, study_works.fail_odd) for k in range(4)]
        numbers = [StudyTask({"number": k}, {"k": k}, study_works.double) for k in range(40)]
        with open_workers(address=made.scheduler_address) as there:
            assert there.width == 2
            assert [row.status for row in run_tasks(failing, there)] == ["done", "failed"] * 2
            rows = run_tasks(numbers, there, progress=kill)
        assert killed
        assert [row.result["double"] for row in rows] == [2 * k for k in range(40)]
        for stem, how in (("dask", ("--dask", made.scheduler_address)), ("0", ("--workers", 0))):
            files = "--out", tmp_path / f"{stem}.study", "--csv", tmp_path / f"{stem}.csv"
            assert coverable("study", study, *files, *how).status == 0
    assert (tmp_path / "dask.csv").read_bytes() == (tmp_path / "0.csv").read_bytes()
    assert len((tmp_path / "0.csv").read_text(encoding="utf-8").splitlines()) == 25


def test_a_scheduler_that_is_lost_or_was_never_there() -> None:
    """One clear message, and what was finished is kept."""
    for address in ("nonsense://x", "", "127.0.0.1:1"):
        with (
            pytest.raises(WorkersError, match="Dask scheduler"),
            open_workers(address=address, connect=0.3),
        ):
            pass
    tasks = [StudyTask({"number": k}, {"k": k}, study_works.double) for k in range(40)]
    made = cluster(1)

    def lose(done, total, text) -> None:
        if 5 < done < total:
            made.close()

    with (
        Store(":memory:") as store,
        open_workers(address=made.scheduler_address, connect=0.3) as there,
    ):
        with pytest.raises(WorkersError, match="what was finished is kept"):
            run_tasks(tasks, there, store, lose)
        assert 5 < len(store) < 40
