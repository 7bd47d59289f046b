"""Where the outcomes of a study are kept: one SQLite file, written as they come.

The file has a write-ahead log, and every batch of outcomes is one transaction. So whatever kills
the process, what was kept before stays. A file that no study has written is refused unread: a view
or a trigger in it would be a program that runs when rows are read.
"""

import json
import math
import os
import sqlite3
import stat
from collections.abc import Generator, Iterable, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal

from coverable.files import FileFault, open_regular
from feasibility.read_files import FileError, shown_path
from feasibility.safe_files import check_writable
from feasibility.studies.stored import json_object

MAGIC = b"SQLite format 3\0"
LARGEST = 2**62  # [byte] no limit
LARGEST_ROW = 64 << 20  # [byte]
BESIDE = ("-wal", "-shm", "-journal")  # files that SQLite keeps with a store
PATIENCE = 5.0  # [s] that another process may hold the file

TABLE = """CREATE TABLE tasks (
    key TEXT PRIMARY KEY,
    parameters TEXT NOT NULL,
    status TEXT NOT NULL CHECK (status IN ('done', 'failed')),
    result TEXT NOT NULL,
    seconds REAL NOT NULL
) WITHOUT ROWID"""
FIND = "SELECT key, parameters, status, result, seconds FROM tasks WHERE key = ?"

FOREIGN = "is not a study file of this version; give another name, or remove the file"
DAMAGED = "is damaged ({}); remove it to start anew"
DAMAGED_RECORD = "the record {!r} is damaged: {}; remove the file to start anew"
STAYS = "what was kept before stays: free some space and run again"
FAULTS = {
    sqlite3.SQLITE_FULL: f"the disk is full; {STAYS}",
    sqlite3.SQLITE_IOERR: f"cannot be written: {{}}; {STAYS}",
    sqlite3.SQLITE_NOTADB: FOREIGN,
    sqlite3.SQLITE_CORRUPT: DAMAGED,
    sqlite3.SQLITE_BUSY: "is held by another process; wait until that ends, or give another name",
    sqlite3.SQLITE_READONLY: "cannot be written: {}; choose another place",
    sqlite3.SQLITE_CANTOPEN: "cannot be written: {}; choose another place",
}  # what to do about an error of SQLite, by its primary code

Status = Literal["done", "failed"]


class StoreError(FileError):
    """A store that cannot be read or written: which file, why, and what would do."""


@dataclass(frozen=True, eq=False, slots=True)
class Row:
    """What came of one task."""

    parameters: Mapping[str, Any]
    """What varies in the study."""
    status: Status
    """'failed' where no worker came to an end with it; it is tried again next time."""
    result: Mapping[str, Any]
    """What the work returned, JSON values; where it failed, an undecided verdict whose message says
    why."""
    seconds: float
    """Time that the work took."""
    key: str = ""
    """Says what the task is; see `StudyTask`."""


class Store(AbstractContextManager["Store"]):
    """Rows by key in one file. Use it as a context, so that it is closed.

    Example:
        >>> with Store(":memory:") as store:
        ...     store.keep([Row({"cone": 10}, "done", {"verdict": "feasible"}, 0.1, "k1")])
        ...     store.find(["k1", "k2"])["k1"].result
        {'verdict': 'feasible'}
    """

    def __init__(self, path: str | os.PathLike[str], *, patience: float = PATIENCE) -> None:
        """Open a store, or make a new one.

        Args:
            path: the file; ":memory:" for a store that is gone when it is closed.
            patience: s that another process may hold the file.

        Raises:
            StoreError: the file is something else, damaged, or cannot be written.
        """
        self.path, self._name = os.fspath(path), shown_path(path)
        in_memory = self.path == ":memory:"
        if not in_memory:
            self._refuse_special_files()
        with self._reported():
            self._base = sqlite3.connect(
                self.path if in_memory else os.path.abspath(self.path),
                timeout=patience,
                isolation_level="IMMEDIATE",
            )
        try:
            with self._reported():
                self._prepare()
        except BaseException:  # SQLite keeps files beside one that is open
            self._base.close()
            raise

    def _refuse_special_files(self) -> None:
        """See that the file can be a store; a pipe beside it would be waited for without end."""
        try:
            with open_regular(self.path, LARGEST, "a study file") as stream:
                head = stream.read(len(MAGIC))
            if head not in (b"", MAGIC):  # SQLite would take a shorter file for an empty one
                raise self._refused(FOREIGN)
        except (FileFault, OSError) as error:
            if not isinstance(error.__cause__, FileNotFoundError):
                raise self._refused(str(error)) from error
            try:
                check_writable(self.path)
            except FileError as fault:
                raise StoreError(fault.faults, fault.source) from fault
        for end in BESIDE:
            beside = os.path.realpath(self.path) + end
            if os.path.lexists(beside) and not stat.S_ISREG(os.lstat(beside).st_mode):
                raise self._refused(f"{shown_path(beside)} is not a regular file; remove it")

    def _prepare(self) -> None:
        """Make the table, or see that it is there, undamaged and alone."""
        self._base.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, LARGEST_ROW)
        rows = self._base.execute("SELECT sql FROM sqlite_master WHERE sql IS NOT NULL")
        made = [str(sql) for (sql,) in rows]
        if made not in ([], [TABLE]):
            raise self._refused(FOREIGN)
        (state,) = self._base.execute("PRAGMA quick_check(1)").fetchone()
        if state != "ok":
            raise self._refused(DAMAGED.format(" ".join(str(state).split())))
        self._base.execute("PRAGMA journal_mode = WAL")
        self._base.execute("PRAGMA synchronous = NORMAL")
        self._base.execute(TABLE.replace("TABLE", "TABLE IF NOT EXISTS", 1))

    def _refused(self, fault: str) -> StoreError:
        """An error about this file."""
        return StoreError(fault, self._name)

    @contextmanager
    def _reported(self) -> Generator[None]:
        """Errors of SQLite, with what to do about them."""
        try:
            yield
        except sqlite3.Error as error:
            # The primary code is the lowest byte.
            code = getattr(error, "sqlite_errorcode", 0) & 0xFF
            text = FAULTS.get(code, "cannot be used as a study file: {}")
            raise self._refused(text.format(error)) from error

    def keep(self, rows: Iterable[Row]) -> None:
        """Write rows in one transaction; one with a known key replaces the old one.

        Raises:
            StoreError: the file cannot be written, such as on a full disk; what was kept before
                stays.
        """
        dumps = partial(json.dumps, allow_nan=False)
        values = [
            (row.key, dumps(dict(row.parameters)), row.status, dumps(dict(row.result)), row.seconds)
            for row in rows
        ]
        with self._reported(), self._base:
            self._base.executemany("INSERT OR REPLACE INTO tasks VALUES (?, ?, ?, ?, ?)", values)

    def find(self, keys: Iterable[str]) -> dict[str, Row]:
        """The rows of some keys, as far as there are any.

        Raises:
            StoreError: the file cannot be read, or holds rows that no study has written.
        """
        with self._reported():
            found = (values for key in set(keys) for values in self._base.execute(FIND, [key]))
            return {values[0]: self._row(*values) for values in found}

    def _row(self, key: str, parameters: Any, status: Any, result: Any, seconds: Any) -> Row:
        """A row read back."""
        try:
            if status not in ("done", "failed"):
                raise ValueError("its status is neither done nor failed")
            if not isinstance(seconds, float) or not 0.0 <= seconds < math.inf:
                raise ValueError("its time is no finite number of seconds")
            return Row(json_object(parameters), status, json_object(result), seconds, key)
        except ValueError as error:
            raise self.damaged(key, str(error)) from error

    def damaged(self, key: str, fault: str) -> StoreError:
        """The error about a row that no study has written."""
        return self._refused(DAMAGED_RECORD.format(str(key)[:20], fault))

    def __len__(self) -> int:
        """Number of rows.

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
