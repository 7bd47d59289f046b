"""Studies: the table is the same whoever works, and whoever is killed meanwhile."""

import csv
import io
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing import resource_tracker
from multiprocessing.process import BaseProcess
from pathlib import Path

import numpy as np
import psutil
import pytest
import study_works
from jobs import case_named, run_coverable, verdict_named
from samples import sampled, spread

from coverable import Store, load_study, open_workers, run_tasks
from feasibility.cases.toml import as_read
from feasibility.cli.main import run
from feasibility.studies.pool import WorkersError
from feasibility.studies.run import StudyTask
from feasibility.studies.stored import cells_of

SHARED = Path(study_works.__file__).parent


def numbers(count, work=study_works.double, **more):
    return [StudyTask({"number": k, **more}, {"number": k}, work) for k in range(count)]


@pytest.fixture(scope="module")
def pool():
    with open_workers(2, warm=False) as workers:
        yield workers


@pytest.mark.parametrize("name", ["plate", "long plate"])
def test_an_outcome_says_what_the_verdict_says(name) -> None:
    verdict, case = verdict_named(name), case_named(name)
    with open_workers(0) as workers:
        (row,) = run_tasks([StudyTask(as_read(case.to_tables()), {})], workers)
    outcome, areas, n = row.result, verdict.cells.areas, len(verdict.cells)
    assert (outcome["verdict"], outcome["evidence"]) == (str(verdict.answer), str(verdict.evidence))
    assert (outcome["covered"], outcome["message"]) == (verdict.n_covered, verdict.message)
    assert outcome["share"] == pytest.approx(areas[verdict.covered].sum() / areas.sum())
    assert outcome["causes"] == Counter(str(cause.kind) for cause in verdict.causes)
    covers = {tuple(np.flatnonzero(cells_of(bits, n))) for bits in outcome["components"]}
    known = [set(cells.tolist()) for cells in verdict.components]
    largest = [own for own in known if not any(own < other for other in known)]
    assert {tuple(sorted(own)) for own in largest} == covers
    assert (outcome["margins"] is None) == (not verdict.feasible)
    if verdict.feasible:
        q, robot, margins = verdict.witness.q, verdict.robot, outcome["margins"]
        least = np.degrees(np.minimum(q - robot.lower, robot.upper - q).min())
        assert margins["limit_deg"] == pytest.approx(least)
        assert 0.0 <= margins["cone_deg"] <= verdict.task.cone_deg
        assert 0.0 < margins["reach_m"] < robot.reach


def test_rows_come_in_the_order_of_the_tasks(pool, tmp_path) -> None:
    """Whatever the order in which they end: here the first one is the last to end."""
    work = study_works.double_but_the_first_is_last
    tasks, seen = numbers(40, work, mark=str(tmp_path / "mark"), last=39), []
    rows = run_tasks(tasks, pool, progress=lambda done, total, text: seen.append((done, total)))
    assert [row.result["double"] for row in rows] == list(range(0, 80, 2))
    assert seen == sorted(seen)
    assert seen[-1] == (40, 40)
    assert run_tasks([], pool) == ()


def test_the_same_task_is_done_once_and_only_what_has_changed_again(pool, tmp_path) -> None:
    tasks = [StudyTask({"n": k % 3}, {"k": k}, study_works.whoami) for k in range(12)]
    with Store(tmp_path / "a.study") as store:
        rows = run_tasks(tasks, pool, store)
        assert len(store) == 3
    assert [dict(row.parameters) for row in rows] == [{"k": k} for k in range(12)]
    assert all(row.result == rows[k % 3].result for k, row in enumerate(rows))
    there = {row.result["pid"] for row in rows}
    assert os.getpid() not in there
    more = [StudyTask({"n": k}, {}, study_works.whoami) for k in range(5)]
    with Store(tmp_path / "a.study") as store, open_workers(0) as workers:
        after = run_tasks(more, workers, store)
    assert {row.result["pid"] for row in after[:3]} <= there
    assert {row.result["pid"] for row in after[3:]} == {os.getpid()}


@pytest.mark.parametrize("here", [True, False])
def test_tasks_that_fail_are_told_and_tried_again(pool, here, tmp_path) -> None:
    tasks = numbers(9, study_works.fail_odd)
    tasks.append(StudyTask({"number": 99}, {"number": 99}, study_works.fail_odd))
    with Store(tmp_path / "a.study") as store, open_workers(0) as mine:
        rows = run_tasks(tasks, mine if here else pool, store)
        assert [row.status for row in rows] == ["done", "failed"] * 5
        assert {row.result["verdict"] for row in rows[1::2]} == {"undecided"}
        assert "3 is odd" in rows[3].result["message"]
        assert "JSON" in rows[9].result["message"]
        again = numbers(2, study_works.fail_once, folder=str(tmp_path))
        for status in ("failed", "done", "done"):
            rows = run_tasks(again, mine if here else pool, store)
            assert [row.status for row in rows] == [status] * 2


def test_work_that_no_worker_can_be_told(pool) -> None:
    with pytest.raises(WorkersError, match="cannot run the tasks"):
        run_tasks([StudyTask({}, {}, lambda tables: {})], pool)
    with pytest.raises(WorkersError, match="not both"), open_workers(2, "tcp://127.0.0.1:1"):
        pass
    with pytest.raises(ValueError, match=r"0 \.\. 1,000"), open_workers(-1):
        pass


def test_a_worker_that_dies_costs_its_own_task_alone(tmp_path) -> None:
    """The deadly one is given up, and only that; what was beside it is done."""
    tasks = numbers(40, study_works.die_first, folder=str(tmp_path), deadly=[7], once=[11])

    def kill(done, total, text) -> None:
        for victim in multiprocessing.active_children()[-1:] if done == total else ():
            os.kill(victim.pid, signal.SIGKILL)  # from outside, when all is done

    with open_workers(2, warm=False) as workers:
        rows = run_tasks(tasks, workers, progress=kill)
        # What is left of the pool still works.
        assert run_tasks(numbers(3), workers)[2].result["double"] == 4
    for k, row in enumerate(rows):
        if k == 7:
            assert (row.status, row.result["verdict"]) == ("failed", "undecided")
            assert "worker died, 3 times" in row.result["message"]
        else:
            assert (row.status, row.result["double"]) == ("done", 2 * k)


@sampled("count", spread([60, 2000], 1))
def test_workers_that_are_killed_at_random(count, tmp_path) -> None:
    """Each task has one row, the one that it should have."""
    rng, seen, killed = np.random.default_rng(count), [], []
    tasks = numbers(count, study_works.double_slowly)

    def kill(done, total, text) -> None:
        seen.append(done)
        children = multiprocessing.active_children()
        works = len(seen) > 1 and done > seen[-2]  # no three of them die while they start
        if works and done < 0.8 * total and len(killed) < count // 30 and rng.random() < 0.3:
            killed.append(children[int(rng.integers(len(children)))].pid)
            os.kill(killed[-1], signal.SIGKILL)

    with Store(tmp_path / "a.study") as store, open_workers(2, warm=False) as workers:
        rows = run_tasks(tasks, workers, store, kill)
        kept = store.find(task.key for task in tasks)
        assert len(store) == len(kept) == count
    assert len(set(killed)) > 1
    assert (seen == sorted(seen), seen[-1]) == (True, count)
    for k, (task, row) in enumerate(zip(tasks, rows, strict=True)):
        assert row.result["double"] == kept[task.key].result["double"] == 2 * k


@contextmanager
def stopped(study: Path, folder: Path, count: int) -> Iterator[BaseProcess]:
    """The command in a process that has all loaded, stopped when it has kept something."""
    ours, theirs = os.pipe()

    def command() -> None:
        os.setsid()
        os.dup2(os.open(folder / "said", os.O_CREAT | os.O_WRONLY | os.O_APPEND), 2)
        os.dup2(theirs, 1)
        sys.stdout, sys.stderr = sys.__stdout__, sys.__stderr__
        signal.signal(signal.SIGINT, signal.default_int_handler)
        resource_tracker._resource_tracker._fd = None  # a new command has none yet
        sys.argv[1:] = map(str, (*asked(study, folder, "a"), "--workers", count))
        study_works.stop_after_keeping()
        run()

    process = multiprocessing.get_context("fork").Process(target=command)
    process.start()
    os.close(theirs)
    try:
        with open(ours) as out:
            assert out.readline() == "kept\n"
            yield process
            process.join()
            assert out.read().replace("kept\n", "") == ""
    finally:
        process.kill()
        process.join()


def stored(path) -> int:
    if not path.exists():
        return 0
    with Store(path) as store:
        return len(store)


def wait_until_gone(processes) -> None:
    """Until there are no such processes, but for their remains."""
    for one in processes:
        with suppress(psutil.NoSuchProcess):
            while one.status() != psutil.STATUS_ZOMBIE:
                time.sleep(0.01)


@pytest.fixture(scope="module")
def in_peace(tmp_path_factory):
    """A study file, and the CSV table that the command writes of it, left in peace."""
    folder = tmp_path_factory.mktemp("peace")
    study = folder / "plates.toml"
    study.write_text(study_works.STUDY, encoding="utf-8")
    assert run_coverable(*asked(study, folder, "0"), "--workers", 0).status == 0
    text = (folder / "0.csv").read_text(encoding="utf-8")
    verdicts = [line["verdict"] for line in csv.DictReader(io.StringIO(text))]
    assert len(verdicts) == 12
    assert min(verdicts.count("feasible"), verdicts.count("infeasible")) >= 3
    return study, text


def asked(study, folder, stem):
    return "study", study, "--out", folder / f"{stem}.study", "--csv", folder / f"{stem}.csv"


def test_the_command_killed_and_run_again(in_peace, tmp_path) -> None:
    """What was kept stays, workers end with their parent, and the table is that of one run."""
    study, text = in_peace
    before = set(multiprocessing.active_children())
    path, held, orphans = tmp_path / "a.study", [], []
    for count in (0, 1):
        with stopped(study, tmp_path, count) as process:
            orphans += psutil.Process(process.pid).children()
            process.kill()
        held.append(stored(path))
        assert not (tmp_path / "a.csv").exists()
    assert 0 < held[0] < held[1] < 12
    with Store(path) as store:
        assert len(store.find(task.key for task in load_study(study).tasks)) == held[-1]
    said = run_coverable(*asked(study, tmp_path, "a"), "--workers", 0)
    assert said.status == 0
    assert f"{held[-1]} finished cases" in said.err
    assert (tmp_path / "a.csv").read_text(encoding="utf-8") == text
    assert set(multiprocessing.active_children()) <= before
    assert orphans
    wait_until_gone(orphans)


def test_ctrl_c_stores_and_leaves_no_worker(in_peace, tmp_path) -> None:
    """A terminal sends it to the workers too: neither they nor their parent write a traceback."""
    with stopped(in_peace[0], tmp_path, 1) as process:
        children = psutil.Process(process.pid).children()
        os.killpg(process.pid, signal.SIGINT)
    held = stored(tmp_path / "a.study")
    assert 0 < held < 12
    assert process.exitcode == 130
    lines = (err := (tmp_path / "said").read_text()).splitlines()
    assert lines[-1] == "coverable: interrupted"
    assert f"{held} cases are stored" in lines[-2]
    assert "Traceback" not in err
    assert children
    wait_until_gone(children)


DYING = """
import os
if __name__ != "__main__":
    os._exit(3)  # a worker imports this module first
from feasibility.studies.pool import WorkersError
from feasibility.studies.workers import open_workers
from study_works import double
try:
    with open_workers(1, warm=False) as workers:
        workers.run(double, [{"number": 1}], print)
except WorkersError as error:
    print(error)
"""


def test_workers_that_die_while_starting_are_not_started_for_ever(tmp_path) -> None:
    script = tmp_path / "dying.py"
    script.write_text(DYING)
    path = os.pathsep.join([str(SHARED), *filter(None, sys.path)])
    done = subprocess.run(
        [sys.executable, script], env={**os.environ, "PYTHONPATH": path},
        capture_output=True, text=True, check=False, timeout=1800,
    )  # fmt: skip
    assert "died while starting, 3 times; what was finished is kept" in done.stdout, done.stderr
