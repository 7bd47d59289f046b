"""The store of a study: what goes in comes out, and nothing else is touched or believed."""

import json
import os
import resource
import signal
import sqlite3
from contextlib import closing

import pytest
from hostile_stores import ODD, SCRIPT, allowed, put, rows, study_with_store
from jobs import case_named, run_coverable

from coverable import Pose, Store, open_workers, run_tasks
from feasibility.placement.trials import evaluator_of_study
from feasibility.read_files import FileError
from feasibility.studies.run import StudyTask
from feasibility.studies.store import Row, StoreError
from feasibility.studies.stored import outcome_fault


def record(k: int, status: str = "done", size: int = 10) -> Row:
    result = {"verdict": "feasible", "text": "x" * size}
    return Row({"k": k}, status, result, 0.5 * k, f"key{k}")


def facts(found: dict[str, Row]) -> dict[str, tuple]:
    return {key: (r.key, r.parameters, r.status, r.result, r.seconds) for key, r in found.items()}


def run_sql(path, program: str) -> None:
    with closing(sqlite3.connect(path)) as base:
        base.executescript(program)


def test_what_is_kept_is_found_also_by_two_at_a_time(tmp_path) -> None:
    path = tmp_path / "a.study"
    records = [record(k, "failed" if k % 3 == 0 else "done") for k in range(20)]
    with Store(path) as store, Store(path) as other:
        store.keep(records[:12])
        store.keep([])
        other.keep(records[12:])
        assert len(store) == 20
    with Store(path) as store:
        found = store.find([f"key{k}" for k in range(5, 30)])
        assert facts(found) == facts({r.key: r for r in records[5:]})
        again = Row({"k": 7}, "done", {"new": True}, 1.0, "key7")
        store.keep([again])
        assert facts(store.find(["key7"])) == facts({"key7": again})
        assert len(store) == 20


def test_records_are_kept_all_or_none(tmp_path) -> None:
    with Store(tmp_path / "a.study") as store:
        store.keep([record(1)])
        with pytest.raises(StoreError):
            store.keep([record(2), Row({}, "perhaps", {}, 1.0, "key3")])
        with pytest.raises(ValueError, match="JSON"):
            store.keep([record(2), Row({}, "done", {"x": float("nan")}, 1.0, "key4")])
        assert len(store) == 1


def test_a_full_disk_loses_nothing_that_was_kept(tmp_path) -> None:
    """No file of this process may grow beyond a limit: writing fails as on a full disk."""
    path = tmp_path / "a.study"
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    before = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    kept, message = 0, ""
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, hard))
        with Store(path) as store:
            while not message:
                try:
                    store.keep([record(kept, size=5_000)])
                    kept += 1
                except StoreError as error:
                    message = str(error)
            assert "what was kept before stays" in message
            assert len(store) == kept > 3
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, before)
    with Store(path) as store:
        assert set(store.find(f"key{k}" for k in range(1000))) == {f"key{k}" for k in range(kept)}
        store.keep([record(kept, size=5_000)])
        assert len(store) == kept + 1


def test_a_locked_store_says_so(tmp_path) -> None:
    path = tmp_path / "a.study"
    with (
        Store(path, patience=0.1) as store,
        closing(sqlite3.connect(path, isolation_level=None)) as base,
    ):
        store.keep([record(1)])
        base.execute("BEGIN IMMEDIATE")
        with pytest.raises(StoreError, match="held by another process"):
            store.keep([record(2)])
        base.execute("ROLLBACK")
        store.keep([record(3)])
        assert set(store.find(["key1", "key2", "key3"])) == {"key1", "key3"}


def test_a_file_of_someone_else_is_refused_and_left_alone(tmp_path) -> None:
    letter, short, other, old = (tmp_path / name for name in ("a.txt", "b.bin", "c.db", "d.study"))
    letter.write_text("Dear Sir or Madam, " * 100)
    short.write_bytes(b"\1")
    run_sql(other, "CREATE TABLE tasks (key, parameters, status, result, seconds)")
    run_sql(old, "CREATE TABLE tasks (key TEXT PRIMARY KEY, outcome TEXT) WITHOUT ROWID")
    words = dict.fromkeys((letter, short, other, old), "is not a study file of this version")
    for path, word in words.items():
        before = path.read_bytes()
        with pytest.raises(StoreError, match=word) as caught:
            Store(path)
        assert str(path) in str(caught.value)
        assert path.read_bytes() == before
        assert sorted(tmp_path.iterdir()) == sorted(words)
    assert issubclass(StoreError, FileError)


def test_places_that_are_no_files(tmp_path) -> None:
    os.mkfifo(tmp_path / "pipe")
    none, pipe = tmp_path / "none" / "a.study", tmp_path / "pipe"
    words = "is a folder", "no folder", "not a regular file", "cannot be"
    for path, word in zip((tmp_path, none, pipe, "a\0b"), words, strict=True):
        with pytest.raises(StoreError, match=word):
            Store(path)
    for end in ("-wal", "-shm", "-journal"):  # a pipe beside a store is not waited for
        with Store(tmp_path / f"{end}.study") as store:
            store.keep([record(1)])
        os.mkfifo(tmp_path / f"{end}.study{end}")
        with pytest.raises(StoreError, match=f"{end} is not a regular file"):
            Store(tmp_path / f"{end}.study")


PROGRAMS = {
    "a view that never ends": "CREATE VIEW v AS WITH RECURSIVE n(k) AS "
    "(SELECT 1 UNION ALL SELECT k FROM n) SELECT k FROM n",
    "a trigger": "CREATE TRIGGER t AFTER INSERT ON tasks BEGIN DELETE FROM tasks; END",
    "a column that is computed": "ALTER TABLE tasks ADD COLUMN more AS (zeroblob(900000000))",
    "no status": "PRAGMA ignore_check_constraints = ON; UPDATE tasks SET status = 'perhaps'",
    "another column": "ALTER TABLE tasks RENAME COLUMN result TO outcome",
    "another table": "DROP TABLE tasks; CREATE TABLE tasks (key)",
    "text that is none": "UPDATE tasks SET result = CAST(x'7bff7d' AS TEXT)",
    "text without end": "UPDATE tasks SET result = CAST(printf('%.*c', 80000000, 'x') AS TEXT)",
}
VALUES = (
    "result = '{'", "result = '[]'", "result = replace(hex(zeroblob(50000)), '0', '[')",
    "result = '{\"a\": Infinity}'", "result = '{\"share\": 1e999}'", "parameters = 3",
    "parameters = x'ff'", "seconds = 'soon'", "seconds = -1.0", "seconds = 9e999",
)  # fmt: skip
PROGRAMS |= {value: f"UPDATE tasks SET {value}" for value in VALUES}


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    """A study of two cases with its store; one tampered with is one message and shows nothing."""
    return study_with_store(tmp_path_factory.mktemp("study"))


def ask(folder, store, *more):
    return run_coverable("study", folder / "study.toml", "--out", store, "--workers", 0, *more)


def refused(folder, store) -> str:
    """A store that the command does not believe: one line says so, and nothing is written."""
    page, table = store.with_name("page.html"), store.with_name("table.csv")
    said = ask(folder, store, "--html", page, "--csv", table)
    assert (said.status, said.out, page.exists(), table.exists()) == (2, "", False, False)
    assert store.name in said.err
    assert all(line.isprintable() for line in said.err.splitlines())
    return said.err


def copied(good, tmp_path):
    path = tmp_path / "copy.study"
    path.write_bytes((good / "out.study").read_bytes())
    return path


@pytest.mark.parametrize("program", PROGRAMS)
def test_a_store_that_no_study_has_written_is_refused(program, good, tmp_path) -> None:
    path = copied(good, tmp_path)
    run_sql(path, PROGRAMS[program])
    assert ("is damaged (CHECK" in refused(good, path)) == (program == "no status")


def test_every_value_of_a_result_is_judged(good, tmp_path) -> None:
    """Each key of a stored verdict, replaced by each odd value that it may not have."""
    result = json.loads(rows(good / "out.study")[0][3])
    assert outcome_fault(result) == ""
    for key in result:
        for odd in ODD:
            assert (outcome_fault({**result, key: odd}) == "") == allowed(key, odd), (key, odd)
        assert key in outcome_fault({k: v for k, v in result.items() if k != key})
    assert "more" in outcome_fault({**result, "more": 1})
    assert "share" in outcome_fault({**result, "share": 1.5})
    assert "covered is more than cells" in outcome_fault({**result, "covered": 10**6})
    for bits in ("zz", "00" * 99):
        assert "components" in outcome_fault({**result, "components": [bits]})
    path = copied(good, tmp_path)
    for key, odd in (("verdict", "maybe"), ("share", -1), ("components", [SCRIPT])):
        row = rows(good / "out.study")[0]
        put(path, (*row[:3], json.dumps({**result, key: odd}), 1.0))
        assert f"{key} must be" in refused(good, path) or key == "components"


def test_what_works_keep_is_what_is_read_again_and_judged(tmp_path) -> None:
    """Outcomes and trials: a second run reads all from the store, and believes no oddity."""
    case = case_named("plate").with_overrides(["surface.cells=[2, 2]"])
    poses = [Pose.of_values([x, 0.0, 0.3, 0.0, 0.0, 0.0]) for x in (0.0, 0.2, 3.0)]
    path = tmp_path / "all.study"

    def run(store) -> None:
        with open_workers(0) as workers:
            evaluator = evaluator_of_study(case, 4, workers, store)
            for effort in ("quickly", "fully"):
                assert not any(trial.failed for trial in evaluator(poses, effort))
            run_tasks([StudyTask(case.to_tables(), {})], workers, store)

    for _ in range(2):
        with Store(path) as store:
            run(store)
            assert len(store) == 3 + 3 + 1
    for key, *between, text, seconds in rows(path):
        result = json.loads(text)
        put(path, (key, *between, json.dumps({**result, "verdict": "five"}), seconds))
        with Store(path) as store, pytest.raises(StoreError, match="verdict must be"):
            run(store)
        put(path, (key, *between, text, seconds))
