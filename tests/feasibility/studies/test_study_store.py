"""The store of a study: what goes in comes out, and nothing else is touched or believed."""

from __future__ import annotations

import os
import random
import resource
import signal
import sqlite3
import subprocess
import sys
from contextlib import closing

import pytest

from feasibility.safe_files import FileError
from feasibility.studies import Store
from feasibility.studies.store import APPLICATION, FORMAT, Record, StoreError


def record(k: int, status: str = "done", size: int = 10) -> Record:
    return Record(f"key{k}", {"k": k}, status, {"verdict": "feasible", "text": "x" * size}, 0.5 * k)


def facts(found: dict[str, Record]) -> dict[str, tuple]:
    return {key: (r.key, r.parameters, r.status, r.result, r.seconds) for key, r in found.items()}


def test_what_is_kept_is_found(tmp_path) -> None:
    path = tmp_path / "a.study"
    records = [record(k, "failed" if k % 3 == 0 else "done") for k in range(20)]
    with Store(path) as store:
        store.keep(records[:12])
        store.keep([])
        store.keep(records[12:])
    with Store(path) as store:
        found = store.find([f"key{k}" for k in range(5, 30)])
        assert facts(found) == facts({r.key: r for r in records[5:]})
        again = Record("key7", {"k": 7}, "done", {"new": True}, 1.0)
        store.keep([again])
        assert facts(store.find(["key7"])) == facts({"key7": again})
        assert len(store) == 20


def test_two_processes_may_write_the_same_store(tmp_path) -> None:
    path = tmp_path / "a.study"
    with Store(path) as one, Store(path) as two:
        one.keep([record(1)])
        two.keep([record(2)])
        assert set(one.find(["key1", "key2"])) == {"key1", "key2"}


def test_records_are_kept_all_or_none(tmp_path) -> None:
    with Store(tmp_path / "a.study") as store:
        store.keep([record(1)])
        bad = Record("key3", {}, "perhaps", {}, 1.0)  # type: ignore[arg-type]
        with pytest.raises(StoreError):
            store.keep([record(2), bad])
        with pytest.raises(ValueError, match="JSON"):
            store.keep([record(2), Record("key4", {}, "done", {"x": float("nan")}, 1.0)])
        assert len(store) == 1


def test_a_file_of_someone_else_is_refused_and_left_alone(tmp_path) -> None:
    text = tmp_path / "letter.txt"
    text.write_text("Dear Sir or Madam, " * 100)
    other = tmp_path / "other.db"
    with closing(sqlite3.connect(other)) as base:
        base.execute("CREATE TABLE tasks (key, parameters, status, result, seconds)")
        base.commit()
    named = tmp_path / "named.db"
    with closing(sqlite3.connect(named)) as base:
        base.execute("PRAGMA application_id = 77")
        base.commit()
    short = tmp_path / "short.bin"
    short.write_bytes(b"\1")
    words = {text: "is not a study", other: "another program", named: "another", short: "not a"}
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
    for path, word in (
        (tmp_path, "is a folder"),
        (tmp_path / "none" / "a.study", "no folder"),
        (tmp_path / "pipe", "not a regular file"),
        ("a\0b", "cannot be"),
    ):
        with pytest.raises(StoreError, match=word):
            Store(path)


@pytest.mark.parametrize("written", [1, FORMAT + 1])
def test_a_store_of_another_format_is_refused_and_left_alone(tmp_path, written) -> None:
    """Also one that was made when the keys held the names of modules."""
    path = tmp_path / "a.study"
    with Store(path) as store:
        store.keep([record(1)])
    with closing(sqlite3.connect(path)) as base:
        assert base.execute("PRAGMA application_id").fetchone() == (APPLICATION,)
        base.execute(f"PRAGMA user_version = {written}")
    before = path.read_bytes()
    with pytest.raises(StoreError, match=f"format {written}, and this program writes format"):
        Store(path)
    assert path.read_bytes() == before


def test_damage_is_told_and_never_believed(tmp_path) -> None:
    """Bytes are overwritten at random: a store either says so, or gives what was kept."""
    path = tmp_path / "a.study"
    records = [record(k, size=700) for k in range(60)]
    with Store(path) as store:
        store.keep(records)
    whole = path.read_bytes()
    expected = facts({r.key: r for r in records})
    rng = random.Random(5)
    told = 0
    for _ in range(60):
        data = bytearray(whole)
        start, length = rng.randrange(len(data)), rng.choice([4, 40, 4096])
        for k in range(start, min(start + length, len(data))):
            data[k] = rng.randrange(256)
        path.write_bytes(data[: rng.choice([len(data), len(data), len(data) // 2])])
        try:
            with Store(path) as store:
                found = facts(store.find(expected))
        except StoreError:
            told += 1
        else:
            for key, fact in found.items():
                # A text may be changed without a trace (SQLite has no checksums); no record may
                # be out of shape.
                assert fact[2] in ("done", "failed")
                assert isinstance(fact[3], dict), key
        for end in ("-wal", "-shm"):
            (tmp_path / f"a.study{end}").unlink(missing_ok=True)
    assert told > 10


def test_rows_that_no_study_has_written(tmp_path) -> None:
    path = tmp_path / "a.study"
    for row in (
        ("k", "{}", "done", "{", 1.0),
        ("k", "{}", "done", "[]", 1.0),
        ("k", "3", "done", "{}", 1.0),
        ("k", b"\xff", "done", "{}", 1.0),
        ("k", "{}", "done", "[" * 100_000, 1.0),
        ("k", "{}", "done", "{}", "soon"),
    ):
        with Store(path) as store:
            store.keep([])
        with closing(sqlite3.connect(path)) as base:
            base.execute("INSERT OR REPLACE INTO tasks VALUES (?, ?, ?, ?, ?)", row)
            base.commit()
        with Store(path) as store, pytest.raises(StoreError, match="damaged"):
            store.find(["k"])


def test_a_locked_store_says_so(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr("feasibility.studies.store.PATIENCE", 0.1)
    path = tmp_path / "a.study"
    with Store(path) as store, closing(sqlite3.connect(path, isolation_level=None)) as base:
        store.keep([record(1)])
        base.execute("BEGIN IMMEDIATE")
        with pytest.raises(StoreError, match="held by another process"):
            store.keep([record(2)])
        base.execute("ROLLBACK")
        store.keep([record(3)])
        assert set(store.find(["key1", "key2", "key3"])) == {"key1", "key3"}


def test_a_full_disk_loses_nothing_that_was_kept(tmp_path) -> None:
    """No file of this process may grow beyond a limit: writing fails as on a full disk."""
    path = tmp_path / "a.study"
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    before = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    kept = 0
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, hard))
        with Store(path) as store:
            for kept in range(10_000):
                try:
                    store.keep([record(kept, size=5_000)])
                except StoreError as error:
                    message = str(error)
                    break
            assert "what was kept before stays" in message
            assert kept > 3
            assert len(store) == kept
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, before)
    with Store(path) as store:
        assert set(store.find(f"key{k}" for k in range(10_000))) == {f"key{k}" for k in range(kept)}
        store.keep([record(kept, size=5_000)])
        assert len(store) == kept + 1


def test_the_words_for_a_full_disk(tmp_path) -> None:
    with Store(tmp_path / "a.study") as store:
        store.keep([record(1)])
        store._base.execute("PRAGMA max_page_count = 6")
        with pytest.raises(StoreError, match="disk is full; what was kept before stays"):
            store.keep([record(2, size=100_000)])
        assert len(store) == 1


KEEP_ON = """
import sys
from feasibility.studies.store import Record, Store
with Store(sys.argv[1]) as store:
    for k in range(100_000):
        store.keep([Record(f"key{k}", {"k": k}, "done", {"text": "x" * 2000}, 1.0)])
        print(k, flush=True)
"""


def test_a_killed_writer_loses_nothing_that_it_had_kept(tmp_path) -> None:
    path = tmp_path / "a.study"
    command = [sys.executable, "-c", KEEP_ON, str(path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        for line in process.stdout:
            if line == "150\n":
                process.kill()
                break
        last = [150, *map(int, process.stdout.read().split())][-1]
    with Store(path) as store:
        keys = {f"key{k}" for k in range(last + 2)}
        found = store.find(keys)
        # The one that was being written may be there or not.
        assert keys - {f"key{last + 1}"} <= set(found)
        assert all(r.result == {"text": "x" * 2000} for r in found.values())
