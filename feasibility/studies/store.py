"""Where the outcomes of a study are kept: one SQLite file, written as they come.

The file has a write-ahead log, and every batch of outcomes is one transaction. So whatever kills
the process, what was kept before stays, and the file is never half written.
"""

from __future__ import annotations

import json
import math
import os
import sqlite3
import stat
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import Any, Literal

from coverable_files import FileFault, open_regular
from feasibility.safe_files import FileError, check_writable, shown_path
from feasibility.studies.stored import json_object

APPLICATION = 0x434F5642  # "COVB", in the header of every store
FORMAT = 2  # of the file and of its keys; those of format 1 held the names of modules
MAGIC = b"SQLite format 3\0"
LARGEST = 2**62  # [byte] no limit
LARGEST_ROW = 64 << 20  # [byte]
BESIDE = ("-wal", "-shm", "-journal")  # files that SQLite keeps with a store
PATIENCE = 5.0  # [s] that another process may hold the file
RETRY = 0.01  # [s] between two tries to open a file that is busy

TABLE = """
CREATE TABLE tasks (
    key TEXT PRIMARY KEY,
    parameters TEXT NOT NULL,
    status TEXT NOT NULL CHECK (status IN ('done', 'failed')),
    result TEXT NOT NULL,
    seconds REAL NOT NULL
) WITHOUT ROWID
"""

FOREIGN = "is not a study file; give another name, or remove the file"
DAMAGED_RECORD = "the record {!r} is damaged: {}; remove the file to start anew"
DAMAGED = "is damaged ({}); remove it to start anew"
HELD = "is held by another process; wait until that ends, or give another name"
NO_PLACE = "cannot be written: {}; choose another place"
NOT_WRITTEN = "cannot be written: {}; what was kept before stays: free some space and run again"
FAULTS = {
    sqlite3.SQLITE_FULL: "the disk is full; what was kept before stays: free some space and run "
    "again",
    sqlite3.SQLITE_NOTADB: FOREIGN,
    sqlite3.SQLITE_CORRUPT: DAMAGED,
    sqlite3.SQLITE_BUSY: HELD,
    sqlite3.SQLITE_LOCKED: HELD,
    sqlite3.SQLITE_READONLY: NO_PLACE,
    sqlite3.SQLITE_PERM: NO_PLACE,
    sqlite3.SQLITE_CANTOPEN: NO_PLACE,
    sqlite3.SQLITE_IOERR: NOT_WRITTEN,
}  # what to do about an error of SQLite, by its primary code

Status = Literal["done", "failed"]


class StoreError(FileError):
    """A store that cannot be read or written: which file, why, and what would do."""


@dataclass(frozen=True, slots=True)
class Record:
    """One task that was worked on."""

    key: str
    """Says what the task is; see `StudyTask`."""
    parameters: Mapping[str, Any]
    """What varies in the study, for people who read the file."""
    status: Status
    """'failed' where no worker came to an end with it; it is tried again next time."""
    result: Mapping[str, Any]
    """JSON values."""
    seconds: float
    """Time that the task took."""


class Store(AbstractContextManager["Store"]):
    """Records by key in one file. Use it as a context, so that it is closed.

    Example:
        >>> with Store(":memory:") as store:
        ...     store.keep([Record("k1", {"cone": 10}, "done", {"verdict": "feasible"}, 0.1)])
        ...     store.find(["k1", "k2"])["k1"].result
        {'verdict': 'feasible'}
    """

    def __init__(self, path: str | os.PathLike[str], *, patience: float = PATIENCE) -> None:
        """Open a store, or make a new one.

        Args:
            path: the file; ":memory:" for a store that is gone when it is closed.
            patience: s that another process may hold the file.

        Raises:
            StoreError: the file is something else, damaged, of a later version, or cannot be
                written.
        """
        self.path = os.fspath(path)
        self._name, self._patience = shown_path(path), patience
        in_memory = self.path == ":memory:"
        fresh = in_memory or self._is_new()
        if not in_memory:
            self._refuse_special_files()
        with self._reported():
            self._base = sqlite3.connect(
                self.path if in_memory else os.path.abspath(self.path),
                timeout=patience,
                isolation_level=None,
            )
        try:
            with self._reported():
                self._base.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, LARGEST_ROW)
                self._prepare(fresh)
        except StoreError:
            self._base.close()
            raise

    def _is_new(self) -> bool:
        """Is there no file yet, or an empty one? Anything but a regular file is refused."""
        try:
            with open_regular(self.path, LARGEST, "a study file") as stream:
                head = stream.read(len(MAGIC))
        except (FileFault, OSError) as error:
            if not isinstance(error.__cause__, FileNotFoundError):
                raise self._refused(str(error)) from error
            try:
                check_writable(self.path)
            except FileError as fault:
                raise StoreError(fault.faults, fault.source) from fault
            return True
        if head not in (b"", MAGIC):  # SQLite would take a shorter file for an empty one
            raise self._refused(FOREIGN)
        return not head

    def _refuse_special_files(self) -> None:
        """A pipe where SQLite expects a file of its own would be waited for without end."""
        for end in BESIDE:
            beside = os.path.realpath(self.path) + end
            try:
                mode = os.lstat(beside).st_mode
            except FileNotFoundError:
                continue
            if not stat.S_ISREG(mode):
                raise self._refused(f"{shown_path(beside)} is not a regular file; remove it")

    def _prepare(self, fresh: bool) -> None:
        """Make the table, or see that it is there and undamaged."""
        if not fresh:
            # In one transaction: another run may be making the table right now.
            with self._transaction("DEFERRED"):
                self._refuse_strangers()
        self._write_ahead()
        self._base.execute("PRAGMA synchronous = NORMAL")
        # Two runs may open a new file at the same time: one of them makes the table.
        with self._transaction():
            if not self._tables():
                self._base.execute(TABLE)
                self._base.execute(f"PRAGMA application_id = {APPLICATION}")
                self._base.execute(f"PRAGMA user_version = {FORMAT}")

    def _refuse_strangers(self) -> None:
        """See that the file is an undamaged study file; another program's file is not changed."""
        (application,) = self._base.execute("PRAGMA application_id").fetchone()
        (written,) = self._base.execute("PRAGMA user_version").fetchone()
        empty = application == 0 and written == 0 and not self._tables()
        if application != APPLICATION and not empty:
            raise self._refused(
                "is an SQLite file of another program; give another name for the study, or "
                "remove the file"
            )
        if application == APPLICATION and written != FORMAT:
            raise self._refused(
                f"is a study of format {written}, and this program writes format {FORMAT}; "
                "give another name, and its cases are decided anew"
            )
        (state,) = self._base.execute("PRAGMA quick_check(1)").fetchone()
        if state != "ok":
            raise self._refused(DAMAGED.format(" ".join(str(state).split())))
        self._refuse_other_contents()

    def _write_ahead(self) -> None:
        """Let readers and a writer work side by side.

        SQLite does not wait for another process that opens the file at the same moment: it says at
        once that the file is busy, whatever its patience.
        """
        end = time.monotonic() + self._patience
        while True:
            try:
                self._base.execute("PRAGMA journal_mode = WAL").fetchone()
                return
            except sqlite3.OperationalError as error:
                busy = error.sqlite_errorcode & 0xFF == sqlite3.SQLITE_BUSY
                if not busy or time.monotonic() > end:
                    raise
            time.sleep(RETRY)

    def _refuse_other_contents(self) -> None:
        """A view or a trigger in the file would be a program that runs when rows are read."""
        made = self._base.execute("SELECT sql FROM sqlite_master WHERE sql IS NOT NULL").fetchall()
        if [" ".join(str(sql).split()) for (sql,) in made] not in ([], [" ".join(TABLE.split())]):
            raise self._refused(DAMAGED.format("it holds more than one table of results"))

    def _tables(self) -> list[str]:
        """Names of the tables in the file."""
        rows = self._base.execute("SELECT name FROM sqlite_master WHERE type = 'table'")
        return [str(name) for (name,) in rows]

    @contextmanager
    def _transaction(self, kind: str = "IMMEDIATE") -> Iterator[None]:
        """All or nothing of what is written inside; what is read is of one moment."""
        self._base.execute(f"BEGIN {kind}")
        try:
            yield
            self._base.execute("COMMIT")
        except BaseException:
            if self._base.in_transaction:  # a full disk may have ended it already
                self._base.execute("ROLLBACK")
            raise

    def _refused(self, fault: str) -> StoreError:
        """An error about this file."""
        return StoreError(fault, self._name)

    @contextmanager
    def _reported(self) -> Iterator[None]:
        """Errors of SQLite, with what to do about them."""
        try:
            yield
        except sqlite3.Error as error:
            # The primary code is the lowest byte.
            code = getattr(error, "sqlite_errorcode", 0) & 0xFF
            text = FAULTS.get(code, "cannot be used as a study file: {}")
            raise self._refused(text.format(error)) from error

    def keep(self, records: Iterable[Record]) -> None:
        """Write records in one transaction; one with a known key replaces the old one.

        Raises:
            StoreError: the file cannot be written, such as on a full disk; what was kept before
                stays.
        """
        rows = [
            (
                record.key,
                json.dumps(dict(record.parameters), allow_nan=False),
                record.status,
                json.dumps(dict(record.result), allow_nan=False),
                float(record.seconds),
            )
            for record in records
        ]
        with self._reported(), self._transaction():
            self._base.executemany("INSERT OR REPLACE INTO tasks VALUES (?, ?, ?, ?, ?)", rows)

    def find(self, keys: Iterable[str]) -> dict[str, Record]:
        """The records of some keys, as far as there are any.

        Raises:
            StoreError: the file cannot be read, or holds rows that no study has written.
        """
        wanted = set(keys)
        with self._reported():
            rows = self._base.execute("SELECT key, parameters, status, result, seconds FROM tasks")
            return {row[0]: self._record(row) for row in rows if row[0] in wanted}

    def _record(self, row: tuple[Any, ...]) -> Record:
        """A row read back."""
        key, parameters, status, result, seconds = row
        try:
            if status not in ("done", "failed"):
                raise ValueError("its status is neither done nor failed")
            if not isinstance(seconds, float) or not 0.0 <= seconds < math.inf:
                raise ValueError("its time is no finite number of seconds")
            return Record(key, json_object(parameters), status, json_object(result), seconds)
        except ValueError as error:
            raise self.damaged(key, str(error)) from error

    def damaged(self, key: str, fault: str) -> StoreError:
        """The error about a record that no study has written."""
        return self._refused(DAMAGED_RECORD.format(str(key)[:20], fault))

    def __len__(self) -> int:
        """Number of records.

        Raises:
            StoreError: the file cannot be read.
        """
        with self._reported():
            (count,) = self._base.execute("SELECT count(*) FROM tasks").fetchone()
        return int(count)

    def close(self) -> None:
        """Close the file."""
        self._base.close()

    def __exit__(self, *raised: object) -> None:
        """Close the file."""
        self.close()
