"""Studies on a Dask cluster of this machine: the same table, also when a worker is killed."""

from __future__ import annotations

import os
import signal
import threading

import pytest
import study_works

from feasibility.cli.main import main
from feasibility.studies import Store, StudyTask, open_workers, run_tasks
from feasibility.studies.scheduling import WorkersError

distributed = pytest.importorskip("distributed")

pytestmark = pytest.mark.filterwarnings("ignore")  # what Dask says of its own threads and ports


@pytest.fixture(scope="module")
def cluster():
    """Two workers of one thread each, heard on this machine alone."""
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=None
    ) as made:
        yield made


def facts(rows):
    return [(dict(row.parameters), row.status, row.result) for row in rows]


def test_the_same_table_on_dask(cluster) -> None:
    tasks = study_works.plates()[::3]
    with open_workers(0) as here, open_workers(address=cluster.scheduler_address) as there:
        assert there.width == 2
        assert facts(run_tasks(tasks, there)) == facts(run_tasks(tasks, here))
        failed = [StudyTask({"number": k}, {}, study_works.fail_odd) for k in range(4)]
        assert [row.status for row in run_tasks(failed, there)] == ["done", "failed"] * 2


def test_a_dask_worker_killed_in_the_middle(cluster) -> None:
    tasks = [
        StudyTask({"number": k, "wait": 0.02}, {"k": k}, study_works.double) for k in range(150)
    ]
    killed = []

    def blow(done, total, text) -> None:
        if done > 20 and not killed:
            victim = next(iter(cluster.workers.values()))
            killed.append(victim.pid)
            threading.Thread(target=os.kill, args=(victim.pid, signal.SIGKILL)).start()

    with open_workers(address=cluster.scheduler_address) as there:
        rows = run_tasks(tasks, there, progress=blow)
    assert killed
    assert [row.result["double"] for row in rows] == [2 * k for k in range(150)]


def test_a_dask_worker_killed_under_the_command(cluster, tmp_path, capsys) -> None:
    """Real verdicts, and the table that is written is that of this process alone, byte by byte."""
    study = tmp_path / "plates.toml"
    study.write_text(study_works.STUDY, encoding="utf-8")
    victim = next(iter(cluster.workers.values())).pid
    path = tmp_path / "dask.study"

    def blow() -> None:
        """When some cases are kept, and most are not."""
        while not stop.wait(0.02):
            if path.exists() and study_works.kept(path) >= 8:
                os.kill(victim, signal.SIGKILL)
                held.append(study_works.kept(path))
                return

    stop, held = threading.Event(), list[int]()
    thread = threading.Thread(target=blow)
    thread.start()
    try:
        for stem, how in (
            ("dask", ("--dask", cluster.scheduler_address)),
            ("0", ("--workers", "0")),
        ):
            files = "--out", str(tmp_path / f"{stem}.study"), "--csv", str(tmp_path / f"{stem}.csv")
            assert main(["study", str(study), *files, *how]) == 0
    finally:
        stop.set()
        thread.join()
    assert 8 <= held[0] < 80
    assert (tmp_path / "dask.csv").read_bytes() == (tmp_path / "0.csv").read_bytes()
    assert len((tmp_path / "0.csv").read_text(encoding="utf-8").splitlines()) == 81


def test_one_worker_of_a_machine_loads_first(cluster, monkeypatch, capsys) -> None:
    monkeypatch.setattr("feasibility.studies.dask_workers.warm_up", study_works.mark_loaded)
    with open_workers(address=cluster.scheduler_address) as there:
        assert there.submit(study_works.marks).result() in ([], [1])
        marks = there._client.run(study_works.marks)
    assert sorted(marks.values()) == [[], [1]]


def test_no_scheduler(monkeypatch) -> None:
    monkeypatch.setattr("feasibility.studies.dask_workers.CONNECT", 0.3)
    for address in ("tcp://127.0.0.1:9", "nonsense://x", "", "127.0.0.1"):
        with pytest.raises(WorkersError, match="Dask scheduler"), open_workers(address=address):
            pass


def test_a_scheduler_that_is_lost() -> None:
    """One clear message, and what was finished is kept."""
    tasks = [
        StudyTask({"number": k, "wait": 0.05}, {"k": k}, study_works.double) for k in range(400)
    ]
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, host="127.0.0.1", dashboard_address=None
    ) as made:
        closed: list[threading.Thread] = []

        def close(done, total, text) -> None:
            if done > 5 and not closed:
                closed.append(threading.Thread(target=made.close))
                closed[0].start()

        with Store(":memory:") as store:
            with (
                pytest.raises(WorkersError, match=r"was lost|same coverable"),
                open_workers(address=made.scheduler_address) as there,
            ):
                run_tasks(tasks, there, store, close)
            assert 5 < len(store) < 400
        closed[0].join()
