"""Studies on a Dask cluster of this machine: the same table, though a worker is killed."""

from __future__ import annotations

import gc
import os
import signal
import subprocess
import sys
import weakref
from pathlib import Path

import pytest
import study_works

from feasibility.cli.main import main
from feasibility.studies import Store, StudyTask, open_workers, run_tasks
from feasibility.studies.scheduling import WorkersError

distributed = pytest.importorskip("distributed")

pytestmark = pytest.mark.filterwarnings("ignore")  # what Dask says of its own threads and ports


def two_workers():
    """A cluster of two workers of one thread each, heard on this machine alone."""
    return distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=None
    )


@pytest.fixture(scope="module")
def cluster():
    """Two workers that nobody kills."""
    with two_workers() as made:
        yield made


@pytest.fixture
def mortal():
    """Two workers for one test, which may kill one; another may come late, or never."""
    with two_workers() as made:
        yield made


def test_what_fails_on_dask_is_told(cluster) -> None:
    failed = [StudyTask({"number": k}, {}, study_works.fail_odd) for k in range(4)]
    with open_workers(address=cluster.scheduler_address) as there:
        assert there.width == 2
        assert [row.status for row in run_tasks(failed, there)] == ["done", "failed"] * 2


def test_one_worker_of_a_machine_loads_first(cluster, monkeypatch, capsys) -> None:
    monkeypatch.setattr("feasibility.studies.dask_workers.warm_up", study_works.mark_loaded)
    with open_workers(address=cluster.scheduler_address) as there:
        assert there.submit(study_works.marks).result() in ([], [1])
        marks = there._client.run(study_works.marks)
    assert sorted(marks.values()) == [[], [1]]


def test_a_dask_worker_killed_in_the_middle(mortal) -> None:
    tasks = [StudyTask({"number": k}, {"k": k}, study_works.double) for k in range(40)]
    killed = []

    def kill(done, total, text) -> None:
        if done > 10 and not killed:
            killed.append(next(iter(mortal.workers.values())).pid)
            os.kill(killed[0], signal.SIGKILL)

    with open_workers(address=mortal.scheduler_address) as there:
        rows = run_tasks(tasks, there, progress=kill)
    assert killed
    assert [row.result["double"] for row in rows] == [2 * k for k in range(40)]


def test_a_dask_worker_killed_under_the_command(mortal, tmp_path, capsys, monkeypatch) -> None:
    """Real verdicts, and the table that is written is that of this process alone, byte by byte."""
    study = tmp_path / "plates.toml"
    study.write_text(study_works.STUDY, encoding="utf-8")
    keep, held = Store.keep, []

    def keep_and_kill(self, records) -> None:
        keep(self, records)
        if not held:
            held.append(len(self))
            os.kill(next(iter(mortal.workers.values())).pid, signal.SIGKILL)

    monkeypatch.setattr(Store, "keep", keep_and_kill)
    for stem, how in (("dask", ("--dask", mortal.scheduler_address)), ("0", ("--workers", "0"))):
        files = "--out", str(tmp_path / f"{stem}.study"), "--csv", str(tmp_path / f"{stem}.csv")
        assert main(["study", str(study), *files, *how]) == 0
    assert 0 < held[0] < 24
    assert (tmp_path / "dask.csv").read_bytes() == (tmp_path / "0.csv").read_bytes()
    assert len((tmp_path / "0.csv").read_text(encoding="utf-8").splitlines()) == 25


def test_what_could_not_connect_is_gone_before_the_next_client_starts(monkeypatch) -> None:
    """Else the garbage collector may close it inside the other's lock, and both wait for ever."""
    left = []

    class Client:
        def __init__(self, *given, **options) -> None:
            left.append([one() for one in made if one() is not None])
            made.append(weakref.ref(self))
            self.itself = self  # only the garbage collector ends it
            raise OSError("nobody there")

    made: list[weakref.ref] = []
    monkeypatch.setattr("distributed.Client", Client)
    gc.disable()
    try:
        for _ in range(3):
            with pytest.raises(WorkersError, match="no Dask scheduler answers"):
                open_workers(address="tcp://127.0.0.1:1").__enter__()
    finally:
        gc.enable()
    assert left == [[], [], []]


def test_no_scheduler(monkeypatch) -> None:
    monkeypatch.setattr("feasibility.studies.dask_workers.CONNECT", 0.3)
    for address in ("tcp://127.0.0.1:9", "nonsense://x", "", "127.0.0.1"):
        with pytest.raises(WorkersError, match="Dask scheduler"), open_workers(address=address):
            pass


CLUSTER = """
import signal
import distributed
if __name__ == "__main__":
    made = distributed.LocalCluster(
        n_workers=1, processes=False, protocol="tcp", host="127.0.0.1", dashboard_address=None
    )
    print(made.scheduler_address, flush=True)
    signal.pause()
"""


def test_a_scheduler_that_is_lost(monkeypatch) -> None:
    """One clear message, and what was finished is kept."""
    tasks = [StudyTask({"number": k}, {"k": k}, study_works.double) for k in range(40)]
    folder = Path(__file__).parent
    with subprocess.Popen(
        [sys.executable, "-c", CLUSTER],
        env={**os.environ, "PYTHONPATH": f"{folder}{os.pathsep}{folder.parent}"},
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        lost = []

        def kill(done, total, text) -> None:
            if done > 5 and not lost:
                monkeypatch.setattr("feasibility.studies.dask_workers.CONNECT", 0.3)
                os.killpg(process.pid, signal.SIGKILL)
                lost.append(process.wait())

        assert process.stdout is not None
        with Store(":memory:") as store:
            with (
                pytest.raises(WorkersError, match="was lost; what was finished is kept"),
                open_workers(address=process.stdout.readline().strip()) as there,
            ):
                run_tasks(tasks, there, store, kill)
            assert lost
            assert 5 < len(store) < 40
